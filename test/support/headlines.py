# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documents say of studies, made from the files that their commands write.

``python headlines.py`` (``make headlines``) writes the headlines of the README and the tables of
``doc/stops.md`` anew, and prints what ``doc/results.md`` and others should say and do not.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import headlines_of_bodies as bodies
import headlines_of_faults as faults
from checkout import ROOT

from dmp_cpg_ros.studies import certified_grid, first_walk
from dmp_cpg_ros.studies.random_stops import ROUGHNESS
from dmp_cpg_ros.studies.study_stops import table
from dmp_cpg_ros.studies.walking_trials import relative_error

README = ROOT / 'README.md'

STOPS = ROOT / 'doc' / 'stops.md'
"""Has the tables that ``study_stops`` prints, between lines that name their files."""

BENCHMARK = ROOT / 'doc' / 'performance.md'
"""The table that ``bench_ros`` writes, of :func:`rate`."""


def table_of_studies() -> dict[str, list[str]]:
    """Rows of the README's table by the anchor of their first link: cells with their marks."""
    rows = README.read_text(encoding='utf-8').partition('| study | headline | command |\n')[2]
    found = {}
    for line in rows.partition('\n\n')[0].splitlines()[1:]:
        cells = line.strip('| ').split(' | ')
        found[re.findall(r'\]\([^)]*#([^)]+)\)', cells[0])[0]] = cells
    return found


def section(link: str) -> str:
    """Text of a document below a heading, up to the next of its rank; of ``FILE#anchor``."""
    name, _, anchor = link.partition('#')
    lines, rank = [], 0
    for line in (ROOT / name).read_text(encoding='utf-8').splitlines():
        here = len(line) - len(line.lstrip('#'))
        if here and rank:
            if here <= rank:
                break
        elif here and slug(line) == anchor:
            rank = here
        if rank:
            lines.append(line)
    return '\n'.join(lines)


def slug(heading: str) -> str:
    """What a link to a heading ends with."""
    return re.sub(r'[^\w -]', '', heading.lstrip('# ')).strip().lower().replace(' ', '-')


def tables(text: str) -> Iterator[list[dict[str, str]]]:
    """Tables of a text, each as rows by the names of the columns."""
    for block in re.findall(r'(?:^\|.*\|\n?)+', text, re.MULTILINE):
        head, _, *rows = ([cell.strip() for cell in line.strip().strip('|').split('|')]
                          for line in block.splitlines())
        yield [dict(zip(head, cells, strict=False)) for cells in rows]


# --- headlines of the README ------------------------------------------------------------------


def experiment(metrics: Any) -> str:
    """Of ``metrics.json`` of ``make demo``."""
    stop, start = (as_predicted(metrics[what]) for what in ('stop', 'start'))
    return f'stop in {stop} (bound {metrics["stop"]["bound_s"]:.3f} s), resume in {start}'


def as_predicted(episodes: Any) -> str:
    """Duration of the worst of some episodes, and whether it was that which was predicted."""
    measured, predicted = episodes['measured_s'], episodes['predicted_s']
    assert episodes['completed'] == episodes['count'] > 0, episodes
    return f'{measured:.3f} s as predicted' if abs(measured - predicted) < 0.5e-3 else (
        f'{measured:.3f} s, {predicted:.3f} s predicted')


def stops(rows: Sequence[dict[str, str]]) -> str:
    """Of the rows of ``study_stops`` with ``--baselines``."""
    of = {way: [row for row in rows if row['gait'] != 'all' and row['stopped by'] == way]
          for way in ('inhibition', 'freeze')}
    count, fell = (sum(int(row[name]) for row in of['inhibition']) for name in ('cases', 'fell'))
    over = sum(int(row['over bound'].partition('/')[0]) for row in of['inhibition'])
    least = [min(int(row[name].removesuffix(' %')) for row in of['inhibition'])
             for name in ('stood', 'walked on')]
    fate = 'all stood and walked on' if least == [100, 100] else (
        f'stood {least[0]} %, walked on {least[1]} % at worst')
    return (f'{count:,} stops: {fell} falls, {fate}, bound {over or "never"} exceeded; freezing '
            f'all phases instead: {sum(int(row["fell"]) for row in of["freeze"])} falls')


