# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes a recording as a rosbag2 folder in the exact formats that the nodes publish."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from dmp_cpg_ros.analysis.recording import Recording, StatusEvent
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS

STORE = get_typestore(Stores.ROS2_JAZZY)
WALL_START_NS = 1_760_000_000_123_456_789
WALL_PER_ROBOT = 1.1
"""A wall clock that runs faster than the robot's: a real-time factor of 1/1.1."""


def write_bag(
    recording: Recording,
    folder: Path,
    *,
    storage: StoragePlugin = StoragePlugin.MCAP,
    wall_clock: bool = False,
    namespace: str = '',
    stamped_commands: bool = False,
    odometry: tuple[str, str] = ('ground_truth', 'odom'),
) -> Path:
    """Write a bag.

    Parameters
    ----------
    recording : Recording
        What to write.
    folder : Path
        Must not exist yet.
    storage : StoragePlugin
        MCAP or SQLite.
    wall_clock : bool
        Whether the record time is wall time instead of the robot's.
    namespace : str
        Put before the relative topic names, such as ``/spot``.
    stamped_commands : bool
        Whether ``cmd_vel`` is TwistStamped.
    odometry : tuple of str
        Topics of the truth and of the estimate.
    """
    with Writer(folder, version=9, storage_plugin=storage) as writer:
        connections: dict[str, Any] = {}
        for time_ns, topic, kind, message in sorted(
            _messages(recording, stamped_commands, odometry), key=lambda m: m[0]
        ):
            name = topic if topic.startswith('/') else f'{namespace}/{topic}'
            if name not in connections:
                connections[name] = writer.add_connection(name, kind, typestore=STORE)
            bag_ns = round(WALL_START_NS + WALL_PER_ROBOT * time_ns) if wall_clock else time_ns
            writer.write(connections[name], bag_ns, STORE.serialize_cdr(message, kind))
    return folder


def make(kind: str, **fields: Any) -> Any:
    """Message of a type, such as ``make('geometry_msgs/msg/Vector3', x=1.0, y=0.0, z=0.0)``."""
    return STORE.types[kind](**fields)


def _messages(recording: Recording, stamped: bool, odometry: tuple[str, str],
              ) -> Iterator[tuple[int, str, str, Any]]:
    yield from _robot_messages(recording, *odometry)
    for time, value in zip(recording.reference.time, recording.reference.value, strict=True):
        yield (
            _ns(time),
            'reference',
            'geometry_msgs/msg/TwistStamped',
            make(
                'geometry_msgs/msg/TwistStamped',
                header=_header(time, 'base_link'),
                twist=_twist(*value),
            ),
        )
    names = [f'{leg}_x{k}' for leg in LEGS for k in (1, 2)]
    for time, x, x_dot in zip(
        recording.canonical.time, recording.canonical.x, recording.canonical.x_dot, strict=True
    ):
        yield (
            _ns(time),
            'canonical_state',
            *_joint_state(time, names, x.ravel(), x_dot.ravel(), np.array([])),
        )
    for row, time in enumerate(recording.targets.time):
        for leg in range(4):
            columns = slice(3 * leg, 3 * leg + 3)
            yield (
                _ns(time),
                'joint_targets',
                *_joint_state(
                    time,
                    JOINT_NAMES[columns],
                    *(
                        getattr(recording.targets, name)[row, columns]
                        for name in ('position', 'velocity', 'effort')
                    ),
                ),
            )
    for time, value in zip(recording.commands.time, recording.commands.value, strict=True):
        message = _twist(*value)
        if stamped:
            message = make('geometry_msgs/msg/TwistStamped', header=_header(time), twist=message)
        # half a millisecond after the tick, as a command that comes from outside
        yield _ns(time) + 500_000, 'cmd_vel', message.__msgtype__, message
    for event in recording.inhibition:
        yield _ns(event.time), 'inhibition_state', *_status({'inhibition': event})
    for name, history in recording.statuses.items():
        for event in history:
            yield _ns(event.time), '/diagnostics', *_status({name: event})


