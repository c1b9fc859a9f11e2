# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the suite: processes up, ready, the scenario played, everything down again."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import rclpy

from dmp_cpg_ros.commands.ending_signals import ending_signals
from dmp_cpg_ros.commands.fork_server import ForkServer
from dmp_cpg_ros.commands.processes import ProcessGroup
from dmp_cpg_ros.commands.suite_watch import Say, SuiteError, SuiteWatch
from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.nodes.framework import execution, middleware
from dmp_cpg_ros.nodes.scenario_player import ScenarioPlayer
from dmp_cpg_ros.suite_table import PROCESSES, RECORDER, VISUALIZATION

ENDED_WITHIN_S = 15.0
"""How long a process may take to end before it is killed [s]."""


def run_suite(scenario: Scenario, tick_ns: int, arguments: Sequence[str], logs: Path, say: Say,
              server: ForkServer, *, lock_step: bool, processes: str, stamped: bool = False,
              view: bool = False, visualization: bool = False, respawn: bool = False,
              make_player: Callable[..., ScenarioPlayer] = ScenarioPlayer
              ) -> tuple[bool, list[str]]:
    """Run the suite from nothing to nothing.

    A walk goes on without its recorder, which says at once when it cannot write any more, and
    without a change that is refused.

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
    stamped : bool
        Whether the nodes read ``TwistStamped`` on ``cmd_vel``.
    view : bool
        Whether to serve a live view, whose end does not end the run.
    visualization : bool
        Whether to start the node that draws for RViz; its end does not end the run either.
    respawn : bool
        Whether processes that end before their time are started again, all but the robot's: with
        it a simulated robot has lost its state.
    make_player : callable
        Makes the player of the scenario, from the arguments of :class:`ScenarioPlayer`.

    Returns
    -------
    whole : bool
        Whether all of the walk was recorded.
    told : list of str
        What is to be said at the end: how the recorder ended before its time, how many events of
        the scenario were refused.

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
    with ending_signals() as interrupted:
        middleware.start_ros(['walk', *arguments])
        try:
            if view:  # its address holds a token, which is for the terminal only
                views.start('live_view', ['live_view', *arguments], logged=False)
            if visualization:
                views.start(VISUALIZATION, [VISUALIZATION, *arguments])
            shared = {RECORDER: (RECORDER,), **PROCESSES[processes]}
            group.start_nodes(shared, arguments)
            if not respawn:
                server.close()
            player = make_player(scenario, tick_ns, lock_step, say, stamped=stamped)
            executor = execution.make_executor('events')
            executor.add_node(player)
            watch = SuiteWatch(executor, player, group, views, interrupted, say, shared,
                               respawn)
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
            for text in group.failed:
                say(math.nan, text)
            if killed:
                say(math.nan, f'had to kill {", ".join(killed)}')
        if killed:
            raise SuiteError(f'{", ".join(killed)} hung: no answer at the end of the run')
    told = {f'{watch.unrecorded}; the rest of the walk was not recorded': watch.unrecorded,
            f'{player.refused} of {len(scenario.events)} events were refused': player.refused}
    return not watch.unrecorded, [text for text, so in told.items() if so]
