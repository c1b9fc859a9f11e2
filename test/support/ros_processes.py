# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for tests with real nodes: a domain of their own, processes that end, waits with
deadlines.

Import ``ros_domain``, ``processes`` or ``ros`` into a test module to use them.
"""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from math import inf
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from fork_server_of_tests import TestServer
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from dmp_cpg_ros import __file__ as package
from dmp_cpg_ros.commands.fork_server import Forked
from dmp_cpg_ros.commands.fork_server import __file__ as fork_server_file
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.framework.middleware import prepare_middleware
from dmp_cpg_ros.studies.process_usage import pid_of

TESTS, PACKAGES = (str(Path(file).resolve().parents[1]) for file in (__file__, package))
"""Where processes run, and where they find the package: the same that the tests import."""

DEADLINE_S = 30.0
"""How long a condition may take before a test fails; a loaded machine is no failure."""

RUN_S = 240.0
"""How long a run may take on a loaded machine before a test gives up [s]."""

MARK = 'DMP_CPG_ROS_TEST'
"""Variable by which the processes of a test, and theirs, are known."""

FORK_SERVER = fork_server_file.encode()
"""What forks executables; the process for which it does so is the next word of their command."""

SHARED_HZ = 50.0
"""Control rate of a suite beside which tests ask, command and look on: certified too, and a tick
costs what it costs at any rate.
"""

BY_ITSELF = 'looking after itself'
"""Part of the refusal of a robot that has come to a stand by itself, as it does for a moment where
targets are late on a loaded machine.
"""

ASK_AGAIN_S = 3.0
"""Time after which a request that may be repeated is repeated."""


class NodeProcess:
    """A process whose output is kept.

    Parameters
    ----------
    command : sequence of str
        What to run.
    environment : mapping of str to str
        Its environment.
    forked : bool
        Whether it is an executable of the package that the fork server starts.
    folder : str
        Where the fork server starts it.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str], *,
                 forked: bool, folder: str = '') -> None:
        self.command = list(command)
        read, write = os.pipe()
        if forked:
            self._process: subprocess.Popen[bytes] | Forked = fork_server().start(
                command, write, write, environment=environment, folder=folder)
        else:
            self._process = subprocess.Popen(command, env=environment, stdout=write,
                                             stderr=write, cwd=TESTS, start_new_session=True)
        os.close(write)
        self._lines: list[str] = []
        self._reader = threading.Thread(target=self._read, args=(read,), daemon=True)
        self._reader.start()

    @property
    def output(self) -> str:
        """What it has written so far."""
        return ''.join(self._lines)

    @property
    def pid(self) -> int:
        return self._process.pid

    def pid_of(self, node: str) -> int:
        """Process of a node of this walk, which it may share with others."""
        return pid_of(self.pid, [node]) or pytest.fail(f'{node} does not run:\n{self.output}')

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def wait_for_output(self, pattern: str, deadline_s: float = DEADLINE_S) -> re.Match[str]:
        """Wait until the output matches; fails when the process ends before."""
        found: list[re.Match[str]] = []

        def matches() -> bool:
            running = self.running
            if not running:
                self._reader.join(DEADLINE_S)
            match = re.search(pattern, self.output)
            found.extend([match] if match else [])
            assert match or running, f'{self} ended before it wrote {pattern!r}'
            return bool(match)

        wait_until(matches, deadline_s, what=lambda: f'{pattern!r} in the output of {self}')
        return found[0]

    def signal(self, number: int) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def interrupt(self) -> None:
        """Press Ctrl-C."""
        self.signal(signal.SIGINT)

    def kill(self) -> None:
        """Kill it; it cannot notice."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait(DEADLINE_S)
        self._reader.join(DEADLINE_S)

    def wait(self, deadline_s: float = DEADLINE_S) -> int:
        """Wait for its end; returns its exit status."""
        try:
            status = self._process.wait(deadline_s)
        except subprocess.TimeoutExpired:
            pytest.fail(f'{self} did not end within {deadline_s} s')
        self._reader.join(DEADLINE_S)
        return status

    def _read(self, descriptor: int) -> None:
        with open(descriptor, encoding='utf-8', errors='replace') as stream:
            self._lines.extend(iter(stream.readline, ''))

    def __repr__(self) -> str:
        return f"{' '.join(self.command)}\n--- output ---\n{self.output}--------------\n"


@cache
def fork_server() -> TestServer:
    """Fork server of this process, from which executables start in a tenth of the time."""
    server = TestServer(TESTS)
    atexit.register(server.close)
    return server


class Processes:
    """Starts processes in one domain and ends them all.

    Attributes
    ----------
    domain : int
        Their ROS domain.
    """

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self._started: list[NodeProcess] = []
        self._mark = uuid.uuid4().hex

    @property
    def environment(self) -> dict[str, str]:
        """Environment that keeps nodes in the domain and on this machine."""
        paths = [PACKAGES, *filter(None, [os.environ.get('PYTHONPATH')])]
        return {**os.environ, 'ROS_DOMAIN_ID': str(self.domain), 'PYTHONUNBUFFERED': '1',
                'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'PYTHONPATH': os.pathsep.join(paths),
                MARK: self._mark}

    def start(self, *command: str, forked: bool = False, folder: str = '',
              **environment: str) -> NodeProcess:
        """Start any command; an executable of the package in some folder."""
        process = NodeProcess(command, {**self.environment, **environment}, forked=forked,
                              folder=folder)
        self._started.append(process)
        return process

    def walk(self, scenario: Path | str, out: Path, *options: str) -> NodeProcess:
        """Start a walk without a report; a scenario that is a text is written beside ``out``."""
        if isinstance(scenario, str):
            text, scenario = scenario, out.with_suffix('.yaml')
            scenario.write_text(text, encoding='utf-8')
        return self.executable('walk', str(scenario), '--no-report', '--out', str(out), *options)

    def walked(self, scenario: Path | str, out: Path, *options: str) -> Path:
        """Walk to the end; returns ``out``."""
        process = self.walk(scenario, out, *options)
        assert process.wait(RUN_S) == 0, str(process)
        return out

    def python(self, *arguments: str, **environment: str) -> NodeProcess:
        """Start this Python with arguments."""
        return self.start(sys.executable, *arguments, **environment)

    def executable(self, *command: str, folder: str = '') -> NodeProcess:
        """Start an executable of the package as the fork server does it."""
        return self.start(*command, forked=True, folder=folder)

    def node(self, kind: str, *ros_arguments: str, **parameters: Any) -> NodeProcess:
        """Start a node of the suite, with parameters as keywords."""
        pairs = [f'{name}:={_yaml(value)}' for name, value in parameters.items()]
        given = [item for pair in pairs for item in ('-p', pair)]
        return self.executable(kind, '--ros-args', *ros_arguments, *given)

    def end(self) -> None:
        """Kill what still runs, and what that has started in sessions of its own.

        A node whose ``walk`` was killed takes a moment to end, and has its name until then.
        """
        for process in self._started:
            process.kill()
        if self._started:
            wait_until(lambda: not self._kill_the_marked(), what=lambda: 'the end of them all')

    def _kill_the_marked(self) -> bool:
        """Kill every process with this environment, or forked for one that was started; whether
        there was one.
        """
        mark, found = f'{MARK}={self._mark}'.encode(), False
        parents = {str(process.pid).encode() for process in self._started}
        for folder in Path('/proc').glob('[0-9]*'):
            # Not ours, or gone; what has ended but is not yet waited for has an empty environment.
            with contextlib.suppress(OSError):
                words = (folder / 'cmdline').read_bytes().split(b'\0')
                forked = words[1:2] == [FORK_SERVER] and parents & set(words[2:3])
                if forked or mark in (folder / 'environ').read_bytes().split(b'\0'):
                    os.kill(int(folder.name), signal.SIGKILL)
                    found = True
        return found


class Ros:
    """A node of the test itself, in the test's domain.

    Attributes
    ----------
    node : Node
        For publishers, subscriptions, clients.
    context : Context
        For nodes under test that run in this process.
    nodes : list of Node
        Those of them that end with the test; whoever is left to the garbage collector stays in
        the graph of the tests that follow.
    """

    def __init__(self, domain: int) -> None:
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain, args=[])
        self.executor = SingleThreadedExecutor(context=self.context)
        self.node = Node('test', context=self.context)
        self.executor.add_node(self.node)
        self.nodes = [self.node]

    def spin_until(self, condition: Callable[[], bool], deadline_s: float = DEADLINE_S,
                   what: Callable[[], str] | None = None) -> None:
        """Run callbacks until a condition holds; fails at the deadline."""
        wait_until(condition, deadline_s, what=what,
                   between=lambda: self.executor.spin_once(timeout_sec=0.02))

    def call(self, service_type: Any, name: str, request: Any,
             deadline_s: float = DEADLINE_S) -> Any:
        """Call a service and return the response.

        A server drops the response when it has not yet matched the client's reply reader; only
        the client's own side is known here. So a request is repeated until it is answered. A
        change of state must not be: before it, the node's state is asked for. Discovery tells a
        participant's readers in the order in which they were made, so that an answer to a client
        that was made later proves that the earlier one is heard as well.
        """
        client = self.node.create_client(service_type, name)
        self.spin_until(client.service_is_ready, deadline_s, what=lambda: f'service {name}')
        futures: list[Future] = []
        if service_type is ChangeState:
            self.call(GetState, name.replace('change_state', 'get_state'), GetState.Request())
            futures.append(client.call_async(request))
        asked = -inf

        def answered() -> bool:
            nonlocal asked
            if service_type is not ChangeState and time.monotonic() > asked + ASK_AGAIN_S:
                asked = time.monotonic()
                futures.append(client.call_async(request))
            return any(future.done() for future in futures)

        self.spin_until(answered, deadline_s, what=lambda: f'answer of {name}')
        self.node.destroy_client(client)
        return next(future for future in futures if future.done()).result()

    def granted(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service until it agrees, which a robot that looks after itself does later."""
        answers: list[Any] = []

        def agreed() -> bool:
            answers.append(self.call(service_type, name, request))
            assert answers[-1].success or BY_ITSELF in answers[-1].message, answers[-1].message
            return bool(answers[-1].success)

        self.spin_until(agreed, RUN_S, what=lambda: f'{name}: {answers[-1].message}')
        return answers[-1]

    def collect(self, message_type: Any, topic: str, qos: Any = 10, *,
                raw: bool = False) -> list[Any]:
        """Subscribe; returns the list into which messages go."""
        messages: list[Any] = []
        self.node.create_subscription(message_type, topic, messages.append, qos, raw=raw)
        return messages

    def end(self) -> None:
        """Destroy the nodes and end the context."""
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.context.try_shutdown()


