# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Values cross the wire bit for bit; names decide, not places; no bad number enters."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist, TwistStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from messages import canonical_writer
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dmp_cpg_ros.core.balance.body_command import BodyCommand
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS, LegTargets, RobotState
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateReader
from dmp_cpg_ros.nodes.messages.cdr import Serialized
from dmp_cpg_ros.nodes.messages.commands import read_twist
from dmp_cpg_ros.nodes.messages.inhibition import (
    InhibitionGainsReader,
    InhibitionGainsWriter,
    inhibition_state,
    read_state_word,
)
from dmp_cpg_ros.nodes.messages.joint_targets import JointTargetsReader, JointTargetsWriter
from dmp_cpg_ros.nodes.messages.posture_feedback import (
    BodyReader,
    CommandReader,
    PostureFeedbackReader,
    PostureFeedbackWriter,
    read_body_mode,
)
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter, read_reference
from dmp_cpg_ros.nodes.messages.robot_state import (
    FootContactsReader,
    JointsReader,
    RobotStateWriter,
    read_imu,
    read_odom,
)
from dmp_cpg_ros.nodes.messages.values import LARGEST, header_ns, set_stamp, stamp_ns, text
from dmp_cpg_ros.suite import load_gait, load_gaits

FLOATS = st.floats(-LARGEST, LARGEST)
STAMPS = st.integers(0, 2**31 * 10**9 - 1)
GAITS = load_gaits()


def numbers(*shape: int) -> st.SearchStrategy[np.ndarray]:
    return arrays(np.float64, shape, elements=FLOATS)


def wire(message: Any) -> Any:
    """The message as another process gets it that reads it with rclpy."""
    if isinstance(message, Serialized):
        return deserialize_message(message.serialized, message.KIND)
    return deserialize_message(serialize_message(message), type(message))


def bits(*values: Any) -> list[bytes]:
    return [np.ascontiguousarray(value, dtype=np.float64).tobytes() for value in values]


@given(STAMPS)
def test_stamps_are_exact(time_ns: int) -> None:
    stamp = Time()
    set_stamp(stamp, time_ns)
    assert stamp_ns(wire(stamp)) == time_ns


@pytest.mark.parametrize('stamp', [Time(sec=-1), Time(nanosec=10**9)])
def test_stamps_that_are_no_time_are_refused(stamp: Time) -> None:
    with pytest.raises(DataError, match='stamp'):
        stamp_ns(stamp)


@settings(max_examples=30)
@given(STAMPS, numbers(4, 2), numbers(4, 2))
def test_canonical_state(time_ns: int, x: np.ndarray, x_dot: np.ndarray) -> None:
    known = KnownGaits(GAITS)
    gait = known.transition(known.named('trot'), known.named('amble')).at(0.3, 0.0).scaled(1.25)
    message = wire(canonical_writer().fill(time_ns, x, x_dot, gait, -0.5))
    assert list(message.name[:3]) == ['fl_x1', 'fl_x2', 'fr_x1'] and not message.header.frame_id
    x_read, rate_read, gait_read = CanonicalStateReader(known).read(message)
    assert bits(x_read, rate_read) == bits(x, x_dot) and gait_read == gait
    assert header_ns(message) == time_ns
    entries = dict(zip(message.name, zip(message.position, message.velocity, strict=True),
                       strict=True))
    assert entries['gait/walk'] == (0.0, 0.0) and entries['gait/amble'] == (0.3, 0.0)
    assert entries['cadence_scale'] == (1.25, -0.5)


def test_a_gait_that_is_not_known_to_the_reader_is_refused() -> None:
    message = wire(canonical_writer().fill(0, np.ones((4, 2)), np.ones((4, 2)), load_gait('trot')))
    others = {name: gait for name, gait in GAITS.items() if name != 'trot'}
    with pytest.raises(DataError, match='shares of gaits'):
        CanonicalStateReader(KnownGaits(others)).read(message)