def _robot_messages(recording: Recording, truth: str, estimate: str,
                    ) -> Iterator[tuple[int, str, str, Any]]:
    joints, odometry, feet = recording.joints, recording.odometry, recording.feet
    for row, time in enumerate(joints.time):
        yield (
            _ns(time),
            '/clock',
            'rosgraph_msgs/msg/Clock',
            make('rosgraph_msgs/msg/Clock', clock=_stamp(time)),
        )
        yield (
            _ns(time),
            'joint_states',
            *_joint_state(
                time, JOINT_NAMES, joints.position[row], joints.velocity[row], joints.effort[row]
            ),
        )
    for time, force in zip(feet.time, feet.force, strict=True):
        yield (
            _ns(time),
            'foot_contacts',
            *_joint_state(time, LEGS, np.array([]), np.array([]), force),
        )
    for row, time in enumerate(odometry.time):
        yield _ns(time), truth, 'nav_msgs/msg/Odometry', _odometry(odometry, row, time)
    for row, time in enumerate(recording.estimate.time):
        message = _odometry(recording.estimate, row, time)
        yield _ns(time), estimate, 'nav_msgs/msg/Odometry', message


def _odometry(odometry: Any, row: int, time: float) -> Any:
    x, y, z = (float(value) for value in odometry.position_in_world[row])
    pose = make(
        'geometry_msgs/msg/Pose',
        position=make('geometry_msgs/msg/Point', x=x, y=y, z=z),
        orientation=_quaternion(odometry.quaternion[row]),
    )
    twist = make(
        'geometry_msgs/msg/Twist',
        linear=_vector(odometry.velocity_in_base[row]),
        angular=_vector(odometry.rate_in_base[row]),
    )
    return make(
        'nav_msgs/msg/Odometry',
        header=_header(time, 'odom'),
        child_frame_id='base_link',
        pose=make('geometry_msgs/msg/PoseWithCovariance', pose=pose, covariance=np.zeros(36)),
        twist=make('geometry_msgs/msg/TwistWithCovariance', twist=twist, covariance=np.zeros(36)),
    )


def _joint_state(
    time: float, names: Any, position: Any, velocity: Any, effort: Any
) -> tuple[str, Any]:
    kind = 'sensor_msgs/msg/JointState'
    return kind, make(
        kind,
        header=_header(time),
        name=list(names),
        position=np.asarray(position, dtype=float),
        velocity=np.asarray(velocity, dtype=float),
        effort=np.asarray(effort, dtype=float),
    )


def _status(events: dict[str, StatusEvent]) -> tuple[str, Any]:
    kind = 'diagnostic_msgs/msg/DiagnosticArray'
    status = [
        make(
            'diagnostic_msgs/msg/DiagnosticStatus',
            level=event.level,
            name=name,
            message=event.message,
            hardware_id='',
            values=[
                make('diagnostic_msgs/msg/KeyValue', key=key, value=value)
                for key, value in event.values.items()
            ],
        )
        for name, event in events.items()
    ]
    return kind, make(kind, header=_header(next(iter(events.values())).time), status=status)


def _header(time: float, frame: str = '') -> Any:
    return make('std_msgs/msg/Header', stamp=_stamp(time), frame_id=frame)


def _stamp(time: float) -> Any:
    sec, nanosec = divmod(_ns(time), 1_000_000_000)
    return make('builtin_interfaces/msg/Time', sec=sec, nanosec=nanosec)


def _ns(time: float) -> int:
    return round(float(time) * 1e9)


def _vector(values: Any) -> Any:
    x, y, z = (float(value) for value in values)
    return make('geometry_msgs/msg/Vector3', x=x, y=y, z=z)


def _quaternion(values: Any) -> Any:
    x, y, z, w = (float(value) for value in values)
    return make('geometry_msgs/msg/Quaternion', x=x, y=y, z=z, w=w)


def _twist(v_x: float, v_y: float, gamma: float) -> Any:
    return make(
        'geometry_msgs/msg/Twist',
        linear=_vector((v_x, v_y, 0.0)),
        angular=_vector((0.0, 0.0, gamma)),
    )
