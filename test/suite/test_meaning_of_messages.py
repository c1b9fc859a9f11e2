# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages mean what they say: numbers that control anything are numbers, frames are frames."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

import ros_processes
from diagnostic_msgs.msg import DiagnosticArray
from ros_processes import Processes
from rosbags.highlevel import AnyReader

from dmp_cpg_ros.core.balance.body_command import MODES
from dmp_cpg_ros.nodes.messages.interfaces import TOPICS
from dmp_cpg_ros.nodes.messages.robot_state import BASE_FRAME, ODOM_FRAME, WORLD_FRAME
from dmp_cpg_ros.suite_table import WALKING

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

SCENARIO = """\
name: everything
duration: 4.4
parameters: {gait: amble, voting: true, control_rate: 50.0}
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.3}}
  - {at: 0.5, gait: trot}
  - {at: 0.7, set: {cadence_scale: 1.1}}
  - {at: 0.8, push: {impulse: [0, 1, 0]}}
  - {at: 1.6, inhibit: true}
  - {at: 2.6, inhibit: false}
  - {at: 3.0, votes: {fl: 0.5}}
  - {at: 3.2, lie_down: true}
"""

FRAMES = {'', BASE_FRAME, ODOM_FRAME, WORLD_FRAME, 'base_footprint'}
CONTROLLING = {topic.name for topic in TOPICS
               if {kind.name for kind in WALKING}.intersection(topic.subscribers)}


def test_nothing_that_walks_reads_what_is_written_for_people() -> None:
    assert all(topic.type is not DiagnosticArray for topic in TOPICS if topic.name in CONTROLLING)


def test_no_text_of_a_run_in_lock_step_carries_a_number_that_controls(
        processes: Processes, tmp_path: Path) -> None:
    run = processes.walked(SCENARIO, tmp_path / 'run', '--lock-step', '--composed')
    texts: dict[str, set[tuple[str, ...]]] = defaultdict(set)
    with AnyReader([run / 'bag']) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            frame = getattr(getattr(message, 'header', None), 'frame_id', '')
            assert frame in FRAMES, connection.topic
            assert getattr(message, 'child_frame_id', '') in FRAMES, connection.topic
            name = connection.topic.strip('/')
            if name not in CONTROLLING:
                continue
            if connection.msgtype == 'std_msgs/msg/String':
                texts[name].add((message.data,))
            elif connection.msgtype == 'sensor_msgs/msg/JointState':
                texts[name].add(tuple(message.name))
            else:  # a new type may have texts: think about it
                assert connection.msgtype.split('/')[0] in ('geometry_msgs', 'nav_msgs') or (
                    connection.msgtype in ('sensor_msgs/msg/Imu', 'rosgraph_msgs/msg/Clock'))
    modes = texts.pop('body_mode')
    assert {('standing',), ('stopping',), ('lowering',)} <= modes
    assert modes <= {(mode,) for mode in MODES}
    # Names never change, so they tell nothing from one message to the next.
    assert {name: len(rows) for name, rows in texts.items()} == {
        name: 4 if name == 'joint_targets' else 1 for name in texts}
    assert {'canonical_state', 'posture_feedback', 'inhibition_gains', 'votes'} <= set(texts)
