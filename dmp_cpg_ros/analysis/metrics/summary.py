# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All of ``metrics.json``, and its groups on gait, stops and starts, and timing.

Whether the legs kept their places, and how long each foot stood; of every stop and start what was
predicted, bounded and measured, and what the body did.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis import episodes
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import Episode
from dmp_cpg_ros.analysis.metrics import robot
from dmp_cpg_ros.analysis.motion import held, mean_between
from dmp_cpg_ros.analysis.recording import OF_JOINTS, Array, Recording, StatusEvent, taken
from dmp_cpg_ros.core.canonical.phase import phase, wrapped
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.suite_table import ROBOT

STILL_SPEED = 0.01
"""Speed below which the body stands still [m/s]."""

REST_SETTLING = 0.5
"""Time after the oscillators' rest from which on the body is expected to be still [s]."""


def _summary(entries: list[dict[str, Any]]) -> dict[str, Any]:
    """The slowest completed stop or start, and ``all``."""
    completed = [entry for entry in entries if entry['measured_s'] is not None]
    slowest = max(completed, key=lambda entry: float(entry['measured_s']), default={})
    return {
        **{key: slowest.get(key) for key in ('predicted_s', 'bound_s', 'measured_s')},
        'count': len(entries), 'completed': len(completed),
        **{key: sum(entry[key] for entry in entries) for key in ('overruled', 'cut_off')},
        'all': entries}


def _stop(recording: Recording, context: RunContext, episode: Episode) -> dict[str, Any]:
    at_rest = next((event for event in episode.events if event.message == 'at_rest'), None)
    entry = {**_times(recording, episode, at_rest),
             'distance_bound_m': _promised(episode, at_rest, 'bound_m')}
    if at_rest is None:
        return entry
    end = episodes.stands_until(recording, at_rest.time, episode.end)
    window = (min(at_rest.time + REST_SETTLING, end), end)
    return {**entry, 'rest_s': at_rest.time, 'rest_until_s': end,
            **_body_at_rest(recording, entry['request_s'], window),
            **_feet_at_rest(recording, context, window)}


def _start(recording: Recording, start: Episode) -> dict[str, Any]:
    """Times of a start; one that another state than walking follows was interrupted."""
    return _times(recording, start, next((
        event for event in recording.inhibition
        if event.time == start.end and event.message in episodes.RUNNING), None))


def _times(recording: Recording, episode: Episode, done: StatusEvent | None) -> dict[str, Any]:
    """Request, prediction, bound and measurement; the node's own numbers where it states them;
    whether another request or a push came before it was done, or within the bound the recording's
    end.
    """
    first = episode.events[0]
    stated = first.number('request_stamp')
    # a stamp far from the event that bears it belongs to another request
    request = stated if stated is not None and abs(stated - first.time) < 1.0 else first.time
    measured = None if done is None else done.number('measured_s')
    if done is not None and measured is None:
        measured = done.time - request
    following = next((event for event in recording.inhibition
                      if event.time >= episode.end and event not in episode.events), first)
    overruled = measured is None and any(
        following.values.get(what) != first.values.get(what) for what in ('requested', 'pushed'))
    bound, end = _promised(episode, done, 'bound_s'), recording.span[1]
    return {'request_s': request, 'predicted_s': _promised(episode, done, 'predicted_s'),
            'bound_s': bound, 'measured_s': measured, 'overruled': overruled,
            'cut_off': measured is None and not overruled and episode.end >= end
            and bound is not None and end - request < bound}


def _promised(episode: Episode, done: StatusEvent | None, key: str) -> float | None:
    """What was promised last before it was done: changes of parameters change the promise."""
    numbers = [event.number(key) for event in episode.events
               if done is None or event.time <= done.time]
    return next((number for number in reversed(numbers) if number is not None), None)


def _body_at_rest(
        recording: Recording, request: float, window: tuple[float, float]) -> dict[str, Any]:
    odometry = taken(recording.odometry, slice(*np.searchsorted(
        recording.odometry.time, (request, window[1]))))
    since, rows = (odometry.time >= start for start in (request, window[0]))
    if not rows.any():
        return {'body_speed_at_rest_m_s': None, 'body_still_after_s': None, 'displacement_m': None}
    speed = np.linalg.norm(odometry.velocity_in_base, axis=1)
    moving = odometry.time[since & (speed >= STILL_SPEED)]
    still_after = float(moving[-1]) - request if moving.size else 0.0
    start, end = (odometry.position_in_world[rows_of][0, :2] for rows_of in (since, rows))
    return {
        'body_speed_at_rest_m_s': float(speed[rows].max()),
        'body_still_after_s': still_after if speed[rows][-1] < STILL_SPEED else None,
        'displacement_m': float(np.hypot(*(end - start)))}


def _feet_at_rest(
        recording: Recording, context: RunContext, window: tuple[float, float]) -> dict[str, Any]:
    force = recording.feet.force[episodes.within(recording.feet.time, [window])]
    least = float(force.min()) if force.size else None
    return {'feet_down_at_rest': None if least is None else bool(least > context.contact_force),
            'least_foot_force_n': least}


