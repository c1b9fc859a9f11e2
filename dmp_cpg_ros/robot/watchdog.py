# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Command watchdog: the newest joint targets, or a safe stop when a leg sends none.

A walking robot goes on with the rhythm of its last cycle, first the leg that sends none, then all,
in steps that become smaller until it stands; without a rhythm it holds its joints for 0.1 s and
puts its feet down. A standing robot holds its stance. One that is upright but low (on its way up
or down, or on its belly) is lowered onto its belly. So is one with a lame leg, which gives no
torque or anything, as fast as it would fall: three legs do not carry a body that moves, and from
its belly nothing falls. The joints of a tilted one are damped. Targets are followed again when
they rest where the joints are, or a step away where the robot stands, and act in time.
"""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.clock import fresh
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.modes.falls import BodySense, FallParameters
from dmp_cpg_ros.core.modes.motion_library import RISE, lying_posture, time_unit
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS, JointTargets, RobotState
from dmp_cpg_ros.robot.absent_legs import CARRIED_NS, JOINTS, TAKEN_UP_S, AbsentLegs, share
from dmp_cpg_ros.robot.drive_watch import DriveWatch
from dmp_cpg_ros.robot.last_cycle import LastCycle, Rhythm
from dmp_cpg_ros.robot.start_pose import home_joint_position
from dmp_cpg_ros.robot.target_loss import BORNE, LITTLE, TargetLoss
from dmp_cpg_ros.robot.target_watch import TargetWatch

HELD_NS = 100_000_000
"""Age up to which late targets are held that have no rhythm with which to go on [ns]."""

LATE_NS = 1_000_000_000
"""Time for which targets may be late again and again until the robot looks after itself [ns]."""

STAND_S = 0.15
"""Time in which a stand is taken up from wherever the joints are [s]: a raised foot has to be down
before the robot tips over to its side.
"""

DROP = 1.5
"""Time in which it is lowered from a stand when a leg is lame, in √(l/g); falling takes 1.3."""

STOP_CYCLES = 2.0
"""Periods of its last rhythm in which a walking robot comes to a stand by itself."""

LONGEST_STOP_S = 1.6
"""Longest time of that [s]: the period that is found may be several."""

NEAR, SLOW = 0.3, 0.3
"""Distance [rad] and speed [rad/s] within which targets are at rest where the joints are held."""

STEPPED = 0.7
"""That distance for a robot that stands: its legs may rest on footholds a step away [rad]."""

AT_EASE_NS, MOST_AT_EASE_NS = 100_000_000, 400_000_000
"""Time for which targets must have been at rest and in time until they are followed again [ns];
twice as long each time that the robot has to look after itself again soon, and how long at most: a
robot that starts to walk has no rhythm yet with which to go on when they are late once more.
"""

AGAIN_NS = 10_000_000_000
"""Time since it looked after itself from which on it is as for the first time [ns]."""

YIELDS = 0.15
"""Share of its torque limits with which a leg moves that was cut off, until the legs are followed
again: it may lie under the body, which full torque would roll over.
"""

SLOWER = (('stand', 'stand'), ('lie', 'lie'))
"""What a robot does by itself, and the way of it, that gives way to lying down at once."""

STANDING_HEIGHT = 0.7
"""Fraction of the standing height from which the robot stands."""


class CommandWatchdog:
    """The newest targets of the four legs, or a fallback when one of them is too old.

    Targets hold a lead after their stamp, and those that come earlier wait until then: a delay
    that varies within the lead becomes a constant one. Those that act later are carried on by
    their own velocity to the time at which they act, as the joint would have moved if they had
    come in time; otherwise every late message would hold the feet, and with them the body, back.
    A leg whose targets are still later goes on with the rhythm of the last cycle, and when it does
    not come back the robot takes up its stance.

    Parameters
    ----------
    description : RobotDescription
        The robot, for its postures.
    timeout_ns : int
        Age of a leg's targets from which the robot falls back [ns].
    lead_ns : int
        Time after their stamp for which targets were computed [ns].
    tick_ns : int
        Time between two targets of a leg [ns]; 0: it does not look at what is lost.
    return_ns : int
        How much longer it goes on with the rhythm of a walk, for nodes that may come back [ns].

    Attributes
    ----------
    stamps : list of int or None
        Of the newest targets of each leg [ns].
    fallback : str
        ``stand``, ``lie`` or ``damp`` while the robot falls back; else empty.
    leaving : str
        The same, and until the joints have gone over to the targets: on the way no gait may start.
    drives : DriveWatch
        Which joints do not do what they are told.
    lateness_ns : int
        By how much the targets act too late, of the leg for which it is most [ns].
    ticks, carried : int
        How often targets were asked for since all legs were known, and how often some were carried
        on.
    """

    def __init__(self, description: RobotDescription, timeout_ns: int, lead_ns: int = 0,
                 tick_ns: int = 0, return_ns: int = 0) -> None:
        """Start without targets."""
        self._return_ns = return_ns
        self._losses = [TargetLoss(tick_ns, timeout_ns) for _ in LEGS]
        self._watches = [TargetWatch(leg, timeout_ns) for leg in description.legs]
        self._losing = False
        self._timeout_ns, self._lead_ns, self._targets = timeout_ns, lead_ns, np.zeros((3, 12))
        self.stamps: list[int | None] = [None] * len(LEGS)
        self.fallback = self.leaving = ''
        self._sense, self._stance_height = BodySense(description), description.stance_height
        lying, unit = lying_posture(description), time_unit(description)
        self._ways = {'stand': (home_joint_position(description), STAND_S),
                      'lie': (lying, RISE * unit), 'drop': (lying, DROP * unit)}
        self._way = ''
        self.drives = DriveWatch(description)
        self._tilt = FallParameters().fall_tilt
        self._memory = LastCycle()
        self._absent = AbsentLegs(self._memory, timeout_ns + return_ns)
        self._given, self._off = np.zeros(12), np.zeros(12)
        self._begin_ns = self._uneasy_ns = 0
        self._ease_ns, self._alone_ns = AT_EASE_NS, -AGAIN_NS
        self._stop_s = 0.0
        self._cut: set[str] = set()  # legs that are or were cut off since it looks after itself
        limit = np.concatenate([leg.torque_limit for leg in description.legs])
        self._yields = YIELDS * limit / np.maximum(np.tile(description.kp, 4), 1e-9)  # [rad]
        self.lateness_ns = self.ticks = self.carried = 0
        self._start = self._targets

    def accept(self, leg: str, stamp_ns: int, targets: JointTargets) -> None:
        """Take a leg's targets, unless they are not newer than the newest or not believed."""
        i = LEGS.index(leg)
        newest = self.stamps[i]
        if (newest is not None and stamp_ns <= newest
                or not self._watches[i].believes(stamp_ns, targets)):
            return
        self.stamps[i] = stamp_ns
        self._losses[i].accept(stamp_ns)
        self._memory.accept(i, stamp_ns + self._lead_ns, targets)

    def silent(self, now_ns: int) -> list[str]:
        """Legs whose targets are missing or too old; all, where they are late all the time, or
        too many are lost.
        """
        since_ns = self._absent.since_ns
        more_ns = self._return_ns if since_ns and self._absent.rhythm else 0
        late = 0 < since_ns < now_ns - LATE_NS - more_ns
        return list(LEGS) if late or self._losing else self.unheard(now_ns, more_ns)

    def unheard(self, now_ns: int, more_ns: int = 0) -> list[str]:
        """Legs whose targets are missing or too old, by more than some time [ns]."""
        return [leg for leg, stamp in zip(LEGS, self.stamps, strict=True)
                if stamp is None or now_ns - stamp > self._timeout_ns + more_ns]

    def doubted(self, now_ns: int) -> list[str]:
        """Legs whose targets jump, or repeat while they move, or did so a moment ago."""
        return [leg for leg, watch in zip(LEGS, self._watches, strict=True)
                if 0 <= watch.doubted_ns and fresh(
                    watch.doubted_ns, now_ns, self._timeout_ns)]

    @property
    def lost(self) -> float:
        """Share of the targets that do not come, of the leg that lacks most."""
        return max(loss.share for loss in self._losses)

    @property
    def losing(self) -> bool:
        """Whether the robot falls back because too many targets are lost."""
        return self._losing

    @property
    def outrun(self) -> bool:
        """Whether the robot falls back while targets that come act too late."""
        return bool(self.fallback) and self.lateness_ns > CARRIED_NS

    def targets(self, state: RobotState) -> JointTargets:
        """Targets of all joints, (12,) each, at a state of the robot."""
        self.drives.see(state)
        targets = self._chosen(state)
        self._cut |= set(self.drives.lame) if self.drives.cuts else set()
        if not self.fallback:
            self._cut.clear()
        elif self._cut:
            targets = self._yielding(targets, state)
        self._given = targets.position.copy()
        self.leaving = self.fallback or self.leaving
        self.drives.tell(state.time_ns, targets)
        if self.drives.offsets.known:
            return replace_unchecked(
                targets, position=targets.position - self.drives.offsets.offset)
        return targets

    def _yielding(self, targets: JointTargets, state: RobotState) -> JointTargets:
        """Targets by which a leg that is cut off has nothing to do, and goes on with little torque
        from where it is once its power is back.
        """
        cut, lame = (np.repeat([leg in legs for leg in LEGS], len(JOINTS_OF_LEG))
                     for legs in (self._cut, self.drives.lame))
        most, q = np.where(lame, 0.0, self._yields), state.joint_position
        return JointTargets(
            np.where(cut, np.clip(targets.position, q - most, q + most), targets.position),
            np.where(cut, 0.0, targets.velocity), np.where(cut, 0.0, targets.effort))

    def _chosen(self, state: RobotState) -> JointTargets:
        now, known = state.time_ns, None not in self.stamps
        ages = self._take_what_acts(now)
        self.lateness_ns = max(ages, default=0)
        if known:
            self.ticks, self.carried = self.ticks + 1, self.carried + (self.lateness_ns > 0)
        if not self.fallback and self.lateness_ns > CARRIED_NS:
            self._absent.watch(now, ages)
        self._losing = self.lost > (LITTLE if self._losing else BORNE)
        if self.drives.lame or self.silent(now) or self._astray() or (
                self.fallback and known and not self._at_ease(now)):
            return self._falling_back(state)
        if self.fallback:
            self.fallback, off = '', self._given - self._targets[0]
            self._absent.take_up(
                now, off, TAKEN_UP_S * max(1.0, float(np.abs(off).max()) / NEAR))
        targets = self._targets.copy()
        if any(ages):
            late = np.repeat(ages, len(JOINTS_OF_LEG))
            targets[0] += 1e-9 * np.clip(late, 0, CARRIED_NS) * targets[1]
        if self._absent.since_ns and not self._absent.go_on(now, targets, self._given):
            return self._falling_back(state)
        if not self._absent.taking_up(now, targets[0]) and not self._absent.since_ns:
            self.leaving = ''
        return JointTargets(*targets)

    def _astray(self) -> bool:
        """Whether moving legs are late that have no rhythm with which to go on: a robot that took
        up a stand until they are in time again would be torn out of it into their stride.
        """
        absent = self._absent
        return bool(absent.since_ns and absent.rhythm is None and self.lateness_ns > HELD_NS
                    and np.abs(self._targets[1]).max() > SLOW)

    def _take_what_acts(self, now: int) -> list[int]:
        """Take of each leg the newest targets whose time has come; return their ages [ns]."""
        ages = []
        for i in range(len(LEGS)):
            acting = self._memory.acting(i, now)
            if acting is not None:
                holds_ns, self._targets[:, JOINTS[i]] = acting
                ages.append(now - holds_ns)
        return ages

    def _stands(self, state: RobotState) -> bool:
        condition = self._sense.condition(state)
        return (condition.tilt <= self._tilt
                and condition.height >= STANDING_HEIGHT * self._stance_height)

    def _at_ease(self, now: int) -> bool:
        """Whether the targets have rested for a while where the joints are held, and in time:
        a robot that follows what is late would soon have to look after itself again.
        """
        position, velocity, _ = self._targets
        near = STEPPED if self.fallback == 'stand' else NEAR
        stopping = self._absent.rhythm is not None and now - self._begin_ns < 1e9 * self._stop_s
        if (stopping or np.abs(velocity).max() > SLOW or self.lateness_ns > CARRIED_NS
                or np.abs(position - self._given).max() > near):
            self._uneasy_ns = now
        return now - self._uneasy_ns >= self._ease_ns

    def _falling_back(self, state: RobotState) -> JointTargets:
        """Targets of the fallback that the robot's state asked for when it began; a robot that
        tips over meanwhile is damped.
        """
        now, lame = state.time_ns, bool(self.drives.lame)
        if self.fallback != 'damp' and self._sense.condition(state).tilt > self._tilt:
            self.fallback = 'damp'
        elif not self.fallback or (lame and (self.fallback, self._way) in SLOWER):
            again = now - self._alone_ns < AGAIN_NS
            self._ease_ns = min(2 * self._ease_ns, MOST_AT_EASE_NS) if again else AT_EASE_NS
            self._begin_falling_back(state)
        if None not in self.stamps:
            self._alone_ns = now
        if lame or self.silent(now):
            self._uneasy_ns = now
        if self.fallback == 'damp':
            return JointTargets(state.joint_position.copy(), np.zeros(12), np.zeros(12))
        if self.fallback == 'stand' and self._absent.rhythm is not None:
            return self._coming_to_a_stand(self._absent.rhythm, state)
        return JointTargets(*self._taking_up(self._way, now - self._begin_ns, state))

    def _begin_falling_back(self, state: RobotState) -> None:
        """Choose what the robot's state asks for."""
        now, stands, lame = state.time_ns, self._stands(state), bool(self.drives.lame)
        self.fallback = 'stand' if stands and not lame else 'lie'
        self._way = 'drop' if lame else self.fallback
        known = None not in self.stamps
        start = np.array((self._given if known else state.joint_position, *np.zeros((2, 12))))
        if known and not self._absent.since_ns and not lame:
            self._absent.look()
        self._absent.all_here()
        self._begin_ns = self._uneasy_ns = now
        self._start, rhythm = start, self._absent.rhythm
        if rhythm is not None:
            self._stop_s = min(STOP_CYCLES * rhythm.period_s, LONGEST_STOP_S)
        self._off = self._given - rhythm.at(now)[0] if rhythm else np.zeros(12)

    def _taking_up(self, posture: str, ahead_ns: int, state: RobotState) -> Array:
        """Targets (3, 12) on the way to a posture; a standing robot carries its weight."""
        goal, seconds = self._ways[posture]
        done, rate = share(ahead_ns, seconds), share(ahead_ns, seconds, 1) / seconds
        left, away = (1.0 - done) * self._start, goal - self._start[0]
        left[0] += done * goal
        left[1] += rate * away
        if posture == 'stand':
            left[2] += self._sense.carrying_torque(state, done)
        return left

    def _coming_to_a_stand(self, rhythm: Rhythm, state: RobotState) -> JointTargets:
        """The last rhythm about the stance, smaller and smaller."""
        now, goal = state.time_ns, self._ways['stand'][0]
        seconds, ahead = self._stop_s, now - self._begin_ns
        size, rate = 1.0 - share(ahead, seconds), -share(ahead, seconds, 1) / seconds
        position, velocity, effort = rhythm.at(now)
        away = position + (1.0 - share(ahead, TAKEN_UP_S)) * self._off - goal
        carried = self._sense.carrying_torque(state, 1.0 - size)
        return JointTargets(
            goal + size * away, size * velocity + rate * away, size * effort + carried)
