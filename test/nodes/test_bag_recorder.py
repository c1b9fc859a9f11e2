# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder keeps every byte, and what a killed one had flushed can be rescued."""

from __future__ import annotations

import signal
import time
import tracemalloc
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import ros_processes
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from ros_processes import NodeProcess, Processes, Ros
from rosbags.rosbag2 import Reader
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from dmp_cpg_ros.analysis.bag import opened
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.nodes.recording.bag_writing import BagWriter

processes, ros, ros_domain = ros_processes.processes, ros_processes.ros, ros_processes.ros_domain

TICK_NS = 4_000_000


def joint_state(k: int) -> JointState:
    message = JointState(name=[f'joint_{i}' for i in range(12)],
                         position=[0.1 * k + i for i in range(12)],
                         velocity=[-1.0 / (k + 1)] * 12)
    set_stamp(message.header.stamp, TICK_NS * (k + 1))
    return message


def read(bag: Path) -> dict[str, list[tuple[int, bytes]]]:
    with opened(bag) as reader:
        messages: dict[str, list[tuple[int, bytes]]] = {topic: [] for topic in reader.topics}
        for connection, time_ns, data in reader.messages():
            messages[connection.topic].append((time_ns, bytes(data)))
    return messages


def started(processes: Processes, ros: Ros, bag: Path, **parameters: object) -> NodeProcess:
    """Start a recorder; its subscriptions match the test's publishers when this returns."""
    process = processes.node(
    'bag_recorder',
    output=bag,
    expected_nodes=['bag_recorder'],
     **parameters)
    answers = []

    def ready() -> bool:
        answers.append(ros.call(Trigger, 'bag_recorder/ready', Trigger.Request()))
        return answers[-1].success

    ros.spin_until(ready, what=lambda: f'{answers} {process}')
    publishers = list(ros.node.publishers)
    ros.spin_until(lambda: all(p.get_subscription_count() for p in publishers if p.topic_name in (
        '/joint_states', '/cmd_vel', '/clock')), what=lambda: f'matching with {process}')
    return process


def publisher(ros: Ros, name: str):
    topic = interface(name)
    return ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_stopped_recorder_has_every_byte(processes: Processes, ros: Ros, tmp_path: Path,
                                           storage: str) -> None:
    joints, commands, clock = (publisher(ros, name)
                               for name in ('joint_states', 'cmd_vel', '/clock'))
    bag = tmp_path / 'bag'
    process = started(processes, ros, bag, storage=storage)
    sent = [serialize_message(joint_state(k)) for k in range(300)]
    for k, data in enumerate(sent):
        joints.publish(data)
        if k % 100 == 50:
            joints.wait_for_all_acked()
            commands.publish(Twist())
    commands.wait_for_all_acked()
    joints.wait_for_all_acked()
    process.interrupt()
    assert process.wait() == 0, str(process)
    recorded = read(bag)
    assert [data for _, data in recorded['/joint_states']] == sent
    assert [time_ns for time_ns, _ in recorded['/joint_states']
        ] == [TICK_NS * (k + 1) for k in range(300)]
    assert len(recorded['/cmd_vel']) == 3
    assert all(TICK_NS <= time_ns <= 300 * TICK_NS for time_ns, _ in recorded['/cmd_vel'])
    with opened(bag) as reader:
        offered = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}
    assert offered['/inhibition_state'].durability.name == 'TRANSIENT_LOCAL'
    assert offered['/joint_states'].durability.name == 'VOLATILE'
    assert {profile.reliability.name for profile in offered.values()} == {'RELIABLE'}


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_second_signal_does_not_break_into_the_end_of_a_recording(
        processes: Processes, tmp_path: Path, number: int) -> None:
    """Under launch a node gets the Ctrl-C of the terminal and that of launch."""
    program = (
        'import os, signal, sys\n'
        f'signal.signal({int(number)}, signal.SIG_DFL)\n'  # it may be ignored here
        'from dmp_cpg_ros.nodes.bag_recorder import BagRecorder\n'
        'from dmp_cpg_ros.nodes.framework.execution import run_node\n'
        'complete = BagRecorder.cleanup\n'
        'def cleanup(node):\n'
        f'    os.kill(os.getpid(), {int(number)})\n'
        '    complete(node)\n'
        'BagRecorder.cleanup = cleanup\n'
        "sys.exit(run_node('bag_recorder'))\n")
    process = processes.python(
        '-c', program, '--ros-args', '-p', f'output:={tmp_path / "bag"}')
    process.wait_for_output('active')
    process.signal(number)
    assert process.wait() == 0, str(process)
    assert 'Traceback' not in process.output, process
    assert (tmp_path / 'bag' / 'metadata.yaml').is_file()


