# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The posture controller's sensors as messages: silent, stale, not finite."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from messages import canonical_writer

pytest.importorskip('rclpy')

import ros_processes
from core_examples import network, quadruped, standing_state
from rclpy.serialization import deserialize_message
from ros_processes import Processes, Ros

from dmp_cpg_ros.core.estimation.estimator import BodyEstimator
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.core.robot_model.sensor_readings import readings_of
from dmp_cpg_ros.nodes.messages.cdr import Serialized
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter
from dmp_cpg_ros.nodes.messages.robot_state import (
    FootContactsReader,
    OdometryWriter,
    RobotStateWriter,
    read_imu,
    read_odom,
)
from dmp_cpg_ros.nodes.messages.values import LARGEST
from dmp_cpg_ros.nodes.posture_control import sensor_readings

processes, ros_domain, ros = ros_processes.processes, ros_processes.ros_domain, ros_processes.ros

JOINTS = (8, (np.zeros(12), np.zeros(12), np.zeros(12)))
IMU = (np.ones(3), np.full(3, 2.0))
FORCE = np.full(4, 20.0)


def test_readings_of_one_stamp_belong_together() -> None:
    values = {'joint_states': JOINTS, 'imu': (8, IMU), 'foot_contacts': (8, FORCE)}
    readings = sensor_readings(8, values)
    assert np.array_equal(readings.rate_in_base, IMU[0])
    assert np.array_equal(readings.specific_force_in_base, IMU[1])
    assert np.array_equal(readings.foot_force, FORCE)
    assert readings.joints_ns == 8


def test_joints_of_another_stamp_are_told_with_it() -> None:
    """Of the newest, which is used where a tick's own are lost."""
    values = {'joint_states': JOINTS, 'imu': (12, IMU), 'foot_contacts': (12, FORCE)}
    readings = sensor_readings(12, values)
    assert (readings.time_ns, readings.joints_ns) == (12, 8) and all(readings.usable_legs)


@pytest.mark.parametrize('old', [(4, IMU), None])
def test_an_old_or_absent_reading_is_missing(old: Any) -> None:
    readings = sensor_readings(
        8, {'joint_states': JOINTS, 'imu': old, 'foot_contacts': (8, FORCE)})
    assert not readings.imu_is_usable and all(readings.usable_contacts)
    force = None if old is None else (4, FORCE)
    readings = sensor_readings(
        8, {'joint_states': JOINTS, 'imu': (8, IMU), 'foot_contacts': force})
    assert readings.imu_is_usable and not any(readings.usable_contacts)


def wire(message: Serialized) -> Any:
    """The message as rclpy reads it."""
    return deserialize_message(message.serialized, message.KIND)


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf, 1e300])
def test_numbers_that_are_not_finite_reach_the_estimators_judgement(bad: float) -> None:
    writer = RobotStateWriter()
    writer.fill(standing_state(quadruped()))
    imu, feet = wire(writer.imu), wire(writer.foot_contacts)
    imu.angular_velocity.y = bad
    feet.effort[2] = bad
    contacts = FootContactsReader().read(feet)
    readings = sensor_readings(0, {'joint_states': JOINTS, 'imu': (0, read_imu(imu)),
                                   'foot_contacts': (0, contacts)})
    assert not readings.imu_is_usable
    assert readings.usable_contacts == (True, True, False, True)


def test_the_estimate_passes_bit_for_bit() -> None:
    robot = quadruped()
    estimator = BodyEstimator(robot, EstimationParameters())
    memory, _ = estimator.step(None, readings_of(standing_state(robot)))
    _, estimate = estimator.step(memory, readings_of(standing_state(robot, 4_000_000)))
    message = wire(OdometryWriter().fill_estimate(estimate))
    read = read_odom(message)
    assert np.array_equal(read.position_in_world, estimate.position_in_world)
    assert np.array_equal(read.quaternion, estimate.quaternion)
    assert np.array_equal(read.velocity_in_base, estimate.velocity_in_base)
    assert np.array_equal(read.rate_in_base, estimate.rate_in_base)
    for told, variances in (
            (message.pose.covariance, (estimate.position_variance, estimate.attitude_variance)),
            (message.twist.covariance, (estimate.velocity_variance, estimate.rate_variance))):
        assert np.array_equal(np.reshape(told, (6, 6)), np.diag(np.concatenate(variances)))
    truth = RobotStateWriter()
    truth.fill(standing_state(robot))
    assert not wire(truth.ground_truth).pose.covariance.any()


