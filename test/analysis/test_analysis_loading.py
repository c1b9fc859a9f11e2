# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording comes out of a bag as it went in, whatever the bag is like."""

from __future__ import annotations

import dataclasses
import errno
import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import mcap.reader
import mcap.writer
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from synthetic_bag import STORE, WALL_PER_ROBOT, make, write_bag
from synthetic_walk import SyntheticWalk

from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.metrics.summary import compute_metrics
from dmp_cpg_ros.analysis.recording import JointSeries, Recording, StatusEvent
from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.layouts import OSCILLATOR_ROWS

SERIES = ('joints', 'targets', 'canonical', 'reference', 'odometry', 'estimate', 'feet')


@pytest.fixture(scope='module')
def walked() -> Recording:
    return SyntheticWalk(rate_hz=50.0, stop_s=2.0, release_s=4.0, end_s=6.0).recording()


def assert_same(loaded: Recording, written: Recording) -> None:
    for name in SERIES:
        for field in dataclasses.fields(getattr(written, name)):
            np.testing.assert_allclose(
                getattr(getattr(loaded, name), field.name),
                getattr(getattr(written, name), field.name),
                rtol=0.0,
                atol=1e-9 if field.name == 'time' else 0.0,
                err_msg=f'{name}.{field.name}',
            )
    assert loaded.inhibition == written.inhibition
    assert loaded.statuses == written.statuses


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_every_topic_survives_the_bag(
    walked: Recording, tmp_path: Path, storage: StoragePlugin
) -> None:
    assert_same(load_recording(write_bag(walked, tmp_path / 'bag', storage=storage)), walked)


@pytest.mark.parametrize('odometry', [('ground_truth', 'odom'), ('odom', 'estimated_odom')])
def test_the_truth_of_new_and_of_old_bags_is_not_the_estimate(
        walked: Recording, tmp_path: Path, odometry: tuple[str, str]) -> None:
    still = dataclasses.replace(walked.odometry, velocity_in_base=np.zeros((
        len(walked.odometry.time), 3)))
    recording = dataclasses.replace(walked, estimate=still)
    assert_same(load_recording(write_bag(recording, tmp_path / 'bag', odometry=odometry)),
                recording)


def test_a_run_folder_and_a_file_in_the_bag_name_the_bag(
    walked: Recording, tmp_path: Path
) -> None:
    bag = write_bag(walked, tmp_path / 'bag')
    for name in (tmp_path, bag / 'bag.mcap', bag / 'metadata.yaml'):
        assert load_recording(name).counts == load_recording(bag).counts


def test_a_namespace_does_not_matter_but_two_robots_do(walked: Recording, tmp_path: Path) -> None:
    assert_same(load_recording(write_bag(walked, tmp_path / 'one', namespace='/spot')), walked)
    with Writer(tmp_path / 'two', version=9) as writer:
        for name in ('/a/joint_states', '/b/joint_states'):
            writer.add_connection(name, 'sensor_msgs/msg/JointState', typestore=STORE)
    with pytest.raises(DataError, match='/a/joint_states, /b/joint_states'):
        load_recording(tmp_path / 'two')


@pytest.mark.parametrize('wall_clock', [False, True])
@pytest.mark.parametrize('stamped', [False, True])
def test_commands_are_on_the_clock_of_the_robot(
    walked: Recording, tmp_path: Path, wall_clock: bool, stamped: bool
) -> None:
    bag = write_bag(walked, tmp_path / 'bag', wall_clock=wall_clock, stamped_commands=stamped)
    loaded = load_recording(bag)
    # a command is recorded half a millisecond after a tick, so the last tick before it is its own
    np.testing.assert_allclose(loaded.commands.time, walked.commands.time, atol=1e-9)
    np.testing.assert_array_equal(loaded.commands.value, walked.commands.value)


def test_record_times_tell_only_on_a_wall_clock(walked: Recording, tmp_path: Path) -> None:
    wall = load_recording(write_bag(walked, tmp_path / 'wall', wall_clock=True)).arrivals
    robot = load_recording(write_bag(walked, tmp_path / 'robot')).arrivals
    assert wall.on_wall_clock
    assert not robot.on_wall_clock
    period = 1.0 / 50.0
    np.testing.assert_allclose(np.diff(wall.state), WALL_PER_ROBOT * period, atol=1e-6)


