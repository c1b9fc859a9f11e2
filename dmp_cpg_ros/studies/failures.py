# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Let every component of the walking robot fail in every way, in the plain loop.

The robot walks at 0.5 m/s, one component fails for half a second, and one and a half seconds later
it is told to stop. As in the nodes its own estimate balances it, and the robot's command watchdog
guards the targets of the legs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from copy import deepcopy
from functools import cache
from math import acos
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.core.balance.body_command import BALANCED
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.maths.vec3 import upward
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.scenario.fault import (
    COMPONENTS,
    KINDS,
    PLACED,
    Fault,
    FaultInjector,
    Message,
)
from dmp_cpg_ros.nodes.framework.ticks import TickInputs
from dmp_cpg_ros.robot.mujoco_robot import LYING_TILT, MujocoRobot
from dmp_cpg_ros.robot.watchdog import CommandWatchdog
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_suite

GAITS = ('amble', 'trot')
"""Gaits of the tables."""

STANDS_S, WALKS_S, LAST_S, AFTER_S, STOPS_S = 0.3, 2.5, 0.2, 1.5, 3.5
"""Times of standing, of walking, of walking until the failure, which begins later in the cycle, of
walking after its end, and for the stop [s].
"""

LASTS, SPEEDS = (0.1, 2.0), (0.5, 1.0)
"""Between what the time is drawn for which a component fails [s], and from what the speed [m/s].
"""

RESTS = 3
"""For how many tenths of a second it rests until the stop, which has ``STOPS_S``, is over."""

Cell = tuple[str, str, str]
"""Gait, component, kind."""


class Case(NamedTuple):
    """A failure in a walk.

    Attributes
    ----------
    gait, component, kind, leg : str
        As of a fault.
    fails_s : float
        How long the component fails [s].
    later_s : float
        How much later in the cycle [s].
    seed : int
        Of what is garbage or intermittent.
    speed : float
        Commanded [m/s].
    robot : str
        Its file, in the config folder or by its path.
    first, first_s : str, float
        How the component has failed just before, and for how long [s]; empty if it has not.
    """

    gait: str
    component: str
    kind: str
    leg: str = 'fl'
    fails_s: float = 0.5
    later_s: float = 0.0
    seed: int = 0
    speed: float = 0.5
    robot: str = 'robots/mini_quadruped.yaml'
    first: str = ''
    first_s: float = 0.0


def drawn(cell: Cell, seed: int, robots: Sequence[str], lasts: Sequence[float] = LASTS,
          speeds: Sequence[float] = SPEEDS, first: str = '') -> Case:
    """Draw a case of a cell: leg, duration between two [s], sixteenth of a second, speed [m/s],
    robot, and for how long it has failed in a first way.
    """
    random, (least, most) = np.random.default_rng((seed, 78)), lasts
    case = Case(*cell, str(random.choice(LEGS)),
                round(float(least * (most / least) ** random.random()), 2),
                int(random.integers(16)) / 16.0, seed, float(random.choice(list(speeds))),
                str(random.choice(list(robots))))
    return case if not first else case._replace(
        first=first, first_s=round(float(least * (most / least) ** random.random()), 2))


class Outcome(NamedTuple):
    """What a failure led to.

    Attributes
    ----------
    end : str
        ``rests``: it walked on and stopped when it was told to; ``stops``: it stopped or did not
        come to rest as told, and is on its feet; ``lies``: it lowered itself, and lies on its
        belly; ``falls``.
    named : tuple of str
        What was named as failing, by the estimator, the watchdog or the legs' readers.
    """

    end: str
    named: tuple[str, ...]


class FailingWalk:
    """The robot, its watchdog and the suite in a gait, with an injector between them."""

    def __init__(self, gait: str, robot: str) -> None:
        suite = load_suite(overrides={'gait': gait, 'robot': robot})
        self.robot = MujocoRobot(suite.robot_file, suite.tick_ns, world=suite.world,
                                 sensors=suite.sensors)
        self.loop = WalkingLoop(
            self.robot.description, suite.gait, suite.parameters, suite.gaits.gaits)
        self.injector = FaultInjector(0)
        self.watchdog = CommandWatchdog(
            self.robot.description, round(suite.robot.target_timeout * 1e9))
        self.watchdog.drives.cuts = True
        self.state, self.named, self.tilt = self.robot.reset(), set[str](), 0.0
        self._ticks = TickInputs(self._on_tick, ('robot',), 'robot')
        self._sent: list[Message] = []

    def run(self, seconds: float) -> None:
        """Tick for a time [s]."""
        for _ in range(round(seconds * 1e9 / self.robot.tick_ns)):
            self.tick()

    def follow(self, speed: float, seconds: float) -> bool:
        """Walk at a speed [m/s] for a time [s]; tells whether the robot fell."""
        fell = False
        for left in np.arange(seconds, 1e-6, -0.1):
            self.loop.command(speed)
            self.run(min(0.1, left))
            fell = fell or self.fallen
        return fell

    @property
    def fallen(self) -> bool:
        """Whether the robot is down: low or tilted while it should stand, as in its node, or at
        any time tilted so far that it does not lie on its belly.
        """
        should_stand = self.loop.mode.mode in BALANCED
        return self.tilt > LYING_TILT or (should_stand and self.robot.fallen)

    def tick(self) -> None:
        """One tick of the robot; of the suite if it takes the stamp, by the rule of its nodes."""
        state, injector, guard = self.state, self.injector, self.watchdog
        sensed, self._sent = injector.sensed(state), []
        taken = self._ticks.add('robot', sensed.time_ns, sensed)
        if injector.acting and not taken:
            self.named.add('stamps')
        for leg, stamp, targets in injector.sent(self._sent):
            sound = np.isfinite((targets.position, targets.velocity, targets.effort)).all()
            if stamp <= state.time_ns and sound:  # as the robot's reader takes them
                guard.accept(leg, stamp, targets)
        vertical = upward(state.base_quaternion.tolist())[2]
        self.tilt = max(self.tilt, acos(min(1.0, max(-1.0, vertical))))
        estimator = self.loop.estimator_state
        if injector.acting:
            self.named.update(f'targets of {leg}' for leg in (
                *guard.silent(state.time_ns), *guard.doubted(state.time_ns)))
            self.named.update(() if estimator is None else estimator.estimate.problems)
        targets = guard.targets(state)
        self.loop.told_drive(guard.fallback)
        if injector.acting:
            self.named.update(f'joint {name}' for name in guard.drives.failing)
        self.robot.without_power = guard.drives.lame
        self.state = self.robot.step(injector.driven(targets))

    def _on_tick(self, stamp_ns: int, inputs: Mapping[str, Any]) -> None:
        targets = self.loop.tick(inputs['robot']).targets.by_leg()
        self._sent = [(leg, stamp_ns, of_leg) for leg, of_leg in targets.items()]