def test_a_middleware_that_does_not_end_is_ended_after_the_recording(
        processes: Processes, tmp_path: Path) -> None:
    program = (
        'import sys, threading\n'
        'from dmp_cpg_ros.nodes.bag_recorder import BagRecorder\n'
        'from dmp_cpg_ros.nodes.framework import execution\n'
        'execution.TORN_DOWN_S = 0.5\n'
        'BagRecorder.destroy_node = lambda node: threading.Event().wait()\n'
        "sys.exit(execution.run_node('bag_recorder'))\n")
    process = processes.python(
        '-c', program, '--ros-args', '-p', f'output:={tmp_path / "bag"}')
    process.wait_for_output('active')
    process.signal(signal.SIGTERM)
    assert process.wait() == 1, str(process)
    assert 'most recent call first' in process.output, process
    assert (tmp_path / 'bag' / 'metadata.yaml').is_file()


def test_a_killed_recorder_leaves_what_it_had_flushed(
    processes: Processes, ros: Ros, tmp_path: Path) -> None:
    joints = publisher(ros, 'joint_states')
    reports = ros.collect(DiagnosticArray, '/diagnostics', QoSProfile(depth=100))
    bag = tmp_path / 'bag'
    process = started(processes, ros, bag, flush_period=0.05)
    sent: list[bytes] = []

    def flushed() -> int:
        values = [{v.key: v.value for v in report.status[0].values} for report in reports]
        return max((int(value.get('messages_on_disk', 0)) for value in values), default=0)

    def enough() -> bool:
        # Every call is a second of the robot's clock, so that the recorder reports.
        sent.append(serialize_message(joint_state(250 * len(sent))))
        joints.publish(sent[-1])
        return flushed() > 20

    ros.spin_until(enough, what=lambda: str(process))
    with pytest.raises(DataError, match='still being recorded'):
        read(bag)
    on_disk = flushed()
    process.kill()
    assert not (bag / 'metadata.yaml').exists()
    recorded = read(bag)
    saved = [data for _, data in recorded['/joint_states']]
    assert saved == sent[:len(saved)]
    assert sum(map(len, recorded.values())) >= on_disk
    assert read(bag) == read(bag.with_name('bag.rescued')) == recorded
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag.rescued']


def test_a_second_recording_gets_a_name_of_its_own(processes: Processes, ros: Ros,
                                                   tmp_path: Path) -> None:
    for _ in range(2):
        process = started(processes, ros, tmp_path / 'bag')
        process.interrupt()
        assert process.wait() == 0, str(process)
    assert process.output.count('WARN') == 1
    assert f"'{tmp_path / 'bag'}' exists" in process.output
    for name in ('bag', 'bag_1'):
        assert (tmp_path / name / 'metadata.yaml').is_file()