@given(numbers(3))
def test_reference(r: np.ndarray) -> None:
    message = wire(ReferenceWriter().fill(0, r))
    assert bits(read_reference(message)) == bits(r)
    twist = message.twist
    assert bits([twist.linear.x, twist.linear.y, twist.angular.z]) == bits(r)


@given(st.sampled_from(LEGS), numbers(3, 3))
def test_joint_targets(leg: str, values: np.ndarray) -> None:
    sent = LegTargets(*values)
    found, targets = JointTargetsReader().read(wire(JointTargetsWriter(leg).fill(0, sent)))
    assert found == leg
    assert bits(*dataclasses.astuple(targets)) == bits(*sent)


@settings(max_examples=30)
@given(numbers(12), numbers(4, 3), numbers(4, 2), numbers(3), numbers(12), numbers(4), numbers(4),
       numbers(5), st.tuples(*[st.booleans()] * 4), numbers(4))
def test_posture_feedback(torque: np.ndarray, shift: np.ndarray, drift: np.ndarray,
                          correction: np.ndarray, measured: np.ndarray,
                          force: np.ndarray, margins: np.ndarray, way: np.ndarray,
                          felt: tuple[bool, ...], level: np.ndarray) -> None:
    command = BodyCommand('rising', 'rise', 1.0 / 3.0, -0.1)
    sent = PostureFeedback(torque, shift, drift, correction, command, measured, force,
                           tuple(margins.tolist()), Progress((way[0], way[1]), *way[2:].tolist()),
                           felt, tuple(level.tolist()))
    message = wire(PostureFeedbackWriter().fill(0, sent))
    read = PostureFeedbackReader().read(message)
    assert bits(read.torque, read.shift_in_base, read.drift_in_base, read.correction,
                read.measured, read.foot_force, read.level) == bits(
                    torque, shift, drift, correction, measured, force, level)
    assert read.command == command == CommandReader().read(message)
    assert (read.margins, read.progress, read.felt) == (sent.margins, sent.progress, felt)
    assert BodyReader().read(message) == ('rising', sent.margins, sent.progress)
    assert not message.header.frame_id


def state_of(values: np.ndarray, time_ns: int = 0) -> RobotState:
    quaternion = values[:4] / np.linalg.norm(values[:4])
    return RobotState(time_ns, values[4:16], values[16:28], values[28:40], values[40:43],
                      quaternion, values[43:46], values[46:49], values[49:52], values[52:56],
                      values[56:59])


def read_state(writer: RobotStateWriter) -> RobotState:
    joints = JointsReader().read(wire(writer.joint_states))
    imu = wire(writer.imu)
    rate, acceleration = read_imu(imu)
    assert bits(rate, acceleration) == bits(*read_imu(writer.imu))
    assert imu.orientation_covariance[0] == -1.0  # ROS for: there is no orientation
    base = read_odom(wire(writer.ground_truth))
    assert bits(*base) == bits(*read_odom(writer.ground_truth))  # as nodes of one process have it
    stamps = {header_ns(message) for message in (
        writer.joint_states, writer.imu, writer.ground_truth, writer.foot_contacts)}
    assert stamps == {stamp_ns(writer.clock.clock)}
    return RobotState(stamps.pop(), *joints, *base, acceleration,
                      FootContactsReader().read(wire(writer.foot_contacts)), rate)


@given(STAMPS, numbers(59))
def test_robot_state(time_ns: int, values: np.ndarray) -> None:
    values[:4] = np.clip(values[:4], -1.0, 1.0) + [0.0, 0.0, 0.0, 2.0]
    sent, writer = state_of(values, time_ns), RobotStateWriter()
    writer.fill(state_of(np.ones(59)))  # the messages are used again
    writer.fill(sent)
    read = read_state(writer)
    assert read.time_ns == time_ns
    names = [field.name for field in dataclasses.fields(RobotState)[1:]]
    assert bits(*(getattr(read, name) for name in names)) == bits(
        *(getattr(sent, name) for name in names))


