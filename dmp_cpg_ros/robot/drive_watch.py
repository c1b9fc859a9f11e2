# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which joints do not do what they are told, by the torques that their drives report.

The drive law says which torque τ* the last targets ask for at the measured angle and velocity.
A drive with power gives it, a weak one a part of it; one without power gives nothing, and one that
follows anything but the targets gives what has nothing to do with it. So does not follow whoever
reports, over the last few hundredths of a second, ∫ τ τ* < 0.15 ∫ τ*² while much is asked. A leg
is limp whose three joints move and give nothing; one that has given what nobody asked for has
power, and carries. One is wild whose torques vary by much that has nothing to do with τ*: the
smaller of their variance and ∫ τ² − (∫ τ τ*)² / ∫ τ*². Limp or wild, a leg is lame: the robot lies
down, and cuts the leg off where it can. Once its power is back what it gave before does not count,
and what it gives without being asked at first cuts it off again. One reading alone tells of no
joint that it fails and of no leg that it is limp: where a foot lands between the last torque and
the reading, the drive could not know the velocity for which τ* is asked.

Motors behind a bus act by commands of some periods ago, nobody knows how many. Of them τ* is what
is nearest to τ between all that the targets of that time have asked for.
"""

from __future__ import annotations

from collections import deque
from math import exp

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS, JointTargets, RobotState
from dmp_cpg_ros.robot.drive_offsets import DriveOffsets
from dmp_cpg_ros.robot.joint_drive import JointDrive

Mask = NDArray[np.bool_]

MEMORY_S = 0.02
"""Time constant with which what was is forgotten [s]."""

MUCH = 0.15
"""Share of its torque limit from which what is asked of a joint tells whether it follows."""

FOLLOWS, WORKS = 0.15, 0.5
"""Share of what it is asked for from which a joint follows; and from which its drive reports
torques: nothing is said of drives that never did.
"""

LIMP = 0.15
"""Share of the squared torques asked for below which a leg gives none."""

WILD = 0.55
"""What varies and follows nothing of a leg's torques, in squared limits, summed over its joints,
from which its drives give anything: full torque this way and that throws a robot over within a
tenth of a second. In walks on rough ground torques vary as much, as they are asked to.
"""

MOVES = 0.5
"""Joint speed above which a leg without torque is not one that is held [rad/s]."""

STRANGE, STRANGE_NS = 0.15, 1_000_000_000
"""Share of its torque limits that a leg gives without being asked, and for how long it is known by
that to have power [ns].
"""

WELL_NS = 1_000_000_000
"""Time for which a joint must have done what it is told until it counts as sound again [ns]."""

TRIED_NS = 100_000_000
"""Time after its power is back for which a leg is cut off as soon as it gives what nobody asks for
[ns]: a leg that gives anything throws a robot over that lies, too, before it is found to be wild.
"""

LONGEST_NS = 50_000_000
"""Longest time between two states that are judged together [ns]."""


class DriveWatch:
    """Compares the torques of twelve joints with what their targets ask for.

    Parameters
    ----------
    description : RobotDescription
        Gains and limits of the drives.

    Attributes
    ----------
    watches : bool
        Whether there are drives that can be judged.
    keeps_velocity : bool
        Whether drives go on with a velocity that they are told again with the same angle, as
        motors do that are told both at a rate of their own; those of the simulator stop there.
    late_ns : int
        Age of the oldest targets by which drives may still act [ns]; 0 where they act by the last.
    failing : tuple of str
        Joints, by the robot's names, that do not follow or did not lately; those of a leg that is
        cut off among them.
    cuts : bool
        Whether lame legs are without power: drives that give anything are to be cut off, and a
        robot that only lies down with one of them is thrown over from its belly.
    offsets : DriveOffsets
        By how much drives are off.
    lame : tuple of str
        Legs that move without giving torque that is asked of them, or did lately; where they are
        cut off, also those that give torques that change wildly.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._kp, self._kd = np.tile(description.kp, 4), np.tile(description.kd, 4)
        self._limit = np.concatenate([leg.torque_limit for leg in description.legs])
        self._damping = np.concatenate([leg.damping for leg in description.legs])
        self.offsets = DriveOffsets(description)
        self._limited = JointDrive(description, 1, 1e-3).limited
        self._names = description.joint_names
        self._told: Array | None = None  # (3, 12)
        self._goes = np.zeros(len(self._names))  # velocities that the drives still follow
        self._told_ns = 0
        self._reports = False
        self._before: deque[tuple[int, Array, Array]] = deque()  # what was told before that
        self.watches, self.keeps_velocity, self.cuts, self.late_ns = True, False, False, 0
        self._failed_ns = np.full(len(self._names), -WELL_NS)
        self.failing: tuple[str, ...] = ()
        # Means over squared limits: τ* by both laws, friction, τ; τ*² by both (the second first),
        # τ τ* by both, τ², q̇².
        self._means, self._news = np.zeros((2, 10, len(self._names)))
        self._failing_now, self._limp_now = (  # by what was last seen
            np.zeros(size, dtype=bool) for size in (len(self._names), len(LEGS)))
        self._strange_ns = np.full(len(LEGS), -STRANGE_NS)
        self._lame_ns = np.full(len(LEGS), -WELL_NS)
        self._back_ns = np.full(len(LEGS), -TRIED_NS)  # when its power came back
        self.lame: tuple[str, ...] = ()

    def tell(self, time_ns: int, targets: JointTargets) -> None:
        """Keep what the joints are told at a stamp [ns]."""
        told, last = np.array((targets.position, targets.velocity, targets.effort)), self._told
        held = False if last is None or self.keeps_velocity else (
            told == last).all(axis=0)                            # nothing new to the drive
        if last is not None and self.late_ns:
            self._before.append((self._told_ns, last, self._goes))
        self._goes = np.where(held, 0.0, told[1])
        self._told_ns, self._told = time_ns, told

    def see(self, state: RobotState) -> None:
        """Judge what the joints have made of it."""
        now, told = state.time_ns, self._told
        after_ns = now - self._told_ns
        if not self.watches:
            return
        if told is None or not 0 < after_ns <= LONGEST_NS:
            self._means = np.zeros_like(self._means)
            self._failing_now[:] = self._limp_now[:] = False
            self._before.clear()
            self.offsets.forget()
            return
        dt, q, q_dot = 1e-9 * after_ns, state.joint_position, state.joint_velocity
        news, given, fade = self._news, state.joint_effort / self._limit, exp(-dt / MEMORY_S)
        asked = self._asked(told[0] + dt * told[1] - q, told[2], self._goes, q_dot)
        if self.late_ns:
            asked[:] = self._nearest(given, asked, state)
        if self.lame:
            self.offsets.forget(self.lame)
        else:
            self.offsets.see(now, given, asked, q, told[0] + dt * told[1])
        news[:2], news[2], news[3] = asked, self._damping * q_dot / self._limit, given
        news[5:3:-1] = asked * asked
        news[6:8], news[8], news[9] = asked * given, given * given, q_dot * q_dot
        self._means = fade * self._means + (1.0 - fade) * news
        self._watch_legs(now)
        power, shared = self._means[5:3:-1], self._means[6:8]
        much = power > MUCH * MUCH
        if not self._reports:
            self._reports = bool((much & (shared > WORKS * power)).any())
            return
        failing = (much & (shared < FOLLOWS * power)).all(axis=0)
        if np.count_nonzero(failing):
            failing &= (news[6:8] < FOLLOWS * news[5:3:-1]).all(axis=0)
        failing, self._failing_now = failing & self._failing_now, failing
        if self.cuts and self.lame:
            failing |= np.repeat([leg in self.lame for leg in LEGS], len(JOINTS_OF_LEG))
        if self.offsets.known:
            failing |= self.offsets.offset != 0.0
        if np.count_nonzero(failing):
            self._failed_ns = np.where(failing, now, self._failed_ns)
        elif not self.failing:
            return
        lately = now - self._failed_ns < WELL_NS
        self.failing = tuple(name for name, of in zip(self._names, lately, strict=True) if of)

    def _asked(self, ahead: Array, effort: Array, goes: Array, q_dot: Array) -> Array:
        """Torques that the drives give by both laws, as shares of their limits, for angles that
        are ahead of them [rad], efforts [N m] and velocities to follow [rad/s], each (..., 12):
        ndarray (2, ..., 12).
        """
        plain = self._kp * ahead + self._kd * (goes - q_dot) + effort
        return np.asarray(self._limited(
            np.array((plain, plain + self._damping * goes)), q_dot) / self._limit)

    def _nearest(self, given: Array, asked: Array, state: RobotState) -> Array:
        """What is nearest to the torques that are given, (12,), between those that are asked for,
        (2, 12), and those that older targets ask for.
        """
        while self._before and state.time_ns - self._before[0][0] > self.late_ns:
            self._before.popleft()
        if self._before:
            told, goes = (np.array(rows) for rows in list(zip(*self._before, strict=True))[1:])
            older = self._asked(told[:, 0] - state.joint_position, told[:, 2], goes,
                                state.joint_velocity)
            asked = np.concatenate([asked, *older])
        return np.asarray(np.clip(given, asked.min(axis=0), asked.max(axis=0)))

    def _are_wild(self, now: int, unexplained: Mask) -> Mask:
        """Legs (4,) whose torques change wildly, or that have just got their power back and give
        what nobody asks for, where it is ``unexplained`` in the mean.
        """
        means = self._means
        followed = (np.maximum(means[6:8], 0.0) ** 2 / np.maximum(means[5:3:-1], 1e-9)).max(axis=0)
        kicks = np.minimum(means[8] - means[3] * means[3], means[8] - followed)
        wild = kicks.reshape(len(LEGS), -1).sum(axis=1) > WILD
        return np.asarray(wild | (now - self._back_ns < TRIED_NS) & unexplained)

    def _watch_legs(self, now: int) -> None:
        """Judge whether a leg moves without any torque."""
        means = self._means
        asked, *shared, reported, moves = means[5:].reshape(5, len(LEGS), -1).sum(axis=2)
        explained = np.maximum(np.maximum(*shared), 0.0)
        first, second, friction, mean = means[:4]
        low = np.minimum(np.minimum(first, second), 0.0) + np.minimum(friction, 0.0)
        high = np.maximum(np.maximum(first, second), 0.0) + np.maximum(friction, 0.0)
        unasked = mean - np.minimum(np.maximum(mean, low), high)
        strange = (unasked * unasked).reshape(len(LEGS), -1).sum(axis=1)
        strangely = unexplained = strange > STRANGE * STRANGE
        if self.offsets.known:  # what drives give that are off nobody asks for
            strangely = unexplained | self.offsets.offset.reshape(len(LEGS), -1).any(axis=1)
        if np.count_nonzero(strangely):
            self._strange_ns = np.where(strangely, now, self._strange_ns)
        limp = (asked > MUCH * MUCH) & (np.maximum(reported, explained) < LIMP * asked)
        if np.count_nonzero(limp):
            limp &= (moves > MOVES * MOVES) & (now - self._strange_ns > STRANGE_NS)
            asked, *shared, reported = self._news[5:9].reshape(4, len(LEGS), -1).sum(axis=2)
            limp &= np.maximum(reported, np.maximum(*shared)) < LIMP * asked
        limp, self._limp_now = limp & self._limp_now, limp
        lame = limp | self._are_wild(now, unexplained) if self.cuts else limp
        if self._reports and np.count_nonzero(lame):
            self._lame_ns = np.where(lame, now, self._lame_ns)
        elif not self.lame:
            return
        lately, before = now - self._lame_ns < WELL_NS, self.lame
        self.lame = tuple(leg for leg, of in zip(LEGS, lately, strict=True) if of)
        if self.cuts:  # that it gave nothing while it was cut off is no sign against a leg
            back = np.array([leg in before and leg not in self.lame for leg in LEGS])
            self._back_ns = np.where(back, now, self._back_ns)
            self._means[:, np.repeat(back, len(JOINTS_OF_LEG))] = 0.0
