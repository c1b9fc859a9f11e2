# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A recording comes out of a bag as it went in, whatever the bag is like."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from synthetic_bag import STORE, WALL_PER_ROBOT, make, write_bag
from synthetic_walk import SyntheticWalk

from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.recording import JointSeries, Recording, StatusEvent
from dmp_cpg_ros.core.errors import DataError, MissingFileError

SERIES = ('joints', 'targets', 'canonical', 'reference', 'odometry', 'estimate', 'imu', 'feet',
          'posture')


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


def test_a_bag_without_our_topics_is_an_empty_recording(tmp_path: Path) -> None:
    with Writer(tmp_path / 'bag', version=9) as writer:
        connection = writer.add_connection('/chatter', 'std_msgs/msg/String', typestore=STORE)
        message = make('std_msgs/msg/String', data='hello')
        writer.write(connection, 1, STORE.serialize_cdr(message, connection.msgtype))
    loaded = load_recording(tmp_path / 'bag')
    assert loaded.span == (0.0, 0.0)
    assert loaded.joints.position.shape == (0, 12)
    assert loaded.canonical.x.shape == (0, 4, 2)


def test_a_bag_that_was_not_closed_is_rescued(walked: Recording, tmp_path: Path) -> None:
    bag = write_bag(walked, tmp_path / 'bag')
    file = bag / 'bag.mcap'
    file.write_bytes(file.read_bytes()[:-500])  # the summary at the end is cut off
    (bag / 'metadata.yaml').unlink()
    assert_same(load_recording(bag), walked)


def test_what_is_no_bag_is_said_so(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match='does not exist'):
        load_recording(tmp_path / 'nowhere')
    with pytest.raises(DataError, match='no rosbag2 recording'):
        load_recording(tmp_path)
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'x.db3').write_bytes(b'not a database')
    with pytest.raises(DataError, match='cannot be read'):
        load_recording(tmp_path)