def brisk_stops(rows: Sequence[dict[str, str]]) -> str:
    """Of the rows of ``study_stops`` with ``--braking``."""
    *cases, whole = rows
    over, bounded = whole['over bound'].split('/')
    assert bounded == whole['cases'] and whole['prediction error %'] == '0.0 / 0.0', whole
    speeds_asked = [float(row['m/s']) for row in cases]
    bounds = sorted({row['bound s'].split(' / ')[1] for row in cases})
    typical, worst = whole['still s'].split(' / ')
    return (f'with `inhibited_legs: [{value_of(cases, "leg")}]` and `braking: '
            f'{value_of(cases, "braking")}`, {whole["cases"]} stops from {min(speeds_asked):g} to '
            f'{max(speeds_asked):g} m/s at {value_of(cases, "cases")} phases: '
            f'{"no" if whole["fell"] == "0" else whole["fell"]} fall, the body stands after '
            f'{typical} s (median), {worst} s at worst; bounds {" and ".join(bounds)} s, '
            f'{"none" if over == "0" else over} exceeded')


def body_stops(of: Any) -> str:
    """Of ``study_stops --random``."""
    told = 'none of the others stood' if not of['late'] + of['far'] else (
        f'of the others {of["late"]} stood later and {of["far"]} farther on')
    below = f', in another one below {100.0 * of["below"]["1e-06"]:.2g} % at confidence ' \
        '1 − 10⁻⁶' if of['below'] else ''
    later = ' later or farther on' if told.endswith('stood') else ''
    slopes, hills = (f'{max(ROUGHNESS[ground]):g}°' for ground in ('slope', 'hills'))
    assert set(of['grounds']) == set(ROUGHNESS), of['grounds']
    return (f'{of["stops"]:,} random stops on the flat, slopes of {slopes} and hills of {hills}, '
            f'with friction of 0.3 to 1, payloads and pushes: {of["fell"] or "none"} fell, '
            f'{of["stepped"]} were stepped out of, {told}{later} than was said{below}')


def value_of(rows: Sequence[dict[str, str]], name: str) -> str:
    """The one value that a column has in all rows."""
    (value,) = {row[name] for row in rows}
    return value


def speeds(results: Any) -> str:
    """Of ``benchmark_walking --tables speeds``."""
    held = [(one['case'], errors(one)) for one in results['speeds']]
    most = {gait: max(case['velocity'][0] for case, _ in held if case['gait'] == gait)
            for gait in ('amble', 'trot')}
    worst = max(error for _, error in held)
    return (f'amble to {most["amble"]:.1f} m/s, trot to {most["trot"]:.1f} m/s: speed error at '
            f'most {100.0 * worst:.1f} %')


def errors(one: Any) -> float:
    """Relative error of a velocity that was held; without a fall it is a number."""
    outcome = bodies.steady_outcome(one['outcome'])
    assert not outcome.fell, one
    return relative_error(outcome, tuple(one['case']['velocity']))


def gaits(results: Any) -> str:
    """Of ``benchmark_walking --tables gaits``."""
    outcomes = [one['outcome'] for one in results['gaits']]
    names = {one['case']['before'] for one in results['gaits']}
    worst = max(one['phase_error'] for one in outcomes if not one['fell'])
    digits, power = f'{worst:.0e}'.split('e')
    sign = str(int(power)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))
    return (f'{len(outcomes)} changes between {bodies.NUMBERS[len(names)]} gaits: '
            f'{sum(one["fell"] for one in outcomes) or "no"} fall, largest phase error '
            f'{digits}·10{sign} rad')


def any_command(results: Any) -> str:
    """Of ``random_commands``."""
    count, _, fell, stops, late, stepped, _ = commanded(results)
    kept = 'as predicted and within their bounds' if not late else f'of which {late} were late'
    seconds = max(one['seconds'] for one in results)  # those that fell are shorter
    return (f'{count} walks of {seconds:.0f} s under random commands, gaits and stops on seeds '
            f'nothing was tuned on: {fell or "none"} fell, {stops:,} stops {kept}, {stepped} more '
            'stepped out of')


