# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that die while the robot walks come back, or the gait stops and ``walk`` names them."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import numpy as np
import ros_processes
from ros_processes import (
    RUN_S,
    SHARED_HZ,
    NodeProcess,
    Processes,
    Ros,
    reserved_domain,
    wait_until,
)
from std_srvs.srv import SetBool

from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.motion import tilt
from dmp_cpg_ros.core.suite_parameters import CANONICAL, INHIBITION
from dmp_cpg_ros.nodes.framework.known_stop import TELLERS
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.suite_table import PROCESSES, ROBOT

processes, ros, ros_domain = (
    ros_processes.processes, ros_processes.ros, ros_processes.ros_domain)

PROGRAM = """
import sys
from dmp_cpg_ros.commands import suite_run, suite_watch
{}
from dmp_cpg_ros.__main__ import walk
sys.exit(walk())
"""

IMPATIENT = PROGRAM.format('suite_watch.LAST_WORDS_S = suite_run.ENDED_WITHIN_S = 1.5')
"""Program of a ``walk`` that waits for a node that hangs for 1.5 s, instead of 10 and 15."""

WATCHFUL = PROGRAM.format('suite_watch.FIRST_WORD_S = 1.0')
"""Program of a ``walk`` that finds waiting of 1 s worth a word, instead of 3."""

AGAIN = 'all nodes are ready again'

LOCK_STEP = ('--lock-step', '--rate', str(SHARED_HZ))

RESTS_S = 2.0
"""How long a robot rests, of its own time, after its nodes are ready again [s]."""


def scenario(folder: Path, duration_s: float, events: Sequence[Mapping[str, Any]] = ()) -> Path:
    file = folder / 'kills.yaml'
    file.write_text(json.dumps({'name': 'kills', 'duration': duration_s, 'events': [
        {'at': 0.3, 'command': {'v_x': 0.4}}, *events]}), encoding='utf-8')
    return file


def walk(processes: Processes, folder: Path, duration_s: float, *arguments: str,
         events: Sequence[Mapping[str, Any]] = ()) -> NodeProcess:
    return processes.walk(scenario(folder, duration_s, events), folder / 'run', *arguments)


def assert_undisturbed(run: Path) -> None:
    """Every tick is there, and neither the body nor the gait shows that nodes have died."""
    recording = load_recording(run)
    assert np.allclose(np.diff(np.unique(recording.joints.time)), 1.0 / SHARED_HZ)
    assert tilt(recording.odometry.quaternion).max() < 0.2
    assert json.loads((run / 'metrics.json').read_text(encoding='utf-8'))[
        'gait']['phase_error_rad_max'] < 0.05


def test_in_lock_step_the_walk_goes_on_as_if_nobody_had_died(
        processes: Processes, tmp_path: Path) -> None:
    process = walk(processes, tmp_path, 4.0, *LOCK_STEP, '--respawn')
    process.wait_for_output(r's +walking', RUN_S)
    dead = ('inhibition', 'canonical_oscillators', 'leg_transformation_fl')
    for node in dead:
        os.kill(process.pid_of(node), signal.SIGKILL)
        process.wait_for_output(rf'{node} was ended by signal 9 \(SIGKILL\)', RUN_S)
    process.wait_for_output(AGAIN, RUN_S)
    assert process.wait(RUN_S) == 0, str(process)
    assert_undisturbed(tmp_path / 'run')


def test_in_lock_step_the_walk_goes_on_after_the_death_of_each_block(
        processes: Processes, tmp_path: Path) -> None:
    process = walk(processes, tmp_path, 12.0, *LOCK_STEP, '--respawn', '--processes', 'blocks')
    process.wait_for_output(r's +walking', RUN_S)
    blocks = [name for name in PROCESSES['blocks'] if name != ROBOT]
    # The gait is forgotten where both die of whom either remembers it.
    pairs = [pair for pair in combinations(blocks, 2) if pair != ('gait', 'supervision')]
    died = Counter[str]()
    for count, names in enumerate([*((name,) for name in blocks), *pairs], 1):
        died.update(names)
        for pid in [process.pid_of(PROCESSES['blocks'][name][0]) for name in names]:
            os.kill(pid, signal.SIGKILL)
        for name in names:
            process.wait_for_output(
                rf'(?s)({name} was ended by signal 9 \(SIGKILL\).*){{{died[name]}}}', RUN_S)
        process.wait_for_output(rf'(?s)({AGAIN}.*){{{count}}}', RUN_S)
    assert process.wait(RUN_S) == 0, str(process)
    assert_undisturbed(tmp_path / 'run')


