# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Walks under random commands: velocities that jump every 0.5 to 3 s over all that may be asked,
gaits that change every 2 to 8 s, stops every 4 to 14 s that are held for 0.2 to 4.5 s. With
``--changes`` also one of the parameters that may change while they run every 0.3 to 3 s, anywhere
in its range or in what certificates can be had for, and lying down or standing up every 5 to 20 s.
With ``--drawn-gaits`` gaits have any lags, as those of a user's own may have them.
With ``--auto-gait`` the gait is chosen by speed, among gaits and at speeds that change every 5 to
20 s; with ``--disturbed`` each walk is disturbed by some of a slippery floor, hills and bumps, a
payload, and pushes (:mod:`~dmp_cpg_ros.studies.disturbances`).

Prints the falls with what was asked when, the stops that took longer than their bound or another
time than predicted, and the share of what was asked that was granted. Of stops in which parameters
changed or the robot was to lie down too nothing was predicted. The MuJoCo robot in the
plain loop, with the state estimated from noisy sensors. Equal seeds give equal walks.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.canonical.coupling import TOPOLOGIES
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.studies import output
from dmp_cpg_ros.studies.disturbances import UNDISTURBED, Disturbance, pushes
from dmp_cpg_ros.studies.draws import log_uniform
from dmp_cpg_ros.studies.loop_recording import Velocity, suite_of
from dmp_cpg_ros.studies.push_trials import push
from dmp_cpg_ros.studies.walking_trials import Walk
from dmp_cpg_ros.studies.workers import Workers

JUMPS, CHANGES, STOPS, HOLDS = (0.5, 3.0), (2.0, 8.0), (4.0, 14.0), (0.2, 4.5)
"""Times between jumps of the command, changes of the gait and stops, and of holding one [s]."""

SETTINGS, MODES, CHOICES = (0.3, 3.0), (5.0, 20.0), (5.0, 20.0)
"""Times between changes of a parameter, between requests to lie down or stand up, and between
changes of what ``auto_gait`` chooses among [s].
"""

DRAWN = ('first', 'second', 'third')
"""Names of gaits that are drawn."""

GAITS = ('amble', 'walk', 'trot', 'pace', 'bound', 'pronk')

NUMBERS = {
    'rho': (2.0, 50.0), 'coupling_gain': (5.0, 400.0), 'cadence_scale': (0.7, 4.0),
    'gait_change_rate': (0.01, 0.6), 'alpha_r': (0.3, 6.0), 'max_speed': (0.02, 10.0),
    'max_lateral_speed': (0.02, 10.0), 'max_turn_rate': (0.02, 10.0), 'max_curve': (0.01, 10.0),
    'braking': (0.5, 6.0), 'inhibition_gain': (100.0, 4000.0), 'region_radius': (0.05, 0.6),
    'capture_speed': (0.01, 10.0), 'auto_delay': (0.05, 5.0)}
"""Numbers that change, and between what they are drawn, evenly over their logarithms."""

BAND, APART = (0.001, 0.2), (0.02, 0.5)
"""Of ``auto_gait``: width of the bands, and distances between them, dimensionless speeds."""

NEAR_THE_GROUND = ('lowering', 'lying', 'rising')
"""Modes of a body that has not fallen and may touch the ground."""

WORDS: dict[str, tuple[Any, ...]] = {
    'coupling_graph': TOPOLOGIES, 'inhibited_legs': (('auto',), *((leg,) for leg in LEGS),
                                                     ('fl', 'rr'), ('fr', 'rl', 'rr'), LEGS),
    'auto_gait': (False, True), 'auto_inhibit': (False, True), 'push_recovery': (False, True),
    'caution': (False, True)}
"""Choices that change."""