def commanded(results: Any) -> tuple[int, ...]:
    """Walks, their time [s], falls, stops to rest, those of them that were late, stops that the
    robot stepped out of, and the share of what was asked that was granted [%].
    """
    stops = [stop for one in results for stop in one['stops']]
    late = [gait for gait, predicted, bound, took in stops
            if took > bound + 1e-9 or abs(took - predicted) > 1e-9]
    share = sum(one['granted'] for one in results) / sum(one['asked'] for one in results)
    return (len(results), round(sum(one['seconds'] for one in results)),
            sum(bool(one['fell']) for one in results), len(stops), len(late),
            sum(one['stepped'] for one in results), round(100.0 * share))


def rough(results: Any) -> str:
    """Of ``benchmark_walking --tables rough``."""
    shares = [share for of in crossings(results).values() for share in of]
    seeds = {one['case']['seed'] for one in results['rough']}
    span = f'{min(shares):.0f} to {max(shares):.0f} %'.replace('100 to 100', '100')
    blocks, slope, steps, friction = (size_of(results['rough'], kind, name) for kind, name in (
        ('blocks', 'height'), ('slope', 'degrees'), ('steps', 'height'),
        ('low_friction', 'friction')))
    return (f'blind, {len(seeds)} seeds each: {span} cross blocks of {100.0 * blocks:g} cm, '
            f'slopes of {slope:g}°, steps of {100.0 * steps:g} cm, and friction {friction:g}')


def size_of(of: Any, kind: str, name: str) -> float:
    """The size that a number of all grounds of a kind has."""
    (size,) = {abs(one['case']['numbers'][name]) for one in of if one['case']['kind'] == kind}
    return float(size)


def stairs(results: Any) -> str:
    """Of ``benchmark_walking --tables climbing``."""
    counts, of = climbed(results), len(results['climbing']) // 2
    (off, off_fell, _), (on, on_fell, _) = (
        map(sum, zip(*(counts[word, gait] for gait in ('amble', 'trot')), strict=True))
        for word in ('off', 'on'))
    high, number = (size_of(results['climbing'], 'steps', name) for name in ('height', 'count'))
    return (f'{bodies.NUMBERS[int(number)]} of {100.0 * high:g} cm up and down, blind: {on} of '
            f'{of} walks cross, {on_fell} fall; without what all legs share {off or "none"} and '
            f'{off_fell}')


def climbed(results: Any) -> dict[tuple[str, str], list[int]]:
    """How many walks crossed, fell, and stopped as blocked, by ``climbing`` and gait."""
    of: dict[tuple[str, str], list[int]] = {}
    for one in results['climbing']:
        case, outcome = one['case'], one['outcome']
        counts = of.setdefault(('off' if case['values'] else 'on', case['gait']), [0, 0, 0])
        for k, name in enumerate(('crossed', 'fell', 'blocked')):
            counts[k] += outcome[name]
    return of


def crossings(results: Any) -> dict[str, list[float]]:
    """Shares of the seeds that crossed each ground, by gait [%]."""
    of: dict[str, dict[str, list[bool]]] = {}
    for one in results['rough']:
        case = one['case']
        grounds = of.setdefault(case['gait'], {})
        crossed = grounds.setdefault(f'{case["kind"]} {case["numbers"]}', [])
        crossed.append(one['outcome']['crossed'])
    return {gait: [100.0 * sum(crossed) / len(crossed) for crossed in grounds.values()]
            for gait, grounds in of.items()}


def tightness(rows: Any) -> str:
    """Of ``tightness``."""
    def span(*conditions: str, digits: int = 2) -> str:
        ratios = [ratio(row) for row in rows if row['condition'] in conditions]
        low, high = (f'{of(ratios):.{digits}f}' for of in (min, max))
        return low if low == high else f'{low} to {high}'

    tubes, slow = 'contraction along tubes', ', slow gait'
    return (f'certified over smallest gain: {span("synchronisation")} synchronisation, '
            f'{span("capture")} capture, {span("vote of two")} votes; contraction '
            f'{span(tubes, tubes + slow)} along tubes, '
            f'{span("contraction", "contraction" + slow, digits=1)} in a constant norm')


