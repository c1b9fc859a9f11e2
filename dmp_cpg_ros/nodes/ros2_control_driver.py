# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``ros2_control_driver``: takes the place of the robot where ros2_control moves a real one.

What the broadcasters of ros2_control publish becomes the tick of the suite, and the legs' targets
become commands of forward_command_controllers. Nothing is commanded before ``~/enable``.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Float64MultiArray

from dmp_cpg_ros.core import suite_parameters as core
from dmp_cpg_ros.core.clock import RESET_NS, fresh
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import Parameters, parameter, typed
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, LegTargets, RobotState
from dmp_cpg_ros.core.robot_model.target_limits import TargetLimits
from dmp_cpg_ros.nodes.framework.driven_robot import RETREATS, DrivenRobot
from dmp_cpg_ros.nodes.framework.gaits import description_of
from dmp_cpg_ros.nodes.framework.ticks import AHEAD_NS
from dmp_cpg_ros.nodes.messages.interfaces import (
    COMMAND_INTERFACES,
    IMU_BROADCASTER,
    JOINT_BROADCASTER,
    POWER,
    commands_of,
    foot_wrench,
)
from dmp_cpg_ros.nodes.messages.robot_state import (
    JointsReader,
    RobotStateWriter,
    read_imu,
    read_orientation,
)
from dmp_cpg_ros.nodes.messages.values import checked, header_ns, sensed
from dmp_cpg_ros.robot.absent_legs import CARRIED_NS
from dmp_cpg_ros.robot.drive_watch import DriveWatch
from dmp_cpg_ros.robot.joint_drive import JointDrive
from dmp_cpg_ros.suite_table import DRIVER, KINDS

FRESH_NS = 100_000_000
"""Age up to which a reading of a sensor counts [ns]; NaN stand for older ones."""

LOOK_S = 1.0
"""How often it is asked whether joint states come [s]."""

TICK_TOPICS = ('imu', 'foot_contacts', 'joint_states')
"""What a tick of the suite consists of, the tick itself last."""


@dataclass(frozen=True)
class DriverParameters(Parameters):
    """Parameters of the node."""

    command_interfaces: tuple[str, ...] = parameter(
        ('position',), 'command interfaces of the joints, each once and with a '
        'forward_command_controller; one of them is position, or effort, which without position '
        'is the torque of the whole drive law; kp and kd are beside position only; power, 1 or 0, '
        'takes that of drives which do anything',
        choices=(*COMMAND_INTERFACES, POWER))
    publish_clock: bool = parameter(True, 'whether to publish /clock, by which silence is noticed')

    def __post_init__(self) -> None:
        """Validate; the interfaces must close a loop about the joints, and be there once."""
        super().__post_init__()
        given = set(self.command_interfaces)
        if not given & {'position', 'effort'} or (
                given & {'kp', 'kd'} and 'position' not in given) or (
                len(given) < len(self.command_interfaces)):
            raise ParameterError(
                f'command_interfaces = {typed(self.command_interfaces)} must have each once, '
                'position or effort among them, and kp and kd with position only: without, '
                'nothing holds the joints')