@dataclass
class Outcome:
    """What became of one walk.

    Attributes
    ----------
    seed : int
        Of commands, start and noise.
    seconds : float
        Time until the end or the fall [s].
    fell : str
        What went on at the fall; empty without.
    asked, granted : float
        Foot speed of the command and of what is left of it within the limits, over the time at
        which no stop held it [m].
    stops : list of (str, float, float, float)
        Gait; time to rest as predicted, bounded, and measured of those that came to rest [s].
    stepped : int
        Stops that the robot stepped out of, of which nothing is claimed.
    changed, refused : int
        Changes of parameters that were made, and those that were refused.
    touched : float
        Time at whose ticks parts of the robot touched one another, as legs that kick each other
        [s].
    disturbed : dict of str to float
        By what, but for pushes.
    pushed : int
        Pushes.
    """

    seed: int
    seconds: float = 0.0
    fell: str = ''
    asked: float = 0.0
    granted: float = 0.0
    stops: list[tuple[str, float, float, float]] = field(default_factory=list)
    stepped: int = 0
    changed: int = 0
    refused: int = 0
    touched: float = 0.0
    disturbed: dict[str, float] = field(default_factory=dict)
    pushed: int = 0

    @property
    def late(self) -> list[tuple[str, float, float, float]]:
        """Stops beyond their bound, or at another time than was predicted."""
        return [stop for stop in self.stops
                if stop[3] > stop[2] + 1e-9 or abs(stop[3] - stop[1]) > 1e-9]


def course(seed: int, seconds: float, limits: Velocity, gaits: Sequence[str] = GAITS,
           changes_too: bool = False, auto_gait: bool = False) -> list[tuple[float, str, Any]]:
    """Events of one walk in order of time: ``command``, ``gait``, ``stop`` (whether), with changes
    ``set`` (a mapping) and ``mode``, and with gaits by speed ``set`` instead of ``gait``; those of
    a longer one begin with them.
    """
    jumps, changes, stops, settings, modes, choices = np.random.default_rng(seed).spawn(6)

    def times(rng: np.random.Generator, between: tuple[float, float]) -> Iterator[float]:
        at = 0.0
        while (at := at + float(rng.uniform(*between))) < seconds:
            yield at

    events: list[tuple[float, str, Any]] = [
        (at, 'command', tuple((jumps.uniform(-1.0, 1.0, 3) * limits).tolist()))
        for at in chain((0.0,), times(jumps, JUMPS))]
    if auto_gait:
        events += [(at, 'set', choice(choices, gaits))
                   for at in chain((0.0,), times(choices, CHOICES))]
    else:
        events += [(at, 'gait', str(changes.choice(gaits))) for at in times(changes, CHANGES)]
    begin = 0.0
    for at in times(stops, STOPS):
        if at > begin:  # not while the stop before is held
            begin = at + float(stops.uniform(*HOLDS))
            events += [(at, 'stop', True), (begin, 'stop', False)]
    if changes_too:
        events += [(at, 'set', setting(settings)) for at in times(settings, SETTINGS)]
        events += [(at, 'mode', str(modes.choice(['lie_down', 'stand_up'])))
                   for at in times(modes, MODES)]
    return sorted(events, key=lambda event: event[0])


def setting(rng: np.random.Generator) -> dict[str, Any]:
    """Draw a parameter and its value."""
    name = str(rng.choice([*NUMBERS, *WORDS]))
    if name in WORDS:
        return {name: WORDS[name][rng.integers(len(WORDS[name]))]}
    return {name: log_uniform(rng, *NUMBERS[name])}


def choice(rng: np.random.Generator, gaits: Sequence[str]) -> dict[str, Any]:
    """Draw gaits that are chosen by speed, in any order, and the speeds at which."""
    band = log_uniform(rng, *BAND)
    borders = np.cumsum([band + log_uniform(rng, *APART) for _ in range(
        int(rng.integers(1, min(4, len(gaits)))))]).tolist()
    return {'auto_gait': True, 'auto_hysteresis': band, 'auto_speeds': tuple(borders),
            'auto_gaits': tuple(map(str, rng.choice(gaits, len(borders) + 1, replace=False)))}


def drawn_gaits(seed: int) -> dict[str, Gait]:
    """Three gaits by name, equal for equal seeds: each leg lags by anything or by twelfths of a
    cycle, the cadence is 0.3 to 0.75 √(g/l), and a foot stands for 0.5 to 0.8 of a cycle.
    """
    rng, gaits = np.random.default_rng(seed), dict[str, Gait]()
    for name in DRAWN:
        lags = rng.random(4) if rng.random() < 0.5 else rng.integers(0, 12, 4) / 12.0
        cadence, duty = rng.uniform(0.3, 0.5), rng.uniform(0.55, 0.8)
        gaits[name] = Gait.from_mapping(name, {
            'lag': dict(zip(LEGS, lags.tolist(), strict=True)), 'speed': [0.0, 0.5],
            'cadence': [cadence, cadence * rng.uniform(1.0, 1.5)],
            'duty_factor': [duty, max(0.5, duty - rng.uniform(0.0, 0.15))], 'highest_speed': 0.5})
    return gaits


