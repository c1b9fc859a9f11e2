# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run in plain sentences, each with its number and whether it holds; needs no plotting."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from dmp_cpg_ros.analysis.metrics.summary import STILL_SPEED
from dmp_cpg_ros.core.parameters import shown

SPEED_TOLERANCE = 0.10
"""Relative error of steady speed that is accepted."""

REAL_TIME_FACTOR = 0.98
"""Least real-time factor of a run that was to keep wall time."""

SLOW_MOTION = ('it walked in slow motion; walk --composed, --processes blocks or a lower --rate '
               'takes less of the processor')
"""What is said of a run that did not keep wall time."""

COSTS = {'joint_work': 'from the work of every physics step',
         'joint_states': 'estimated from torque and speed at the stamps alone'}
"""What a cost of transport was taken from, in words."""


class Fact(NamedTuple):
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
    missing, foreign = (metrics['recording'][of] for of in ('missing_topics', 'foreign_joints'))
    return [*([Fact('Nothing was recorded on', ', '.join(missing), None)] if missing else []),
            *(Fact(f"{topic} names joints that are not the robot's",
                   f'{shown(", ".join(names))}; give --robot FILE', False)
              for topic, names in foreign.items() if names),
            *_walking(metrics), *_stops(metrics), *_timing(metrics['timing'], lock_step),
            *_certificate(metrics)]


def _walking(metrics: Mapping[str, Any]) -> list[Fact]:
    robot, error = metrics['robot'], metrics['tracking']['v_error_max']
    fell, lost = robot['fell'], metrics['recording']['undecodable_messages'] or None
    finding = 'not recorded' if fell is None else 'it fell' if fell else 'it did'
    if robot['down_at_start']:
        finding = f'it was down at the beginning{", and fell again" if fell else ""}'
    return [
        *_if_known(lost, 'Every message could be decoded', '{} could not and were left out',
                   holds=False),
        Fact('The robot stayed on its feet', finding,
             False if fell else None if fell is None or robot['down_at_start'] else True),
        Fact('Distance walked', _number(robot['distance_m'], '{:.2f} m'), None),
        Fact(
            f'Mean speed within {SPEED_TOLERANCE:.0%} of the reference wherever that was constant',
            'no such stretch' if error is None else f'largest error {error:.1%}',
            None if error is None else error <= SPEED_TOLERANCE),
        *_if_known(robot['cost_of_transport'], 'Cost of transport',
                   f'{{:.2f}}, {COSTS.get(robot["cost_of_transport_from"])}'),
        *_if_known(robot['cost_without_joint_losses'],
                   'Cost of transport without damping and friction in the joints', '{:.2f}'),
        *_if_known(robot['yaw_drift_deg_per_10m'], 'Yaw drift on straight stretches',
                   '{:.2f}° per 10 m'),
        *_if_known(metrics['gait']['phase_error_rad_max'],
                   'Largest phase error of a leg while walking', '{:.2g} rad')]


def _stops(metrics: Mapping[str, Any]) -> list[Fact]:
    found = []
    for word, end, aim in (
            ('stop', 'came to rest', 'rest'), ('start', 'led to walking', 'walking')):
        entries, done, count, overruled, cut_off = (
            metrics[word][key] for key in ('all', 'completed', 'count', 'overruled', 'cut_off'))
        if entries:
            apart = f'; another request or a push ended {overruled} before' if overruled else ''
            apart += f'; the recording ended during {cut_off}' if cut_off else ''
            asked = count - overruled - cut_off
            found += [Fact(f'Every {word} {end}', f'{done} of {asked}{apart}',
                           done == asked if asked else None), *_predictions(entries, aim)]
    if speeds := _known(metrics['stop']['all'], 'body_speed_at_rest_m_s'):
        fastest, = max(speeds)
        found.append(Fact('The body stood still at rest', f'at most {1e3 * fastest:.2g} mm/s',
                          fastest < STILL_SPEED))
    if down := [loaded for loaded, in _known(metrics['stop']['all'], 'feet_down_at_rest')]:
        found.append(Fact('All four feet carried load at rest',
                          f'in {sum(down)} of {len(down)} stops', all(down)))
    return found


def _predictions(entries: list[dict[str, Any]], aim: str) -> list[Fact]:
    found = []
    if pairs := _known(entries, 'measured_s', 'predicted_s'):
        finding = '{:.3f} s measured, {:.3f} s predicted (worst case)'.format(
            *max(pairs, key=lambda pair: float(abs(pair[0] - pair[1]))))
        found.append(Fact(f'Time to {aim} against its prediction', finding, None))
    if pairs := _known(entries, 'measured_s', 'bound_s'):
        measured, bound = max(pairs, key=lambda pair: float(pair[0] / pair[1]))
        finding = f'{measured:.3f} s of {bound:.3f} s (nearest case)'
        found.append(Fact(f'Time to {aim} within its bound', finding, measured <= bound))
    return found


def _timing(timing: Mapping[str, Any], lock_step: bool | None) -> list[Fact]:
    factor = timing['real_time_factor']
    rate = _number(timing['rate_hz'], '{:.0f} Hz')
    if factor is None or lock_step:
        return _if_known(factor, 'Speed of the lock-step run', f'{{:.2f}} × real time, {rate}')
    kept = None if lock_step is None else factor >= REAL_TIME_FACTOR
    latency = _number(timing['latency_ms_p50'], 'median {:.2f} ms')
    late = _number(timing['latency_ms_p99'], '99% {:.2f} ms')
    hint = '' if kept is not False else f'; {SLOW_MOTION}'
    return [Fact('The suite kept wall time', f'real-time factor {factor:.3f}, {rate}{hint}', kept),
            Fact('Latency from state to last target', f'{latency}, {late}', None)]


def _certificate(metrics: Mapping[str, Any]) -> list[Fact]:
    holds = [bool(entry['holds']) for entry in metrics['certificate'] or []
             if isinstance(entry, dict) and 'holds' in entry and entry.get('required', True)]
    return [
        *_if_known(sum(holds) if holds else None,
                   'The certificate of the parameters at the start holds',
                   f'{{}} of {len(holds)} required inequalities', all(holds)),
        *_if_known(metrics['gait']['certificate_lost_s'],
                   'The certificate held whatever was changed', 'it failed from {:.2f} s on',
                   holds=False)]


def _known(entries: list[dict[str, Any]], *keys: str) -> list[tuple[Any, ...]]:
    """Values of some keys of the entries that have all of them."""
    rows = [tuple(entry.get(key) for key in keys) for entry in entries]
    return [row for row in rows if None not in row]


def _number(value: float | None, form: str) -> str:
    return 'not recorded' if value is None else form.format(value)


def _if_known(value: float | None, statement: str, form: str, holds: bool | None = None,
              ) -> list[Fact]:
    return [] if value is None else [Fact(statement, form.format(value), holds)]
