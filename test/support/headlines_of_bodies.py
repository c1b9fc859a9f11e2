# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documents say of studies of the body: pushes, what is not known of it, other robots,
a learned policy.

Each study has its headline of the README and rows of a document's tables, made from the content of
the file that its command has written.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import product
from math import nan, pi
from statistics import median
from typing import Any

from checkout import ROOT

from dmp_cpg_ros.studies.benchmark_cases import MISMATCHED, MISMATCHED_WALKS
from dmp_cpg_ros.studies.benchmark_walking import steady_cells
from dmp_cpg_ros.studies.loop_recording import StopOutcome, StopSummary
from dmp_cpg_ros.studies.trial_tables import least_and_median
from dmp_cpg_ros.studies.walking_trials import SteadyOutcome, relative_error

FOLDER = ROOT / 'doc' / 'results'
"""Where the files are, named as the sections: ``COMMAND --json doc/results/SECTION.json``."""

Pushes = dict[str, list[list[float]]]
"""Speed changes that were survived (phases, directions), by who was pushed [m/s]."""


def steady_outcome(outcome: dict[str, Any]) -> SteadyOutcome:
    """Outcome of a velocity that was held."""
    return SteadyOutcome(**{name: nan if value is None else value
                            for name, value in outcome.items()})


# --- pushes -------------------------------------------------------------------------------------


def survived(results: Any, *names: str) -> Pushes:
    """Pushes survived, by what their cases have under some names."""
    of: Pushes = {}
    for one in results:
        key = ' '.join(f'{one["case"][name]:g}' if isinstance(one['case'][name], float)
                       else one['case'][name] for name in names)
        of.setdefault(key, []).append(one['outcome']['speed_change'])
    return of


def least(changes: Sequence[Sequence[float]]) -> float:
    """Largest push that is survived at every phase from everywhere [m/s]."""
    return min(map(min, changes))


def at_rest(results: Any) -> dict[float, dict[bool, list[bool]]]:
    """Falls by pushes all around a robot at rest: by speed change, and whether it may step."""
    of: dict[float, dict[bool, list[bool]]] = {}
    for one in results['manoeuvres']:
        case = one['case']
        if case['manoeuvre'] == 'at rest' and not case['drawn']:
            of.setdefault(case['speed_change'], {}).setdefault(case['recovery'], []).append(
                one['outcome']['fell'])
    return of


def pushes(results: Any) -> str:
    """Of ``benchmark_walking --tables pushes manoeuvres``."""
    walks, resting = survived(results['pushes'], 'gait', 'speed'), at_rest(results)
    of = json.loads((FOLDER / 'other-robots.json').read_text(encoding='utf-8'))
    mass = other_robots(of)[ROBOTS['mini_quadruped']]['mass']
    amble, (low, high) = least(walks['amble 0.5']), (min(resting), max(resting))

    def falls(change: float, steps: bool) -> str:
        return f'{sum(resting[change][steps])} of {len(resting[change][steps])}'

    return (f'at every phase, from everywhere, amble 0.5 m/s: {amble:.1f} m/s '
            f'({amble * mass:.1f} N s), trot: {least(walks["trot 0.5"]):.1f} m/s; at rest '
            f'{low:g} m/s from {len(resting[low][True])} directions: {falls(low, True)} falls '
            f'(without steps {falls(low, False)}), {high:g} m/s: {falls(high, True)} '
            f'({falls(high, False)})')


def push_rows(results: Any) -> list[str]:
    """Rows of the table of pushes."""
    return [' | '.join((f'| {name} m/s', *least_and_median(of))) + ' |'
            for name, of in survived(results['pushes'], 'gait', 'speed').items()]


def manoeuvre_rows(results: Any) -> list[str]:
    """Rows of the table of pushes at rest and in manoeuvres."""
    cells: dict[tuple[str, bool, float], dict[bool, list[Any]]] = {}
    for one in results['manoeuvres']:
        case = one['case']
        cells.setdefault((case['manoeuvre'], case['drawn'], case['speed_change']), {}).setdefault(
            case['recovery'], []).append(one['outcome'])
    rows = []
    for (name, drawn, change), of in cells.items():
        fell = [f'{sum(one["fell"] for one in of[steps])}/{len(of[steps])}' if steps in of else '–'
                for steps in (False, True)]
        rests = ['–', '–']  # where no stop is in force
        if False in of:
            rests = [str(sum(one['rests'] for one in of[True])),
                     str(max(one['releases'] for one in of[True]))]
        rows.append(' | '.join((
            f'| {name}', 'drawn' if drawn else f'{len(of[True])} directions', f'{change:g}',
            *fell, *rests)) + ' |')
    return rows