def test_without_a_topic_of_the_robot_messages_bear_the_time_of_the_day(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    commands, bag = publisher(ros, 'cmd_vel'), tmp_path / 'bag'
    process = started(processes, ros, bag, topics=['cmd_vel'])
    recorded: list[JointState] = ros.collect(
        JointState, 'bag_recorder/recorded', interface('~/recorded').reader_qos)
    before_ns = time.time_ns()
    for number in (1.0, 2.0):
        commands.publish(Twist())
        ros.spin_until(lambda number=number: [[number]] == [
            [*message.position] for message in recorded[-1:]])
    process.interrupt()
    assert process.wait() == 0, str(process)
    (first_ns, _), (second_ns, _) = read(bag)['/cmd_vel']
    assert before_ns < first_ns < second_ns < time.time_ns()


def test_an_output_that_cannot_be_made_is_refused(processes: Processes, tmp_path: Path) -> None:
    (tmp_path / 'file').touch()
    process = processes.node('bag_recorder', output=tmp_path / 'file' / 'bag')
    assert process.wait() == 2
    assert 'output' in process.output and str(tmp_path) in process.output
    nameless = processes.node('bag_recorder', output='/')
    assert nameless.wait() == 2 and 'Traceback' not in nameless.output, nameless
    assert "output '/' must be" in nameless.output


def test_a_real_time_recording_is_as_long_as_the_robot_walked(processes: Processes, ros: Ros,
                                                              tmp_path: Path) -> None:
    """Whatever users stamp, and whatever opens the gate."""
    joints, clock, push = (publisher(ros, name) for name in ('joint_states', '/clock', 'push'))
    gate = publisher(ros, 'mujoco_robot/advance_until')
    command = ros.node.create_publisher(TwistStamped, 'cmd_vel', 10)
    bag = tmp_path / 'bag'
    process = started(processes, ros, bag, stamped_cmd_vel=True)
    ros.spin_until(push.get_subscription_count, what=lambda: f'matching with {process}')
    wall, far = TwistStamped(), Clock()
    set_stamp(wall.header.stamp, 1_795_314_289_790_000_000)
    set_stamp(far.clock, (2**31 - 1) * 1_000_000_000)
    assert gate.get_subscription_count() == 0
    for k in range(100):
        joints.publish(joint_state(k))
        if k % 20 == 10:
            joints.wait_for_all_acked()
            command.publish(wall)
            push.publish(WrenchStamped(header=wall.header))
            clock.publish(far)
    for sender in (command, push, clock, joints):
        sender.wait_for_all_acked()
    process.interrupt()
    assert process.wait() == 0, str(process)
    recorded = read(bag)
    times = [time_ns for messages in recorded.values() for time_ns, _ in messages]
    assert [len(recorded[name]) for name in ('/cmd_vel', '/push', '/clock')] == [5, 5, 5]
    assert min(times) == TICK_NS and max(times) == 100 * TICK_NS
    information = yaml.safe_load((bag / 'metadata.yaml').read_text())
    duration = information['rosbag2_bagfile_information']['duration']['nanoseconds']
    assert duration == 99 * TICK_NS


def test_the_time_of_a_command_is_that_of_its_reception(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    """Even where its own stamp is one of the recording."""
    joints, push = (publisher(ros, name) for name in ('joint_states', 'push'))
    counts = interface('~/recorded')
    told = ros.collect(counts.type, 'bag_recorder/recorded', counts.reader_qos)
    process = started(processes, ros, tmp_path / 'bag', flush_period=0.05)
    ros.spin_until(push.get_subscription_count, what=lambda: f'matching with {process}')

    def recorded(topic: str) -> float:
        return dict(zip(told[-1].name, told[-1].position, strict=True))[topic] if told else 0.0

    for k in range(50):
        joints.publish(joint_state(k))
    ros.spin_until(lambda: recorded('/joint_states') == 50, what=lambda: str(process))
    early = WrenchStamped()
    set_stamp(early.header.stamp, 2 * TICK_NS)
    push.publish(early)
    ros.spin_until(lambda: recorded('/push') == 1, what=lambda: str(process))
    process.interrupt()
    assert process.wait() == 0, str(process)
    (time_ns, _), = read(tmp_path / 'bag')['/push']
    assert time_ns == 50 * TICK_NS


def test_the_gate_is_not_in_the_bag(processes: Processes, ros: Ros, tmp_path: Path) -> None:
    process = started(processes, ros, tmp_path / 'bag')
    process.interrupt()
    assert process.wait() == 0, str(process)
    topics = read(tmp_path / 'bag').keys()
    assert '/joint_states' in topics
    assert not [topic for topic in topics if topic.startswith('/mujoco_robot/')]


def test_a_node_outside_the_table_is_refused(processes: Processes, tmp_path: Path) -> None:
    process = processes.node('bag_recorder', output=tmp_path / 'bag', topics=['joint_stats'])
    assert process.wait() == 2
    assert 'joint_stats' in process.output and 'joint_states' in process.output
    assert not (tmp_path / 'bag').exists()


def writer(bag: Path) -> tuple[BagWriter, dict[str, object]]:
    bag_writer = BagWriter(bag)
    writers = {}
    for name in ('joint_states', 'foot_contacts', 'cmd_vel', 'inhibition_state',
                 'canonical_state'):
        topic = interface(name)
        writers[name] = bag_writer.add_topic(
            f'/{name}', topic.type_name, topic.publisher_qos, stamped=name != 'cmd_vel',
            clock=name in ('joint_states', 'foot_contacts'))
    return bag_writer, writers


def test_messages_without_a_stamp_bear_the_time_of_the_robot(tmp_path: Path) -> None:
    bag, write = writer(tmp_path / 'bag')
    twist, early = serialize_message(Twist()), serialize_message(DiagnosticArray())
    write['cmd_vel'](twist)
    write['inhibition_state'](early)
    write['joint_states'](serialize_message(joint_state(9)))
    write['cmd_vel'](twist)
    write['joint_states'](serialize_message(joint_state(10)))
    write['cmd_vel'](twist)
    bag.close()
    recorded = read(tmp_path / 'bag')
    assert [time_ns // TICK_NS for time_ns, _ in recorded['/cmd_vel']] == [10, 10, 11]
    assert [time_ns // TICK_NS for time_ns, _ in recorded['/inhibition_state']] == [10]


@settings(max_examples=30)
@given(st.permutations([(name, k) for name in ('joint_states', 'canonical_state')
                        for k in range(3, 9)]))
def test_record_times_of_the_suite_do_not_depend_on_arrival(order: list[tuple[str, int]]) -> None:
    with TemporaryDirectory() as folder:
        bag = Path(folder) / 'bag'
        closing, write = writer(bag)
        write['joint_states'](serialize_message(joint_state(2)))
        for name, k in order:
            write[name](serialize_message(joint_state(k)))
        closing.close()
        recorded = read(bag)
    for name, first in (('/joint_states', 2), ('/canonical_state', 3)):
        assert sorted(time_ns for time_ns, _ in recorded[name]
                      ) == [(k + 1) * TICK_NS for k in range(first, 9)]


@settings(max_examples=30)
@given(st.permutations(5 * ['joint_states', 'foot_contacts', 'canonical_state']))
def test_topics_that_come_apart_by_seconds_keep_their_times(order: list[str]) -> None:
    stamps = [seconds * 10**9 for seconds in (1, 2, 4, 7, 8)]
    left = {name: iter(stamps) for name in order}
    with TemporaryDirectory() as folder:
        bag = Path(folder) / 'bag'
        closing, write = writer(bag)
        write['joint_states'](serialize_message(joint_state(9)))
        for name in order:
            message = JointState()
            set_stamp(message.header.stamp, next(left[name]))
            write[name](serialize_message(message))
        closing.close()
        recorded = read(bag)
    for name in left:
        assert [time_ns for time_ns, _ in recorded[f'/{name}']][-5:] == stamps


def test_a_robot_that_begins_anew_takes_the_clock_along(tmp_path: Path) -> None:
    bag, write = writer(tmp_path / 'bag')
    for k in (1, 1000, 2, 3):
        for name in ('joint_states', 'foot_contacts', 'canonical_state'):
            write[name](serialize_message(joint_state(k)))
    write['cmd_vel'](serialize_message(Twist()))
    bag.close()
    ((time_ns, _),) = read(tmp_path / 'bag')['/cmd_vel']
    assert time_ns == 4 * TICK_NS


@pytest.mark.parametrize('stamp_ns', [10**18, 2 * 10**9, 15 * TICK_NS, 3 * TICK_NS])
def test_no_stamp_leads_out_of_the_time_of_the_robot(tmp_path: Path, stamp_ns: int) -> None:
    bag, write = writer(tmp_path / 'bag')
    foreign = JointState()
    set_stamp(foreign.header.stamp, stamp_ns)
    write['joint_states'](serialize_message(joint_state(9)))
    write['canonical_state'](serialize_message(foreign))
    write['joint_states'](serialize_message(joint_state(10)))
    bag.close()
    (time_ns, _), = read(tmp_path / 'bag')['/canonical_state']
    assert 10 * TICK_NS <= time_ns <= 11 * TICK_NS


def test_a_recording_without_a_robot_is_kept(tmp_path: Path) -> None:
    bag, write = writer(tmp_path / 'bag')
    write['cmd_vel'](serialize_message(Twist()))
    bag.close()
    assert len(read(tmp_path / 'bag')['/cmd_vel']) == 1


def test_an_empty_recording_can_be_opened(tmp_path: Path) -> None:
    bag, _ = writer(tmp_path / 'bag')
    bag.close()
    assert not any(read(tmp_path / 'bag').values())


@pytest.mark.parametrize('kept', [0.2, 0.5, 0.9, 0.999])
def test_a_file_cut_anywhere_keeps_its_closed_chunks(tmp_path: Path, kept: float) -> None:
    whole, write = writer(tmp_path / 'bag')
    sizes, file = [], tmp_path / 'bag' / 'bag.mcap'
    for k in range(200):
        write['joint_states'](serialize_message(joint_state(k)))
        if k % 10 == 9:
            whole.flush()
            sizes.append((file.stat().st_size, k + 1))
    whole.close()
    size = round(sizes[-1][0] * kept)
    with file.open('r+b') as stream:
        stream.truncate(size)
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    expected = max((count for end, count in sizes if end <= size), default=0)
    if not expected:
        with pytest.raises(DataError, match='no complete message'):
            read(tmp_path / 'bag')
        return
    saved = [data for _, data in read(tmp_path / 'bag')['/joint_states']]
    assert saved[:expected] == [serialize_message(joint_state(k)) for k in range(expected)]
    assert expected <= len(saved) <= expected + 10


def test_the_index_of_a_long_recording_is_whole_and_not_in_memory(tmp_path: Path) -> None:
    chunks = 3000
    topic, bag = interface('joint_states'), BagWriter(tmp_path / 'bag')
    write = bag.add_topic('/joint_states', topic.type_name, topic.publisher_qos, stamped=True,
                          clock=True)
    messages = [serialize_message(joint_state(k)) for k in range(chunks)]

    def record(begin: int, end: int) -> int:
        for data in messages[begin:end]:
            write(data)
            bag.flush()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        before = record(0, chunks // 2)
        assert record(chunks // 2, chunks) - before < 20 * chunks
    finally:
        tracemalloc.stop()
    bag.close()
    assert not [path for path in (tmp_path / 'bag').iterdir()
                if path.name not in ('bag.mcap', 'metadata.yaml')]
    with open(tmp_path / 'bag' / 'bag.mcap', 'rb') as file:
        summary = make_reader(file).get_summary()
        assert summary is not None and len(summary.chunk_indexes) == chunks
    assert [data for _, data in read(tmp_path / 'bag')['/joint_states']] == messages


def test_what_cannot_be_read_or_made_is_named(tmp_path: Path) -> None:
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'bag.mcap').write_bytes(b'no mcap at all')
    with pytest.raises(DataError, match='no complete message'):
        read(tmp_path / 'bag')
    with pytest.raises(ParameterError, match='output'):
        BagWriter(tmp_path / 'bag' / 'bag.mcap' / 'bag')


def test_clock_is_stamped_like_a_header() -> None:
    message = Clock()
    set_stamp(message.clock, 7_000_000_003)
    assert serialize_message(message)[4:8] == (7).to_bytes(4, 'little')


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_bag_is_one_of_rosbag2_for_the_readers_of_others(tmp_path: Path, storage: str) -> None:
    """Its metadata have the fields that rosbag2 of Jazzy reads, and both readers find it whole."""
    bag = BagWriter(tmp_path / 'bag', storage)
    topic = interface('joint_states')
    write = bag.add_topic('/joint_states', topic.type_name, topic.publisher_qos, stamped=True,
                          clock=True)
    sent = [(TICK_NS * (k + 1), serialize_message(joint_state(k))) for k in range(100)]
    for k, (_, data) in enumerate(sent):
        write(data)
        if k == 50:
            bag.flush()
    bag.close()
    metadata = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text(encoding='utf-8'))
    described = metadata['rosbag2_bagfile_information']
    assert set(described) == {
        'version', 'storage_identifier', 'duration', 'starting_time', 'message_count',
        'topics_with_message_count', 'compression_format', 'compression_mode',
        'relative_file_paths', 'files', 'custom_data', 'ros_distro'}
    assert (described['version'], described['storage_identifier']) == (9, storage)
    assert described['message_count'] == 100
    assert described['duration'] == {'nanoseconds': 99 * TICK_NS}
    (file,), (name,) = described['files'], described['relative_file_paths']
    assert file == {
        'path': name, 'starting_time': described['starting_time'],
        'duration': described['duration'], 'message_count': 100}
    (counted,) = described['topics_with_message_count']
    assert set(counted['topic_metadata']) == {
        'name', 'type', 'serialization_format', 'offered_qos_profiles', 'type_description_hash'}
    (profile,) = counted['topic_metadata']['offered_qos_profiles']
    assert set(profile) == {
        'history', 'depth', 'reliability', 'durability', 'deadline', 'lifespan', 'liveliness',
        'liveliness_lease_duration', 'avoid_ros_namespace_conventions'}
    with Reader(tmp_path / 'bag') as reader:
        assert [(time_ns, bytes(raw)) for _, time_ns, raw in reader.messages()] == sent
    if storage == 'mcap':
        with (tmp_path / 'bag' / name).open('rb') as stream:
            of_mcap = make_reader(stream, validate_crcs=True)
            summary = of_mcap.get_summary()
            assert of_mcap.get_header().profile == 'ros2'
            assert summary is not None and summary.statistics is not None
            assert summary.statistics.message_count == 100 and len(summary.chunk_indexes) > 1
            assert [(message.log_time, message.data)
                    for _, _, message in of_mcap.iter_messages()] == sent
            assert [schema.encoding for schema in summary.schemas.values()] == ['ros2msg']