def wait_until(condition: Callable[[], bool], deadline_s: float = DEADLINE_S, *,
               between: Callable[[], Any] = lambda: time.sleep(0.01),
               what: Callable[[], str] | None = None) -> None:
    """Wait until a condition holds; fails at the deadline and says what did not come."""
    end = time.monotonic() + deadline_s
    while not condition():
        if time.monotonic() > end:
            pytest.fail(f'waited {deadline_s} s in vain for {what() if what else condition}')
        between()


def _yaml(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_yaml(entry) for entry in value)}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


@contextlib.contextmanager
def reserved_domain() -> Iterator[int]:
    """Reserve a ROS domain among 1 to 100 that no other test on this machine uses."""
    folder = Path(tempfile.gettempdir()) / f'dmp_cpg_ros_domains_{os.getuid()}'
    folder.mkdir(exist_ok=True)
    for offset in range(100):
        domain = 1 + (os.getpid() + offset) % 100
        with (folder / str(domain)).open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield domain
            return
    pytest.fail('all hundred ROS domains of the tests are in use')


@contextlib.contextmanager
def own_domain() -> Iterator[int]:
    """Reserve a domain; the environment of this process names it too."""
    with reserved_domain() as domain, pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_DOMAIN_ID', str(domain))
        patch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        prepare_middleware()
        yield domain