def gait_metrics(recording: Recording, context: RunContext) -> dict[str, Any]:
    """Group ``gait`` of ``metrics.json``.

    Returns
    -------
    dict
        ``name`` of the gait at the start, ``names`` of all in order and their ``changes``;
        ``phase_error_rad_max``, the largest deviation of a leg from its place in the gait while
        walking freely and settled; ``duty_factor``, the measured share of the cycle on the ground,
        mean of the legs, with ``duty_factor_of_leg`` and the planned ``duty_factor_planned``;
        ``period_s``, the median gait cycle; ``certificate_lost_s``, when a change of gait or
        parameters first left them without the certificate that they had.
    """
    time, errors = phase_errors(recording, context)
    settled = np.abs(errors[settled_rows(recording, time)])
    duty = duty_factors(recording, context)
    changes = [{'start_s': start, 'end_s': end}
               for start, end in episodes.changing_intervals(recording)]
    return {
        'name': None if context.gait is None else context.gait.name,
        'names': episodes.gaits_walked(recording) or None, 'changes': changes or None,
        'phase_error_rad_max': float(settled.max()) if settled.size else None,
        'duty_factor': None if duty is None else float(duty.mean()),
        'duty_factor_of_leg':
            None if duty is None else dict(zip(LEGS, duty.tolist(), strict=True)),
        'duty_factor_planned': planned_duty_factor(recording, context),
        'period_s': episodes.gait_period(recording),
        'certificate_lost_s': _certificate_lost(recording.inhibition)}


def _certificate_lost(events: Sequence[StatusEvent]) -> float | None:
    """Time at which the inhibition first said that the certificate fails which had held [s]."""
    told = [event for event in events if 'certified' in event.values]
    return next((after.time for before, after in pairwise(told)
                 if (before.values['certified'], after.values['certified']) == ('true', 'false')),
                None)


def phase_errors(recording: Recording, context: RunContext) -> tuple[Array, Array]:
    """Deviation of each leg's phase from its place, relative to the circular mean of the four.

    Returns
    -------
    time : ndarray (n,)
        [s]
    error : ndarray (n, 4)
        [rad]; from the places in the gait in force, which move while gaits change. Where the gait
        is not known its offsets are the circular means of the settled walk.
    """
    time, phi = recording.canonical.time, phase(recording.canonical.x)
    offsets = episodes.phase_offsets(recording, context)
    if offsets is None:
        relative = (phi - phi[:, :1])[settled_rows(recording, time)]
        offsets = np.arctan2(np.sin(relative).sum(axis=0), np.cos(relative).sum(axis=0))
    places = phi - offsets
    common = np.arctan2(np.sin(places).sum(axis=1), np.cos(places).sum(axis=1))
    return time, wrapped(places - common[:, None])


def settled_rows(recording: Recording, time: Array) -> NDArray[np.bool_]:
    """Which times lie in settled, moving walking, boolean ndarray (n,)."""
    inside = episodes.within(time, [(start + episodes.SETTLING, end) for start, end
                                    in episodes.running_intervals(recording)])
    if recording.reference.time.size and time.size:
        value = held(recording.reference.time, recording.reference.value, time)
        inside &= (np.abs(value) > episodes.MOVING).any(axis=1)
    return inside


def duty_factors(recording: Recording, context: RunContext) -> Array | None:
    """Measured share of time on the ground over whole cycles of steady walking, ndarray (4,)."""
    segments, feet = episodes.steady_segments(recording), recording.feet
    if not segments or not feet.time.size:
        return None
    contact = (feet.force > context.contact_force).astype(float)
    shares = [mean_between(feet.time, contact, start, end) for start, end in segments]
    return np.average(shares, axis=0, weights=np.diff(segments)[:, 0])


def planned_duty_factor(recording: Recording, context: RunContext) -> float | None:
    """Duty factor that the gait plans, averaged over the same stretches."""
    segments, time = episodes.steady_segments(recording), recording.canonical.time
    _, duty = episodes.planned_stance(recording, context)
    if not duty.size or not segments:
        return None
    planned = [duty[(time >= start) & (time <= end)].mean() for start, end in segments]
    return float(np.average(planned, weights=np.diff(segments)[:, 0]))


TIMING = ('rate_hz', 'real_time_factor', 'latency_ms_p50', 'latency_ms_p99', 'deadline_misses')


def compute_metrics(
        recording: Recording, context: RunContext | None = None,
        certificate: Sequence[Any] | None = None) -> dict[str, Any]:
    """Everything that a run's ``metrics.json`` holds.

    Parameters
    ----------
    recording : Recording
        The run.
    context : RunContext, optional
        What is known besides.
    certificate : sequence, optional
        The inequalities, passed through.

    Returns
    -------
    dict
        Nested, of plain Python values; None where the recording cannot tell.
    """
    context = context or RunContext()
    return {
        'robot': robot.robot_metrics(recording, context),
        'tracking': robot.tracking_metrics(recording),
        'estimation': robot.estimation_metrics(recording, context),
        'gait': gait_metrics(recording, context),
        'stop': _summary([_stop(recording, context, stop)
                          for stop in episodes.requested_stops(recording)]),
        'start': _summary([_start(recording, start)
                           for start in episodes.episodes(recording, episodes.STARTING)]),
        'timing': timing_metrics(recording),
        'recording': {'undecodable_messages': sum(recording.undecodable.values()),
                      'missing_topics': recording.missing or None,
                      'foreign_joints': {topic: recording.foreign_joints.get(topic)
                                         for topic in OF_JOINTS}},
        'certificate': None if certificate is None else list(certificate)}


def timing_metrics(recording: Recording) -> dict[str, Any]:
    """Group ``timing`` of ``metrics.json``, as the robot stated each key last."""
    metrics: dict[str, Any] = dict.fromkeys(TIMING)
    last = [status for name, status in recording.diagnostics.items() if ROBOT in name]
    for status in sorted(last, key=lambda status: status.time):
        metrics.update({key: value for key in TIMING
                        if (value := status.number(key)) is not None})
    if metrics['deadline_misses'] is not None:
        metrics['deadline_misses'] = round(metrics['deadline_misses'])
    return metrics
