# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors, rotations and matrix exponentials."""

from bisect import bisect_right
from collections.abc import Sequence
from math import inf

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]
"""An array of floats."""


def clamped(value: float, lowest: float, highest: float) -> float:
    """Number, or the end of a range beyond which it is: ``min(max())`` at a third of its price."""
    return lowest if value < lowest else highest if value > highest else value


def interpolated(at: float, xs: Sequence[float], ys: Sequence[float]) -> float:
    """Piecewise linear interpolation, constant outside, of plain floats: it runs at every tick."""
    place = bisect_right(xs, at)
    if place == 0:
        return ys[0]
    if place == len(xs):
        return ys[-1]
    share = (at - xs[place - 1]) / (xs[place] - xs[place - 1])
    return ys[place - 1] + share * (ys[place] - ys[place - 1])


def check_positive(**values: float | Array) -> None:
    """Raise ParameterError for a number, or one in an array, that is not positive and finite."""
    for name, value in values.items():
        if isinstance(value, float):
            holds = 0.0 < value < inf
        else:
            holds = bool(np.all(np.isfinite(value)) and np.all(np.greater(value, 0.0)))
        if not holds:
            raise ParameterError(f'{name} = {value!r} must be a positive finite number')
