# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What looks after a suite that runs: processes that end, nodes that hang, the end of the run."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.executors import Executor
from rclpy.task import Future

from dmp_cpg_ros.commands.ending_signals import InterruptedRunError
from dmp_cpg_ros.commands.processes import ProcessGroup
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.nodes.framework import health
from dmp_cpg_ros.nodes.framework.execution import spin_in_slices
from dmp_cpg_ros.nodes.messages.interfaces import private
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES
from dmp_cpg_ros.nodes.scenario_player import ScenarioPlayer
from dmp_cpg_ros.suite_table import RECORDER, ROBOT, WALKING_NODES

READY_WITHIN_S = 120.0
"""How long nodes may take to come up and find each other [s]."""

SLICE_S = 0.1
"""How often processes and Ctrl-C are looked at [s]."""

LAST_WORDS_S = 10.0
"""How long a node may take to finish its work at the end of a run [s]."""

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

FIRST_WORD_S = 3.0
"""Waiting that is not worth a word [s]."""

REMIND_S = 0.5
"""How often the robot is to tell its ticks again where nodes have come back and it stands still
[s]: each hears of a tick only once those before it have, and is believed after half a second.
"""

Say = Callable[[float, str], None]
"""Told at which time [s] what happens."""


class SuiteError(DmpCpgError):
    """The suite did not come up, or a node died."""


class SuiteWatch:
    """Spins the player while it watches the processes and Ctrl-C.

    A server drops its response when it has not yet matched the client's reply reader, which the
    client cannot see. Discovery tells a participant's readers in the order in which they were
    made. So all clients whose requests must not be repeated are made first, the player's and those
    for the end of the run; then every node is asked whether it is ready, as often as it takes, and
    its answer proves that it knows the clients that were made before.

    Parameters
    ----------
    executor : Executor
        Runs the player.
    player : ScenarioPlayer
        Who plays the scenario.
    group : ProcessGroup
        Processes of the nodes.
    views : ProcessGroup
        Processes that only look on; the walk goes on without them.
    interrupted : list of int
        Signals that ask for the end, as they come.
    say : callable (time_s, text)
        Told what happens.
    shared : mapping of str to sequence of str
        Nodes by process.
    respawn : bool
        Whether processes that end before their time are started again, all but the robot's.

    Attributes
    ----------
    unrecorded : str
        How the recorder ended before its time; empty where it did not.
    """

    def __init__(self, executor: Executor, player: ScenarioPlayer, group: ProcessGroup,
                 views: ProcessGroup, interrupted: list[int], say: Say,
                 shared: Mapping[str, Sequence[str]], respawn: bool) -> None:
        """Create the clients, and hear what is recorded."""
        self._executor, self._player, self._group, self._views = executor, player, group, views
        self._interrupted, self._say = interrupted, say
        self._shared, self._respawn = shared, respawn
        self._gone: set[str] = set()  # nodes that have ended and are not started again
        self._told: set[str] = set()  # processes of which that is known
        self._restarts: Counter[str] = Counter()  # since all were ready
        self._returning: health.ReadinessOfOthers | None = None
        self._reminded_s = math.inf  # when it was looked last whether those that came back go on
        self._progress: tuple[int, bool] | None = None
        self._stood_ns = -1  # robot time when progress was looked at last
        self._stalled, self._stalled_s = health.Intervals(FIRST_WORD_S), 0.0
        self._asked: health.ReadinessOfOthers | None = None
        self._hung_ns = -1  # robot time at which somebody hung last
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
        for _ in spin_in_slices(self._executor, future, SLICE_S, patience_s):
            if self._interrupted and not self._ending:
                raise InterruptedRunError(self._interrupted[0])
            self._look_after_processes()
        return bool(future.done())

    def _look_after_processes(self) -> None:
        """Start what has ended again, or raise SuiteError with how it ended, once."""
        for name, how in self._views.ended().items():
            if name not in self._told:
                self._told.add(name)
                self._say(self._player.progress_ns * 1e-9, f'{how}; the walk goes on without it')
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
            self._reminded_s = time.monotonic()
        if not self._ending:
            self._look_for_stall()

    def _look_for_stall(self) -> None:
        """Say which nodes do not answer while no tick ends, or while the robot does not follow;
        after a while end those that hang, or the run.
        """
        player, now = self._player, time.monotonic()
        progress = player.progress_ns, player.drive == DRIVE_MODES[0]
        if self._progress is None or progress != self._progress and progress[1]:
            if self._asked is not None:
                self._asked.end()
            self._reminded_s = max(self._reminded_s, now)
            self._progress, self._asked, self._stood_ns = progress, None, progress[0]
            self._stalled, self._stalled_s = health.Intervals(FIRST_WORD_S), now
            return
        if now > self._reminded_s + REMIND_S:
            self._reminded_s = now
            player.remind()
        if self._stalled.due() and player.begun and self._returning is None:
            # Ticks that go on while the robot looks after itself need no word, and shall not have
            # one by the wall clock.
            stands, self._stood_ns = progress[0] == self._stood_ns, progress[0]
            if stands and not player.busy:
                player.remind()
            asked, self._asked = self._asked, health.ReadinessOfOthers(
                player, list(self._transitions))
            self._asked.missing()
            if asked is None:
                return
            silent = [text for text in asked.missing() if text.endswith(health.NO_ANSWER)]
            said = [f'{name}: {text[text.find(words):]}' for name, text in asked.said.items()
                    for words in (health.FAILED, health.LACKS) if words in text]
            asked.end()
            because = '; '.join((*silent, *said))
            self._say(player.progress_ns * 1e-9,
                      'the robot waits' + (f' for {because}' if because else ''))
            failed = [text for text in said if health.FAILED in text]
            if failed or (silent and now > self._stalled_s + HUNG_S):
                self._end_hung({text.partition(':')[0] for text in failed or silent},
                               '; '.join(failed) or f'no answer for {HUNG_S:g} s')

    def _end_hung(self, nodes: set[str], why: str) -> None:
        hung = [name for name, own in self._shared.items() if nodes.intersection(own)]
        at_ns = self._player.progress_ns
        if not self._respawn or at_ns == self._hung_ns:  # nor does it help a second time
            raise SuiteError(f'{", ".join(hung)} hung: {why}')
        self._hung_ns = at_ns
        for name in hung:
            self._say(at_ns * 1e-9, f'{name} hung ({why}) and is ended')
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
