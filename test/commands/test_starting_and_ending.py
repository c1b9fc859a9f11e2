# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A suite starts alone in its domain, in a namespace or not, and ends as a whole."""

from __future__ import annotations

import errno
import fcntl
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import termios
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

pytest.importorskip('rclpy')

import rclpy
import ros_processes
from ros_processes import RUN_S, SHARED_HZ, NodeProcess, Processes, Ros, wait_until
from std_srvs.srv import Trigger

from dmp_cpg_ros import configuration
from dmp_cpg_ros.analysis.bag import payload_digests
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.commands import analyze
from dmp_cpg_ros.commands import walk as walk_command
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments
from dmp_cpg_ros.commands.suite_domain import alone_in_domain
from dmp_cpg_ros.configuration import config_folders, find_config
from dmp_cpg_ros.core.errors import MissingFileError
from dmp_cpg_ros.nodes.framework.claims import AlreadyRunningError, claim
from dmp_cpg_ros.studies.process_usage import children
from dmp_cpg_ros.suite_table import WALKING_NODES

processes, ros, ros_domain = ros_processes.processes, ros_processes.ros, ros_processes.ros_domain

SCENARIO = """\
name: brief
duration: {duration}
events:
  - {{at: 0.1, inhibit: false}}
  - {{at: 0.1, command: {{v_x: 0.4}}}}
"""


def scenario(folder: Path, duration_s: float) -> str:
    path = folder / f'brief_{duration_s:g}.yaml'
    path.write_text(SCENARIO.format(duration=duration_s), encoding='utf-8')
    return str(path)


def walk(processes: Processes, *arguments: str) -> NodeProcess:
    return processes.executable('walk', *arguments)


def alive(pid: int) -> bool:
    """Whether a process runs; one that nobody has waited for does not."""
    try:
        status = Path(f'/proc/{pid}/stat').read_text(encoding='utf-8')
    except OSError:
        return False
    return status.rpartition(')')[2].split()[0] not in 'ZX'


# Starting ----------------------------------------------------------------------------------------


def test_a_second_suite_in_the_domain_is_refused_and_the_first_walks_on(
        processes: Processes, tmp_path: Path) -> None:
    brief = scenario(tmp_path, 0.5)
    lasting = (scenario(tmp_path, 60.0), '--composed', '--no-report', '--rate', str(SHARED_HZ))
    first = walk(processes, *lasting, '--out', str(tmp_path / 'first'))
    second = walk(processes, *lasting, '--out', str(tmp_path / 'second'))
    wait_until(lambda: not (first.running and second.running), RUN_S)
    refused, walking = (second, first) if first.running else (first, second)
    assert refused.wait() == 2
    domain = processes.domain
    assert f'already running in ROS domain {domain}' in refused.output
    assert 'ROS_DOMAIN_ID' in refused.output and 'Traceback' not in refused.output
    walking.wait_for_output('walking', RUN_S)
    late = walk(processes, brief, '--out', str(tmp_path / 'late'))
    assert late.wait(RUN_S) == 2 and not (tmp_path / 'late').exists()
    beside = walk(processes, brief, '--composed', '--lock-step', '--no-report', '--namespace',
                  'robot2', '--out', str(tmp_path / 'beside'))
    assert beside.wait(RUN_S) == 0, str(beside)
    assert walking.running
    walking.interrupt()
    assert walking.wait(RUN_S) == 130, str(walking)


