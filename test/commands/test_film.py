# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Films of recordings: as long as the run, following the robot, with its state written on it."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from dmp_cpg_ros import __file__ as package
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.recording import Recording, StatusEvent
from dmp_cpg_ros.commands.film import Shot, checked_film_path, film, has_encoder, main, write_film
from dmp_cpg_ros.commands.walk import main as walk
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.robot.camera import Camera
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import recording_of

PACKAGES = Path(package).resolve().parents[1]
"""Where processes find the package."""

SMALL = Shot(fps=10.0, width=160, height=90)


@pytest.fixture(scope='module')
def glide():
    """A robot that glides along x at 1 m/s for 0.6 s, then is at rest."""
    with Camera(width=32, height=32) as camera:
        if camera.reason:
            pytest.skip(camera.reason)
    start, states = MujocoRobot().reset(), []
    for k in range(151):
        place = start.base_position_in_world + (0.004 * k, 0.0, 0.0)
        states.append(dataclasses.replace(start, time_ns=4_000_000 * k,
                                          base_position_in_world=place))
    words = (StatusEvent(0.0, 0, 'walking', {}), StatusEvent(0.3, 0, 'at_rest', {}))
    return dataclasses.replace(recording_of(states), inhibition=words)


def frames_of(path):
    with Image.open(path) as image:
        frames = []
        for k in range(image.n_frames):
            image.seek(k)
            frames.append(np.asarray(image.convert('RGB')).astype(int))
        return frames, image.info['duration']


def test_a_gif_has_a_frame_for_every_moment_at_the_robots_pace(glide, tmp_path):
    path = tmp_path / 'glide.gif'
    assert film(glide, RunContext(), None, path, SMALL) == 7
    frames, duration = frames_of(path)
    assert duration == 100 and frames[0].shape == (90, 160, 3)
    assert film(glide, RunContext(), None, path, dataclasses.replace(SMALL, start=0.2,
                                                                     end=0.41)) == 3


def test_the_camera_follows_and_the_words_change(glide, tmp_path):
    path = tmp_path / 'glide.gif'
    film(glide, RunContext(), None, path, SMALL)
    frames, _ = frames_of(path)
    orange = [(f[..., 0] - f[..., 2] > 90) & (f[..., 0] > 150) for f in frames]
    columns = [np.median(np.nonzero(seen)[1]) for seen in orange]
    assert np.ptp(columns) < 20 and all(seen.sum() > 5 for seen in orange)
    left = [f[:14, :80] for f in frames]
    assert np.abs(left[0] - left[1]).mean() < 3.0 < np.abs(left[0] - left[-1]).mean()


def test_frames_arrive_in_order_and_in_colour(tmp_path):
    colours = [(200, 30, 30), (30, 200, 30), (30, 30, 200)]
    frames = [np.full((48, 64, 3), colour, dtype=np.uint8) for colour in colours]
    write_film(tmp_path / 'colours.gif', iter(frames), frames, 5.0)
    read, duration = frames_of(tmp_path / 'colours.gif')
    assert duration == 200
    np.testing.assert_allclose([frame.mean(axis=(0, 1)) for frame in read], colours, atol=6)


def test_a_film_that_is_interrupted_leaves_what_was_there(tmp_path):
    path = tmp_path / 'film.gif'
    path.write_bytes(b'an earlier film')
    frame = np.full((48, 64, 3), 100, dtype=np.uint8)

    def broken():
        yield frame
        yield frame
        assert path.read_bytes() == b'an earlier film'
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(path, broken(), [frame], 5.0)
    assert [of.name for of in tmp_path.iterdir()] == ['film.gif']
    assert path.read_bytes() == b'an earlier film'


BEGUN = """
import sys
from dmp_cpg_ros.files import replacing
with replacing(sys.argv[1]) as new:
    new.write_bytes(b'a part')
    print('begun', flush=True)
    sys.stdin.read()
"""
"""A writer that waits in the middle of a file."""


