# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every stop and every start: predicted, bounded, measured, and what the body did."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmp_cpg_ros.analysis import episodes
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import Episode
from dmp_cpg_ros.analysis.recording import Recording, StatusEvent

STILL_SPEED = 0.01
"""Speed below which the body stands still [m/s]."""

REST_SETTLING = 0.5
"""Time after the oscillators' rest from which on the body is expected to be still [s]."""


def stop_metrics(recording: Recording, context: RunContext) -> dict[str, Any]:
    """Group ``stop`` of ``metrics.json``: the slowest completed stop, and ``all``."""
    return _summary([_stop(recording, context, stop)
                     for stop in episodes.requested_stops(recording)])


def start_metrics(recording: Recording) -> dict[str, Any]:
    """Group ``start`` of ``metrics.json``: the slowest completed start, and ``all``."""
    return _summary([_start(recording, start)
                     for start in episodes.episodes(recording, episodes.STARTING)])


def _summary(entries: list[dict[str, Any]]) -> dict[str, Any]:
    completed = [entry for entry in entries if entry['measured_s'] is not None]
    slowest = max(completed, key=lambda entry: float(entry['measured_s']), default={})
    return {
        **{key: slowest.get(key) for key in ('predicted_s', 'bound_s', 'measured_s')},
        'count': len(entries), 'completed': len(completed), 'all': entries}


def _stop(recording: Recording, context: RunContext, episode: Episode) -> dict[str, Any]:
    at_rest = next((event for event in episode.events if event.message == 'at_rest'), None)
    entry = {**_times(episode, at_rest), 'distance_bound_m': _first(episode, 'bound_m')}
    if at_rest is None:
        return entry
    end = episodes.stands_until(recording, at_rest.time, episode.end)
    window = (min(at_rest.time + REST_SETTLING, end), end)
    return {**entry, 'rest_s': at_rest.time, 'rest_until_s': end,
            **_body_at_rest(recording, entry['request_s'], window),
            **_feet_at_rest(recording, context, window)}


def _start(recording: Recording, start: Episode) -> dict[str, Any]:
    """Times of a start; one that another state than walking follows was interrupted."""
    return _times(start, next((event for event in recording.inhibition if event.time == start.end
                               and event.message in episodes.RUNNING), None))


def _times(episode: Episode, done: StatusEvent | None) -> dict[str, Any]:
    """Request, prediction, bound and measurement; the node's own numbers where it states them."""
    first = episode.events[0]
    stated = first.number('request_stamp')
    # a stamp far from the event that bears it belongs to another request
    request = stated if stated is not None and abs(stated - first.time) < 1.0 else first.time
    measured = None if done is None else done.number('measured_s')
    if done is not None and measured is None:
        measured = done.time - request
    return {'request_s': request, 'predicted_s': _first(episode, 'predicted_s'),
            'bound_s': _first(episode, 'bound_s'), 'measured_s': measured}


def _first(episode: Episode, key: str) -> float | None:
    numbers = (event.number(key) for event in episode.events)
    return next((number for number in numbers if number is not None), None)


def _body_at_rest(
        recording: Recording, request: float, window: tuple[float, float]) -> dict[str, Any]:
    odometry = recording.odometry
    since, rows = (episodes.within(odometry.time, [(start, window[1])])
                   for start in (request, window[0]))
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