def test_work_comes_at_every_tenth_state_with_the_largest_torque_since() -> None:
    rng, writer, sent = np.random.default_rng(0), RobotStateWriter(), []
    peaks = rng.uniform(0.0, 9.0, (31, 12))
    for k, peak in enumerate(peaks):
        plain = state_of(np.ones(59), k)
        writer.fill(dataclasses.replace(
            plain, joint_work=np.full(12, float(k)), joint_peak_effort=peak,
            joint_loss=np.full(12, 0.5 * k)))
        if writer.joint_work is not None:
            sent.append((k, wire(writer.joint_work)))
    assert [k for k, _ in sent] == [0, 10, 20, 30]
    for k, message in sent:
        assert (header_ns(message), message.name) == (k, [*JOINT_NAMES, *(
            f'loss/{name}' for name in JOINT_NAMES)])
        assert bits(message.position) == bits(np.repeat((float(k), 0.5 * k), 12))
        assert bits(message.effort[:12]) == bits(peaks[max(0, k - 9):k + 1].max(axis=0))
    writer.fill(state_of(np.ones(59)))  # of a robot that does not know its work
    assert writer.joint_work is None


@given(st.permutations(range(12)), st.booleans(), numbers(12))
def test_joints_are_taken_by_name(order: list[int], more: bool, position: np.ndarray) -> None:
    names = [JOINT_NAMES[i] for i in order] + (['tail'] if more else [])
    extra = [0.5] if more else []
    message = JointState(name=names, position=[position[i] for i in order] + extra,
                         velocity=[-position[i] for i in order] + extra)
    reader = JointsReader()
    for _ in range(2):  # the second time from the cache
        read = reader.read(wire(message))
        assert bits(*read) == bits(position, -position, np.zeros(12))
    plain = JointState(name=list(JOINT_NAMES), position=position, velocity=position)
    assert bits(reader.read(plain)[0]) == bits(position)


@pytest.mark.parametrize(('change', 'problem'), [
    (lambda m: m.name.__setitem__(4, 'fr_hop'), 'fr_hip'),
    (lambda m: m.name.__setitem__(4, 'fl_hip'), 'fr_hip'),
    (lambda m: [getattr(m, field).append(value) for field, value in (
        ('name', 'fl_hip'), ('position', 0.0), ('velocity', 0.0))], 'unique'),
    (lambda m: m.position.pop(), 'position has 11 entries for 12 names'),
    (lambda m: m.velocity.append(0.0), 'velocity has 13 entries for 12 names'),
    (lambda m: m.effort.append(0.0), 'effort has 1 entries for 12 names'),
    (lambda m: m.name.clear(), 'fl_abduction'),
])
def test_messages_that_do_not_fit_are_refused(change: Callable, problem: str) -> None:
    message = JointState(name=list(JOINT_NAMES), position=[0.0] * 12, velocity=[0.0] * 12)
    change(message)
    with pytest.raises(DataError, match=problem):
        JointsReader().read(message)


def test_targets_of_no_leg_are_refused() -> None:
    for names in ([], ['fl_hip'], ['xx_abduction', 'xx_hip', 'xx_knee'], list(JOINT_NAMES),
                  ['fl_abduction', 'fr_hip', 'fl_knee']):
        values = [0.0] * len(names)
        message = JointState(name=names, position=values, velocity=values, effort=values)
        with pytest.raises(DataError, match='fl'):
            JointTargetsReader().read(message)


BAD = (math.nan, math.inf, -math.inf, 1e300, -1.001 * LARGEST)


@pytest.mark.parametrize('bad', BAD)
@given(st.integers(0, 11), st.sampled_from(['position', 'velocity', 'effort']))
def test_no_bad_number_enters_through_joints(bad: float, place: int, field: str) -> None:
    message = JointState(name=list(JOINT_NAMES), position=[0.0] * 12, velocity=[0.0] * 12,
                         effort=[0.0] * 12)
    getattr(message, field)[place] = bad
    with pytest.raises(DataError, match=f'{field}.*must be finite'):
        JointsReader().read(message)


