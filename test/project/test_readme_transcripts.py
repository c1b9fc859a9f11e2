# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The console blocks of the documents, run in their order: what they show is what happens."""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from checkout import setup_constant
from ros_processes import (
    SHARED_HZ,
    NodeProcess,
    Processes,
    Ros,
    fork_server,
    reserved_domain,
)
from test_readme import TRANSCRIPTS, as_shown, files, transcript

from dmp_cpg_ros.nodes.framework.middleware import prepare_middleware
from dmp_cpg_ros.nodes.messages.inhibition import read_state_word
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.posture_feedback import read_body_mode
from dmp_cpg_ros.nodes.messages.values import stamp_ns

BIN = Path(sys.prefix) / 'bin'
EXECUTABLES = setup_constant('EXECUTABLES')
pytestmark = pytest.mark.skipif(
    not (BIN / 'robot_client').exists(), reason='the commands are not installed')

SETTLED_NS = 1_000_000_000
"""Time on the robot's clock without a change after which it has done what it was told [ns]."""

RATES_HZ = {'README.md': None, 'usage.md': 100.0}
"""Control rates of documents that show numbers which depend on it: the usual one, and the one
above that at which a change that is refused loses rows of the step, too. The walks of all others
are typed with the option of a lower one, and their parameter files have it: the machine has less
to do.
"""

PATIENCE_S = 240.0
"""How long a loaded machine may take [s]."""


class Reader:
    """A reader of a document: waits until the robot has done one thing before the next."""

    def __init__(self, domain: int, folder: Path, options: str = '') -> None:
        self.processes, self.ros, self.folder = Processes(domain), Ros(domain), folder
        self.options = options
        self.background: list[NodeProcess] = []
        self.states: dict[str, str] = {}
        self.now_ns = self.changed_ns = 0
        self.changes = 0
        self.listen('/clock', lambda message: setattr(self, 'now_ns', stamp_ns(message.clock)))
        self.listen('inhibition_state', lambda message: self.take(
            'gait', read_state_word(message)))
        self.listen('body_mode', lambda message: self.take('body', read_body_mode(message)))

    def listen(self, name: str, take: object) -> None:
        topic = interface(name)
        self.ros.node.create_subscription(topic.type, topic.name, take, topic.reader_qos)

    def take(self, what: str, state: str) -> None:
        if self.states.get(what) != state:
            self.states[what], self.changed_ns = state, self.now_ns
            self.changes += 1

    def settled(self) -> bool:
        return (self.states.get('gait') in ('at_rest', 'walking')
                and self.states.get('body') in ('standing', 'lying')
                and self.now_ns > self.changed_ns + SETTLED_NS)

    def type(self, command: str) -> str:
        """Run a command; returns what it prints, of one in the background nothing."""
        text = re.sub(r'^walk\b', f'walk{self.options}', command.partition('#')[0].strip())
        begun = self.changes
        name, *words = shlex.split(text.rstrip(' &'))
        forked = name in EXECUTABLES and self.options  # not of the README
        if forked and '|' in words:
            printed = self.piped(text)
        else:
            process = self.processes.executable(
                name, *words, folder=str(self.folder)) if forked else self.processes.start(
                'bash', '-c', f'cd {self.folder}; PATH={BIN}:$PATH; exec {text.rstrip(" &")}')
            if text.endswith('&'):
                self.background.append(process)
                self.ros.spin_until(lambda: self.changes > begun and self.settled(), PATIENCE_S,
                                    what=lambda: f'an effect of {process}')
                return ''
            self.ros.spin_until(lambda: not process.running, PATIENCE_S, what=lambda: str(process))
            process.wait()
            printed = process.output
        if self.background:
            self.changed_ns = self.now_ns
            self.ros.spin_until(self.settled, PATIENCE_S, what=lambda: str(self.states))
        return printed

    def piped(self, text: str) -> str:
        """What a command prints through a pipe, and to its side; it is forked as others are."""
        command, _, filters = text.partition('|')
        pipe, aside = self.folder / 'pipe', self.folder / 'aside'
        pipe.unlink(missing_ok=True)
        os.mkfifo(pipe)
        process = self.processes.start('bash', '-c', f'< {pipe} {filters}')
        with pipe.open('wb') as through, aside.open('wb') as errors:
            forked = fork_server().start(
                shlex.split(command), through.fileno(), errors.fileno(),
                environment=self.processes.environment, folder=str(self.folder))
        forked.wait(PATIENCE_S)
        process.wait(PATIENCE_S)
        return aside.read_text(encoding='utf-8') + process.output

    def end(self) -> None:
        self.processes.end()
        self.ros.end()


@pytest.fixture
def reader(document: Path, tmp_path: Path) -> Iterator[Reader]:
    with reserved_domain() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_DOMAIN_ID', str(domain))
        prepare_middleware()
        rate = RATES_HZ.get(document.name, SHARED_HZ)
        started = Reader(domain, tmp_path, f' --rate {rate}' if rate else '')
        try:
            yield started
        finally:
            started.end()


@pytest.mark.parametrize('document', TRANSCRIPTS, ids=lambda document: document.name)
def test_what_the_transcripts_show_is_what_happens(reader: Reader, document: Path) -> None:
    for name, content in files(document).items():
        rate = RATES_HZ.get(document.name, SHARED_HZ)
        slower = f'\\g<0>\n    control_rate: {rate}' if rate else '\\g<0>'
        (reader.folder / name).write_text(
            re.sub('ros__parameters:$', slower, content, flags=re.MULTILINE), encoding='utf-8')
    happened = [(command, shown, reader.type(command)) for command, shown in transcript(document)]
    assert any(shown for _, shown, _ in happened)
    wrong = [f'$ {command}\n{printed}--- {document.name} shows ---\n{shown}'
             for command, shown, printed in happened if not as_shown(printed, shown)]
    assert not wrong, '\n'.join(wrong)