def test_who_knows_of_a_stop_is_not_all_in_one_process() -> None:
    """Of those who tell a restarted inhibition of it one is alone with what is never restarted."""
    tellers = {kind for topic in TELLERS for kind in interface(topic).publishers}
    assert ROBOT in tellers and all(
        INHIBITION in interface(topic).subscribers and interface(topic).latched
        for topic in TELLERS)
    for processes in (PROCESSES['each'], PROCESSES['blocks']):
        (supervising,) = (nodes for nodes in processes.values() if INHIBITION in nodes)
        assert not tellers.intersection(supervising)
        assert (ROBOT,) in processes.values()


@pytest.mark.parametrize('way', [('--lock-step', '--processes', 'blocks'), ()])
def test_a_stop_of_the_service_outlives_inhibition_and_oscillators(
        processes: Processes, ros: Ros, tmp_path: Path, way: tuple[str, ...]) -> None:
    """Under a command that never ends; afterwards the service can start the gait."""
    process = walk(processes, tmp_path, 3600.0, *way, '--rate', str(SHARED_HZ), '--respawn',
                   events=[{'at': 1.5, 'inhibit': True}])
    process.wait_for_output(r'(?s)> inhibit.*s +at rest', RUN_S)
    dead = ('gait', 'supervision') if 'blocks' in way else (CANONICAL, INHIBITION)
    for node in (CANONICAL, INHIBITION):
        os.kill(process.pid_of(node), signal.SIGKILL)
    for name in dead:
        process.wait_for_output(rf'{name} was ended by signal 9 \(SIGKILL\)', RUN_S)
    process.wait_for_output(AGAIN, RUN_S)
    clock = interface('/clock')
    ticks = ros.collect(clock.type, clock.name, clock.reader_qos)
    ros.spin_until(lambda: len(ticks) > RESTS_S * SHARED_HZ, RUN_S)
    assert 'walking' not in process.output.partition('was ended by')[2]
    ros.granted(SetBool, 'inhibit', SetBool.Request(data=False))
    process.wait_for_output(r'(?s)was ended by.*s +walking', RUN_S)


@pytest.mark.parametrize('node', ['canonical_oscillators', 'inhibition'])
def test_without_respawn_the_robot_comes_to_a_stand_and_walk_names_who_died(
        processes: Processes, tmp_path: Path, node: str) -> None:
    process = walk(processes, tmp_path, 60.0, '--rate', str(SHARED_HZ))
    process.wait_for_output(r's +walking', RUN_S)
    os.kill(process.pid_of(node), signal.SIGKILL)
    assert process.wait(RUN_S) == 1, str(process)
    assert re.search(rf'walk: {node} was ended by signal 9 \(SIGKILL\)', process.output)
    odometry = load_recording(tmp_path / 'run').odometry
    assert tilt(odometry.quaternion).max() < 0.5
    assert np.linalg.norm(odometry.velocity_in_base[-1]) < 0.05


def test_a_node_that_hangs_is_named_and_the_run_has_failed(
        processes: Processes, tmp_path: Path) -> None:
    process = processes.python(
        '-c', IMPATIENT, str(scenario(tmp_path, 2.0)), '--no-report', '--out',
        str(tmp_path / 'run'), '--composed', '--rate', str(SHARED_HZ))
    process.wait_for_output(r's +walking', RUN_S)
    os.kill(process.pid_of('bag_recorder'), signal.SIGSTOP)
    assert process.wait(RUN_S) == 1, str(process)
    # and whoever has not ended either, on a loaded machine
    assert re.search(r'walk: bag_recorder(, \w+)* hung', process.output), process


@pytest.mark.parametrize('node', ['leg_transformation_fl', 'posture_control'])
def test_a_node_that_stands_still_for_a_while_is_followed_again(
        processes: Processes, tmp_path: Path, node: str) -> None:
    """As one of a machine that was busy or asleep: what it sends then is late, and no restart."""
    process = walk(processes, tmp_path, 3600.0, '--rate', str(SHARED_HZ))
    process.wait_for_output(r's +walking', RUN_S)
    begin, pid = len(process.output), process.pid_of(node)
    try:
        os.kill(pid, signal.SIGSTOP)
        wait_until(lambda: 'looks after itself' in process.output[begin:], RUN_S,
                   what=lambda: str(process))
    finally:
        os.kill(pid, signal.SIGCONT)
    wait_until(lambda: re.search(r'(?s)looks after itself.*s +walking', process.output[begin:]),
               RUN_S, what=lambda: str(process))
    process.interrupt()
    assert process.wait(RUN_S) == 130, str(process)
    assert 'was ended by' not in process.output
    assert tilt(load_recording(tmp_path / 'run').odometry.quaternion).max() < 0.5