def settings(rows: Any) -> str:
    """Of ``certified_grid``."""
    of, tried = (sum(row[name] for row in rows) for name in ('certified', 'settings'))
    wrong = sum(row['certified'] - min(row['synchronise'], row['stop']) + row['keep'][1]
                - row['keep'][0] for row in rows)
    return (f'{of} of {tried:,} settings certified; '
            f'{f"{wrong} of them fail" if wrong else "none of them fails"} in simulation')


def ratio(row: Any) -> float:
    """How much more a certificate asks for than what works."""
    return max(row['certified'] / row['works'], row['works'] / row['certified'])


def falls(results: Any) -> str:
    """Of ``study_recovery``."""
    (of,) = results.values()
    stood = [fall for fall in of if fall['stands']]
    return (f'{len(stood)} of {len(of)} recovered to standing, '
            f'{median(fall["seconds"] for fall in stood):.1f} s in the median')


def rate(runs: Any) -> str:
    """Of some ``metrics.json`` of ``walk amble_60`` on slow cores, and the table of the benchmark.
    """
    each, composed, slow = (real_time_factor(runs[way])
                            for way in ('each', 'composed', 'each_100_hz'))
    assert slow > 0.999, slow
    usual, lower = (control_rate(runs[way]) for way in ('each', 'each_100_hz'))
    return (f'ten processes at {usual} Hz on two cores: real-time factor '
            f'{benchmarked("idle"):.2f}; on [slower cores](doc/performance.md) in slow motion '
            f'({each:.2f}, with `--composed` {composed:.2f}), at {lower} Hz in real time')


def control_rate(metrics: Any) -> int:
    """Ticks in a second of the robot's clock [Hz]."""
    return round(metrics['timing']['rate_hz'] / metrics['timing']['real_time_factor'])


def real_time_factor(metrics: Any) -> float:
    """Of a run in which the robot did not fall."""
    assert not metrics['robot']['fell'], metrics['robot']
    return float(metrics['timing']['real_time_factor'])


def benchmarked(how: str) -> float:
    """Real-time factor of ten processes in the benchmark, ``idle`` or ``busy``."""
    (measured,) = (row['measured'] for table in tables(BENCHMARK.read_text(encoding='utf-8'))
                   for row in table if row.get('what') == f'{how}: real-time factor')
    return float(measured)


# --- tables of doc/results.md -----------------------------------------------------------------


def experiment_rows(metrics: Any) -> list[str]:
    """What the section about the experiment says, in pieces."""
    stop, start = (as_predicted(metrics[what]) for what in ('stop', 'start'))
    moved = max(one['body_speed_at_rest_m_s'] for one in metrics['stop']['all'])
    return [f'speed error of at most {100.0 * metrics["tracking"]["v_error_max"]:.1f} %, '
            f'{metrics["robot"]["distance_m"]:.1f} m in all',
            f'stopped by the service in {stop} (bound {metrics["stop"]["bound_s"]:.3f} s',
            f'the body below {1e3 * moved:.1f} mm/s; resumed in {start}',
            f'Yaw drift {abs(metrics["robot"]["yaw_drift_deg_per_10m"]):.1f}° per 10 m',
            f'off by {abs(metrics["estimation"]["yaw_error_deg_per_10m"]):.1f}° per 10 m']


def stop_rows(rows: Sequence[dict[str, str]]) -> list[str]:
    """Rows of the table of stops: all of them, by each way to stop."""
    ways = {'inhibition': 'inhibiting one oscillator', 'freeze': 'freezing all phases at once',
            'finish_swing': 'letting every leg finish its swing'}
    names = ('fell', 'stood', 'body rest s', 'slip mm', 'moved m', 'tilt deg', 'm/s^2')
    return [' | '.join((f'| {ways[row["stopped by"]]}', *(row[name] for name in names))) + ' |'
            for row in rows if row['gait'] == 'all']