def test_a_film_takes_away_what_a_killed_one_has_left_and_nothing_of_others(tmp_path):
    path, frame = tmp_path / 'film.gif', np.full((48, 64, 3), 100, dtype=np.uint8)
    names = {'film.gif', '.99999999.other.gif', '.99999999.my.film.gif', '.backup.film.gif'}
    writers = []
    for name in names:
        (tmp_path / name).write_bytes(b'')
    for _ in range(2):
        writers.append(subprocess.Popen(
            [sys.executable, '-c', BEGUN, str(path)], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, env={**os.environ, 'PYTHONPATH': str(PACKAGES)}))
        assert writers[-1].stdout.readline() == b'begun\n'
    killed, running = writers
    killed.kill()
    killed.wait()
    begun = [f'.{writer.pid}.film.gif' for writer in writers]
    assert {of.name for of in tmp_path.iterdir()} == {*names, *begun}
    write_film(path, iter([frame]), [frame], 5.0)
    assert {of.name for of in tmp_path.iterdir()} == {*names, begun[1]}
    running.communicate()
    assert {of.name for of in tmp_path.iterdir()} == names
    assert path.read_bytes() == b'a part'


def test_it_is_told_how_far_a_film_is(glide, tmp_path):
    told = []
    film(glide, RunContext(), None, tmp_path / 'glide.gif', SMALL, told.append)
    assert told[0] == 'drawing: 1 of 7 frames' and told[-1] == 'drawing: 7 of 7 frames'


@pytest.mark.skipif(not has_encoder(), reason='imageio-ffmpeg is not installed')
def test_an_mp4_is_written_where_there_is_an_encoder(tmp_path):
    frames = [np.full((48, 64, 3), value, dtype=np.uint8) for value in (0, 120, 240)]
    write_film(tmp_path / 'film.mp4', iter(frames), [], 10.0)
    assert (tmp_path / 'film.mp4').read_bytes()[4:8] == b'ftyp'


def test_what_cannot_be_written_is_refused_before_the_run(tmp_path, capsys, monkeypatch):
    with pytest.raises(ParameterError, match='must end in .gif or .mp4'):
        checked_film_path(tmp_path / 'film.avi')
    monkeypatch.setattr('dmp_cpg_ros.commands.film.find_spec', lambda name: None)
    with pytest.raises(ParameterError, match='pip install imageio-ffmpeg; a .gif needs none'):
        checked_film_path(tmp_path / 'film.mp4')
    if find_spec('rclpy') is not None:
        assert walk(['--video', 'film.mp4', '--out', str(tmp_path / 'run')]) == 2
        assert 'imageio-ffmpeg' in capsys.readouterr().err
        assert not (tmp_path / 'run').exists()


def test_an_empty_recording_or_time_has_no_film(glide, tmp_path):
    with pytest.raises(DataError, match='needs recorded joint_states and ground_truth or odom'):
        film(Recording(), RunContext(), None, tmp_path / 'film.gif')
    with pytest.raises(DataError, match='nothing was recorded between 5.0 s'):
        film(glide, RunContext(), None, tmp_path / 'film.gif', Shot(start=5.0))


def test_a_missing_run_is_named(tmp_path, capsys):
    assert main([str(tmp_path / 'no_run'), str(tmp_path / 'film.gif')]) == 2
    assert 'no_run' in capsys.readouterr().err


@pytest.mark.parametrize(('option', 'value', 'valid'), [
    ('--fps', '0', 'from 0.1 to 240'), ('--fps', '-1', 'from 0.1 to 240'),
    ('--fps', '1e9', 'from 0.1 to 240'), ('--fps', 'nan', 'finite'),
    ('--start', 'nan', 'finite'), ('--end', 'inf', 'finite'), ('--width', '0', 'from 32 to 3840'),
    ('--width', '100000', 'from 32 to 3840'), ('--width', '100.5', 'a whole number')])
def test_numbers_that_no_film_can_have_are_refused(tmp_path, capsys, option, value, valid):
    with pytest.raises(SystemExit) as ended:
        main([str(tmp_path), str(tmp_path / 'film.gif'), option, value])
    assert ended.value.code == 2
    assert f'argument {option}: {value} must be {valid}' in capsys.readouterr().err
