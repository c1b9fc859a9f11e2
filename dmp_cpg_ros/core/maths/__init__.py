# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors, rotations and matrix exponentials."""

from math import inf

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError

Array = NDArray[np.float64]
"""An array of floats."""


def clamped(value: float, lowest: float, highest: float) -> float:
    """Number, or the end of a range beyond which it is: ``min(max())`` at a third of its price."""
    return lowest if value < lowest else highest if value > highest else value


def check_positive(**values: float | Array) -> None:
    """Raise ParameterError for a number, or one in an array, that is not positive and finite."""
    for name, value in values.items():
        if isinstance(value, float):
            holds = 0.0 < value < inf
        else:
            holds = bool(np.all(np.isfinite(value)) and np.all(np.greater(value, 0.0)))
        if not holds:
            raise ParameterError(f'{name} = {value!r} must be a positive finite number')