@pytest.mark.parametrize('bad', BAD)
def test_no_bad_number_enters_otherwise(bad: float) -> None:
    for part in ('linear', 'angular'):
        for axis in 'xyz':
            twist = TwistStamped()
            setattr(getattr(twist.twist, part), axis, bad)
            with pytest.raises(DataError, match='finite'):
                read_reference(twist)
    writer = RobotStateWriter()
    writer.fill(state_of(np.ones(59)))
    odom = wire(writer.ground_truth)
    for part in (odom.pose.pose.position, odom.pose.pose.orientation, odom.twist.twist.linear,
                 odom.twist.twist.angular):
        good, part.y = part.y, bad
        with pytest.raises(DataError):
            read_odom(odom)
        part.y = good
        read_odom(odom)


@pytest.mark.parametrize('bad', [math.nan, math.inf])
def test_no_bad_number_leaves(bad: float) -> None:
    x = np.zeros((4, 2))
    x[2, 1] = bad
    with pytest.raises(DataError, match='velocity'):
        canonical_writer().fill(0, np.zeros((4, 2)), x, load_gait('trot'))
    with pytest.raises(DataError, match='effort'):
        JointTargetsWriter('fl').fill(0, LegTargets(np.zeros(3), np.zeros(3), np.full(3, bad)))
    with pytest.raises(DataError, match='reference'):
        ReferenceWriter().fill(0, np.array([0.0, bad, 0.0]))
    for place in range(4, 59):
        values = np.ones(59)
        values[place] = bad
        with pytest.raises(DataError, match='finite'):
            RobotStateWriter().fill(state_of(values))


def test_a_quaternion_must_be_a_rotation() -> None:
    writer = RobotStateWriter()
    writer.fill(state_of(np.ones(59)))
    odom = wire(writer.ground_truth)
    odom.pose.pose.orientation.w = 3.0
    with pytest.raises(DataError, match='quaternion'):
        read_odom(odom)


@given(st.tuples(FLOATS, FLOATS, FLOATS))
def test_commands(values: tuple[float, float, float]) -> None:
    message = Twist()
    message.linear.x, message.linear.y, message.angular.z = values
    assert bits(read_twist(wire(message))) == bits(values)


@given(STAMPS, st.floats(allow_nan=False, allow_infinity=False), st.booleans())
def test_inhibition_state(time_ns: int, number: float, flag: bool) -> None:
    message = wire(inhibition_state(time_ns, 'at_rest', {'gain': number, 'requested': flag}))
    assert (read_state_word(message), header_ns(message)) == ('at_rest', time_ns)
    told = {entry.key: entry.value for entry in message.status[0].values}
    assert bits(float(told['gain'])) == bits(number)
    assert told['requested'] == ('true' if flag else 'false')
    message.status[0].name = 'other'
    with pytest.raises(DataError, match='inhibition'):
        read_state_word(message)


@given(STAMPS, numbers(4), st.booleans(), st.booleans(), st.booleans())
def test_inhibition_gains(time_ns: int, values: np.ndarray, requested: bool, rests: bool,
                          opposite: bool) -> None:
    gains = np.minimum(np.abs(values), 1000.0)
    sent = Inhibition(requested, gains, 0.25, rests, opposite=opposite, share=0.5, quickness=1.75)
    message = wire(InhibitionGainsWriter().fill(time_ns, sent))
    read = InhibitionGainsReader().read(message)
    assert bits(read.gains, read.region_radius) == bits(gains, 0.25)
    assert (read.requested, read.at_rest, read.opposite) == (requested, rests, opposite)
    assert (read.share, read.quickness) == (0.5, 1.75)
    assert header_ns(message) == time_ns


@pytest.mark.parametrize('word', ['', 'flying', 'rising rise 3 0.5'])
def test_a_body_mode_is_one_of_the_words(word: str) -> None:
    assert read_body_mode(String(data='lying')) == 'lying'
    with pytest.raises(DataError, match='standing, stopping, lying'):
        read_body_mode(String(data=word))


@given(st.floats())
def test_texts_read_back_to_the_same_float(value: float) -> None:
    assert bits(float(text(value))) == bits(value) or math.isnan(value)
    assert text(np.float64(value)) == text(value)
