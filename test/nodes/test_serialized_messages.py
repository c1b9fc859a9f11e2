# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Messages read from their bytes are what rclpy reads from the same bytes."""

from __future__ import annotations

from array import array

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped, WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu, JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.reference import read_reference
from dmp_cpg_ros.nodes.messages.robot_state import read_imu
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.studies.fuzz_bytes import KINDS, fuzz

TEXTS = st.text(st.characters(exclude_characters='\x00', exclude_categories=['Cs']), max_size=12)
NUMBERS = st.lists(st.floats(width=64), max_size=9)


def joint_state(frame: str, names: list[str], *arrays: list[float]) -> JointState:
    message = JointState(name=names)
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = 12, 345_678_901
    for field, numbers in zip(('position', 'velocity', 'effort'), arrays, strict=True):
        setattr(message, field, array('d', numbers))
    return message


@settings(max_examples=200, deadline=None)
@given(TEXTS, st.lists(TEXTS, max_size=6), NUMBERS, NUMBERS, NUMBERS)
def test_a_joint_state_is_read_as_rclpy_reads_it(frame, names, position, velocity, effort):
    message = joint_state(frame, names, position, velocity, effort)
    read = serialized_reader(JointState)
    for _ in range(2):  # the second time its names are known
        got = read(bytes(serialize_message(message)))
        assert (header_ns(got), got.name) == (12_345_678_901, names)
        for field in ('position', 'velocity', 'effort'):
            assert getattr(got, field).tobytes() == getattr(message, field).tobytes()


def test_names_of_the_same_lengths_are_told_apart():
    read = serialized_reader(JointState)
    for names in (['aa', 'bb'], ['aa', 'cc'], ['aa', 'bb'], ['aa', 'b'], ['aa', 'bb']):
        data = serialize_message(joint_state('', names, [1.0, 2.0], [], []))
        assert read(data).name == names


@given(st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6), TEXTS)
def test_a_twist_and_an_imu_are_read_as_rclpy_reads_them(numbers, frame):
    twist, imu = TwistStamped(), Imu()
    for message, pairs in ((twist, (twist.twist.linear, twist.twist.angular)),
                           (imu, (imu.angular_velocity, imu.linear_acceleration))):
        message.header.frame_id, message.header.stamp.sec = frame, 3
        for place, vector in zip((0, 3), pairs, strict=True):
            vector.x, vector.y, vector.z = numbers[place:place + 3]
    data = serialize_message(twist), serialize_message(imu)
    got = serialized_reader(TwistStamped)(data[0])
    assert header_ns(got) == 3 * 10**9
    np.testing.assert_array_equal(
        read_reference(got), read_reference(deserialize_message(data[0], TwistStamped)))
    got = serialized_reader(Imu)(data[1])
    assert header_ns(got) == 3 * 10**9
    np.testing.assert_array_equal(read_imu(got), read_imu(deserialize_message(data[1], Imu)))


@pytest.mark.parametrize('kind', [JointState, TwistStamped, Imu])
def test_bytes_that_are_cut_short_are_refused(kind):
    message = joint_state('base', ['a', 'bc'], [1.0, 2.0], [3.0], []) if (
        kind is JointState) else kind()
    data, read = bytes(serialize_message(message)), serialized_reader(kind)
    read(data)
    for length in range(2, len(data) - 8):
        with pytest.raises(DataError):
            read(data[:length])


def test_impossible_numbers_of_entries_are_refused():
    data = bytearray(serialize_message(joint_state('', ['a'], [1.0], [], [])))
    read = serialized_reader(JointState)
    at = bytes(data).index(b'\x01\x00\x00\x00\x02\x00\x00\x00a')
    data[at:at + 4] = b'\xff\xff\xff\xff'
    with pytest.raises(DataError):
        read(bytes(data))


def test_a_stamp_that_is_no_time_is_refused():
    message = JointState()
    message.header.stamp.sec = -1
    with pytest.raises(DataError, match='stamp'):
        serialized_reader(JointState)(serialize_message(message))


def test_another_encoding_is_left_to_rclpy():
    message = TwistStamped()
    message.header.stamp.sec, message.twist.linear.x = 7, 0.25
    little = serialize_message(message)
    big = b'\x00\x00' + little[2:4] + (7).to_bytes(4, 'big') + little[8:12] + (
        1).to_bytes(4, 'big') + little[16:]
    got = serialized_reader(TwistStamped)(big)
    assert isinstance(got, TwistStamped)
    assert got.header.stamp.sec == 7


def test_kinds_that_this_module_does_not_read_are_left_to_rclpy():
    message = WrenchStamped()
    message.wrench.force.x = 2.0
    assert serialized_reader(WrenchStamped)(serialize_message(message)) == message
    twist = TwistStamped()
    assert serialized_reader(TwistStamped, as_message=True)(serialize_message(twist)) == twist


@pytest.mark.parametrize('kind', [JointState, TwistStamped, Imu, WrenchStamped, DiagnosticArray])
@pytest.mark.parametrize('encoding', ['0001', '0000', '0003', 'ffff'])
def test_what_is_cut_short_is_refused_in_every_encoding(kind, encoding):
    read = serialized_reader(kind)
    for data in (bytes.fromhex(encoding), bytes.fromhex(encoding) + 3 * b'\xff'):
        with pytest.raises(DataError, match=f'{len(data)} bytes are no {kind.__name__}'):
            read(data)


def test_a_message_that_is_too_long_is_not_kept():
    message = joint_state('', [f'{k:09}' for k in range(20_000)], [], [], [])
    with pytest.raises(DataError, match='at most'):
        serialized_reader(JointState)(serialize_message(message))


def test_mutated_bytes_are_read_as_rclpy_reads_them(capfd):
    """Both refuse a buffer, or both read the same; ``studies.fuzz_bytes`` tries a million."""
    counts, failures, _ = fuzz(0, seed=20261122, count=3000)
    capfd.readouterr()  # the middleware says something of each
    assert not failures
    assert sum(counts.values()) == 3000
    assert min(counts[f'both {what} {kind.__name__}'] for what in ('read', 'refuse')
               for kind in KINDS) > 200


@pytest.mark.parametrize(('kind', 'data', 'expected'), [
    # names that are no UTF-8, that hold a zero, that do not end with one, and of no length
    (JointState, b'\x01\x00\x00\x00\x03\x00\x00\x00\xff\xfe\x00', ['\ufffd\ufffd']),
    (JointState, b'\x01\x00\x00\x00\x04\x00\x00\x00a\x00b\x00', ['a']),
    (JointState, b'\x01\x00\x00\x00\x02\x00\x00\x00ab', ['ab']),
    (JointState, b'\x01\x00\x00\x00\x00\x00\x00\x00', ['']),
])
def test_odd_names_are_those_that_rclpy_reads(kind, data, expected):
    header = b'\x00\x01\x00\x00' + 8 * b'\x00' + b'\x01\x00\x00\x00\x00\x00\x00\x00'
    data = header + data + bytes(-len(data) % 4) + 12 * b'\x00'
    assert serialized_reader(kind)(data).name == expected
    assert list(deserialize_message(data, kind).name) == expected
