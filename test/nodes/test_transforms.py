# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``/tf`` with a stand-in for ``tf2_msgs``, which the wheels do not have, and without."""

from __future__ import annotations

import dataclasses
import importlib.util
import sys
from collections import defaultdict
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')

import ros_processes
from core_examples import quadruped, standing_state
from geometry_msgs.msg import TransformStamped
from rclpy.serialization import deserialize_message, serialize_message
from ros_processes import Processes

from dmp_cpg_ros.core.estimation.parameters import EstimationParameters, StateSourceParameters
from dmp_cpg_ros.nodes import posture_control
from dmp_cpg_ros.nodes.messages import interfaces, transforms
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.suite_table import namespace_rules

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

RATE_HZ = 50.0


class TFMessage:
    """As ``tf2_msgs/msg/TFMessage``: one list of stamped transforms."""

    __module__ = 'tf2_msgs.msg._tf_message'

    def __init__(self, transforms: list[TransformStamped] | None = None) -> None:
        self.transforms = transforms or []

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        return {'transforms': 'sequence<geometry_msgs/TransformStamped>'}


class CollectingNode:
    """What ``BodyState`` needs of a node; keeps copies of what is published."""

    return_ns = 0

    def __init__(self) -> None:
        self.sent: dict[str, list[Any]] = defaultdict(list)
        self.said: list[str] = []

    def parameters_of(self, kind: Any) -> Any:
        return {StateSourceParameters: StateSourceParameters(),
                EstimationParameters: EstimationParameters(estimate_rate=RATE_HZ)}[kind]

    def publisher(self, name: str) -> Any:
        def publish(message: Any) -> None:
            if isinstance(message, TFMessage):
                message = [deserialize_message(serialize_message(entry), TransformStamped)
                           for entry in message.transforms]
            else:
                message = deserialize_message(message.serialized, message.KIND)
            self.sent[name].append(message)

        return SimpleNamespace(publish=publish)

    def get_logger(self) -> Any:
        return SimpleNamespace(info=self.said.append)

    def clear(self, key: str) -> None:
        """Nothing is wrong."""


def turn_on_the_spot(node: Any) -> None:
    """A tenth of a second of a body that turns to the left."""
    robot = quadruped()
    body = posture_control.BodyState(node, robot)
    for stamp in range(0, 104_000_000, 4_000_000):
        state = standing_state(robot, stamp)
        body.state(stamp, {
            'joint_states': (stamp, (
                state.joint_position, state.joint_velocity, state.joint_effort)),
            'imu': (stamp, (np.array((0.0, 0.0, 0.5)), state.acceleration_in_base)),
            'foot_contacts': (stamp, state.foot_force)})


def test_the_estimator_owns_the_transform_from_odom_to_the_base(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(transforms, 'TFMessage', TFMessage)
    monkeypatch.setitem(interfaces.INTERFACES, '/tf',
                        dataclasses.replace(interface('/tf'), type=TFMessage))
    node = CollectingNode()
    turn_on_the_spot(node)
    assert len(node.sent['/tf']) == len(node.sent['odom']) == 6
    assert node.said == []
    for (transform,), odom in zip(node.sent['/tf'], node.sent['odom'], strict=True):
        assert transform.header == odom.header
        assert odom.header.frame_id == 'odom'
        assert transform.child_frame_id == odom.child_frame_id == 'base_link'
        place, told = transform.transform.translation, odom.pose.pose.position
        assert (place.x, place.y, place.z) == (told.x, told.y, told.z)
        assert transform.transform.rotation == odom.pose.pose.orientation
    assert node.sent['/tf'][-1][0].transform.rotation.z > 0.01


@pytest.mark.parametrize('there', [True, False])
def test_the_type_is_taken_where_it_is_installed(
        monkeypatch: pytest.MonkeyPatch, there: bool) -> None:
    package, messages = ModuleType('tf2_msgs'), ModuleType('tf2_msgs.msg')
    messages.TFMessage = TFMessage  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'tf2_msgs', package if there else None)
    monkeypatch.setitem(sys.modules, 'tf2_msgs.msg', messages if there else None)
    spec = importlib.util.spec_from_file_location('again', transforms.__file__)
    assert spec is not None and spec.loader is not None
    again = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(again)
    assert (again.TFMessage is TFMessage) == there
    topic = dataclasses.replace(interface('/tf'), type=again.TFMessage)
    assert topic.installed == there
    assert topic.type_name == 'tf2_msgs/msg/TFMessage'


@pytest.mark.skipif(interface('/tf').installed, reason='tf2_msgs is installed')
def test_without_the_type_the_nodes_say_so_once_and_do_the_rest(
        processes: Processes, tmp_path: Path) -> None:
    node = CollectingNode()
    turn_on_the_spot(node)
    assert node.said == [transforms.WITHOUT_TF]
    assert set(node.sent) == {'odom'}
    process = processes.node('posture_control')
    process.wait_for_output('active')
    assert process.output.count('tf2_msgs') == 1
    recorder = processes.node('bag_recorder', output=str(tmp_path / 'bag'))
    recorder.wait_for_output('active')


def test_a_robot_in_a_namespace_has_its_own_frames() -> None:
    assert {('/tf', 'tf'), ('/tf_static', 'tf_static')} <= set(namespace_rules('/robot1'))