@cache
def walking(gait: str, robot: str, speed: float) -> FailingWalk:
    """A robot that walks, with an injector that knows the last of it only; to be copied."""
    walk = FailingWalk(gait, robot)
    walk.run(STANDS_S)
    walk.loop.request(False)
    walk.follow(speed, WALKS_S)
    walk.injector = FaultInjector()
    walk.follow(speed, LAST_S)
    return walk


def trial(case: Case) -> Outcome:
    """Let a component fail."""
    before = walking(case.gait, case.robot, case.speed)
    kept = (before.robot.model, before.robot.description)
    walk = deepcopy(before, {id(part): part for part in kept})
    walk.injector.seed(case.seed)
    walk.follow(case.speed, case.later_s)
    fell, leg = False, case.leg if case.component in PLACED else ''
    if case.first:
        walk.injector.add(
            Fault(case.component, case.first, case.first_s, leg), walk.state.time_ns)
        fell = walk.follow(case.speed, case.first_s)
    walk.injector.add(Fault(case.component, case.kind, case.fails_s, leg), walk.state.time_ns)
    fell = walk.follow(case.speed, case.fails_s + AFTER_S) or fell
    walked = walk.loop.stop.state == 'walking'
    walk.loop.request(True)
    rested = 0
    for _ in range(round(STOPS_S / 0.1)):
        walk.run(0.1)
        fell = fell or walk.fallen
        rested = rested + 1 if walk.loop.stop.state == 'at_rest' else 0
        if fell or rested == RESTS:
            break
    rests = walked and rested > 0
    lies = walk.loop.mode.mode not in BALANCED
    return Outcome('falls' if fell else 'lies' if lies else 'rests' if rests else 'stops',
                   tuple(sorted(walk.named)))


def study(cases: Sequence[Case], workers: Workers) -> dict[Case, Outcome]:
    """Outcome of every case."""
    with workers:
        return dict(zip(cases, workers.map(trial, cases), strict=True))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = parser_of('failures', __doc__, 'the outcomes')
    parser.add_argument('--gaits', nargs='+', default=GAITS)
    parser.add_argument('--components', nargs='+', choices=COMPONENTS, default=COMPONENTS)
    parser.add_argument('--kinds', nargs='+', choices=KINDS, default=KINDS)
    parser.add_argument('--draws', type=at_least_one, metavar='N',
                        help='draw N cases of each cell, and count those that fall or stop')
    parser.add_argument('--seed', type=int, default=0, help='of the first case of each cell')
    parser.add_argument('--lasts', nargs=2, type=float, default=LASTS, metavar='S',
                        help='between what the time of a failure is drawn (default: 0.1 2)')
    parser.add_argument('--speeds', nargs='+', type=float, default=SPEEDS, metavar='M/S',
                        help='from what the speed is drawn (default: 0.5 1)')
    parser.add_argument('--first', choices=KINDS, default='',
                        help='how what is drawn fails before, for as long as it may')
    parser.add_argument('--robots', nargs='+', default=[Case._field_defaults['robot']],
                        metavar='FILE', help='of which one is drawn')
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: Any) -> int:
    cells = [(gait, component, kind) for gait in options.gaits
             for component in options.components for kind in options.kinds]
    seeds = range(options.seed, options.seed + (options.draws or 0))
    cases = {cell: [drawn(cell, seed, options.robots, options.lasts, options.speeds,
                         options.first)
                    for seed in seeds]
             if options.draws else [Case(*cell)] for cell in cells}
    outcomes = study([case for of in cases.values() for case in of],
                     Workers(options.workers, options.cluster))
    for gait in options.gaits:
        rows = [[component, *(_told([outcomes[case] for case in cases[gait, component, kind]])
                              for kind in options.kinds)] for component in options.components]
        print(f'{gait}:\n\n{markdown_table(("component", *options.kinds), rows)}\n')
    write_results(options.json, [{'case': case, **of._asdict()} for case, of in outcomes.items()])
    return 0


def _told(outcomes: Sequence[Outcome]) -> str:
    """Text of a cell of the table."""
    if len(outcomes) == 1:
        end, named = outcomes[0]
        return f'{end} ({", ".join(named)})' if named else end
    ends = [of.end for of in outcomes]
    return (f'{ends.count("falls")} fall, {ends.count("lies")} lie, {ends.count("stops")} stop, '
            f'{sum(bool(of.named) for of in outcomes)} named of {len(ends)}')


if __name__ == '__main__':
    sys.exit(main())
