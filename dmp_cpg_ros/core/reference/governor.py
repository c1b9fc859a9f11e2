# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How hard a reference may accelerate: as the next steps can catch and friction can hold.

A body whose velocity changes by Δv is caught by a foot Δv √(h/g) farther out (capture point; Pratt
et al. 2006, for the linear inverted pendulum of height h). Feet come down every T = 1/(n f), with
n groups of legs that step in turn at the cadence f. A foot that stands for T_s = β/f already
needs w T_s/2 of its room, with w the speed of the body over it; what is left has to take the
change of a step:

    A = (room − w T_s/2) / (T √(h/g)) ,

ahead with w = |v| and the room sqrt(L² − h²) of a leg of length L, across with w = |v_y| + |γ| ρ
and the room up to the middle between the feet, beyond which they do not step. Both bound an
ellipse, and friction, of which a curve has |v| |γ| already, a circle:

    (a_x/A_x)² + (a_y/A_y)² ≤ 1 ,    |a|² + (v γ)² ≤ max_acceleration² .

A quarter of ``max_acceleration`` is always allowed, or a reference could be stuck. The limits are
those of the gait that is wanted, and the least ones where gaits are chosen by speed. Braking to
rest is not limited (:mod:`~dmp_cpg_ros.core.reference.filter`), and slowing down towards another
velocity only by ``max_acceleration``, whatever the curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, pi, sqrt

from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Pair

LEAST = 0.25
"""Share of the largest acceleration that is always allowed."""


class Governor:
    """Limits of acceleration of one robot in its gaits.

    Parameters
    ----------
    gaits : sequence of Gait
        That may be in force.
    scale : BodyScale
        The robot's lengths.
    """

    def __init__(self, gaits: Sequence[Gait] = (), scale: BodyScale | None = None) -> None:
        """Keep both."""
        self._gaits, self._scale = gaits, scale

    def share(self, r: Array, change: Array | Pair, dt: float, largest: float) -> float:
        """Share of a change of the velocity that is within the limits.

        Parameters
        ----------
        r : ndarray (3,)
            Reference v_x, v_y [m/s], γ [rad/s].
        change : ndarray (2,) or pair of float
            Of v_x and v_y within the step [m/s].
        dt : float
            Step [s].
        largest : float
            ``max_acceleration`` [m/s^2].

        Returns
        -------
        float
            In (0, 1].
        """
        a_x, a_y = change[0] / dt, change[1] / dt
        asked = hypot(a_x, a_y)
        if asked <= LEAST * largest:
            return 1.0
        (v_x, v_y, gamma), least = r.tolist(), LEAST * largest
        curve = hypot(v_x, v_y) * gamma
        most = sqrt(max(largest * largest - curve * curve, least * least)) / asked
        for ahead, across in (self._caught(gait, r) for gait in self._gaits):
            most = min(most, 1.0 / hypot(a_x / max(ahead, least), a_y / max(across, least)))
        return min(1.0, max(most, least / asked))

    def _caught(self, gait: Gait, r: Array) -> tuple[float, float]:
        """A_x and A_y [m/s^2]."""
        assert self._scale is not None
        scale = self._scale
        (v_x, v_y, gamma), omega, _, duty = gait.pace(r, scale)
        half_stance = pi * duty / omega
        rate = gait.steps * omega / (2.0 * pi) * sqrt(GRAVITY / scale.leg_length)
        return ((scale.room_ahead - half_stance * hypot(v_x, v_y)) * rate,
                (scale.room_across
                 - half_stance * (abs(v_y) + abs(gamma) * scale.hip_radius)) * rate)
