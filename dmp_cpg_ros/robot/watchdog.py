# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Command watchdog: the newest joint targets, or a safe stop when a leg sends none.

A standing robot holds its stance. One that is upright but low (on its way up or down, or on its
belly) is lowered onto its belly. The joints of a tilted one are damped.
"""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.modes.falls import BodySense, FallParameters
from dmp_cpg_ros.core.modes.motion_library import RISE, Movements, lying_posture
from dmp_cpg_ros.core.primitives.demonstration import minimum_jerk
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS, JointTargets, RobotState
from dmp_cpg_ros.robot.start_pose import home_joint_position

CARRIED_NS = 24_000_000
"""Age up to which late targets are carried on by their own velocity [ns]."""

STAND_S = 0.6
"""Time in which a stand is taken up from wherever the joints are [s]."""

STANDING_HEIGHT = 0.7
"""Fraction of the standing height from which the robot stands."""


class CommandWatchdog:
    """The newest targets of the four legs, or a fallback when one of them is too old.

    Targets hold at their stamp. Those that act later are carried on by their own velocity to the
    time at which they act, as the joint would have moved if they had come in time; otherwise every
    late message would hold the feet, and with them the body, back.

    Parameters
    ----------
    description : RobotDescription
        The robot, for its postures.
    timeout_ns : int
        Age of a leg's targets from which the robot falls back [ns].

    Attributes
    ----------
    stamps : list of int or None
        Of the newest targets of each leg [ns].
    fallback : str
        ``stand``, ``lie`` or ``damp`` while the robot falls back; else empty.
    """

    def __init__(self, description: RobotDescription, timeout_ns: int) -> None:
        """Start without targets."""
        self._timeout_ns, self._targets = timeout_ns, np.zeros((3, 12))
        self.stamps: list[int | None] = [None] * len(LEGS)
        self.fallback = ''
        self._sense, self._stance_height = BodySense(description), description.stance_height
        self._ways = {'stand': (home_joint_position(description), STAND_S),
                      'lie': (lying_posture(description), RISE * Movements(description).time_unit)}
        self._tilt = FallParameters().fall_tilt

    def accept(self, leg: str, stamp_ns: int, targets: JointTargets) -> None:
        """Take a leg's targets; older ones than the newest are ignored."""
        i = LEGS.index(leg)
        newest = self.stamps[i]
        if newest is not None and stamp_ns < newest:
            return
        self.stamps[i] = stamp_ns
        joints = slice(len(JOINTS_OF_LEG) * i, len(JOINTS_OF_LEG) * (i + 1))
        self._targets[:, joints] = targets.position, targets.velocity, targets.effort

    def silent(self, now_ns: int) -> list[str]:
        """Legs whose targets are missing or too old."""
        return [leg for leg, stamp in zip(LEGS, self.stamps, strict=True)
                if stamp is None or now_ns - stamp > self._timeout_ns]

    def age_ns(self, now_ns: int) -> int:
        """Age of the oldest leg's targets [ns]; 0 while a leg has never sent any."""
        known = [stamp for stamp in self.stamps if stamp is not None]
        return now_ns - min(known) if len(known) == len(self.stamps) else 0

    def targets(self, state: RobotState) -> JointTargets:
        """Targets of all joints, (12,) each, at a state of the robot."""
        if self.silent(state.time_ns):
            return self._falling_back(state)
        self.fallback = ''
        position, velocity, effort = self._targets.copy()
        ages = [max(0, state.time_ns - stamp) for stamp in self.stamps if stamp is not None]
        if any(ages):
            late = np.repeat([1e-9 * min(age, CARRIED_NS) for age in ages], len(JOINTS_OF_LEG))
            position += late * velocity
        return JointTargets(position, velocity, effort)

    def _falling_back(self, state: RobotState) -> JointTargets:
        """Targets of the fallback that the robot's state asked for when it began; a robot that
        tips over meanwhile is damped.
        """
        condition, here = self._sense.condition(state), state.joint_position
        if self.fallback != 'damp' and condition.tilt > self._tilt:
            self.fallback = 'damp'
        elif not self.fallback:
            stands = condition.height >= STANDING_HEIGHT * self._stance_height
            self.fallback, self._begin_ns = 'stand' if stands else 'lie', state.time_ns
            self._start = here.copy()
        if self.fallback == 'damp':
            return JointTargets(here.copy(), np.zeros(12), np.zeros(12))
        goal, seconds = self._ways[self.fallback]
        share = float(minimum_jerk(np.array((state.time_ns - self._begin_ns) * 1e-9 / seconds)))
        return JointTargets(self._start + share * (goal - self._start), np.zeros(12), np.zeros(12))