# --- robots that are others ---------------------------------------------------------------------


def mismatched(results: Any) -> Iterator[tuple[str, str, list[float], int]]:
    """What is not known, who walks, errors of the speed [%], and how many walked."""
    cells = list(product(MISMATCHED, MISMATCHED_WALKS))
    each = len(results['mismatch']) // len(cells)
    for k, (what, (gait, speed)) in enumerate(cells):
        of = [steady_outcome(one['outcome'])
              for one in results['mismatch'][k * each:(k + 1) * each]]
        yield what, f'{gait} {speed:g}', [
            100.0 * relative_error(one, (speed, 0.0, 0.0)) for one in of if not one.fell], each


def mismatch(results: Any) -> str:
    """Of ``benchmark_walking --tables mismatch``."""
    of = list(mismatched(results))
    walks = sum(each for *_, each in of)
    fell = walks - sum(len(errors) for _, _, errors, _ in of)
    worst = max(max(errors) for _, _, errors, _ in of)
    payload, weak, friction, noise, aside = map(unknown(results).__getitem__, (
        'payload', 'joint_strength', 'joint_friction', 'sensor_noise', 'mass_offset'))
    load = "the robot's mass" if payload == 1.0 else f"{payload:g} of the robot's mass"
    assert friction == noise, (friction, noise)
    return (f'payload of {load}, a drive at {100.0 * weak:.0f} %, {NUMBERS[int(friction)]} times '
            f"the friction or the sensors' noise, mass {100.0 * aside:g} cm aside: {walks} walks, "
            f'{fell or "no"} fall, speed within {worst:.1f} %')


def unknown(results: Any) -> dict[str, float]:
    """What the controllers do not know, by its name: the size of the one value that is none of
    a robot as they know it.
    """
    of: dict[str, set[float]] = {}
    for one in results['mismatch']:
        for name, value in one['case']['values']:
            listed = value if isinstance(value, list) else [value]
            usual = 0.0 if name == 'mass_offset' else 1.0 if name == 'joint_strength' else None
            of.setdefault(name, set()).update(abs(part) for part in listed if part != usual)
    assert all(len(sizes) == 1 for sizes in of.values()), of
    return {name: size for name, (size,) in of.items()}


def mismatch_rows(results: Any) -> list[str]:
    """Rows of the table of robots that are not as their controllers know them."""
    return [f'| {what} | {who} | {each - len(errors)}/{each} | {median(errors):.1f} | '
            f'{max(errors):.1f} |' for what, who, errors, each in mismatched(results)]


ROBOTS = {
    'mini_quadruped': "the package's own", 'mini_cheetah': 'Mini Cheetah', 'go1': 'Go1',
    'go2': 'Go2', 'aliengo': 'AlienGo', 'a2': 'A2', 'spot': 'Spot', 'pegasus': 'Pegasus',
    'b2': 'B2', 'hyqreal1': 'HyQReal 1', 'hyqreal2': 'HyQReal 2'}
"""Names of the robots by those of their files."""

NUMBERS = ('no', 'one', 'two', 'three', 'four', 'five', 'six', 'seven', 'eight', 'nine', 'ten',
           'eleven', 'twelve')


def other_robots(results: Any) -> dict[str, Any]:
    """Outcomes by the names of the robots."""
    return {ROBOTS[one['case']['file'].rpartition('/')[2].removesuffix('.yaml')]: one['outcome']
            for one in results['robots']}


def robots(results: Any) -> str:
    """Of ``benchmark_walking --tables robots``."""
    of = {name: one for name, one in other_robots(results).items()
          if name != ROBOTS['mini_quadruped']}
    mass, top = ([one[name] for one in of.values()] for name in ('mass', 'top_speed'))
    first, *_, last = of
    return (f'{NUMBERS[len(of)]} of {min(mass):.0f} to {max(mass):.0f} kg, {first} to '
            f'{last.split()[0]}: trot held at {min(top):.1f} to {max(top):.1f} m/s, '
            f'{sum(one["stop_falls"] for one in of.values())} falls in stops')


