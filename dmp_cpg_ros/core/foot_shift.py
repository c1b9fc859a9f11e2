# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the shift s of a foot's path moves: to its placement in swing, with the ground in stance.

In swing ṡ = h λ_p (s_wanted − s), with h the relative height of the foot: a foot that has not left
the ground is not dragged along it.

In stance ṡ = drift + λ_y (p_measured − p) horizontally, a spring that yields: the target p of a
standing foot stays where the foot is. Vertically ṡ = −λ_l s, back to level.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ShiftRates:
    """Rates of the shift.

    Attributes
    ----------
    placement : float
        λ_p [1/s].
    yielding : float
        λ_y [1/s].
    levelling : float
        λ_l [1/s].
    """

    placement: float
    yielding: float
    levelling: float

    def in_swing(
        self, shift: Array, wanted: Array, height: float, activity: float, dt: float
    ) -> Array:
        """Rate of the shift of a swinging foot.

        Parameters
        ----------
        shift, wanted : ndarray (3,)
            Present and wanted shift [m].
        height : float
            Height of the foot as a share of its largest, in [0, 1].
        activity : float
            Swing activity of the leg; a foot that comes down as the phase stops is left alone.
        dt : float
            Time step [s], positive.

        Returns
        -------
        ndarray (3,)
            Mean over the step [m/s].
        """
        return (wanted - shift) * ((1.0 - exp(-self.placement * activity * height * dt)) / dt)

    def in_stance(
        self, shift: Array, drift: Array, away: Array, activity: float, dt: float
    ) -> Array:
        """Rate of the shift of a standing foot.

        Parameters
        ----------
        shift : ndarray (3,)
            Present shift [m].
        drift : ndarray (2,)
            Velocity by which the ground moves otherwise than planned [m/s].
        away : ndarray (3,)
            Where the foot is relative to its target [m].
        activity : float
            Swing activity of the leg; at rest the foot holds.
        dt : float
            Time step [s], positive.

        Returns
        -------
        ndarray (3,)
            Mean over the step [m/s].
        """
        share = activity * (1.0 - exp(-self.yielding * dt)) / dt
        back = (1.0 - exp(-self.levelling * dt)) / dt
        return np.array((
            drift[0] + share * away[0], drift[1] + share * away[1], -back * shift[2]))