def brisk_rows(rows: Sequence[dict[str, str]]) -> list[str]:
    """Rows of the table of brisk stops: gait and speed."""
    names = ('still s', 'rest s', 'bound s', 'slip mm', 'm/s^2')
    return [' | '.join((f'| {row["gait"]} {float(row["m/s"]):.1f}', *(
        row[name].split(' / ')[1] if name == 'bound s' else row[name] for name in names))) + ' |'
            for row in rows[:-1]]


def body_rows(of: Any) -> list[str]:
    """Row of the table of random stops."""
    still, within = of['still_s'], of['within_s']
    return [f'| {of["seed"]} | {of["stops"]} | {of["fell"]} | {of["stepped"]} | {of["late"]} | '
            f'{of["far"]} | {still[0]:.2f} / {still[1]:.2f} | {within[0]:.2f} |']


def speed_rows(results: Any) -> list[str]:
    """Rows of the table of speeds: straight ahead, gait by gait."""
    rows = []
    for gait in dict.fromkeys(one['case']['gait'] for one in results['speeds']):
        ahead = [one for one in results['speeds'] if one['case']['gait'] == gait
                 and one['case']['velocity'][0] > 0.0 and not any(one['case']['velocity'][1:])]
        costs = [one['outcome']['cost_of_transport'] for one in ahead]
        rows.append(' | '.join((
            f'| {gait}', ', '.join(f'{one["case"]["velocity"][0]:g}' for one in ahead),
            f'at most {100.0 * max(map(errors, ahead)):.1f} %',
            f'at most {max(abs(one["outcome"]["yaw_drift"]) for one in ahead):.1f}°',
            f'{min(costs):.2f} to {max(costs):.2f} |')))
    return rows


def command_rows(results: Any) -> list[str]:
    """Row of the table of random commands."""
    count, seconds, fell, stops, late, stepped, granted = commanded(results)
    first, last = (of(one['seed'] for one in results) for of in (min, max))
    return [f'(`--runs {count} --seed {first}`) | {first} to {last}, nothing tuned on | {count} | '
            f'{seconds} | {fell} | {stops}, and {stepped} stepped out | {late} | {granted} % |']


def rough_rows(results: Any) -> list[str]:
    """Rows of the table of rough ground: a gait, and its share on every ground."""
    return [' | '.join((f'| {gait}', *(f'{share:.0f} %' for share in shares))) + ' |'
            for gait, shares in crossings(results).items()]


def stair_rows(results: Any) -> list[str]:
    """Rows of the table of stairs: climbing, gait, and what became of the walks."""
    each = len(results['climbing']) // 4
    return [f'| {climbing} | {gait} | {crossed}/{each} | {fell} | {blocked} |'
            for (climbing, gait), (crossed, fell, blocked) in climbed(results).items()]


def rate_rows(runs: Any) -> list[str]:
    """Rows of the table of rates on slow cores, and what the section says of the benchmark."""
    ways = {'each': 'ten processes', 'blocks': 'blocks',
            'composed': 'one process and the recorder', 'each_100_hz': 'ten processes'}
    rows = [f'| {way} | {control_rate(runs[name])} Hz | {real_time_factor(runs[name]):.2f} | '
            f'{runs[name]["timing"]["latency_ms_p50"]:.1f} / '
            f'{runs[name]["timing"]["latency_ms_p99"]:.1f} ms | '
            f'{100.0 * runs[name]["tracking"]["v_error_max"]:.1f} % |'
            for name, way in ways.items()]
    return [*rows, f'{benchmarked("idle"):.2f} with nothing else to do and '
            f'{benchmarked("busy"):.2f} beside a busy loop']


def first_rows(results: Any) -> list[str]:
    """Rows of ``first_walk``."""
    assert all(map(first_walk.as_promised, results)), results
    return [f'| {" | ".join(first_walk.cells(one))} |' for one in results]


TIGHTNESS = {
    'synchronisation': 'synchronisation', 'capture': 'capture',
    'contraction under inhibition, along tubes': 'contraction along tubes',
    'the same at ω = 3 rad/s': 'contraction along tubes, slow gait',
    'contraction in a constant norm, what `certify` asks for': 'contraction',
    'the same at ω = 3 rad/s, too': 'contraction, slow gait',
    'frequency mismatch': 'frequency mismatch', 'vote of two legs': 'vote of two'}
