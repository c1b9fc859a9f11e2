# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages in, data model out: which topic goes into which array."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from dmp_cpg_ros.analysis.message_numbers import (
    Rows,
    events,
    robot_clock,
    stacked,
    stamp_ns,
    twist,
    xyz,
)
from dmp_cpg_ros.analysis.named_values import NamedValues
from dmp_cpg_ros.analysis.recording import (
    ArrivalSeries,
    CanonicalSeries,
    FootForceSeries,
    ImuSeries,
    JointSeries,
    OdometrySeries,
    PostureSeries,
    Recording,
    StatusEvent,
    VelocitySeries,
    WorkSeries,
)
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS

Handler = Callable[[int, Any], None]

JOINT_TOPICS = (
    'joint_states', 'joint_targets', 'canonical_state', 'foot_contacts', 'posture_feedback',
    'joint_work')


class Collector:
    """Takes messages by topic; rows are stacked once, at the end."""

    def __init__(self) -> None:
        """Start empty."""
        self._named = {topic: NamedValues() for topic in JOINT_TOPICS}
        self._rows: dict[str, Rows] = {
            topic: ([], [])
            for topic in ('reference', 'odom', 'estimated_odom', 'imu')
        }
        self._commands: Rows = ([], [])  # bag time [ns], velocity
        self._frames: dict[int, str] = {}  # stamp [ns], gait in force
        self._clock: tuple[list[int], list[int]] = ([], [])  # bag time, robot's clock [ns]
        self._ticks: tuple[list[int], list[int]] = ([], [])
        self._inhibition: list[StatusEvent] = []
        self._modes: list[StatusEvent] = []
        self._statuses: dict[str, list[StatusEvent]] = {}
        self._last_target: dict[int, int] = {}  # stamp, bag time of the last leg [ns]
        self._handlers: dict[tuple[str, str], Handler] = {
            ('joint_states', 'sensor_msgs/msg/JointState'): self._take_joint_states,
            ('joint_targets', 'sensor_msgs/msg/JointState'): self._take_joint_targets,
            **{
                (name, 'sensor_msgs/msg/JointState'): self._taker_of_named(name)
                for name in JOINT_TOPICS[3:]
            },
            ('canonical_state', 'sensor_msgs/msg/JointState'): self._take_canonical,
            ('reference', 'geometry_msgs/msg/TwistStamped'): self._take_reference,
            ('cmd_vel', 'geometry_msgs/msg/TwistStamped'): self._take_stamped_command,
            ('cmd_vel', 'geometry_msgs/msg/Twist'): self._take_command,
            **{
                (name, 'nav_msgs/msg/Odometry'): self._taker_of_odometry(name)
                for name in ('odom', 'estimated_odom')
            },
            ('imu', 'sensor_msgs/msg/Imu'): self._take_imu,
            ('clock', 'rosgraph_msgs/msg/Clock'): self._take_clock,
            ('inhibition_state', 'diagnostic_msgs/msg/DiagnosticArray'): self._take_inhibition,
            ('body_mode', 'diagnostic_msgs/msg/DiagnosticArray'): self._take_mode,
            ('diagnostics', 'diagnostic_msgs/msg/DiagnosticArray'): self._take_diagnostics,
        }

    def handler(self, topic: str, msgtype: str) -> Handler | None:
        """Function that takes bag time [ns] and message of a topic, None for unused topics.

        Parameters
        ----------
        topic : str
            Name without namespace.
        msgtype : str
            Such as ``sensor_msgs/msg/JointState``.
        """
        return self._handlers.get((topic, msgtype))

    def recording(self, counts: dict[str, int], undecodable: dict[str, int]) -> Recording:
        """Stack everything that was taken."""
        time, canonical = self._named['canonical_state'].table(
            [f'{leg}_x{k}' for leg in LEGS for k in (1, 2)]
        )
        x, x_dot = (canonical[name].reshape(-1, len(LEGS), 2) for name in ('position', 'velocity'))
        imu = stacked(self._rows['imu'], 10)
        return Recording(
            joints=self._joints('joint_states'), targets=self._joints('joint_targets'),
            work=self._work(), canonical=CanonicalSeries(time, x, x_dot, self._gaits(len(time))),
            reference=VelocitySeries(*stacked(self._rows['reference'], 3)),
            commands=self._command_series(), odometry=self._odometry('odom'),
            estimate=self._odometry('estimated_odom'),
            imu=ImuSeries(imu[0], *np.split(imu[1], (4, 7), axis=1)), feet=self._feet(),
            posture=self._posture(), inhibition=tuple(self._inhibition), modes=tuple(self._modes),
            statuses={name: tuple(history) for name, history in self._statuses.items()},
            arrivals=self._arrivals(), counts=counts, undecodable=undecodable)

    def _joints(self, topic: str) -> JointSeries:
        time, values = self._named[topic].table(JOINT_NAMES)
        return JointSeries(time, values['position'], values['velocity'], values['effort'])

    def _work(self) -> WorkSeries:
        time, values = self._named['joint_work'].table(JOINT_NAMES)
        return WorkSeries(time, values['position'], values['effort'])

    def _odometry(self, topic: str) -> OdometrySeries:
        time, rows = stacked(self._rows[topic], 13)
        return OdometrySeries(time, *np.split(rows, (3, 7, 10), axis=1))

    def _feet(self) -> FootForceSeries:
        time, values = self._named['foot_contacts'].table(LEGS)
        if not time.size:
            time, values = self._named['foot_contacts'].table([f'{leg}_foot' for leg in LEGS])
        return FootForceSeries(time, values['effort'])

    def _posture(self) -> PostureSeries:
        time, torques = self._named['posture_feedback'].table(JOINT_NAMES)
        _, shifts = self._named['posture_feedback'].table(
            [f'{leg}_foot_{axis}' for leg in LEGS for axis in 'xy']
        )
        return PostureSeries(time, torques['effort'], shifts['position'].reshape(-1, len(LEGS), 2))

    def _command_series(self) -> VelocitySeries:
        """Commands when they were received: a sender's stamps may be of another clock."""
        bag_ns, rows = self._commands
        stamps = robot_clock(bag_ns, self._ticks if self._ticks[0] else self._clock)
        return VelocitySeries(*stacked((stamps, rows), 3))

    def _arrivals(self) -> ArrivalSeries:
        stamps = np.array(self._ticks[1], dtype=np.int64)
        targets = np.array(
            [self._last_target.get(stamp, np.nan) for stamp in self._ticks[1]], dtype=float
        )
        return ArrivalSeries(
            stamps / 1e9, np.array(self._ticks[0], dtype=np.int64) / 1e9, targets / 1e9)

    def _take_joint_targets(self, bag_ns: int, message: Any) -> None:
        stamp = stamp_ns(message.header.stamp)
        self._last_target[stamp] = bag_ns
        self._named['joint_targets'].add(stamp, message)

    def _take_canonical(self, _: int, message: Any) -> None:
        stamp = stamp_ns(message.header.stamp)
        self._frames[stamp] = sys.intern(message.header.frame_id)
        self._named['canonical_state'].add(stamp, message)

    def _gaits(self, count: int) -> tuple[str, ...]:
        """Gait in force of each canonical state, in the order of the stamps."""
        frames = tuple(self._frames[stamp] for stamp in sorted(self._frames))
        return frames if len(frames) == count and any(frames) else ()

    def _take_joint_states(self, bag_ns: int, message: Any) -> None:
        stamp = stamp_ns(message.header.stamp)
        self._ticks[0].append(bag_ns)
        self._ticks[1].append(stamp)
        self._named['joint_states'].add(stamp, message)

    def _taker_of_named(self, topic: str) -> Callable[[int, Any], None]:
        named = self._named[topic]
        return lambda _, message: named.add(stamp_ns(message.header.stamp), message)

    def _take_reference(self, _: int, message: Any) -> None:
        self._row('reference', message, twist(message.twist))

    def _take_stamped_command(self, bag_ns: int, message: Any) -> None:
        self._take_command(bag_ns, message.twist)

    def _take_command(self, bag_ns: int, message: Any) -> None:
        self._commands[0].append(bag_ns)
        self._commands[1].append(twist(message))

    def _taker_of_odometry(self, topic: str) -> Callable[[int, Any], None]:
        def handle(_: int, message: Any) -> None:
            pose, twist = message.pose.pose, message.twist.twist
            row = [*xyz(pose.position), *xyz(pose.orientation), pose.orientation.w]
            self._row(topic, message, [*row, *xyz(twist.linear), *xyz(twist.angular)])

        return handle

    def _take_imu(self, _: int, message: Any) -> None:
        self._row(
            'imu',
            message,
            [
                *xyz(message.orientation), message.orientation.w, *xyz(message.angular_velocity),
                *xyz(message.linear_acceleration)],
        )

    def _row(self, topic: str, message: Any, row: list[float]) -> None:
        stamps, rows = self._rows[topic]
        stamps.append(stamp_ns(message.header.stamp))
        rows.append(row)

    def _take_clock(self, bag_ns: int, message: Any) -> None:
        self._clock[0].append(bag_ns)
        self._clock[1].append(stamp_ns(message.clock))

    def _take_inhibition(self, _: int, message: Any) -> None:
        for event in events(message).values():
            last = self._inhibition[-1] if self._inhibition else None
            if last is None or (last.message, last.values) != (event.message, event.values):
                self._inhibition.append(event)

    def _take_mode(self, _: int, message: Any) -> None:
        for event in events(message).values():
            if not self._modes or self._modes[-1].message != event.message:
                self._modes.append(event)

    def _take_diagnostics(self, _: int, message: Any) -> None:
        for name, event in events(message).items():
            self._statuses.setdefault(name, []).append(event)