def test_nodes_left_over_are_named_instead_of_measured(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    processes.node('inhibition')
    ros.spin_until(lambda: 'inhibition' in ros.node.get_node_names())
    process = walk(processes, scenario(tmp_path, 0.5), '--out', str(tmp_path / 'run'))
    assert process.wait(RUN_S) == 2
    assert f'ROS domain {processes.domain} (nodes /inhibition)' in process.output


def test_nodes_that_only_the_graph_shows_are_found(ros: Ros) -> None:
    # As of another machine: it has claimed nothing here.
    foreign = rclpy.node.Node('posture_control', context=ros.context, namespace='/robot1')
    with (pytest.raises(AlreadyRunningError, match=r'nodes /robot1/posture_control'),
          alone_in_domain('/robot1')):
        pass
    with alone_in_domain(''):
        pass
    foreign.destroy_node()


def test_a_node_that_runs_already_is_not_started_again(processes: Processes, ros: Ros) -> None:
    first = processes.node('reference_filter')
    ros.spin_until(lambda: 'reference_filter' in ros.node.get_node_names())
    second = processes.node('reference_filter')
    assert second.wait() == 2
    assert f'/reference_filter, process {first.pid}' in second.output
    assert processes.node('reference_filter', '-r', '__ns:=/robot1', autostart=False).running
    first.kill()
    third = processes.node('reference_filter')
    ros.spin_until(lambda: ros.node.get_node_names().count('reference_filter') >= 1)
    assert third.running


def test_a_walk_reads_the_sections_of_its_namespace(processes: Processes, tmp_path: Path) -> None:
    """It is refused before a node starts: for a section, or because others have the domain."""
    path = tmp_path / 'parameters.yaml'
    path.write_text(
        find_config('suite.yaml').read_text(encoding='utf-8')
        + '\n/robot1/canonical_oscillators: {ros__parameters: {gait: gallop}}\n', encoding='utf-8')
    given = (scenario(tmp_path, 0.5), '--parameters', str(path), '--out', str(tmp_path / 'run'))
    inside = walk(processes, *given, '--namespace', '/robot1')
    assert inside.wait() == 2, str(inside)
    assert "no gait 'gallop'" in inside.output, inside
    with claim('/inhibition', processes.domain):
        outside = walk(processes, *given)
        assert outside.wait() == 2, str(outside)
    assert ("section '/robot1/canonical_oscillators' means no node in namespace '/'"
            in outside.output), outside
    assert 'nodes /inhibition' in outside.output, outside


def test_a_walk_in_a_namespace_is_the_walk_without(processes: Processes, tmp_path: Path) -> None:
    brief, digests = scenario(tmp_path, 0.6), []
    lock_step, composed = ('--lock-step', '--no-report'), ('--composed',)
    inside = ('--ros-args', '-r', '__ns:=/robot1', '-p', 'seed:=0')
    for number, (options, given) in enumerate([
            (lock_step + composed, ()), (lock_step + composed, inside), (lock_step, inside),
            ((*composed, '--no-report'), inside)]):
        out = tmp_path / str(number)
        process = walk(processes, brief, '--out', str(out), '--rate', str(SHARED_HZ), *options,
                       *given)
        assert process.wait(RUN_S) == 0, str(process)
        assert 'deprecated' not in process.output
        recording = load_recording(out / 'bag')
        assert len(recording.joints.time) >= 0.6 * SHARED_HZ - 1
        assert recording.counts['/robot1/clock' if given else '/clock'] > 1
        assert (out / 'metrics.json').is_file()
        digests += [payload_digests(out / 'bag')] if '--lock-step' in options else []
    assert digests[0] == digests[1] == digests[2] and len(digests[0]) == 6


# Ending ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(('number', 'composed'), [
    (signal.SIGTERM, ()), (signal.SIGKILL, ()), *((number, ('--composed',)) for number in (
        signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM, signal.SIGKILL))])
def test_whatever_ends_walk_ends_its_nodes_and_closes_the_bag(
        processes: Processes, tmp_path: Path, number: int, composed: tuple[str, ...]) -> None:
    process = walk(processes, scenario(tmp_path, 600.0), '--lock-step', '--out',
                   str(tmp_path / 'run'), '--no-report', '--rate', str(SHARED_HZ), *composed)
    process.wait_for_output('  walking\n', RUN_S)
    nodes = children(process.pid)
    assert len(nodes) == (3 if composed else 13)  # with what judges for those that judge changes
    process.signal(number)
    killed = number == signal.SIGKILL
    assert process.wait(RUN_S) == (-number if killed else 128 + number), str(process)
    wait_until(lambda: not any(map(alive, nodes)), RUN_S,
               what=lambda: f'the end of {[pid for pid in nodes if alive(pid)]}')
    assert (tmp_path / 'run' / 'bag' / 'metadata.yaml').is_file()
    assert len(load_recording(tmp_path / 'run' / 'bag').joints.time) > 0