"""Conditions of the study by their names in the document."""


def tightness_rows(rows: Any) -> list[str]:
    """Rows of the table of tightness: a condition, and its ratio on every graph."""
    return [' | '.join((f'| {name}', *(f'{ratio(row):.2f}' for row in rows
                                       if row['condition'] == condition))) + ' |'
            for name, condition in TIGHTNESS.items()]


def setting_rows(rows: Any) -> list[str]:
    """Rows of the table of certified settings, and its sums."""
    misread, loose = ([sum(counts) for counts in zip(*(row[name] for row in rows), strict=True)]
                      for name in ('misread', 'loose'))
    return [*(f'| {" | ".join(certified_grid.cells(row))} |' for row in rows),
            f'with the eigenvalue misread {misread[1]} of {misread[0]} drift apart, and of '
            f'{loose[0]} that contract without capture {loose[1]} walk on']


def delay_rows(rows: Any) -> list[str]:
    """Rows of the table of delays: a kind, gaits or random networks, and what was certified of the
    smallest age that fails; no number stands for any age, and for none.
    """
    told = []
    for kind, name in (('late', 'late inhibition'), ('held', 'states held'),
                       ('carried', 'states carried on')):
        for group, networks in (('gait', 'gaits'), ('random', 'random networks')):
            of = [row for row in rows
                  if row['kind'] == kind and row['network'].startswith(group)]
            any_age, none = (sum(row[what] is None for row in of)
                             for what in ('certified', 'fails'))
            shares = sorted(row['certified'] / row['fails'] for row in of if row['fails'])
            assert all(row['certified'] is not None for row in of if row['fails']), kind
            spread = ', '.join(f'{share:.2f}' for share in (
                shares[0], median(shares), shares[-1])) if shares else 'none fails'
            told.append(f'| {name} | {len(of)} {networks} | {any_age} | {none} | {spread} |')
    return told


def fall_rows(results: Any) -> list[str]:
    """Sentence about falls, as the only row."""
    (of,) = results.values()
    stood = [fall for fall in of if fall['stands']]
    rolls = [sum(fall['tries'] == n for fall in stood) for n in (0, 1, 2)]
    return [f'{len(stood)} of {len(of)} falls recovered to standing, {rolls[0]} without rolling, '
            f'{rolls[1]} with one roll, {rolls[2]} with two; '
            f'{median(fall["seconds"] for fall in stood):.1f} s in the median, '
            f'{max(fall["seconds"] for fall in stood):.1f} s at most.']


def gait_rows(results: Any) -> list[str]:
    """Sentence about changes of gait, as the only row."""
    outcomes = [one['outcome'] for one in results['gaits']]
    durations = [one['duration'] for one in outcomes if not one['fell']]
    found = gaits(results).partition(': ')[2]
    return [f'{len(outcomes)} changes: {found}, done after {min(durations):.1f} to '
            f'{max(durations):.1f} s.']


# --- both ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Study:
    """What is said of a study.

    Attributes
    ----------
    headline : callable or None
        Content of its file → headline of the README, if it has one.
    rows : callable
        Content of its file → lines of the document.
    document : str
        Where its section is.
    file : str
        Name of the file where it is not the anchor of the section.
    """

    headline: Callable[[Any], str] | None
    rows: Callable[[Any], list[str]]
    document: str = 'doc/results.md'
    file: str = ''