def test_joint_values_go_by_name_and_missing_ones_are_nan(tmp_path: Path) -> None:
    stamp = make('builtin_interfaces/msg/Time', sec=1, nanosec=0)
    header = make('std_msgs/msg/Header', stamp=stamp, frame_id='')
    with Writer(tmp_path / 'bag', version=9) as writer:
        connection = writer.add_connection(
            '/joint_states', 'sensor_msgs/msg/JointState', typestore=STORE
        )
        message = make(
            'sensor_msgs/msg/JointState',
            header=header,
            name=['rr_knee', 'tail', 'fl_abduction'],
            position=np.array([3.0, 9.0, 1.0]),
            velocity=np.array([]),
            effort=np.array([]),
        )
        writer.write(connection, 1, STORE.serialize_cdr(message, connection.msgtype))
    joints = load_recording(tmp_path / 'bag').joints
    assert joints.position[0, 0] == 1.0
    assert joints.position[0, 11] == 3.0
    assert np.isnan(joints.position[0, 1:11]).all()
    assert np.isnan(joints.velocity).all()


@pytest.mark.parametrize(('text', 'gait'), [
    ('trot', GaitShares('trot')), ('trot *1.25', GaitShares('trot', cadence_scale=1.25)),
    ('amble>trot 0.35 0.61 *0.9', GaitShares('amble', 'trot', 0.35, 0.61, 0.9)),
])
def test_gaits_of_former_recordings_are_read_from_their_text(
        text: str, gait: GaitShares, tmp_path: Path) -> None:
    with Writer(tmp_path / 'bag', version=9) as writer:
        connection = writer.add_connection(
            '/canonical_state', 'sensor_msgs/msg/JointState', typestore=STORE)
        stamp = make('builtin_interfaces/msg/Time', sec=1, nanosec=0)
        message = make(
            'sensor_msgs/msg/JointState',
            header=make('std_msgs/msg/Header', stamp=stamp, frame_id=text),
            name=list(OSCILLATOR_ROWS), position=np.ones(8), velocity=np.ones(8),
            effort=np.array([]))
        writer.write(connection, 10**9, STORE.serialize_cdr(message, connection.msgtype))
    assert load_recording(tmp_path / 'bag').canonical.gaits == (gait,)


def test_the_legs_targets_are_merged_where_their_stamps_agree(
    walked: Recording, tmp_path: Path
) -> None:
    targets = walked.targets
    few = [
        np.where(np.arange(12) < 3, block[:2], np.where([[True], [False]], block[:2], np.nan))
        for block in (targets.position, targets.velocity, targets.effort)
    ]
    assert load_recording(
        write_bag(
            dataclasses.replace(Recording(), targets=JointSeries(targets.time[:2], *few)),
            tmp_path / 'bag',
        )
    ).targets.position.shape == (2, 12)


def test_repeated_inhibition_states_are_one_event(tmp_path: Path) -> None:
    words = ('free', 'free', 'waiting', 'waiting', 'waiting', 'free')
    events = tuple(StatusEvent(float(k), 0, word, {}) for k, word in enumerate(words))
    loaded = load_recording(write_bag(Recording(inhibition=events), tmp_path / 'bag'))
    assert [(event.time, event.message) for event in loaded.inhibition] == [
        (0.0, 'free'),
        (2.0, 'waiting'),
        (5.0, 'free'),
    ]


def test_a_state_that_was_told_before_the_recorder_joined_comes_first(tmp_path: Path) -> None:
    with Writer(tmp_path / 'bag', version=9) as writer:
        connection = writer.add_connection(
            '/inhibition_state', 'diagnostic_msgs/msg/DiagnosticArray', typestore=STORE)
        for at, (second, word) in enumerate(((1, 'releasing'), (0, 'at_rest'), (2, 'walking'))):
            message = make('diagnostic_msgs/msg/DiagnosticArray', header=make(
                'std_msgs/msg/Header', frame_id='', stamp=make(
                    'builtin_interfaces/msg/Time', sec=second, nanosec=0)),
                status=[make('diagnostic_msgs/msg/DiagnosticStatus', level=0, name='inhibition',
                             message=word, hardware_id='', values=[])])
            writer.write(connection, at + 1, STORE.serialize_cdr(message, connection.msgtype))
    loaded = load_recording(tmp_path / 'bag')
    assert [event.message for event in loaded.inhibition] == ['at_rest', 'releasing', 'walking']