def test_what_the_sensors_tell_less_of_is_told_with_a_larger_variance() -> None:
    robot = quadruped()
    estimator = BodyEstimator(robot, EstimationParameters())
    memory, begun = estimator.step(None, readings_of(standing_state(robot)))
    for k in range(1, 5000):
        memory, estimate = estimator.step(
            memory, readings_of(standing_state(robot, k * 4_000_000)))
    roll, pitch, yaw = estimate.attitude_variance
    assert 0.0 < max(roll, pitch) < begun.attitude_variance[:2].min()
    assert yaw > begun.attitude_variance[2]            # nothing tells it
    assert (estimate.rate_variance > 0.0).all()
    memory = replace(memory, estimate=replace(
        estimate, velocity_in_base=np.array((1.0, 0, 0)), velocity_in_world=(1.0, 0.0, 0.0)))
    _, walked = estimator.step(memory, readings_of(standing_state(robot, 5000 * 4_000_000)))
    assert (walked.position_variance > estimate.position_variance).all()


def test_a_robot_that_has_felt_nothing_for_minutes_tells_that_it_knows_nothing() -> None:
    """Without IMU and feet the variance of the velocity grows for ever; what is written of it is
    limited.
    """
    robot = quadruped()
    estimator, writer = BodyEstimator(robot, EstimationParameters()), OdometryWriter()
    memory, _ = estimator.step(None, readings_of(standing_state(robot)))
    for k in range(1, 2000):
        told = readings_of(standing_state(robot, k * 100_000_000))
        nothing = np.full(3, np.nan)
        memory, estimate = estimator.step(memory, replace(
            told, rate_in_base=nothing, specific_force_in_base=nothing, foot_force=np.zeros(4)))
    assert estimate.velocity_variance.min() > 30.0 ** 2
    for more in (1.0, LARGEST):
        of = replace(estimate, covariance=more * estimate.covariance)
        variances = np.array(wire(writer.fill_estimate(of)).twist.covariance)[:15:7]
        assert np.array_equal(variances, np.minimum(of.velocity_variance, LARGEST))
    assert variances.min() == LARGEST
    for k in range(1, 250):
        told = readings_of(standing_state(robot, 200_000_000_000 + k * 4_000_000))
        memory, estimate = estimator.step(memory, told)
    assert estimate.velocity_variance.max() < 1e-2
    assert not estimate.problems


def test_the_node_bears_silent_sensors_and_names_them(processes: Processes, ros: Ros) -> None:
    """In real time: all is well at first, then the IMU falls silent and a contact says NaN."""
    process = processes.node('posture_control')
    feedback, told = (ros.collect(interface(name).type, name, interface(name).reader_qos)
                      for name in ('posture_feedback', '/diagnostics'))
    estimates = ros.collect(interface('odom').type, 'odom',
                            interface('odom').reader_qos)
    names = ('imu', 'foot_contacts', 'joint_states', 'reference', 'canonical_state')
    publishers = {name: ros.node.create_publisher(
        interface(name).type, name, interface(name).publisher_qos) for name in names}
    ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers.values()))
    # The node's robot is the package's own; the example stands much like it.
    oscillators = network()
    writer, reference, canonical = RobotStateWriter(), ReferenceWriter(), canonical_writer()

    ticks = itertools.count(1)

    def ticked(broken: bool) -> bool:
        time_ns = 4_000_000 * next(ticks)
        writer.fill(standing_state(quadruped(), time_ns))
        feet = wire(writer.foot_contacts)
        if broken:
            feet.effort[1] = math.nan
        else:
            publishers['imu'].publish(writer.imu.serialized)
        publishers['foot_contacts'].publish(feet)
        publishers['joint_states'].publish(writer.joint_states.serialized)
        publishers['reference'].publish(reference.fill(time_ns, np.zeros(3)).serialized)
        publishers['canonical_state'].publish(
            canonical.fill(time_ns, oscillators.locked_state(), np.zeros((4, 2)),
                           oscillators.gait).serialized)
        return True

    def told_problems() -> str:
        return ' '.join(status.message for message in told for status in message.status)

    ros.spin_until(lambda: ticked(broken=False) and len(feedback) >= 50 and len(estimates) >= 5)
    assert 'contact of fr, imu' not in told_problems()  # while nodes find each other one may lack
    well = len(feedback)
    ros.spin_until(lambda: ticked(broken=True) and len(feedback) >= well + 50
                   and 'contact of fr, imu' in told_problems(),
                   what=lambda: f'the sensors that are silent; told is: {told_problems()[-600:]}')
    assert all(math.isfinite(value) for message in feedback for value in message.effort)
    process.interrupt()
    assert process.wait() == 0, str(process)