@pytest.fixture
def ros_domain() -> Iterator[int]:
    """Domain of one test."""
    with own_domain() as domain:
        yield domain


@pytest.fixture(scope='module')
def shared_domain() -> Iterator[int]:
    """Domain of all tests of a module."""
    with own_domain() as domain:
        yield domain


@contextlib.contextmanager
def composed_suite(domain: int, folder: Path, *ros_arguments: str, **parameters: Any
                   ) -> Iterator[Processes]:
    """A suite in one process, with parameters of all its nodes."""
    file, started = folder / 'parameters.yaml', Processes(domain)
    file.write_text(yaml.safe_dump({'/**': {'ros__parameters': {'seed': 0, **parameters}}, **{
        f'/**/leg_transformation_{leg}': {'ros__parameters': {'leg': leg}} for leg in LEGS}}))
    try:
        started.executable('composed_suite', '--ros-args', '--params-file', str(file),
                           *ros_arguments)
        yield started
    finally:
        started.end()


@pytest.fixture(scope='module')
def shared_suite(shared_domain: int, tmp_path_factory: pytest.TempPathFactory
                 ) -> Iterator[Processes]:
    """A suite in one process that all tests of a module use."""
    with composed_suite(shared_domain, tmp_path_factory.mktemp('suite'),
                        control_rate=SHARED_HZ) as started:
        yield started


@pytest.fixture
def processes(ros_domain: int) -> Iterator[Processes]:
    """Processes that are killed when the test ends."""
    started = Processes(ros_domain)
    try:
        yield started
    finally:
        started.end()


@contextlib.contextmanager
def joined(domain: int) -> Iterator[Ros]:
    """A node of the test itself in a domain."""
    session = Ros(domain)
    try:
        yield session
    finally:
        session.end()


@pytest.fixture
def ros(ros_domain: int) -> Iterator[Ros]:
    """A node of the test itself."""
    with joined(ros_domain) as session:
        yield session


@pytest.fixture
def shared_ros(shared_domain: int) -> Iterator[Ros]:
    """A node of the test itself beside a suite that others use too."""
    with joined(shared_domain) as session:
        yield session