def test_a_bag_without_our_topics_is_an_empty_recording(tmp_path: Path) -> None:
    with Writer(tmp_path / 'bag', version=9) as writer:
        connection = writer.add_connection('/chatter', 'std_msgs/msg/String', typestore=STORE)
        message = make('std_msgs/msg/String', data='hello')
        writer.write(connection, 1, STORE.serialize_cdr(message, connection.msgtype))
    loaded = load_recording(tmp_path / 'bag')
    assert loaded.span == (0.0, 0.0)
    assert loaded.joints.position.shape == (0, 12)
    assert loaded.canonical.x.shape == (0, 4, 2)


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in folder.rglob('*') if path.is_file()}


def cut(file: Path) -> Path:
    """Cut the summary at the end off, as a killed recorder does."""
    file.write_bytes(file.read_bytes()[:-500])
    return file


def written_file(recording: Recording, file: Path) -> Path:
    """Single MCAP file, without the folder of a bag around it."""
    bag = write_bag(recording, file.with_suffix('.bag'))
    (bag / f'{bag.name}.mcap').rename(file)
    shutil.rmtree(bag)
    return file


def test_a_bag_that_was_not_closed_is_read_from_a_copy(
    walked: Recording, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    bag = write_bag(walked, tmp_path / 'bag')
    cut(bag / 'bag.mcap')
    (bag / 'metadata.yaml').unlink()
    before = contents(bag)
    assert_same(load_recording(tmp_path), walked)
    assert contents(bag) == before
    rescued = tmp_path / 'bag.rescued'
    line, = caplog.messages
    assert str(rescued) in line and 'not closed' in line
    assert_same(load_recording(rescued), walked)
    load_recording(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'bag.rescued']
    (rescued / 'bag.mcap').write_bytes(b'repaired by hand')
    assert_same(load_recording(tmp_path), walked)
    assert (rescued / 'bag.mcap').read_bytes() == b'repaired by hand'


def test_a_copy_that_cannot_lie_beside_its_bag_is_temporary(
    walked: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture
) -> None:
    def read_only(prefix: str, dir: Path | None) -> TemporaryDirectory[str]:
        if dir is not None:
            raise OSError(errno.EROFS, 'Read-only file system')
        return TemporaryDirectory(prefix=prefix)

    monkeypatch.setattr('dmp_cpg_ros.analysis.rescue.TemporaryDirectory', read_only)
    file = cut(written_file(walked, tmp_path / 'monday.mcap'))
    assert_same(load_recording(file), walked)
    assert list(tmp_path.iterdir()) == [file]
    copy = re.search("temporary copy '(.*)'", caplog.text)
    assert copy is not None and not Path(copy[1]).exists()


def test_files_of_one_folder_are_separate_recordings(walked: Recording, tmp_path: Path) -> None:
    less = dataclasses.replace(walked, estimate=Recording().estimate)
    monday = written_file(walked, tmp_path / 'monday.mcap')
    tuesday = cut(written_file(less, tmp_path / 'tuesday.mcap'))
    before = contents(tmp_path)
    assert_same(load_recording(monday), walked)
    assert contents(tmp_path) == before
    with pytest.raises(DataError, match=r'name one of them: monday\.mcap, tuesday\.mcap'):
        load_recording(tmp_path)
    assert_same(load_recording(tuesday), less)
    assert contents(tmp_path).items() >= before.items()
    assert set(contents(tmp_path)) - set(before) == {'tuesday.rescued/tuesday.mcap'}


def test_the_parts_of_a_split_bag_are_one(walked: Recording, tmp_path: Path) -> None:
    empty = Recording()
    rest = {field.name: getattr(empty, field.name) for field in dataclasses.fields(empty)
            if field.name != 'joints'}
    (tmp_path / 'day').mkdir()
    written_file(dataclasses.replace(walked, joints=empty.joints), tmp_path / 'day' / 'day_0.mcap')
    cut(written_file(dataclasses.replace(walked, **rest), tmp_path / 'day' / 'day_1.mcap'))
    assert_same(load_recording(tmp_path / 'day'), walked)


@pytest.mark.parametrize('closed', [True, False])
def test_what_is_not_of_ros_is_kept_and_does_not_disturb(
    walked: Recording, tmp_path: Path, closed: bool
) -> None:
    source, file = written_file(walked, tmp_path / 'source.mcap'), tmp_path / 'mixed.mcap'
    with source.open('rb') as read, file.open('wb') as stream:
        writer = mcap.writer.Writer(stream, chunk_size=10_000)
        writer.start(profile='')
        schema = writer.register_schema('weather', 'jsonschema', b'{"type": "object"}')
        weather = writer.register_channel('/weather', 'json', schema)
        writer.add_attachment(1, 2, 'photo.jpg', 'image/jpeg', b'no photo')
        writer.add_metadata('operator', {'name': 'Ada'})
        channels: dict[int, int] = {}
        for number, (schema_there, channel, message) in enumerate(
                mcap.reader.make_reader(read).iter_messages()):
            if channel.id not in channels:
                kind = writer.register_schema(
                    schema_there.name, schema_there.encoding, schema_there.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, kind, channel.metadata)
            writer.add_message(channels[channel.id], message.log_time, message.data,
                               message.publish_time + 7, number)
            writer.add_message(weather, message.log_time, b'{"rain": false}', message.log_time)
        writer.finish()
    source.unlink()
    before = contents(tmp_path)
    if closed:
        assert_same(load_recording(file), walked)
        assert contents(tmp_path) == before
        return
    cut(file)
    assert_same(load_recording(file), walked)
    with (tmp_path / 'mixed.rescued' / 'mixed.mcap').open('rb') as read:
        copy = mcap.reader.make_reader(read)
        assert [a.data for a in copy.iter_attachments()] == [b'no photo']
        assert [m.metadata for m in copy.iter_metadata()] == [{'name': 'Ada'}]
        ours, others = [], []
        for _, channel, message in copy.iter_messages():
            (others if channel.topic == '/weather' else ours).append(message)
    assert len(ours) == len(others)
    assert all(message.publish_time == message.log_time + 7 for message in ours)
    assert sorted(message.sequence for message in ours) == list(range(len(ours)))


def test_one_message_that_cannot_be_decoded_is_left_out(
    walked: Recording, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    bag = write_bag(walked, tmp_path / 'bag')
    kinds = {'/clock': 'rosgraph_msgs/msg/Clock', '/joint_states': 'sensor_msgs/msg/JointState'}
    with Writer(tmp_path / 'spoiled', version=9) as writer, AnyReader([bag]) as reader:
        connections = {c.topic: writer.add_connection(c.topic, c.msgtype, typestore=STORE)
                       for c in reader.connections}
        for number, (connection, bag_ns, raw) in enumerate(reader.messages()):
            if number == 20:
                for topic in kinds:
                    writer.write(connections[topic], bag_ns, b'\x00\x01\x00\x00\xff\xfe')
            writer.write(connections[connection.topic], bag_ns, raw)
    loaded = load_recording(tmp_path / 'spoiled')
    assert_same(loaded, walked)
    assert loaded.undecodable == {'/clock': 1, '/joint_states': 1}
    assert '1 on /clock, 1 on /joint_states' in caplog.text
    lost = [fact for fact in facts(compute_metrics(loaded)) if 'decoded' in fact.statement]
    assert [(fact.holds, fact.finding[0]) for fact in lost] == [(False, '2')]
    assert not any('decoded' in fact.statement for fact in facts(compute_metrics(walked)))


def test_what_is_no_bag_is_said_so(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match='does not exist'):
        load_recording(tmp_path / 'nowhere')
    with pytest.raises(DataError, match='no rosbag2 recording'):
        load_recording(tmp_path)
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'x.db3').write_bytes(b'not a database')
    with pytest.raises(DataError, match='cannot be read'):
        load_recording(tmp_path)
