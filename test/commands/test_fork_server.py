# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the fork server starts is as if it had been started alone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

import ros_processes
from ros_processes import Processes

from dmp_cpg_ros.commands import fork_server
from dmp_cpg_ros.commands.fork_server import Forked, ForkServer
from dmp_cpg_ros.commands.processes import ProcessGroup

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain
WAIT_S = ros_processes.DEADLINE_S
WALKING = '{name: walking, duration: 600.0, events: [{at: 0.1, command: {v_x: 0.3}}]}'
NODE = ('leg_transformation', '--ros-args', '-p', 'leg:=fl', '-p', 'autostart:=false')


@pytest.fixture(scope='module')
def server() -> Iterator[ForkServer]:
    with ForkServer() as started:
        yield started


@pytest.fixture
def node(server: ForkServer, ros_domain: int, tmp_path: Path) -> Iterator[Forked]:
    with (tmp_path / 'output').open('wb') as output:
        process = server.start(NODE, output.fileno(), output.fileno())
    yield process
    process.kill()
    process.wait(WAIT_S)


def command_of(process: Forked) -> list[str]:
    """What ``ps`` shows."""
    words = Path(f'/proc/{process.pid}/cmdline').read_text(encoding='utf-8')
    return words.rstrip('\0').split('\0')


def test_it_is_a_child_in_a_session_of_its_own_and_ps_shows_its_command(node: Forked) -> None:
    assert tuple(command_of(node)[-len(NODE):]) == NODE
    status = Path(f'/proc/{node.pid}/stat').read_text(encoding='utf-8').rpartition(')')[2].split()
    assert status[1:4] == [str(os.getpid()), str(node.pid), str(node.pid)]
    assert str(os.getpid()) in command_of(node)


def test_signals_reach_it_and_its_end_is_known(node: Forked) -> None:
    with pytest.raises(subprocess.TimeoutExpired):
        node.wait(0.0)
    assert node.poll() is None
    node.kill()
    assert node.wait(WAIT_S) == node.poll() == -signal.SIGKILL
    node.send_signal(signal.SIGINT)  # nobody else has its number yet; nothing is sent


def test_it_does_what_its_command_does_alone(server: ForkServer, tmp_path: Path) -> None:
    narrow = {**os.environ, 'COLUMNS': '50'}
    with (tmp_path / 'output').open('wb') as output:
        process = server.start(['certify', '--help'], output.fileno(), environment=narrow)
    alone = subprocess.run([sys.executable, '-m', 'dmp_cpg_ros', 'certify', '--help'],
                           env=narrow, capture_output=True, check=True)
    assert process.wait(WAIT_S) == 0
    assert (tmp_path / 'output').read_bytes() == alone.stdout != b''
    (tmp_path / 'bad.yaml').write_text('name: bad', encoding='utf-8')
    with (tmp_path / 'there').open('wb') as there:
        elsewhere = server.start(['walk', 'bad.yaml'], 1, there.fileno(), folder=str(tmp_path))
    assert elsewhere.wait(WAIT_S) == 2
    assert b'bad.yaml' in (tmp_path / 'there').read_bytes()
    assert b'needs duration' in (tmp_path / 'there').read_bytes()
    with (tmp_path / 'errors').open('wb') as errors:
        refused = server.start(['certify', '--no-such-option'], 1, errors.fileno())
    assert refused.wait(WAIT_S) == 2
    assert b'--no-such-option' in (tmp_path / 'errors').read_bytes()


def test_what_it_prepares_for_nodes_is_there() -> None:
    fork_server.load_type_supports()
    fork_server.read_own_files()


def test_who_ends_at_once_has_said_all_and_cleaned_up() -> None:
    program = ('import atexit, sys\n'
               'from dmp_cpg_ros.commands.fork_server import end\n'
               "atexit.register(print, 'cleaned up')\n"
               "print('said')\n")
    buffered = {**os.environ, 'PYTHONUNBUFFERED': ''}

    def run(last: str, output: int) -> subprocess.CompletedProcess[bytes]:
        return subprocess.run([sys.executable, '-c', program + last], env=buffered, check=False,
                              stdout=output, stderr=subprocess.PIPE)

    ended, alone = run('end(3)', subprocess.PIPE), run('sys.exit(3)', subprocess.PIPE)
    assert ended.returncode == alone.returncode == 3
    assert ended.stdout == alone.stdout == b'said\ncleaned up\n'
    with open('/dev/full', 'wb') as full:
        ended, alone = run('end(3)', full.fileno()), run('sys.exit(3)', full.fileno())
    assert ended.returncode == alone.returncode == 120
    assert b'No space left' in ended.stderr


def test_a_walk_that_was_forked_has_a_server_that_was(
        processes: Processes, tmp_path: Path) -> None:
    """Its environment is the one with which the program was started that has imported all."""
    def started_with(pid: int) -> bytes:
        return Path(f'/proc/{pid}/environ').read_bytes()

    process = processes.walk(WALKING, tmp_path / 'run', '--lock-step',
                             '--composed', '--respawn', '--rate', str(ros_processes.SHARED_HZ))
    process.wait_for_output('  walking\n', ros_processes.RUN_S)
    children = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text('utf-8').split()
    of_walk = [child for child in map(int, children) if started_with(child) == started_with(
        process.pid)]
    assert len(of_walk) == len(children) == 3  # the suite, the recorder and the server
    process.interrupt()
    assert process.wait(ros_processes.RUN_S) == 130, process


def test_a_server_that_has_ended_says_so() -> None:
    with ForkServer() as ended:
        pass
    with pytest.raises(OSError):
        ended.start(NODE)


def test_a_server_that_does_not_answer_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fork_server, 'ANSWERS_WITHIN_S', 0.2)
    with ForkServer() as stopped:
        os.kill(stopped._server.pid, signal.SIGSTOP)
        with pytest.raises(TimeoutError, match='does not answer'):
            stopped.start(NODE)


def test_the_end_of_a_process_is_read_from_its_log_once(
        server: ForkServer, tmp_path: Path) -> None:
    group = ProcessGroup(tmp_path, server)
    group.start('node', ('leg_transformation', '--ros-args', '-p', 'leg:=nose'))
    ros_processes.wait_until(group.ended, what=lambda: 'its end')
    ends = group.ended()
    assert ends['node'].startswith('node ended with status ') and 'nose' in ends['node']
    (tmp_path / 'node.log').write_text('another end')
    assert group.ended() == ends


class Interrupted:
    """A process that ends with a status once it is interrupted."""

    def __init__(self, status: int) -> None:
        self._status, self._ended = status, False

    def send_signal(self, number: int) -> None:
        self._ended = number == signal.SIGINT

    def poll(self) -> int | None:
        return self._status if self._ended else None

    def wait(self, timeout: float) -> int:
        return self._status


def test_who_does_not_end_well_when_told_to_is_named(server: ForkServer, tmp_path: Path) -> None:
    group = ProcessGroup(tmp_path, server)
    for name, status in (('well', 0), ('badly', 1)):
        group._processes[name] = Interrupted(status)
        (tmp_path / f'{name}.log').write_text('last words')
    assert group.stop(1.0) == []
    assert group.failed == ['badly ended with status 1: last words']