def test_nodes_of_one_process_answer_and_end_while_the_gate_is_open_for_long(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    process = walk(processes, 'stand_by', '--lock-step', '--composed', '--no-report', '--out',
                   str(tmp_path / 'run'), '--rate', str(SHARED_HZ))
    process.wait_for_output('  at rest\n', RUN_S)
    assert all(ros.call(Trigger, f'/{name}/ready', Trigger.Request()).success
               for name in WALKING_NODES for _ in range(2))
    process.signal(signal.SIGTERM)
    assert process.wait(RUN_S) == 128 + signal.SIGTERM, str(process)
    assert 'had to kill' not in process.output
    assert load_recording(tmp_path / 'run' / 'bag').joints.time[-1] < 250.0


def test_a_walk_goes_on_without_its_recorder_and_says_so_at_once(
        processes: Processes, tmp_path: Path) -> None:
    """A full disk ends the recorder as a signal does."""
    process = walk(processes, scenario(tmp_path, 4.0), '--lock-step', '--out',
                   str(tmp_path / 'run'), '--no-report', '--composed', '--rate', str(SHARED_HZ))
    process.wait_for_output('  walking\n', RUN_S)
    (recorder,) = (pid for pid in children(process.pid) if 'bag_recorder' in Path(
        f'/proc/{pid}/cmdline').read_text(encoding='utf-8'))
    os.kill(recorder, signal.SIGKILL)
    process.wait_for_output(' s  bag_recorder was ended by signal 9.*; the walk goes on', RUN_S)
    assert process.wait(RUN_S) == 1, str(process)
    assert 'the rest of the walk was not recorded' in process.output
    assert f'; see {tmp_path}' not in process.output  # the scenario was played to its end


def test_a_walk_says_at_once_that_nobody_shows_it_any_more(
        processes: Processes, tmp_path: Path) -> None:
    process = walk(processes, scenario(tmp_path, 4.0), '--lock-step', '--visualization', '--view',
                   '--out', str(tmp_path / 'run'), '--no-report', '--composed', '--rate',
                   str(SHARED_HZ))
    process.wait_for_output('  walking\n', RUN_S)
    for name in ('live_view', 'visualization'):
        os.kill(process.pid_of(name), signal.SIGKILL)
        process.wait_for_output(
            rf' s  {name} was ended by signal 9 .*; the walk goes on without it', RUN_S)
    assert process.wait(RUN_S) == 0, str(process)


def test_a_terminal_that_is_closed_ends_walk_in_order(
        processes: Processes, tmp_path: Path) -> None:
    """What walk has to say then goes nowhere, and is no reason to end otherwise."""
    end, inside = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', 'dmp_cpg_ros', 'walk', scenario(tmp_path, 600.0), '--lock-step',
         '--composed', '--no-report', '--out', str(tmp_path / 'run')],
        stdin=inside, stdout=inside, stderr=inside, env=processes.environment,
        start_new_session=True, preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
    os.close(inside)
    said: list[bytes] = []

    def read() -> None:
        if select.select([end], [], [], 0.02)[0]:
            said.append(os.read(end, 4096))

    try:
        wait_until(lambda: b'  walking\r\n' in b''.join(said), RUN_S, between=read,
                   what=lambda: repr(said))
        nodes = children(process.pid)
        assert len(nodes) == 3  # the suite, what judges for it, the recorder
        os.close(end)
        assert process.wait(RUN_S) == 128 + signal.SIGHUP
        wait_until(lambda: not any(map(alive, nodes)), RUN_S)
    finally:
        process.kill()
        process.wait()
    assert (tmp_path / 'run' / 'bag' / 'metadata.yaml').is_file()


def test_who_reads_no_further_ends_walk_in_order(processes: Processes, tmp_path: Path) -> None:
    """As ``walk | head``, whose nodes get no exception."""
    with subprocess.Popen(
            [sys.executable, '-m', 'dmp_cpg_ros', 'walk', scenario(tmp_path, 600.0), '--lock-step',
             '--composed', '--no-report', '--out', str(tmp_path / 'run')], text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=processes.environment) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline().startswith('brief: ')
        assert process.stdout.readline().startswith('certificate: ')
        process.stdout.close()
        assert process.wait(RUN_S) == 128 + signal.SIGHUP
        assert re.sub('reading: .*\n', '', process.stderr.read()).splitlines() == [
            'walk: interrupted by SIGHUP; the recording up to here is complete',
            'walk: making the metrics, which a second Ctrl-C skips']
    assert (tmp_path / 'run' / 'metrics.json').is_file()


