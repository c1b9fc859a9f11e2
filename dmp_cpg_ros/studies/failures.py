# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Let every component of the walking robot fail in every way, in the plain loop.

The robot walks at 0.5 m/s, one component fails for half a second, and two seconds later it is
told to stop. As in the nodes its own estimate balances it, and the robot's command watchdog
guards the targets of the legs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from copy import deepcopy
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets
from dmp_cpg_ros.core.scenario.fault import (
    COMPONENTS,
    KINDS,
    PLACED,
    Fault,
    FaultInjector,
    Message,
)
from dmp_cpg_ros.nodes.framework.ticks import TickInputs
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.watchdog import CommandWatchdog
from dmp_cpg_ros.studies.output import markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_gaits, load_suite

GAITS = ('amble', 'trot')
SPEED = 0.5
"""Commanded speed [m/s]."""

STANDS_S, WALKS_S, AFTER_S, STOPS_S = 0.3, 2.7, 2.0, 3.5
"""Times of standing, of walking before the failure, after its begin, and for the stop [s]."""

RESTS = 3
"""For how many tenths of a second it rests until the stop, which has ``STOPS_S``, is over."""

FAILS_S = 0.5
"""How long a component fails [s]."""

Cell = tuple[str, str, str]
"""Gait, component, kind."""

CELLS: tuple[Cell, ...] = tuple((gait, component, kind) for gait in GAITS
                                for component in COMPONENTS for kind in KINDS)


class Outcome(NamedTuple):
    """What a failure led to.

    Attributes
    ----------
    end : str
        ``rests``: it walked on and stopped when it was told to; ``stops``: it stopped or did not
        come to rest as told, and is on its feet or its belly; ``falls``.
    named : tuple of str
        What was named as failing, by the estimator, the watchdog or the legs' readers.
    """

    end: str
    named: tuple[str, ...]


class FailingWalk:
    """The robot, its watchdog and the suite in a gait, with an injector between them."""

    def __init__(self, gait: str) -> None:
        suite = load_suite(overrides={'gait': gait})
        self.robot = MujocoRobot(suite.robot_file, suite.tick_ns, world=suite.world,
                                 sensors=suite.sensors)
        self.loop = WalkingLoop(self.robot.description, suite.gait, suite.parameters, load_gaits())
        self.injector = FaultInjector(0)
        self.watchdog = CommandWatchdog(
            self.robot.description, round(suite.robot.target_timeout * 1e9))
        self.state, self.named = self.robot.reset(), set[str]()
        self._ticks = TickInputs(self._on_tick, ('robot',), 'robot')
        self._sent: list[Message] = []

    def run(self, seconds: float) -> None:
        """Tick for a time [s]."""
        for _ in range(round(seconds * 1e9 / self.robot.tick_ns)):
            self.tick()

    def tick(self) -> None:
        """One tick of the robot; of the suite if it takes the stamp, by the rule of its nodes."""
        state, injector, guard = self.state, self.injector, self.watchdog
        sensed, self._sent = injector.sensed(state), []
        taken = self._ticks.add('robot', sensed.time_ns, sensed)
        if injector.acting and not taken:
            self.named.add('stamps')
        for leg, stamp, targets in injector.sent(self._sent):
            sound = all(np.isfinite(values).all() for values in vars(targets).values())
            if stamp <= state.time_ns and sound:  # as the robot's reader takes them
                guard.accept(leg, stamp, targets)
        estimator = self.loop.estimator_state
        if injector.acting:
            self.named.update(f'targets of {leg}' for leg in guard.silent(state.time_ns))
            self.named.update(() if estimator is None else estimator.estimate.problems)
        self.state = self.robot.step(injector.driven(guard.targets(state)))

    def _on_tick(self, stamp_ns: int, inputs: Mapping[str, Any]) -> None:
        tick = self.loop.tick(inputs['robot'])
        parts = np.split(np.array(
            (tick.targets.position, tick.targets.velocity, tick.targets.effort)), 4, axis=1)
        self._sent = [(leg, stamp_ns, JointTargets(*part))
                      for leg, part in zip(LEGS, parts, strict=True)]


@cache
def walking(gait: str) -> FailingWalk:
    """A robot that walks; to be copied."""
    walk = FailingWalk(gait)
    walk.run(STANDS_S)
    walk.loop.request(False)
    walk.loop.command(SPEED)
    for _ in range(round(WALKS_S / 0.1)):
        walk.loop.command(SPEED)
        walk.run(0.1)
    return walk


def trial(cell: Cell, seconds: float = FAILS_S) -> Outcome:
    """Let a component fail for a time [s]; one of a leg fails at the front left one."""
    gait, component, kind = cell
    walk = deepcopy(walking(gait))
    walk.injector.add(Fault(component, kind, seconds, 'fl' if component in PLACED else ''))
    fell = False
    for _ in range(round(AFTER_S / 0.1)):
        walk.loop.command(SPEED)
        walk.run(0.1)
        fell = fell or walk.robot.fallen
    walked = walk.loop.stop.state == 'walking'
    walk.loop.request(True)
    rested = 0
    for _ in range(round(STOPS_S / 0.1)):
        walk.run(0.1)
        fell = fell or walk.robot.fallen
        rested = rested + 1 if walk.loop.stop.state == 'at_rest' else 0
        if fell or rested == RESTS:
            break
    rests = walked and rested > 0
    return Outcome('falls' if fell else 'rests' if rests else 'stops', tuple(sorted(walk.named)))


def study(cells: Sequence[Cell], workers: Workers) -> dict[Cell, Outcome]:
    """Outcome of every cell."""
    with workers:
        return dict(zip(cells, workers.map(trial, cells), strict=True))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = parser_of('failures', __doc__, 'the outcomes')
    parser.add_argument('--gaits', nargs='+', choices=GAITS, default=GAITS)
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: Any) -> int:
    outcomes = study([cell for cell in CELLS if cell[0] in options.gaits],
                     Workers(options.workers, options.cluster))
    for gait in options.gaits:
        rows = [[component, *(' '.join((of.end, *(of.named and [f"({', '.join(of.named)})"])))
                              for kind in KINDS for of in [outcomes[gait, component, kind]])]
                for component in COMPONENTS]
        print(f'{gait}:\n\n{markdown_table(("component", *KINDS), rows)}\n')
    write_results(options.json, [{'cell': cell, **of._asdict()} for cell, of in outcomes.items()])
    return 0


if __name__ == '__main__':
    sys.exit(main())