def robot_rows(results: Any) -> list[str]:
    """Rows of the table of other robots."""
    rows = []
    for name, of in other_robots(results).items():
        cells = []
        for gait, speed in (('amble', 0.5), ('trot', 1.0)):
            _, error, _, cost = steady_cells((speed, 0.0, 0.0), steady_outcome(of[gait]))
            cells.append(f'{error} %, {cost}')
        rows.append(' | '.join((
            f'| {name}', f'{of["mass"]:.1f}', *cells, f'{of["top_speed"]:.1f} m/s',
            f'{of["stood"]} / {of["walked_on"]} / {of["stop_falls"]}',
            f'{of["pushed"]:.1f} ({of["pushed"] * of["mass"]:.0f})')) + ' |')
    return rows


# --- beside a learned policy --------------------------------------------------------------------


def tracked(results: Any) -> dict[tuple[float, ...], dict[str, SteadyOutcome]]:
    """Outcomes by velocity and who walked."""
    of: dict[tuple[float, ...], dict[str, SteadyOutcome]] = {}
    for one in results['tracking']:
        case = one['case']
        of.setdefault(tuple(case['velocity']), {})[case['walker']] = steady_outcome(one['outcome'])
    return of


def duel_stops(results: Any) -> dict[tuple[str, float], StopSummary]:
    """Stops by who stopped, and from which speed."""
    of: dict[tuple[str, float], list[StopOutcome]] = {}
    for one in results['stops']:
        case = one['case']
        of.setdefault((case['walker'], case['speed']), []).append(StopOutcome(**{
            name: nan if value is None else value for name, value in one['outcome'].items()}))
    return {key: StopSummary(outcomes) for key, outcomes in of.items()}


def duel(results: Any) -> str:
    """Of ``duel``."""
    ahead = {v[0]: of for v, of in tracked(results).items() if v[0] > 0.0 and not any(v[1:])}
    errors = {name: {v: relative_error(of[name], (v, 0.0, 0.0)) for v, of in ahead.items()}
              for name in ('policy', 'trot')}
    walks = min(v for v, error in errors['policy'].items() if error < 0.9)
    of, stops = survived(results['pushes'], 'walker'), duel_stops(results)
    still = [stops[name, 1.0].spread('still_s')[0] for name in ('trot', 'policy')]
    return ("on MuJoCo Playground's Go1: a trot keeps "
            f'{min(ahead):g} to {max(ahead):g} m/s within '
            f'{100.0 * max(errors["trot"].values()):.1f} % (the policy stands below {walks:g} '
            f'm/s), withstands {least(of["trot"]):.1f} m/s from everywhere (the policy '
            f'{least(of["policy"]):.1f}), stops from 1 m/s in {still[0]:.2f} s ({still[1]:.2f})')


def duel_rows(results: Any) -> list[str]:
    """Rows of the tables of the duel: velocities held, pushes, stops, standing."""
    rows: list[tuple[str, ...]] = []
    for velocity, of in tracked(results).items():
        cells = []
        for outcome in of.values():
            reached, error, drift, cost = steady_cells(
                (velocity[0], velocity[1], velocity[2]), outcome)
            walked = '' if drift == '-' else f', {drift}°, {cost}'
            cells.append(reached if outcome.fell else f'{error} %{walked}')
        rows.append((', '.join(f'{part:g}' for part in velocity), *cells))
    rows += [(name, *least_and_median(changes))
             for name, changes in survived(results['pushes'], 'walker').items()]
    rows += [(name, f'{speed:g}', str(stops.number('fell')), str(stops.number('standing')),
              *(stops.cell(what, scale, digits) for what, scale, digits in (
                    ('still_s', 1.0, 2), ('displacement_m', 1.0, 2), ('slip_m', 1e3, 1),
                    ('tilt', 180.0 / pi, 1), ('deceleration', 1.0, 1))))
             for (name, speed), stops in duel_stops(results).items()]
    for one in results['standing']:
        at, name = one['outcome'], one['case']['walker']
        rows.append(('policy' if name == 'policy' else 'suite', 'yes' if at['fell'] else 'no',
                     f'{1e3 * at["way"]:.1f}', f'{1e3 * at["speed"]:.1f}', f'{at["torque"]:.2f}',
                     f'{100.0 * at["loaded"]:.0f} %'))
    return [' | '.join(('| ' + row[0], *row[1:])) + ' |' for row in rows]
