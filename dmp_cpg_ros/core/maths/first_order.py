# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""First-order filter ṙ = α (r_ext − r), integrated exactly (eq. p2p_filter).

Filters the velocity reference of the robot, and goal, centre, amplitude and τ of primitives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.maths import Array, check_positive


@dataclass(frozen=True)
class FirstOrderFilter:
    """ṙ = α (r_ext − r), the reference system of a primitive, contracting with rate α.

    The step is the exact solution for a command that is held during the step; it has no stability
    limit. The filter runs in real time, not in scaled time, as the paper prints it (Ijspeert et
    al. 2013 slow it with τ).

    Attributes
    ----------
    rate : float
        α > 0 [1/s].

    Raises
    ------
    ParameterError
        If the rate is not a positive finite number: a filter that follows at once would make
        velocities jump.
    """

    rate: float

    def __post_init__(self) -> None:
        """Validate."""
        check_positive(rate=self.rate)

    def at(self, value: ArrayLike, command: ArrayLike, elapsed: ArrayLike) -> Array:
        """Filtered value some time after the start of a step.

        Parameters
        ----------
        value, command : array_like (...)
            State r at the start of the step and command r_ext during it, in the same unit.
        elapsed : array_like (m,) or ()
            Time since the start of the step [s].

        Returns
        -------
        ndarray (m, ...) or (...)
            r(elapsed).
        """
        value, command = np.asarray(value, dtype=float), np.asarray(command, dtype=float)
        elapsed = np.asarray(elapsed, dtype=float)
        decay = self.kept(elapsed).reshape(elapsed.shape + (1,) * max(value.ndim, command.ndim))
        return command + (value - command) * decay

    def kept(self, elapsed: ArrayLike) -> Array:
        """Share exp(−α t) of a deviation that is left some time later, (...)."""
        return np.asarray(np.exp(-self.rate * np.asarray(elapsed, dtype=float)))

    def step(self, value: ArrayLike, command: ArrayLike, dt: float) -> Array:
        """State after one step of dt [s], as :meth:`at`."""
        return self.at(value, command, dt)