@pytest.mark.parametrize('name', ['walk', 'mujoco_robot'])
def test_ctrl_c_while_modules_are_imported_ends_quietly(processes: Processes, name: str) -> None:
    # The hook interrupts at the very moment at which a module of the command is imported, and
    # makes another error of it, as compiled modules do.
    program = (
        'import os, signal, sys\n'
        'class Interrupt:\n'
        '    def find_spec(self, name, path=None, target=None):\n'
        "        if name == 'numpy':\n"
        '            try:\n'
        '                os.kill(os.getpid(), signal.SIGINT)\n'
        '            except KeyboardInterrupt:\n'
        "                raise ImportError('initialization failed')\n"
        'sys.meta_path.insert(0, Interrupt())\n'
        # Whoever starts tests in the background of a shell may have them ignore Ctrl-C.
        'signal.signal(signal.SIGINT, signal.default_int_handler)\n'
        f"sys.argv = ['{name}']\n"
        f'from dmp_cpg_ros.__main__ import {name}\n'
        f'sys.exit({name}())\n')
    process = processes.python('-c', program)
    assert process.wait() == 130
    assert process.output == ''


LATE_INTERRUPT = """
import os, signal, sys

signal.signal(signal.SIGINT, signal.default_int_handler)


class Late:
    def __del__(self, kill=os.kill, pid=os.getpid(), number=signal.SIGINT):
        if pid == os.getpid():  # and not what it forks
            kill(pid, number)


sys.argv = ['walk', '--help']
from dmp_cpg_ros.__main__ import walk
late = Late()
try:
    walk()
finally:
    print('ending', flush=True)
"""
"""Interrupts itself when Python deletes its objects, after it has let go of all signals."""


def test_ctrl_c_at_the_very_end_does_not_change_the_exit_status(processes: Processes) -> None:
    process = processes.python('-c', LATE_INTERRUPT)
    assert process.wait() == 0, str(process)
    assert process.output.endswith('ending\n')


# --ros-args --------------------------------------------------------------------------------------


COMMANDS = ('analyze', 'learn', 'inspect_robot', 'study_stops', 'benchmark_walking',
            'study_recovery')
NEEDED = {'analyze': ['bag'], 'learn': ['bag', '--out', 'x'], 'inspect_robot': ['nosuch.xml']}


@pytest.mark.parametrize('name', COMMANDS)
def test_commands_without_parameters_refuse_them_and_say_what_is_valid(
        processes: Processes, name: str) -> None:
    process = processes.executable(name, *NEEDED.get(name, []), '--ros-args', '-r', '__node:=x',
                                   '-p', 'gait:=trot')
    assert process.wait() == 2
    assert "no parameter 'gait'" in process.output and '__ns' in process.output


@pytest.mark.parametrize('name', ['analyze', 'inspect_robot'])
def test_commands_take_what_launch_adds(
        processes: Processes, tmp_path: Path, name: str) -> None:
    process = processes.executable(name, str(tmp_path / 'nosuch'), '--ros-args', '-r',
                                   '__node:=x', '-r', '__ns:=/a', '--log-level', 'info')
    assert process.wait() == 2
    assert 'nosuch' in process.output and 'usage' not in process.output


@pytest.mark.parametrize(('arguments', 'text'), [
    (['--ros-args', '-p', 'gaitt:=trot'], "no parameter 'gaitt'"),
    (['--ros-args', '-p', 'gait'], 'must be NAME:=VALUE'),
    (['--ros-args', '-p'], 'needs a value'),
    (['--ros-args', '--parms-file', 'x'], '--params-file'),
    (['--ros-args', '--params-file', 'nosuch.yaml'], 'nosuch.yaml'),
    (['--ros-args', '--log-level', 'loud'], 'debug, info'),
    (['--ros-args', '-r', '__ns:=/a b'], 'is no namespace'),
    (['--namespace', '1st'], 'is no namespace'),
    (['--namespace', 'a__b'], 'is no namespace'),
    (['--namespace', 'a' * 161], 'is no namespace'),
    (['startstop'], 'did you mean scenarios/start_stop?'),
])
def test_walk_refuses_what_is_wrong_and_says_what_is_valid(
        processes: Processes, arguments: list[str], text: str) -> None:
    process = walk(processes, *arguments)
    assert process.wait() == 2, str(process)
    assert text in process.output, process
    assert 'Traceback' not in process.output