def test_in_lock_step_no_tick_is_told_again_because_the_robot_looks_after_itself_for_long(
        processes: Processes, tmp_path: Path) -> None:
    """How long is wall time, of which the published bytes tell nothing."""
    failure = {'at': 1.0, 'fail': {'component': 'link', 'kind': 'off', 'for_s': 7.0, 'leg': 'rl'}}
    process = processes.python(
        '-c', WATCHFUL, str(scenario(tmp_path, 9.0, [failure])), '--no-report', '--out',
        str(tmp_path / 'run'), *LOCK_STEP, '--composed', '--set', 'failures_allowed:=true')
    assert process.wait(RUN_S) == 0, str(process)
    for kind in ('looks after itself: stand', 'follows its legs again'):
        assert f'  the robot {kind}' in process.output
    recording = load_recording(tmp_path / 'run')
    assert recording.counts['/joint_states'] == len(recording.joints.time)


def test_in_lock_step_the_walk_waits_for_nodes_that_stand_still(
        processes: Processes, tmp_path: Path) -> None:
    process = walk(processes, tmp_path, 4.0, *LOCK_STEP)
    process.wait_for_output(r's +walking', RUN_S)
    for node in ('posture_control', 'canonical_oscillators'):
        pid = process.pid_of(node)
        os.kill(pid, signal.SIGSTOP)
        wait_until(lambda pid=pid: ') T ' in Path(f'/proc/{pid}/stat').read_text(), RUN_S)
        os.kill(pid, signal.SIGCONT)
    assert process.wait(RUN_S) == 0, str(process)
    assert_undisturbed(tmp_path / 'run')


FAILING = """
from dmp_cpg_ros.nodes.posture_control import PostureControl

on_tick = PostureControl.on_tick


def failing(self, stamp_ns, values):
    if stamp_ns > 1_000_000_000:
        raise OverflowError('of the test')
    on_tick(self, stamp_ns, values)


PostureControl.on_tick = failing
"""
"""What lets a node fail at every tick after the first second, in each Python that starts."""


DYING = """
import os, signal
from pathlib import Path
from dmp_cpg_ros.nodes.inhibition import InhibitionNode

on_tick, died = InhibitionNode.on_tick, Path(__file__).with_name('died')


def dying(self, stamp_ns, values):
    if stamp_ns > 1_000_000_000 and not died.exists():
        died.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    on_tick(self, stamp_ns, values)


InhibitionNode.on_tick = dying
"""
"""What lets the first process with the inhibition die within a tick that it ends for others."""


def test_in_lock_step_a_block_that_dies_in_its_tick_is_told_of_it_again(
        processes: Processes, tmp_path: Path) -> None:
    """The posture of the tick was sent, so that the robot had gone on; what the inhibition says of
    it, which acts in the next one, was not, and both have forgotten it.
    """
    site = tmp_path / 'site'
    site.mkdir()
    (site / 'sitecustomize.py').write_text(DYING, encoding='utf-8')
    paths = os.pathsep.join((str(site), processes.environment['PYTHONPATH']))
    process = processes.python(
        '-c', WATCHFUL, str(scenario(tmp_path, 4.0)), '--no-report', '--out',
        str(tmp_path / 'run'), *LOCK_STEP, '--processes', 'blocks', '--respawn', PYTHONPATH=paths)
    assert process.wait(RUN_S) == 0, str(process)
    assert 'supervision was ended by signal 9 (SIGKILL)' in process.output
    assert_undisturbed(tmp_path / 'run')


def test_in_lock_step_a_node_that_fails_in_its_tick_is_named_and_ends_the_run(
        tmp_path: Path) -> None:
    """Both ways at once, for most of their time they wait."""
    (tmp_path / 'site').mkdir()
    (tmp_path / 'site' / 'sitecustomize.py').write_text(FAILING, encoding='utf-8')
    brief, walks = scenario(tmp_path, 4.0), []
    with contextlib.ExitStack() as domains:
        for name, *options in (['composed', '--composed'],
                               ['blocks', '--processes', 'blocks', '--respawn']):
            own = Processes(domains.enter_context(reserved_domain()))
            domains.callback(own.end)
            paths = os.pathsep.join((str(tmp_path / 'site'), own.environment['PYTHONPATH']))
            walks.append(own.python(
                '-c', IMPATIENT, str(brief), '--no-report', '--out', str(tmp_path / name),
                *LOCK_STEP, *options, PYTHONPATH=paths))
        failed = (r'posture_control: it failed in its tick at 1\.0\d\d s: '
                  'OverflowError: of the test')
        for process in walks:
            assert process.wait(RUN_S) == 1, str(process)
            assert re.search(rf'the robot waits for .*{failed}', process.output), process
            assert re.search(r'inhibition: it waits in its tick at 1\.0\d\d s of posture_feedback',
                             process.output), process
            assert re.search(rf'walk: \w+ hung: {failed}', process.output), process