def trial(seed: int, seconds: float, robot: str | None = None, gaits: Sequence[str] = GAITS,
          changes: bool = False, auto_gait: bool = False, disturbed: bool = False,
          rate: float = 0.0, size: float = 1.0, file: str | None = None,
          drawn: bool = False) -> Outcome:
    """Walk one course, from a gait that its seed draws.

    Parameters
    ----------
    seed : int
        Of commands, start and noise.
    seconds : float
        Length [s].
    robot : str, optional
        Robot file; the suite's own without.
    gaits : sequence of str
        Gaits to change among.
    changes : bool
        Whether parameters change and the robot lies down and stands up meanwhile.
    auto_gait : bool
        Whether the gait is chosen by speed; at least two of ``gaits`` then.
    disturbed : bool
        Whether the robot is disturbed meanwhile.
    rate : float
        Of the control [Hz]; that of the package's parameter file with 0.
    size : float
        Of disturbances: lengths, in those of the package's own robot.
    file : str, optional
        Parameter file; the package's own without.
    drawn : bool
        Whether gaits are drawn instead of named.
    """
    known = drawn_gaits(seed) if drawn else None
    gaits = list(known or gaits)
    first = gaits[seed % len(gaits)]
    p = suite_of(file, robot=robot).parameters.reference
    limits = (p.max_speed, p.max_lateral_speed, p.max_turn_rate)
    disturbance = Disturbance.drawn(seed, size) if disturbed else UNDISTURBED
    run = Walk(first, robot, disturbance.world, seed + 1,
               (*disturbance.values, *((('control_rate', rate),) if rate else ())), file=file,
               gaits=known)
    outcome = Outcome(seed, disturbed=disturbance.told)
    loop, asked, open_stop = run.loop, (0.0, 0.0, 0.0), None
    events = course(seed, seconds, limits, gaits, changes, auto_gait)
    if disturbance.pushes:
        events = sorted(events + pushes(seed, seconds, size), key=lambda event: event[0])
    foot_speed = loop.canonical.scale.foot_speed
    for k in range(round(seconds / run.tick_s)):
        stops = False
        while events and events[0][0] <= k * run.tick_s:
            _, what, value = events.pop(0)
            if what == 'command':
                asked = value
                loop.command(*asked)
            elif what == 'gait':
                _refused(loop, {'gait': value})
            elif what == 'set':
                refused = _refused(loop, value)
                outcome.refused, outcome.changed = (
                    outcome.refused + refused, outcome.changed + (not refused))
                open_stop = open_stop if refused else None
            elif what == 'mode':
                with suppress(DataError):  # such as to stand up while it stands
                    loop.request_mode(value)
                    open_stop = None
            elif what == 'push':
                push(run, *value)
                outcome.pushed += 1
            else:
                stops, open_stop = value and not loop.inhibition.requested, None
                with suppress(DataError):  # a start while it does not stand
                    loop.request(value)
        if stops:  # what comes within the tick of a request acts when it does
            open_stop = loop.canon.gait.name, loop.request(True), loop.time_to_rest()
        run.tick(run.tick_s)
        run.states.clear()
        outcome.seconds += run.tick_s
        outcome.touched += run.tick_s * touches_itself(run.robot.model, run.robot.data)
        if not loop.inhibition.requested:
            outcome.asked += foot_speed(*asked) * run.tick_s
            outcome.granted += foot_speed(*loop.gate.at(run.state.time_ns)) * run.tick_s
        if open_stop is not None and loop.stop.state in ('releasing', 'stepping'):
            outcome.stepped, open_stop = outcome.stepped + 1, None
        if open_stop is not None and loop.stop.state == 'at_rest':
            outcome.stops.append((*open_stop, loop.stop.measured_s))
            open_stop = None
        if run.fell() and loop.mode.mode not in NEAR_THE_GROUND:
            v_x, v_y, gamma = asked
            outcome.fell = (
                f'{outcome.seconds:.1f} s, {loop.canon.gait.name}, {loop.stop.state}, asked '
                f'({v_x:.2f}, {v_y:.2f}) m/s, {gamma:.2f} rad/s')
            break
    return outcome


