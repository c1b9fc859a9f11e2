# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A scenario played to whoever takes its events, such as the plain loop and its robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.scenario.push import Push
from dmp_cpg_ros.core.scenario.scenario import Scenario

Takers = Mapping[str, Callable[[Any], Any]]
"""Kind of event to the function that takes its value."""


def play(scenario: Scenario, tick_ns: int, step: Callable[[], Any], takers: Takers) -> None:
    """Give events to those who take their kind before the tick at which they act; ``step`` runs
    one tick of loop and robot.

    Raises
    ------
    DataError
        If the scenario has events of a kind that nobody takes.
    """
    actions, place = scenario.timeline(tick_ns), 0
    missing = {action.kind for action in actions} - set(takers)
    if missing:
        raise DataError(
            f'nobody takes {", ".join(sorted(missing))}; taken are {", ".join(sorted(takers))}')
    for k in range(scenario.ticks(tick_ns)):
        while place < len(actions) and actions[place].time_ns <= k * tick_ns:
            if actions[place].value is not None:
                takers[actions[place].kind](actions[place].value)
            place += 1
        step()


def loop_takers(loop: WalkingLoop) -> Takers:
    """What takes the events of a scenario that are for the plain loop."""
    return {
        'command': lambda command: loop.command(*command),
        'inhibit': loop.request,
        'set': loop.change,
        'votes': lambda weights: loop.vote(weights, 'scenario'),
        **{what: partial(lambda what, _: loop.request_mode(what), what) for what in REQUESTS},
        'gait': loop.change_gait,
    }


def robot_takers(robot: Any) -> Takers:
    """What takes those that are for the robot; none where it knows no forces."""
    def take(push: Push) -> None:
        for force in push.forces(robot._tick * robot.tick_ns, robot.tick_ns):
            robot.take_push(force)

    return {'push': take} if hasattr(robot, 'take_push') else {}