class Ros2ControlDriver(DrivenRobot):
    """Makes ticks of what ros2_control measures, and commands for ros2_control of targets."""

    KIND = DRIVER
    PARAMETER_SETS = (*KINDS[DRIVER].sets, DriverParameters)

    def configure(self) -> None:
        """Read the robot and create its topics."""
        options, description = self.parameters_of(DriverParameters), description_of(self)
        names = description.joint_names
        self._tick_ns = self.parameters_of(core.TickParameters).tick_ns
        self._joints, self._writer = JointsReader(names, strict=False), RobotStateWriter(names)
        clock = ('/clock',) if options.publish_clock else ()
        self._tick_publishers = {name: self.publisher(name) for name in (*clock, *TICK_TOPICS)}
        self._joint_publishers = {
            name: self.publisher(commands_of(name)) for name in options.command_interfaces}
        self._limits = [TargetLimits(leg, 1.0) for leg in description.legs]
        self._drive = JointDrive(description, 1, self._tick_ns * 1e-9)
        self._gains = {'kp': np.tile(description.kp, 4), 'kd': np.tile(description.kd, 4)}
        self.prepare_drive(description, self.parameters_of(core.DriveParameters))
        unknown = np.full(3, np.nan)
        self._imu: tuple[int, Array | None, Array, Array] = (-FRESH_NS, None, unknown, unknown)
        self._feet = [(-FRESH_NS, np.nan)] * len(LEGS)
        self._state = self._state_at(-1, np.zeros((3, 12)))
        self._enabled = self._commanding = False
        self._seen = self.health.ticks
        sensors: dict[str, Callable[[Any], None]] = {
            f'{JOINT_BROADCASTER}/joint_states': self._on_joints,
            f'{IMU_BROADCASTER}/imu': self._on_imu,
            **{foot_wrench(leg): partial(self._on_wrench, i) for i, leg in enumerate(LEGS)}}
        for topic, take in sensors.items():
            self.listen(topic, take, qos=qos_profile_sensor_data)
        self.listen('joint_targets', self._on_targets)
        self.serve('~/enable', self._take_request)

    def activate(self) -> None:
        """Begin to publish ticks; nothing is commanded."""
        self.tell_drive('lie')
        self._timer: Any = self.create_steady_timer(LOOK_S, self._look_for_states)

    def deactivate(self) -> None:
        """Command nothing any more; what becomes of the last command is up to ros2_control."""
        self._enabled = self._commanding = False
        self.destroy_timer(self._timer)

    def prepare_watch(self, drives: DriveWatch) -> None:
        """Motors may take a velocity beside the angle, with each command, as late as targets are
        borne, for commands go over topics and a bus; they lose power where they have an interface
        for that: what they are told else they may not do.
        """
        drives.keeps_velocity = {'position', 'velocity'} <= set(self._joint_publishers)
        drives.late_ns, drives.cuts = CARRIED_NS, POWER in self._joint_publishers

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Timing, and whether the joints are commanded and follow the legs."""
        return {**self._timing.values(), 'enabled': self._enabled, 'commanding': self._commanding,
                'drive_mode': self._drive_mode, 'time_s': self._state.time_ns * 1e-9,
                **self.watchdog_values()}

    # What is measured ----------------------------------------------------------------------------

    def _on_imu(self, message: Any) -> None:
        self._imu = (header_ns(message), read_orientation(message), *read_imu(message))

    def _on_wrench(self, leg: int, message: Any) -> None:
        force = message.wrench.force
        size = np.linalg.norm(sensed(np.array((force.x, force.y, force.z))))
        self._feet[leg] = header_ns(message), float(size)

    def _on_joints(self, message: Any) -> None:
        stamp, last = header_ns(message), self._state.time_ns
        position, velocity, effort = self._joints.read(message)
        measured = np.array((checked(position, 'position'), checked(velocity, 'velocity'),
                             np.nan_to_num(effort)))
        if last - RESET_NS < stamp <= last:
            raise DataError(f'stamp {stamp * 1e-9:.3f} s is not after {last * 1e-9:.3f} s')
        if last >= 0 and not 0 < stamp - last <= AHEAD_NS:       # the robot's clock was set
            self.forget_targets()
        self._state = self._state_at(stamp, measured)
        self.clear('states')
        if stamp // self._tick_ns != last // self._tick_ns:
            self._tick(stamp - stamp % self._tick_ns)
        if self._commanding:
            self._command()

    def _state_at(self, stamp: int, measured: Array) -> RobotState:
        """State at a stamp with the measured joints (3, 12), and with what sensors told lately."""
        told, quaternion, rate, force = self._imu
        if quaternion is None:
            quaternion = np.array((0.0, 0.0, 0.0, 1.0))
        if not fresh(told, stamp, FRESH_NS):
            rate = force = np.full(3, np.nan)
        feet = [size if fresh(at, stamp, FRESH_NS) else np.nan for at, size in self._feet]
        position, velocity, effort = measured
        return RobotState(stamp, position, velocity, effort, np.zeros(3), quaternion, np.zeros(3),
                          rate, force, np.array(feet))

    def _tick(self, stamp: int) -> None:
        """Publish a tick of the suite."""
        self._timing.deadline(stamp - self._tick_ns)
        self.begin_tick(stamp)
        self._writer.fill_failing(replace(self._state, time_ns=stamp))  # NaN: a silent sensor
        self._timing.published(stamp)
        for name, publisher in self._tick_publishers.items():
            publisher.publish(getattr(self._writer, name.strip('/')))
        self.end_tick()

    def _look_for_states(self) -> None:
        if self.health.ticks == self._seen:
            self.warn('states', f'no {JOINT_BROADCASTER}/joint_states of the joints '
                      f'{", ".join(self._description.joint_names)}: nothing is commanded')
        self._seen = self.health.ticks

    # What is commanded ---------------------------------------------------------------------------

    def _on_targets(self, message: Any) -> None:
        leg, stamp, targets = self.read_targets(message)
        self._timing.arrived(stamp)
        if self._enabled:
            self._guard.accept(leg, stamp, targets)

    def _command(self) -> None:
        """Command what the newest targets ask of the joints, within their limits."""
        state, targets = self._state, self._guard.targets(self._state)
        self.watch_joints()
        if self._enabled:
            self.watch_silence(state.time_ns)
        else:
            self.tell_drive(self._guard.fallback)
        asked = np.array((targets.position, targets.velocity, targets.effort)).reshape(3, 4, 3)
        limited = [limits.limited(LegTargets(*asked[:, i].tolist()), None, 0.0)
                   for i, limits in enumerate(self._limits)]
        values = {**self._gains, **{name: np.concatenate([getattr(leg, name) for leg in limited])
                                    for name in ('position', 'velocity', 'effort')}}
        if 'position' not in self._joint_publishers:
            self._drive.accept(JointTargets(
                *(values[name] for name in ('position', 'velocity', 'effort'))))
            values['effort'] = self._drive.torque(0, state.joint_position, state.joint_velocity)
        lame = self._guard.drives.lame
        values[POWER] = np.repeat([float(leg not in lame) for leg in LEGS], 3)
        for name, publisher in self._joint_publishers.items():
            # An array of its type is taken as it is; of a list, every entry is looked at.
            publisher.publish(Float64MultiArray(data=array('d', values[name].tobytes())))

    def _take_request(self, request: Any) -> tuple[bool, str]:
        """Enable, or stop following the legs."""
        if not request.data:
            self._enabled = False
            return True, (
                'the legs are not followed any more; the robot looks after itself'
                if self._commanding else 'nothing is commanded')
        stamp, quaternion, *_ = self._imu
        now = self._state.time_ns
        if now < 0 or quaternion is None or not fresh(stamp, now, FRESH_NS) or (
                self.health.has_problem('states')):
            return False, ('joint states and an IMU with its orientation are needed first: '
                           'without them nobody knows whether the robot stands')
        if not self._commanding:
            self.forget_targets()
        self._enabled = self._commanding = True
        self._fell = False
        self.clear('fell')
        self._command()
        retreat = RETREATS.get(self._guard.fallback)
        return True, ('enabled; the legs are followed' if retreat is None else
                      f'enabled: {retreat}, and follows the legs when their targets rest there')
