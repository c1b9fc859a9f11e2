# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the suite: processes up, ready, the scenario played, everything down again."""

from __future__ import annotations

import math
import os
import signal
import stat
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from dmp_cpg_ros.commands.fork_server import ForkServer
from dmp_cpg_ros.commands.processes import ProcessGroup
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.nodes.framework import claims, execution, health
from dmp_cpg_ros.nodes.messages.interfaces import private
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES
from dmp_cpg_ros.nodes.scenario_player import ScenarioPlayer
from dmp_cpg_ros.suite_table import (
    COMPOSED,
    PROCESSES,
    RECORDER,
    ROBOT,
    VISUALIZATION,
    WALKING_NODES,
    instances,
)

READY_WITHIN_S = 120.0
"""How long nodes may take to come up and find each other [s]."""

SLICE_S = 0.1
"""How often processes and Ctrl-C are looked at [s]."""

LAST_WORDS_S = 10.0
"""How long a node may take to finish its work at the end of a run [s]."""

ENDED_WITHIN_S = 15.0
"""How long a process may take to end before it is killed [s]."""

LYING_WITHIN_S = 60.0
"""How long a machine may take to simulate how the robot lies down [s]."""

HUNG_S = 60.0
"""How long nodes may leave the robot waiting without an answer [s]."""

MOST_RESTARTS = 3
"""How often a process is started again before all nodes have been ready."""

REST_NS = 4_000_000_000
"""Time on the robot's clock in which it comes to rest without some nodes [ns]."""

SETTLED_S = 0.3
"""Time without a new message after which the recording counts as complete [s]."""

LOOK_S = 1.0
"""How long the graph is searched for nodes of another suite [s]: discovery takes its time."""