STUDIES = {
    'the-experiment': Study(experiment, experiment_rows),
    'speeds': Study(speeds, speed_rows), 'changes-of-gait': Study(gaits, gait_rows),
    'rough-ground': Study(rough, rough_rows),
    'any-command': Study(any_command, command_rows, 'doc/walking.md'),
    'stairs-what-one-foot-felt-all-know': Study(stairs, stair_rows, 'doc/walking.md'),
    'tightness-of-the-certificates': Study(tightness, tightness_rows),
    'no-certified-setting-fails': Study(settings, setting_rows),
    'what-is-certified-over-what-fails': Study(None, delay_rows, 'doc/certificate.md'),
    'falls': Study(falls, fall_rows), 'stops-at-every-phase': Study(stops, stop_rows),
    'brisk-stops': Study(brisk_stops, brisk_rows, 'doc/walking.md'),
    'when-the-body-stands': Study(body_stops, body_rows, 'doc/walking.md'),
    'pushes': Study(bodies.pushes, bodies.push_rows),
    'pushes-at-rest-and-while-stopping': Study(
        None, bodies.manoeuvre_rows, 'doc/walking.md', 'pushes'),
    'what-the-controllers-do-not-know': Study(
        bodies.mismatch, bodies.mismatch_rows, 'doc/walking.md'),
    'other-robots': Study(bodies.robots, bodies.robot_rows),
    'beside-a-learned-policy': Study(bodies.duel, bodies.duel_rows, 'doc/walking.md'),
    'rate': Study(rate, rate_rows),
    'from-one-line-to-a-walking-robot': Study(
        None, first_rows, 'doc/performance.md', 'first-walk'),
    'hostile-neighbours': Study(faults.hostile, faults.hostile_rows, 'doc/faults.md'),
    'killed-nodes': Study(None, faults.kill_rows, 'doc/faults.md')}
"""Studies that have a file, ``doc/results/ANCHOR.json``, by the anchor of their section; that of
the experiment is a run's ``metrics.json``, and of rates there are several in a folder.
"""


TABLES_OF_STOPS = ('stops-at-every-phase', 'brisk-stops')
"""Studies whose file has the numbers of a table of :data:`STOPS`; their content is its rows."""


def content(anchor: str) -> Any:
    """What the command of a study has written."""
    name = STUDIES[anchor].file or anchor
    if (bodies.FOLDER / name).is_dir():
        return {file.stem: json.loads(file.read_text(encoding='utf-8'))
                for file in (bodies.FOLDER / name).glob('*.json')}
    written = json.loads((bodies.FOLDER / f'{name}.json').read_text(encoding='utf-8'))
    return next(tables(table(written))) if anchor in TABLES_OF_STOPS else written


def with_tables(text: str) -> str:
    """The text of :data:`STOPS` with the tables that its files say."""
    for anchor in TABLES_OF_STOPS:
        rows = content(anchor)
        told = (rows[0], ['---'] * len(rows[0]), *(row.values() for row in rows))
        lines = '\n'.join(f'| {" | ".join(cells)} |' for cells in told)
        text, count = re.subn(
            rf'(<!-- {anchor}: begin -->\n).*?(\n<!-- {anchor}: end -->)',
            rf'\1\n{lines}\n\2', text, flags=re.DOTALL)
        assert count == 1, f'{STOPS} has no place for {anchor}'
    return text


def headlines() -> dict[str, str]:
    """Headlines by the anchor of their row, of all studies that have a file."""
    found = {anchor: study.headline(content(anchor)) for anchor, study in STUDIES.items()
             if study.headline}
    # Two studies have one row.
    found['hostile-neighbours'] += f'; {faults.kills(content("killed-nodes"))}'
    return found


def missing(anchor: str) -> list[str]:
    """Lines that the document should have of a study, and has not."""
    text = section(f'{STUDIES[anchor].document}#{anchor}')
    return [row for row in STUDIES[anchor].rows(content(anchor)) if row not in text]


def main() -> int:
    """Write the README's headlines; returns the exit status."""
    text = README.read_text(encoding='utf-8')
    rows = table_of_studies()
    for anchor, headline in headlines().items():
        title, before, command = rows[anchor]
        text = text.replace(f'| {title} | {before} | {command} |',
                            f'| {title} | {headline} | {command} |')
        print(f'{anchor}: {headline}')
    README.write_text(text, encoding='utf-8')
    STOPS.write_text(with_tables(STOPS.read_text(encoding='utf-8')), encoding='utf-8')
    for anchor in STUDIES:
        for row in missing(anchor):
            print(f'{STUDIES[anchor].document}#{anchor} has not: {row}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
