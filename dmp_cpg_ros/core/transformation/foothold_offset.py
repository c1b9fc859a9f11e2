# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The foothold offset, by which feedback moves the path of a foot.

The offset is the shift s of a foot's path. In swing ṡ = h λ_p (s_wanted − s), with h the
relative height of the foot: a foot that has not left the ground is not dragged along it.

In stance ṡ = drift + λ_y (p_measured − p) horizontally, a spring that yields: the target p of a
standing foot stays where the foot is. Vertically ṡ = −λ_l (s − e), to where the foot stands over
the plane that the body follows (:mod:`~dmp_cpg_ros.core.balance.terrain`): 0 on even ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

from dmp_cpg_ros.core.maths.vec3 import Triple


@dataclass(frozen=True)
class OffsetRates:
    """Rates of the offset.

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

    def in_swing(self, shift: Triple, wanted: Triple, height: float, activity: float,
                 dt: float) -> Triple:
        """Rate of the shift of a swinging foot.

        Parameters
        ----------
        shift, wanted : tuple of float
            Present and wanted shift [m].
        height : float
            Height of the foot as a share of its largest, in [0, 1].
        activity : float
            Swing activity of the leg; a foot that comes down as the phase stops is left alone.
        dt : float
            Time step [s], positive.

        Returns
        -------
        tuple of float
            Mean over the step [m/s].
        """
        share = (1.0 - exp(-self.placement * activity * height * dt)) / dt
        (x, y, z), (wanted_x, wanted_y, wanted_z) = shift, wanted
        return (wanted_x - x) * share, (wanted_y - y) * share, (wanted_z - z) * share

    def in_stance(self, shift: Triple, drift: tuple[float, float], away: tuple[float, float],
                  activity: float, dt: float, level: float = 0.0) -> Triple:
        """Rate of the shift of a standing foot.

        Parameters
        ----------
        shift : tuple of float
            Present shift [m].
        drift : tuple of float
            Horizontal velocity by which the ground moves otherwise than planned [m/s].
        away : tuple of float
            Where the foot is horizontally relative to its target [m].
        activity : float
            Swing activity of the leg; at rest the foot holds.
        dt : float
            Time step [s], positive.
        level : float
            Height over the plane of the ground at which the foot stands [m].

        Returns
        -------
        tuple of float
            Mean over the step [m/s].
        """
        share = activity * (1.0 - exp(-self.yielding * dt)) / dt
        back = (1.0 - exp(-self.levelling * dt)) / dt
        return drift[0] + share * away[0], drift[1] + share * away[1], -back * (shift[2] - level)
