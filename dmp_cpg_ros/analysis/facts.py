# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The run in plain sentences, each with its number and whether it holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dmp_cpg_ros.analysis.metrics.stops import STILL_SPEED

SPEED_TOLERANCE = 0.10
"""Relative error of steady speed that is accepted."""

REAL_TIME_FACTOR = 0.98
"""Least real-time factor of a run that was to keep wall time."""

COSTS = {
    'joint_work': 'from the work of every physics step',
    'joint_states': 'estimated from torque and speed at the stamps alone',
}
"""What a cost of transport was taken from, in words."""


@dataclass(frozen=True)
class Fact:
    """One statement.

    Attributes
    ----------
    statement : str
        What should be so.
    finding : str
        What was found, with unit.
    holds : bool or None
        None where the recording does not tell, or where there is nothing to demand.
    """

    statement: str
    finding: str
    holds: bool | None


def facts(metrics: Mapping[str, Any], lock_step: bool | None = None) -> list[Fact]:
    """Draw the facts from metrics.

    Parameters
    ----------
    metrics : mapping
        As from :func:`~dmp_cpg_ros.analysis.metrics.summary.compute_metrics`.
    lock_step : bool, optional
        Whether the run was in lock-step; a run that is known not to have been has to keep wall
        time.

    Returns
    -------
    list of Fact
        In the order of importance.
    """
    return [
        *_decoding(metrics), *_walking(metrics), *_stops(metrics), *_timing(metrics, lock_step),
        *_certificate(metrics)]


def _decoding(metrics: Mapping[str, Any]) -> list[Fact]:
    lost = metrics['recording']['undecodable_messages']
    if not lost:
        return []
    return [Fact('Every message could be decoded', f'{lost} could not and were left out', False)]


def _walking(metrics: Mapping[str, Any]) -> list[Fact]:
    robot, gait = metrics['robot'], metrics['gait']
    error = metrics['tracking']['v_error_max']
    fell = robot['fell']
    finding = 'not recorded' if fell is None else 'it fell' if fell else 'it did'
    holds = None if fell is None else not fell
    if robot['down_at_start']:
        again = ', and fell again' if fell else ''
        finding, holds = f'it was down at the beginning{again}', False if fell else None
    found = [
        Fact('The robot stayed on its feet', finding, holds),
        Fact('Distance walked', _number(robot['distance_m'], '{:.2f} m'), None),
        Fact(
            f'Mean speed within {SPEED_TOLERANCE:.0%} of the reference wherever that was constant',
            'no such stretch' if error is None else f'largest error {error:.1%}',
            None if error is None else error <= SPEED_TOLERANCE),
    ]
    if robot['cost_of_transport'] is not None:
        finding = f'{robot["cost_of_transport"]:.2f}, {COSTS[robot["cost_of_transport_from"]]}'
        found.append(Fact('Cost of transport', finding, None))
    drift, phase_error = robot['yaw_drift_deg_per_10m'], gait['phase_error_rad_max']
    if drift is not None:
        found.append(Fact('Yaw drift on straight stretches', f'{drift:.2f}° per 10 m', None))
    if phase_error is not None:
        finding = f'{phase_error:.2g} rad'
        found.append(Fact('Largest phase error of a leg while walking', finding, None))
    return found


def _stops(metrics: Mapping[str, Any]) -> list[Fact]:
    found = []
    for word, end in (('stop', 'came to rest'), ('start', 'led to walking')):
        entries = metrics[word]['all']
        if entries:
            done, count = metrics[word]['completed'], metrics[word]['count']
            found.append(Fact(f'Every {word} {end}', f'{done} of {count}', done == count))
            found.extend(_predictions(entries, 'rest' if word == 'stop' else 'walking'))
    stops = metrics['stop']['all']
    speeds = [entry.get('body_speed_at_rest_m_s') for entry in stops]
    speeds = [speed for speed in speeds if speed is not None]
    if speeds:
        finding = f'at most {1e3 * max(speeds):.2g} mm/s'
        found.append(Fact('The body stood still at rest', finding, max(speeds) < STILL_SPEED))
    down = [entry.get('feet_down_at_rest') for entry in stops]
    down = [entry for entry in down if entry is not None]
    if down:
        finding = f'in {sum(down)} of {len(down)} stops'
        found.append(Fact('All four feet carried load at rest', finding, all(down)))
    return found


def _predictions(entries: list[dict[str, Any]], aim: str) -> list[Fact]:
    found = []
    pairs = [(entry['measured_s'], entry['predicted_s']) for entry in entries]
    pairs = [pair for pair in pairs if None not in pair]
    if pairs:
        measured, predicted = max(pairs, key=lambda pair: float(abs(pair[0] - pair[1])))
        finding = f'{measured:.3f} s measured, {predicted:.3f} s predicted (worst case)'
        found.append(Fact(f'Time to {aim} against its prediction', finding, None))
    pairs = [(entry['measured_s'], entry['bound_s']) for entry in entries]
    pairs = [pair for pair in pairs if None not in pair]
    if pairs:
        measured, bound = max(pairs, key=lambda pair: float(pair[0] / pair[1]))
        finding = f'{measured:.3f} s of {bound:.3f} s (nearest case)'
        found.append(Fact(f'Time to {aim} within its bound', finding, measured <= bound))
    return found


def _timing(metrics: Mapping[str, Any], lock_step: bool | None) -> list[Fact]:
    timing = metrics['timing']
    factor = timing['real_time_factor']
    if factor is None:
        return []
    rate = _number(timing['rate_hz'], '{:.0f} Hz')
    if lock_step:
        return [Fact('Speed of the lock-step run', f'{factor:.2f} × real time, {rate}', None)]
    kept = None if lock_step is None else factor >= REAL_TIME_FACTOR
    latency = _number(timing['latency_ms_p50'], 'median {:.2f} ms')
    late = _number(timing['latency_ms_p99'], '99% {:.2f} ms')
    return [
        Fact('The suite kept wall time', f'real-time factor {factor:.3f}, {rate}', kept),
        Fact('Latency from state to last target', f'{latency}, {late}', None),
    ]


def _certificate(metrics: Mapping[str, Any]) -> list[Fact]:
    entries = metrics['certificate'] or []
    holds = [
        bool(entry['holds'])
        for entry in entries
        if isinstance(entry, dict) and 'holds' in entry and entry.get('required', True)
    ]
    if not holds:
        return []
    finding = f'{sum(holds)} of {len(holds)} required inequalities'
    return [Fact('The certificate of the running parameters holds', finding, all(holds))]


def _number(value: float | None, form: str) -> str:
    return 'not recorded' if value is None else form.format(value)