def _refused(loop: WalkingLoop, values: Mapping[str, Any]) -> bool:
    """Ask for a change, of which some are impossible, as of the gait while it is chosen by speed;
    whether it is refused.
    """
    try:
        return bool(loop.change(values))
    except ParameterError:
        return True


def touches_itself(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Whether two moving bodies of a model touch each other."""
    root = model.body_rootid[model.geom_bodyid[data.contact.geom]]
    return bool((root[:, 0] == root[:, 1]).any())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the walks and print what became of them; returns 1 if one fell or a stop was late."""
    parser = output.parser_of('random_commands', __doc__, 'every outcome')
    parser.add_argument('file', nargs='?', help="parameter file; the package's own without")
    parser.add_argument('--runs', type=output.at_least_one, default=20, metavar='N')
    parser.add_argument('--seconds', type=float, default=60.0, help='of each walk (default: 60)')
    parser.add_argument('--robot', metavar='FILE', help="robot file (default: the suite's own)")
    gaits = parser.add_mutually_exclusive_group()
    gaits.add_argument('--gaits', nargs='+', metavar='GAIT', help="gaits to change among, of the "
                       "parameter file's gaits_file (default: all of them)")
    gaits.add_argument('--drawn-gaits', action='store_true', help='gaits that are drawn instead')
    parser.add_argument('--changes', action='store_true', help='parameters change, and the robot '
                        'lies down and stands up, meanwhile')
    parser.add_argument('--auto-gait', action='store_true', help='the gait is chosen by speed')
    parser.add_argument('--disturbed', action='store_true', help='a slippery floor, hills and '
                        'bumps, a payload, pushes: each walk has some of them')
    parser.add_argument('--rate', type=float, default=0.0, metavar='HZ',
                        help="of the control (default: the parameter file's)")
    parser.add_argument('--seed', type=int, default=0, help='of the first walk (default: 0)')
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: RosArguments) -> int:
    known = suite_of(options.file, robot=options.robot).gaits
    for gait in (gaits := options.gaits or list(known.gaits)):
        known.named(gait)
    walk = partial(trial, seconds=options.seconds, robot=options.robot, gaits=gaits,
                   changes=options.changes, auto_gait=options.auto_gait,
                   disturbed=options.disturbed, rate=options.rate, file=options.file,
                   drawn=options.drawn_gaits)
    outcomes = []
    with Workers(options.workers, options.cluster, progress=True) as workers:
        for outcome in workers.map(walk, range(options.seed, options.seed + options.runs)):
            outcomes.append(outcome)
            for line in ([f'fell: {outcome.fell}'] if outcome.fell else []) + [
                    f'stop in {gait}: predicted {predicted:.3f} s, bound {bound:.3f} s, '
                    f'took {took:.3f} s' for gait, predicted, bound, took in outcome.late]:
                print(f'seed {outcome.seed}: {line}', flush=True)
    fallen, late = (sum(map(bool, values)) for values in (
        [outcome.fell for outcome in outcomes], [late for each in outcomes for late in each.late]))
    stops, stepped = sum(len(each.stops) for each in outcomes), sum(
        each.stepped for each in outcomes)
    asked, granted = (sum(getattr(each, name) for each in outcomes)
                      for name in ('asked', 'granted'))
    walked, touched = (sum(getattr(each, name) for each in outcomes)
                       for name in ('seconds', 'touched'))
    print('\n' + output.markdown_table(
        ('walks', 'time s', 'fell', 'stops to rest', 'late', 'stepped out', 'granted',
         'touched itself', 'changed', 'refused'),
        [(str(len(outcomes)), f'{walked:.0f}', str(fallen), str(stops), str(late), str(stepped),
          output.percent(granted, asked), f'{100.0 * touched / walked:.1f} %',
          str(sum(each.changed for each in outcomes)),
          str(sum(each.refused for each in outcomes)))]))
    output.write_results(options.json, [vars(outcome) for outcome in outcomes])
    return int(fallen > 0 or late > 0)


if __name__ == '__main__':
    sys.exit(main())
