# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the controllers take for true where nothing is felt: the plan, but no ground in a gap.

A leg whose joints are not known is on its path: on a flat floor the joints follow their targets
within hundredths of a radian, while angles that were true once are wrong after a tenth of a
second. A robot that feels neither joints nor its IMU moves as the reference has it. While it does,
its feet are where the plan has them. So what comes back after that is late where the feet are
nearer to where the plan had them some time ago: whoever stops first and lags then tells nothing
twice by which the estimator could know it. It is felt once the feet are where they are to be.

A foot that is to stand and hangs in a gap bears nothing, whatever its joints are told. Where its
share of the wrench is missing, the body sinks and rolls onto it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nan, pi
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.balance.virtual_model import EQUAL, distribute
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.core.transformation.foot_path import FootPath

LATE_S = (0.08, 0.12, 0.16, 0.2, 0.24)
"""How late what comes back may be [s]; what is so by less than half of the first is in time."""

LOOKS_S, MEMORY_S, LONGEST_S = 0.05, 0.1, 3.0
"""For how long it is looked at at least, with which time constant what was is forgotten, and after
what time it is believed whatever it tells [s]: feet may follow another plan than this one.
"""

ALIKE = 0.02
"""Distance from the plan that tells nothing, in lengths of a leg: feet that hardly move."""

GOES = 0.5
"""Activity of the legs from which they follow the plan."""


class PlannedFeet(NamedTuple):
    """Where a gait has the feet.

    Attributes
    ----------
    legs : sequence of LegKinematics
        Of the four legs.
    footholds : sequence of four tuples of float
        At mid-stance, in ``base_link`` [m].
    reference : tuple of float
        v_x, v_y [m/s], γ [rad/s].
    omegas : sequence of four floats
        Rates of the legs' cycles [rad/s].
    duty : float
        Share of stance.
    positions : sequence of four floats
        In the cycle, 0 at mid-swing, ±1/2 at mid-stance.
    """

    legs: Sequence[LegKinematics]
    footholds: Sequence[Triple]
    reference: Triple
    omegas: Sequence[float]
    duty: float
    positions: Sequence[float]

    def foot(self, i: int, late_s: float = 0.0) -> Triple:
        """Place of a foot, swings left level, now or some time ago [s]: in ``base_link`` [m]."""
        path = FootPath(self.footholds[i], *self.reference, self.omegas[i], self.duty, 0.0)
        position = self.positions[i]
        if late_s:
            position = (position - self.omegas[i] * late_s / (2.0 * pi) + 0.5) % 1.0 - 0.5
        return path.at(position)[0]

    def apart(self, joint_position: Array, felt: Sequence[int], late_s: float) -> float:
        """Mean squared distance [m²] along the ground of some feet from where they were to be some
        time ago [s], but for what they have in common.
        """
        off = np.array([np.subtract(self.legs[i].foot(joint_position[3 * i:3 * i + 3].tolist()),
                                    self.foot(i, late_s))[:2] for i in felt])
        return float(np.square(off - off.mean(axis=0)).sum(axis=1).mean())


class ComingBack(NamedTuple):
    """What is known of a body that has felt nothing: whether what it feels again is late.

    Attributes
    ----------
    lost : bool
        Whether it has felt nothing, and is not known to feel in time since.
    apart : tuple of float
        Mean squared distance of the feet from where they are to be, and from where they were to be
        by each of ``LATE_S`` ago [m²].
    looked_s : float
        For how long they were looked at [s].
    """

    lost: bool = False
    apart: tuple[float, ...] = ()
    looked_s: float = 0.0

    def felt(self, state: RobotState, planned: PlannedFeet, moving: float, leg_length: float,
             dt: float) -> tuple[ComingBack, RobotState]:
        """Leave out what is late, and take the plan for what is not felt.

        Parameters
        ----------
        state : RobotState
            As it is felt.
        planned : PlannedFeet
            Of this tick.
        moving : float
            Activity of the legs, in [0, 1].
        leg_length : float
            [m]
        dt : float
            Time since the last tick [s].

        Returns
        -------
        memory : ComingBack
        state : RobotState
            With the plan in place of what is not felt; one that feels nothing while what it feels
            is late, or nobody knows.
        """
        back, state = self._judged(state, planned, moving, leg_length, dt)
        return back, state if state.felt_legs is None else as_planned(state, planned)

    def _judged(self, state: RobotState, planned: PlannedFeet, moving: float, leg_length: float,
                dt: float) -> tuple[ComingBack, RobotState]:
        """State without what is late."""
        if state.feels_nothing:
            return LOST, state
        if not self.lost:
            return self, state
        legs = [i for i, felt in enumerate(state.felt_legs or (True,) * len(LEGS)) if felt]
        looked_s = self.looked_s + dt
        if moving < GOES or looked_s > LONGEST_S:
            return SOUND, state
        if len(legs) < 2:
            return self, state
        share = min(dt / MEMORY_S, 1.0) if self.apart else 1.0
        before = self.apart or (0.0,) * (1 + len(LATE_S))
        apart = tuple(
            was + share * (planned.apart(state.joint_position, legs, late_s) - was)
            for was, late_s in zip(before, (0.0, *LATE_S), strict=True))
        if looked_s > LOOKS_S and apart[0] <= min(apart) + (ALIKE * leg_length) ** 2:
            return SOUND, state
        return ComingBack(True, apart, looked_s), replace_unchecked(
            state, felt_legs=(False,) * len(LEGS), gyro_in_base=np.full(3, nan),
            acceleration_in_base=np.full(3, nan), foot_force=np.full(len(LEGS), nan))


SOUND, LOST = ComingBack(), ComingBack(True)
"""Of a body that feels in time, and of one that feels nothing."""


def as_planned(state: RobotState, planned: PlannedFeet) -> RobotState:
    """State with the plan in place of what is not felt.

    Parameters
    ----------
    state : RobotState
        With ``felt_legs``.
    planned : PlannedFeet
        Of this tick.

    Returns
    -------
    RobotState
        Joints of unfelt legs on the feet's paths, swings left level; velocity and turn rate of the
        reference where nothing at all is felt.
    """
    angles = state.joint_position.copy()
    for i, felt in enumerate(state.felt_legs or ()):
        if not felt:
            angles[3 * i:3 * i + 3] = planned.legs[i].angles(planned.foot(i))
    if not state.feels_nothing:
        return replace_unchecked(state, joint_position=angles)
    v_x, v_y, gamma = planned.reference
    return replace_unchecked(
        state, joint_position=angles, base_velocity_in_base=np.array((v_x, v_y, 0.0)),
        base_rate_in_base=np.array((0.0, 0.0, gamma)))


def borne_by_others(force: Triple, moment: Triple, feet: Sequence[Triple], load: Sequence[float],
                    empty: Sequence[bool], friction: float, largest: float,
                    importance: Triple = EQUAL) -> list[Triple]:
    """Forces of the ground on the feet [N]; arguments and forces are those of
    :func:`~dmp_cpg_ros.core.balance.virtual_model.distribute`, but feet that are not ``empty``
    make the wrench alone. A foot in a gap presses on as if it bore: so it finds ground that is
    only lower.
    """
    forces = distribute(force, moment, feet, load, friction, largest, importance)
    if not any(empty):
        return forces
    bears = [0.0 if hangs else share for share, hangs in zip(load, empty, strict=True)]
    alone = distribute(force, moment, feet, bears, friction, largest, importance)
    return [presses if hangs else bearing for presses, bearing, hangs in zip(
        forces, alone, empty, strict=True)]
