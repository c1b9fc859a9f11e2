# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What every node does that moves a robot's joints by ``joint_targets``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from std_msgs.msg import String

from dmp_cpg_ros.core.clock import fresh
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.core.suite_parameters import DriveParameters, TickParameters
from dmp_cpg_ros.nodes.framework import known_stop
from dmp_cpg_ros.nodes.framework.health import RobotTiming
from dmp_cpg_ros.nodes.framework.known_stop import KnownStop
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES, JointTargetsReader
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.robot.absent_legs import CARRIED_NS
from dmp_cpg_ros.robot.drive_watch import DriveWatch
from dmp_cpg_ros.robot.target_loss import BORNE
from dmp_cpg_ros.robot.watchdog import CommandWatchdog

INCIDENT_NS = 1_000_000_000
"""Time that all legs must have been heard for until their silence counts as over [ns]."""

RETREATS = {'stand': 'it takes up a stand', 'lie': 'it lowers itself onto its belly',
            'damp': 'its joints are damped'}
"""What the robot does by itself, in words."""

GOES_ON = 'it goes on with its last rhythm'
"""The same of a robot that does not fall back yet."""


class DrivenRobot(SuiteNode):
    """Reads targets of the joints, watches their age, and says what the joints do."""

    _state: RobotState
    _guard: CommandWatchdog
    _fell = False

    def prepare_drive(self, description: RobotDescription, options: DriveParameters) -> None:
        """Begin without targets; for ``configure``."""
        self._description, self._drive_options = description, options
        self._timing, self._reader = (
            RobotTiming(), JointTargetsReader(description.joint_names))
        self._drive_mode, self._drive_publisher = '', self.publisher('drive_mode')
        self._silent_ns = {'silent': -1, 'doubted': -1, 'late': -1, 'lost': -1}
        kept = KnownStop(self, 'kept_gains')
        known_stop.listen(self, ('acting_gains',), lambda _, *known: kept.learn(*known))
        self.forget_targets()

    def forget_targets(self) -> None:
        """Begin with a new watchdog."""
        p = self._drive_options
        self._guard = CommandWatchdog(self._description, round(p.target_timeout * 1e9),
                                      round(p.target_lead * 1e9),
                                      self.parameters_of(TickParameters).tick_ns
                                      if self.lossy else 0, self.return_ns)
        self.prepare_watch(self._guard.drives)

    def prepare_watch(self, drives: DriveWatch) -> None:
        """Tell the watch what is known of the drives; joints without any are not watched."""
        raise NotImplementedError

    def watchdog_values(self) -> dict[str, Any]:
        """What ``/diagnostics`` tells of the watchdog."""
        guard = self._guard
        now = self._state.time_ns
        return {'silent_legs': ' '.join(guard.silent(now)) or 'none',
                'doubted_legs': ' '.join(guard.doubted(now)) or 'none',
                'guarded_ticks': guard.ticks, 'carried_ticks': guard.carried,
                'lateness_ms': 1e-6 * guard.lateness_ns, 'lost_share': guard.lost}

    def leg_of(self, joint: str) -> str:
        """Leg of a joint by the robot's names."""
        return self._reader.leg_of.get(joint, '')

    def read_targets(self, message: Any) -> tuple[str, int, JointTargets]:
        """Leg, stamp [ns] and targets of a message; raises DataError."""
        leg, targets = self._reader.read(message)
        stamp, now = header_ns(message), self._state.time_ns
        if stamp > now:
            raise DataError(f'the stamp {stamp * 1e-9:.3f} s of {leg} is ahead of the clock, '
                            f'{now * 1e-9:.3f} s')
        return leg, stamp, targets

    def watch_silence(self, now: int) -> None:
        """Tell once that legs are silent, not believed, late all the time, or lose too much, until
        that has been over for a while.
        """
        guard = self._guard
        doubted, heard = guard.doubted(now), any(guard.stamps)
        silent = [leg for leg in guard.unheard(now) if leg not in doubted]
        if heard:
            self.tell_drive(guard.leaving)
        self._tell_silence('doubted', now, bool(doubted), lambda: (
            f'targets of {", ".join(doubted)} are not believed: they jump by more than their '
            'velocity says, or repeat while they move'))
        self._tell_silence('silent', now, heard and bool(silent),
                           lambda: f'no targets from {", ".join(silent)} for '
                           f'{self._drive_options.target_timeout} s')
        self._tell_silence('late', now, not silent and guard.outrun, self._lateness)
        self._tell_silence('lost', now, guard.losing, lambda: (
            f'{guard.lost:.0%} of the targets are lost, and {BORNE:.0%} are borne'))

    def _tell_silence(self, key: str, now: int, true: bool, what: Callable[[], str]) -> None:
        if true:
            self._silent_ns[key] = now
            if not self.health.has_problem(key):
                retreat = RETREATS.get(self._guard.fallback, GOES_ON)
                self.warn(key, f'{what()}: the robot looks after itself: {retreat}', error=True)
        elif not fresh(self._silent_ns[key], now, INCIDENT_NS):
            self.clear(key)

    def _lateness(self) -> str:
        lead_ns, late_ns = round(1e9 * self._drive_options.target_lead), self._guard.lateness_ns
        return (f'targets act {1e-6 * late_ns:.0f} ms late, and {1e-6 * CARRIED_NS:.0f} ms are '
                f'borne: they come {1e-6 * (lead_ns + late_ns):.0f} ms after their states, and '
                f'target_lead is {1e-6 * lead_ns:.0f} ms')

    def watch_joints(self) -> None:
        """Name joints that do not do what they are told, until they have for a while."""
        failing = self._guard.drives.failing
        if not failing:
            self.clear('joints')
            return
        lame = self._guard.drives.lame
        cut = f', and {", ".join(lame)} is without power' if self._guard.drives.cuts else ''
        rest = f'; the robot lowers itself onto its belly{cut}' if lame else ''
        self.warn('joints', f'joint {", ".join(failing)} does not follow: the torque that its '
                  f'drive reports is not what its targets ask for{rest}', error=True)

    def tell_drive(self, fallback: str) -> None:
        """Say whether the joints follow the legs, or what the robot does by itself."""
        mode = fallback or DRIVE_MODES[0]
        if mode != self._drive_mode:
            self._drive_mode = mode
            self._drive_publisher.publish(String(data=mode))
            if fallback == 'damp' and not self._fell:
                self._fell = True
                self.warn('fell', f'the robot fell at {self._state.time_ns * 1e-9:.3f} s while it '
                          'looked after itself', error=True)
