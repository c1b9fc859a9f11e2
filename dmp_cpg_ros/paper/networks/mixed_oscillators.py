# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Oscillators of several kinds in one network, such as a gait's oscillators and a tail's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.networks.family import OscillatorFamily

Array = NDArray[np.float64]


class MixedOscillators:
    """Families one after the other: the first has the first nodes, and so on.

    Parameters
    ----------
    families : sequence of OscillatorFamily
        With states of the same size.

    Raises
    ------
    ParameterError
        If there are none, or their states differ in size.
    """

    def __init__(self, families: Sequence[OscillatorFamily]) -> None:
        """Lay the families out."""
        sizes = sorted({family.state_size for family in families})
        if len(sizes) != 1:
            raise ParameterError(f'mixed oscillators need states of one size, not {sizes}')
        self.families, self.state_size = tuple(families), sizes[0]
        self.rotation_invariant = all(family.rotation_invariant for family in families)
        ends = np.cumsum([family.count for family in families])
        self.count = int(ends[-1])
        starts = ends - [family.count for family in families]
        self._parts = [slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]

    def field(self, x: Array) -> Array:
        """Rates, ndarray (N, n) → (N, n)."""
        return np.concatenate([family.field(x[part]) for family, part in self._pairs()])

    def jacobian(self, x: Array) -> Array:
        """Jacobians, ndarray (N, n) → (N, n, n)."""
        return np.concatenate([family.jacobian(x[part]) for family, part in self._pairs()])

    def stiffness(self, x: Array) -> float:
        """Largest bound of the families [1/s]."""
        return max(family.stiffness(x[part]) for family, part in self._pairs())

    def _pairs(self) -> zip[tuple[OscillatorFamily, slice]]:
        return zip(self.families, self._parts, strict=True)