def test_walk_names_the_file_that_is_wrong(processes: Processes, tmp_path: Path) -> None:
    gallop, wrong = tmp_path / 'gallop.yaml', tmp_path / 'wrong.yaml'
    gallop.write_text(SCENARIO.format(duration=1.0) + '  - {at: 0.2, gait: gallop}\n', 'utf-8')
    wrong.write_text(find_config('suite.yaml').read_text('utf-8').replace(
        'rho: 8.0', 'rho: -8.0'), 'utf-8')
    for arguments, text in (
            ([str(gallop)], f"'{gallop}, event at 0.2 s': there is no gait 'gallop'; valid are"),
            (['--parameters', str(wrong)], f"walk: '{wrong}', /reference_filter: parameter 'rho'"),
            (['--set', 'rho:=-8.0'], "walk: parameter 'rho' = -8.0"),
            ([''], "'' is no name of a file")):
        process = walk(processes, *arguments)
        assert process.wait() == 2, str(process)
        assert text in process.output, process


def test_help_of_walk_lists_the_scenarios(processes: Processes) -> None:
    process = processes.python('-m', 'dmp_cpg_ros', 'walk', '--help')
    assert process.wait() == 0
    assert 'start_stop' in process.output and 'votes' in process.output


@pytest.mark.parametrize(('words', 'played', 'seconds'), [
    ('', 'start_stop', None), ('--view', 'stand_by', 3600.0),
    ('--view --lock-step', 'start_stop', None),
    ('stand_by --view --lock-step', 'stand_by', 300.0)])
def test_what_is_played_without_a_scenario(words: str, played: str, seconds: float | None) -> None:
    options = walk_command._parser().parse_args(words.split())
    scenario = walk_command._planned(options, RosArguments()).scenario
    assert scenario.name == played
    assert scenario.duration_s == (seconds or walk_command.load_scenario(played).duration_s)


@pytest.mark.parametrize(('words', 'played'), [
    ('mini_quadruped', 'start_stop'), ('mini_quadruped --view', 'stand_by'),
    ('amble_60', 'amble_60')])
def test_a_robot_in_the_place_of_a_scenario_is_the_one_that_walks(
        words: str, played: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / 'robots'
    folder.mkdir()
    for name in ('mini_quadruped', 'amble_60'):  # a scenario of the same name is the scenario
        shutil.copy(find_config('robots/mini_quadruped'), folder / f'{name}.yaml')
    folders = [tmp_path, *config_folders()]
    for module in (configuration, walk_command):
        monkeypatch.setattr(module, 'config_folders', lambda: folders)
    plan = walk_command._planned(
        walk_command._parser().parse_args(words.split()), RosArguments())
    assert plan.scenario.name == played
    given = plan.overrides.get('robot')
    assert given == (None if played == words else str(folder / 'mini_quadruped.yaml'))


def test_two_robots_cannot_walk_at_once() -> None:
    options = walk_command._parser().parse_args(['mini_quadruped', '--robot', 'go2'])
    with pytest.raises(MissingFileError, match='mini_quadruped is a robot: walk --robot'):
        walk_command._planned(options, RosArguments())


def test_a_report_says_how_far_it_is_and_a_full_disk_ends_it_in_a_line_before_what_is_said_last(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    def run(plan: Any, folder: Path, server: Any) -> tuple[int, list[str]]:
        (folder / 'bag').mkdir()
        return walk_command.OK, ['an event was refused']

    def full(*_: Any, tell: Callable[[str], None], **__: Any) -> NoReturn:
        tell('figures')
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(walk_command, '_run', run)
    monkeypatch.setattr(analyze, 'analyze_run', full)
    monkeypatch.setattr(Progress, 'SILENT_S', 0.0)
    options = walk_command._parser().parse_args(['--out', str(tmp_path / 'run')])
    plan = walk_command._planned(options, RosArguments())
    assert walk_command._walk(plan, None) == walk_command.FAILED
    told = capsys.readouterr().err
    assert told.startswith('figures\n')
    assert 'No space left on device' in told and 'walk: an event was refused' in told