FIRST_WORD_S = 3.0
"""Waiting that is not worth a word [s]."""

ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""Signals that end a run in order."""

Say = Callable[[float, str], None]


class SuiteError(DmpCpgError):
    """The suite did not come up, or a node died."""


class InterruptedRunError(DmpCpgError):
    """A signal asked for the end of the run.

    Parameters
    ----------
    number : int
        The signal.
    """

    def __init__(self, number: int) -> None:
        """Name the signal, unless it is Ctrl-C."""
        word = '' if number == signal.SIGINT else f' by {signal.Signals(number).name}'
        super().__init__(f'interrupted{word}')
        self.signal = number


@contextmanager
def alone_in_domain(namespace: str, meanwhile: Callable[[], Any] = lambda: None
                    ) -> Iterator[Any]:
    """Hold the ROS domain for one suite in a namespace.

    Parameters
    ----------
    namespace : str
        Of the suite.
    meanwhile : callable ()
        What is done, and handed on, while the graph has time to tell of others.

    Raises
    ------
    AlreadyRunningError
        If another has it, or nodes of one are in the graph, left over perhaps.
    """
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    execution.prepare_middleware()
    context = Context()
    rclpy.init(context=context, args=[])
    try:
        domain = context.get_domain_id()
        held = claims.claim(f'{namespace}/suite', domain)
        names = [f'{namespace}/{name}' for name in (*WALKING_NODES, RECORDER)]
        lookout, deadline = Node('lookout', context=context, namespace=namespace), (
            time.monotonic() + LOOK_S)
        made = meanwhile()
        # Claims tell at once of nodes on this machine; the graph, after a while, of all others.
        others = claims.claimed(names, domain) or _in_graph(lookout, names, deadline)
        lookout.destroy_node()
    finally:
        context.try_shutdown()
    with held:
        if others:
            raise claims.AlreadyRunningError(
                claims.already_running(domain, f'nodes {", ".join(others)}'))
        yield made


def _in_graph(lookout: Node, names: Sequence[str], deadline: float) -> list[str]:
    """Those of some nodes that are in the graph, looked for as long as there are none."""
    while True:
        there = {f'{space.rstrip("/")}/{name}'
                 for name, space in lookout.get_node_names_and_namespaces()}
        found = [name for name in names if name in there]
        if found or time.monotonic() > deadline:
            return found
        time.sleep(SLICE_S)


def run_suite(scenario: Scenario, tick_ns: int, arguments: Sequence[str], logs: Path, say: Say,
              server: ForkServer, *, lock_step: bool, processes: str, view: bool = False,
              visualization: bool = False, respawn: bool = False) -> str:
    """Run the suite from nothing to nothing.

    A walk goes on without its recorder, which says at once when it cannot write any more.

    Parameters
    ----------
    scenario : Scenario
        What is asked of the robot.
    tick_ns : int
        Control tick [ns].
    arguments : sequence of str
        ``--ros-args`` of all nodes, with the file of their parameters.
    logs : Path
        Folder for the output of the processes.
    say : callable (time_s, text)
        Told what happens.
    server : ForkServer
        What starts the processes; closed as soon as it is not needed any more.
    lock_step : bool
        Whether the robot waits for the targets of every tick.
    processes : str
        How nodes share processes, a key of :data:`~dmp_cpg_ros.suite_table.PROCESSES`.
    view : bool
        Whether to serve a live view, whose end does not end the run.
    visualization : bool
        Whether to start the node that draws for RViz; its end does not end the run either.
    respawn : bool
        Whether processes that end before their time are started again, all but the robot's: with
        it a simulated robot has lost its state.

    Returns
    -------
    str
        How the recorder ended before its time; empty where it did not.

    Raises
    ------
    SuiteError
        If nodes do not get ready, or one ends before its time or hangs; its last words are in the
        text. The gait is stopped before.
    PlayerError
        If the suite does not take a command.
    InterruptedRunError
        On Ctrl-C, SIGTERM, SIGHUP or SIGQUIT; everything is shut down cleanly all the same.
    """
    group, views = ProcessGroup(logs, server), ProcessGroup(logs, server)
    with _interrupt() as interrupted:
        rclpy.init(args=['walk', *arguments], signal_handler_options=SignalHandlerOptions.NO)
        try:
            if view:  # its address holds a token, which is for the terminal only
                views.start('live_view', ['live_view', *arguments], logged=False)
            if visualization:
                views.start(VISUALIZATION, [VISUALIZATION, *arguments])
            kinds = {name: kind.name for kind, name, _ in instances()}
            shared = {RECORDER: (RECORDER,), **PROCESSES[processes]}
            for process, nodes in shared.items():
                if len(nodes) == 1:
                    node = ('-r', f'__node:={nodes[0]}')
                    group.start(process, [kinds[nodes[0]], *arguments, *node])
                else:
                    group.start(process, [COMPOSED, *nodes, *arguments])
            if not respawn:
                server.close()
            player = ScenarioPlayer(scenario, tick_ns, lock_step, say)
            executor = execution.make_executor('events')
            executor.add_node(player)
            watch = _Watch(executor, player, group, interrupted, say, shared, respawn)
            try:
                watch.until_ready()
                player.begin()
                watch.until(player.finished, math.inf)
                player.finished.result()
            finally:
                # In lock-step no time passes that nobody asks for: nothing can fall.
                if not lock_step and player.time_ns > 0:
                    watch.lay_down()
                watch.finish_work()
                executor.remove_node(player)
                player.destroy_node()
        finally:
            killed = views.stop(ENDED_WITHIN_S) + group.stop(ENDED_WITHIN_S)
            rclpy.try_shutdown()
            if killed:
                say(math.nan, f'had to kill {", ".join(killed)}')
        if killed:
            raise SuiteError(f'{", ".join(killed)} hung: no answer at the end of the run')
    return watch.unrecorded


class _Watch:
    """Spins the player while it watches the processes and Ctrl-C.

    A server drops its response when it has not yet matched the client's reply reader, which the
    client cannot see. Discovery tells a participant's readers in the order in which they were
    made. So all clients whose requests must not be repeated are made first, the player's and those
    for the end of the run; then every node is asked whether it is ready, as often as it takes, and
    its answer proves that it knows the clients that were made before.
    """

    def __init__(self, executor: Executor, player: ScenarioPlayer, group: ProcessGroup,
                 interrupted: list[int], say: Say, shared: Mapping[str, Sequence[str]],
                 respawn: bool) -> None:
        self._executor, self._player, self._group = executor, player, group
        self._interrupted, self._say = interrupted, say
        self._shared, self._respawn = shared, respawn
        self._gone: set[str] = set()  # nodes that have ended and are not started again
        self._told: set[str] = set()  # processes of which that is known
        self._restarts: Counter[str] = Counter()  # since all were ready
        self._returning: health.ReadinessOfOthers | None = None
        self._progress: tuple[int, bool] | None = None
        self._stalled, self._stalled_s = health.Intervals(FIRST_WORD_S), 0.0
        self._asked: health.ReadinessOfOthers | None = None
        self._transitions = {name: player.create_client(ChangeState, f'{name}/change_state')
                             for name in (*WALKING_NODES, RECORDER)}
        self._recording, self._begun, self._ending = True, False, False
        self.unrecorded = ''
        self._recorded: Any = None
        player.heard.listen(private('~/recorded', RECORDER), self._on_recorded)

    def until(self, future: Future, patience_s: float) -> bool:
        """Spin until a future is done; returns whether it is. Ctrl-C cuts it short, but not while
        the suite is brought to its end.
        """
        deadline = time.monotonic() + patience_s
        while not future.done() and time.monotonic() < deadline:
            self._executor.spin_until_future_complete(future, timeout_sec=SLICE_S)
            if self._interrupted and not self._ending:
                raise InterruptedRunError(self._interrupted[0])
            self._look_after_processes()
        return bool(future.done())

    def _look_after_processes(self) -> None:
        """Start what has ended again, or raise SuiteError with how it ended, once."""
        news = {name: how for name, how in self._group.ended().items() if name not in self._told}
        for name, how in news.items():
            nodes = self._shared[name]
            if (self._respawn and self._begun and not self._ending and ROBOT not in nodes
                    and self._restarts[name] < MOST_RESTARTS):
                self._say(self._player.progress_ns * 1e-9, f'{how}; it is started again')
                self._restarts[name] += 1
                self._group.restart(name)
                # Who was there before has to know the new one, too.
                self._returning = health.ReadinessOfOthers(self._player, list(self._transitions))
            else:
                self._told.add(name)
                self._gone.update(nodes)
        if RECORDER in news and RECORDER in self._told and self._player.begun:
            self._recording, self.unrecorded = False, news.pop(RECORDER)
            self._say(self._player.progress_ns * 1e-9,
                      f'{self.unrecorded}; the walk goes on unrecorded')
        if lost := [how for name, how in news.items() if name in self._told]:
            raise SuiteError('; '.join(lost))
        if self._returning is not None and not self._returning.missing():
            self._returning = None
            self._say(self._player.progress_ns * 1e-9, 'all nodes are ready again')
            self._player.renew([node for name in self._restarts for node in self._shared[name]])
            self._restarts.clear()
        if not self._ending:
            self._look_for_stall()

    def _look_for_stall(self) -> None:
        """Say which nodes do not answer while no tick ends, or while the robot does not follow;
        after a while end those that hang, or the run.
        """
        player, now = self._player, time.monotonic()
        progress = player.progress_ns, player.drive == DRIVE_MODES[0]
        if self._progress is None or progress != self._progress and progress[1]:
            self._progress, self._asked = progress, None
            self._stalled, self._stalled_s = health.Intervals(FIRST_WORD_S), now
        elif self._stalled.due() and progress[0] > 0 and self._returning is None:
            if not player.busy:
                player.remind()
            if self._asked is None:
                self._asked = health.ReadinessOfOthers(player, list(self._transitions))
                self._asked.missing()
                return
            missing = [text for text in self._asked.missing() if text.endswith(health.NO_ANSWER)]
            self._say(player.progress_ns * 1e-9, 'the robot waits'
                      + (f' for {"; ".join(missing)}' if missing else ''))
            if missing and now > self._stalled_s + HUNG_S:
                self._end_hung({text.partition(':')[0] for text in missing})

    def _end_hung(self, nodes: set[str]) -> None:
        hung = [name for name, own in self._shared.items() if nodes.intersection(own)]
        if not self._respawn:
            raise SuiteError(f'{", ".join(hung)} hung: no answer for {HUNG_S:g} s')
        for name in hung:
            self._say(self._player.progress_ns * 1e-9, f'{name} hung and is ended')
            self._group.kill(name)
        self._progress = None

    def until_ready(self) -> None:
        """Ask every node whether it is active and connected until all say yes."""
        deadline, tell = time.monotonic() + READY_WITHIN_S, health.Intervals(FIRST_WORD_S)
        others = health.ReadinessOfOthers(self._player, list(self._transitions))
        while (missing := others.missing()) or not self._player.connected():
            waiting = '; '.join(missing) or 'topics and services of the player'
            if time.monotonic() > deadline:
                raise SuiteError(f'not ready within {READY_WITHIN_S:g} s: {waiting}')
            if tell.due():
                self._say(math.nan, f'waiting for {waiting}')
            self.until(Future(), SLICE_S)
        self._begun = True

    def lay_down(self) -> None:
        """End the recording, then lay the robot down; a second Ctrl-C cuts it short."""
        self._ending, begun = True, len(self._interrupted)
        if ROBOT in self._gone:
            return
        with suppress(DmpCpgError):
            if self._gone - {RECORDER}:
                self._come_to_rest(begun)
                return
            for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP):
                if self._recording and self._change_state(RECORDER, transition) is None:
                    break  # who hangs is not asked twice
            self._recording = False
            down, deadline = self._player.lie_down(), time.monotonic() + LYING_WITHIN_S
            while len(self._interrupted) == begun and time.monotonic() < deadline:
                if self.until(down, SLICE_S):
                    return

    def _come_to_rest(self, begun: int) -> None:
        """Let a robot that has lost nodes come to a stand; where nodes are left that can stop the
        gait they do, and else the drive does.
        """
        player, deadline = self._player, time.monotonic() + LYING_WITHIN_S
        rested_ns = player.time_ns + REST_NS
        player.stop()
        while (player.time_ns < rested_ns and len(self._interrupted) == begun
               and time.monotonic() < deadline and ROBOT not in self._gone):
            with suppress(SuiteError):
                self.until(Future(), SLICE_S)

    def finish_work(self) -> None:
        """Stop the robot, let the recorder take all that was said, deactivate everything."""
        self._ending = True
        with suppress(DmpCpgError):
            self._change_state(ROBOT)
            if self._recording and RECORDER not in self._gone:
                self._until_recorded()
            for name in self._transitions:
                if name != ROBOT and (name != RECORDER or self._recording):
                    self._change_state(name)

    def _change_state(self, name: str, transition: int = Transition.TRANSITION_DEACTIVATE) -> Any:
        if name in self._gone:
            return None
        request = ChangeState.Request(transition=Transition(id=transition))
        return self._ask(self._transitions[name], request, LAST_WORDS_S)

    def _on_recorded(self, counts: Any) -> None:
        self._recorded = counts

    def _until_recorded(self) -> None:
        """Wait until nothing more arrives at the recorder."""
        deadline, before = time.monotonic() + LAST_WORDS_S, self._recorded
        while time.monotonic() < deadline:
            self.until(Future(), SETTLED_S)
            counts = self._recorded
            if before is not None and counts is not before and (
                    counts.position == before.position):
                return
            before = counts

    def _ask(self, client: Any, request: Any, patience_s: float) -> Any:
        """Answer of a service, or None when it is not there or does not answer."""
        if not client.wait_for_service(timeout_sec=LAST_WORDS_S):
            return None
        future = client.call_async(request)
        return future.result() if self.until(future, patience_s) else None


@contextmanager
def _interrupt() -> Iterator[list[int]]:
    """Collect signals that ask for the end instead of being ended by them."""
    received: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        received.append(number)
        if number == signal.SIGHUP:
            _leave_terminal()

    former = {number: signal.signal(number, note) for number in ENDING_SIGNALS}
    try:
        yield received
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


def _leave_terminal() -> None:
    """Write to nowhere instead of to a terminal that is gone."""
    for descriptor in (1, 2):
        if stat.S_ISCHR(os.fstat(descriptor).st_mode):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)
