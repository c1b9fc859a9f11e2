# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node that draws for RViz: what its markers and its path say of a robot that walks."""

from __future__ import annotations

import numpy as np
import pytest
from messages import canonical_writer

pytest.importorskip('rclpy')

import ros_processes
from core_examples import GAITS, TICK_NS, standing_state
from ros_processes import Processes, Ros
from visualization_msgs.msg import Marker

from dmp_cpg_ros.commands.run_folder import resolved_parameters
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.phase import phase_generator, state_at
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.nodes.messages import markers
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.markers import FootMarkers
from dmp_cpg_ros.nodes.messages.posture_feedback import PostureFeedbackWriter
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter
from dmp_cpg_ros.nodes.messages.robot_state import OdometryWriter
from dmp_cpg_ros.nodes.visualization import STEP_M, Visualization
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.robot_file import OWN_ROBOT
from dmp_cpg_ros.suite_table import VISUALIZATION, WALKING

processes, ros, ros_domain = ros_processes.processes, ros_processes.ros, ros_processes.ros_domain


def shown(message: object) -> dict[tuple[str, int], Marker]:
    return {(marker.ns, marker.id): marker for marker in message.markers  # type: ignore[attr-defined]
            if marker.action == Marker.ADD}


def test_arrows_are_as_long_as_the_forces_and_nothing_stays_that_is_over() -> None:
    writer, rng = FootMarkers(0.3, 120.0), np.random.default_rng(1)
    feet, forces, up = rng.normal(size=(4, 3)), np.array((0.0, 30.0, 60.0, 0.0)), np.array((
        0.0, 0.6, 0.8))
    way = rng.normal(size=(5, 3))
    found = shown(writer.fill(7, feet, forces, up, (way, None, None, None)))
    assert set(found) == {('swing_paths', 0), ('footholds', 0), ('feet', 1), ('feet', 2),
                          ('foot_forces', 1), ('foot_forces', 2)}
    assert all(marker.header.frame_id == 'base_link' and marker.header.stamp.nanosec == 7
               for marker in found.values())
    for i in (1, 2):
        begin, end = (np.array((p.x, p.y, p.z)) for p in found['foot_forces', i].points)
        np.testing.assert_allclose(begin, feet[i])
        np.testing.assert_allclose(end - begin, 0.3 * forces[i] / 120.0 * up)
    assert len(found['swing_paths', 0].points) == len(way)
    place = found['footholds', 0].pose.position
    np.testing.assert_allclose((place.x, place.y, place.z), way[-1])
    found = shown(writer.fill(8, feet, forces, up, [None] * 4))
    assert {space for space, _ in found} == {markers.FEET, markers.FORCES}


def test_the_node_draws_the_feet_and_follows_the_body(processes: Processes, ros: Ros) -> None:
    process = processes.node(VISUALIZATION, drawing_rate=100.0)
    process.wait_for_output('active')
    pictures, paths = (ros.collect(interface(name).type, name, interface(name).reader_qos)
                       for name in ('markers', 'body_path'))
    robot = load_description(find_config(OWN_ROBOT))
    legs, gait = RobotLegs(robot), GAITS['amble']
    posture, canonical, reference, odometry = (
        PostureFeedbackWriter(), canonical_writer(), ReferenceWriter(),
        OdometryWriter())
    publishers = {name: ros.node.create_publisher(
        interface(name).type, name, interface(name).publisher_qos)
        for name in ('posture_feedback', 'canonical_state', 'reference', 'odom')}
    ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers.values()))
    standing = standing_state(robot)
    forces = np.full(4, robot.mass * GRAVITY / 4.0)
    rests = np.array((0.0, 0.25, 0.5, 0.75)) * 2.0 * np.pi
    x, ticks = state_at(rests), iter(range(1, 10_000))

    def walked() -> bool:
        k = next(ticks)
        feedback = PostureFeedback(np.zeros(12), np.zeros((4, 3)), np.zeros((4, 2)), np.zeros(3),
                                   measured=standing.joint_position, foot_force=forces)
        for name, message in (
                ('odom', odometry.fill(k * TICK_NS, np.array((0.01 * k, 0.0, 0.3)),
                                       np.array((0.0, 0.0, 0.0, 1.0)), *np.zeros((2, 3)))),
                ('reference', reference.fill(k * TICK_NS, np.array((0.4, 0.0, 0.0)))),
                ('canonical_state', canonical.fill(
                    k * TICK_NS, x, 10.0 * x @ phase_generator().T, gait)),
                ('posture_feedback', posture.fill(k * TICK_NS, feedback))):
            publishers[name].publish(message.serialized)
        return any(len(path.poses) > 5 for path in paths) and any(
            ('footholds', i) in shown(picture) for picture in pictures for i in range(4))

    ros.spin_until(walked)
    found = shown(pictures[-1])
    assert {('feet', i) for i in range(4)} | {('foot_forces', i) for i in range(4)} <= set(found)
    for i, leg in enumerate(legs.kinematics):
        begin, end = found['foot_forces', i].points
        np.testing.assert_allclose(
            (begin.x, begin.y, begin.z), leg.foot(standing.joint_position[3 * i:3 * i + 3]))
        assert end.z - begin.z == pytest.approx(robot.stance_height / 4.0)
    path = paths[-1]
    assert path.header.frame_id == 'odom'
    along = [pose.pose.position.x for pose in path.poses]
    assert np.diff(along).min() >= STEP_M - 1e-9


def test_it_takes_the_parameters_that_walk_gives_to_every_node() -> None:
    given = resolved_parameters(find_config('suite.yaml'), {}, '')[VISUALIZATION]
    assert {*given, 'lock_step', 'expected_nodes'} <= set(Visualization.parameter_table().fields)


def test_nobody_waits_for_who_looks_on() -> None:
    assert VISUALIZATION not in {kind.name for kind in WALKING}
    for name in ('posture_feedback', 'canonical_state', 'reference', 'odom'):
        assert VISUALIZATION in interface(name).sometimes
