# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When the robot walked and in which gait, when it stopped, started, and kept its speed."""

from __future__ import annotations

from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.motion import held, spans, stretches
from dmp_cpg_ros.analysis.recording import Array, Recording, StatusEvent
from dmp_cpg_ros.core.balance.body_command import BALANCED
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits, shares_of
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.transformation.leg import body_scale

STOPPING = ('waiting', 'captured', 'at_rest')
RUNNING = ('free', 'walking')
STARTING = ('releasing',)

STEADY_RATES = np.array([0.02, 0.02, 0.05])
"""Rates of v_x, v_y [m/s^2] and γ [rad/s^2] below which the reference counts as constant."""

SETTLING = 1.0
"""Time that walking, and every constant reference, is given to settle [s]."""

SHORTEST_SEGMENT = 1.0
"""Constant references that last less after settling are not evaluated [s]."""

MOVING = 0.02
"""Reference speed [m/s] or turn rate [rad/s] above which the robot is meant to move."""


class Episode(NamedTuple):
    """Consecutive inhibition states of one kind.

    Attributes
    ----------
    start, end : float
        From its first state to the first state of the next episode, or to the end of the recording
        [s].
    events : tuple of StatusEvent
        The states.
    """

    start: float
    end: float
    events: tuple[StatusEvent, ...]

    @property
    def captured(self) -> float:
        """When inhibition took hold: the first state that is not ``waiting``, or the end [s]."""
        return next((e.time for e in self.events if e.message != 'waiting'), self.end)


def episodes(recording: Recording, words: tuple[str, ...]) -> list[Episode]:
    """Longest stretches in which the inhibition's state is one of ``words``."""
    events = recording.inhibition
    times = [event.time for event in events]
    times.append(max([recording.span[1], *times[-1:]]))
    return [Episode(times[first], times[past], events[first:past]) for first, past in stretches(
        np.array([event.message in words for event in events], dtype=bool))]


def requested_stops(recording: Recording) -> list[Episode]:
    """Stops that were asked for while the robot walked; one that began at rest is none."""
    return [episode for episode in episodes(recording, STOPPING)
            if episode.events[0].message != 'at_rest']


def running_intervals(recording: Recording) -> list[tuple[float, float]]:
    """Intervals without inhibition; the whole recording when the inhibition was not recorded."""
    if not recording.inhibition:
        return [recording.span] if recording.span[1] > recording.span[0] else []
    return [(episode.start, episode.end) for episode in episodes(recording, RUNNING)]


def within(time: Array, intervals: list[tuple[float, float]]) -> NDArray[np.bool_]:
    """Which growing times (n,) lie in one of some half-open intervals, boolean ndarray (n,)."""
    inside = np.zeros(len(time), dtype=bool)
    for first, past in np.searchsorted(time, np.array(intervals).reshape(-1, 2)):
        inside[first:past] = True
    return inside


def changing_intervals(recording: Recording) -> list[tuple[float, float]]:
    """Intervals in which gaits changed [s]."""
    changing = np.array([gait.after != '' for gait in recording.canonical.gaits], dtype=bool)
    return spans(recording.canonical.time, changing)


def cycle_starts(recording: Recording, start: float, end: float) -> Array:
    """Times in an interval at which oscillator fl passes phase 0, ndarray (m,) [s]."""
    time = recording.canonical.time
    inside = slice(np.searchsorted(time, start), np.searchsorted(time, end, side='right'))
    turns, time = recording.canonical.turns[inside], time[inside]
    if len(time) < 2:
        return np.array([])
    if not abs(turns[-1] - turns[0]) <= len(turns):  # a cycle takes more than one sample
        return np.array([])
    whole = np.arange(np.ceil(turns[0]), np.floor(turns[-1]) + 1.0)
    return np.interp(whole, np.maximum.accumulate(turns), time)


def cycle_count(recording: Recording, start: float, end: float) -> float:
    """Gait cycles of oscillator fl between two times; 0 when no oscillators were recorded."""
    time = recording.canonical.time
    if not time.size:
        return 0.0
    return float(np.diff(np.interp([start, end], time, recording.canonical.turns)).item())


def gait_period(recording: Recording) -> float | None:
    """Median duration of a gait cycle while running [s], None where there is none."""
    lengths = [length for interval in running_intervals(recording)
               for length in np.diff(cycle_starts(recording, *interval))]
    return float(np.median(lengths)) if lengths else None


def steady_segments(recording: Recording) -> list[tuple[float, float]]:
    """Intervals of settled walking at constant reference, cut to whole gait cycles [s].

    Where no oscillators were recorded the intervals are not cut.
    """
    time, value = recording.reference.time, recording.reference.value
    if len(time) < 3:
        return []
    rate = np.abs(np.gradient(value, time, axis=0))
    steady = (rate < STEADY_RATES).all(axis=1) & (np.abs(value) > MOVING).any(axis=1)
    running = within(time, running_intervals(recording))
    for start, end in changing_intervals(recording):
        running &= (time < start) | (time > end)
    segments = []
    for first, past in stretches(steady & running):
        start, end = float(time[first]) + SETTLING, float(time[past - 1])
        if recording.canonical.time.size and end > start:
            cycles = cycle_starts(recording, start, end)
            start, end = (float(cycles[0]), float(cycles[-1])) if cycles.size else (start, start)
        if end - start >= SHORTEST_SEGMENT:
            segments.append((start, end))
    return segments


def should_stand(recording: Recording, time: Array) -> NDArray[np.bool_]:
    """Whether the robot was to stand at some times (n,) [s], boolean ndarray (n,): not while it
    lay, rose or lowered itself; always where its body mode was not recorded.
    """
    if not recording.modes:
        return np.ones(len(time), dtype=bool)
    changes, standing = zip(*((event.time, event.message in BALANCED)
                              for event in recording.modes), strict=True)
    return held(np.array(changes), np.array(standing), time).astype(bool)


def stands_until(recording: Recording, start: float, end: float) -> float:
    """First time in an interval at which the robot is not to stand, or the interval's end [s]."""
    down = (event.time for event in recording.modes if event.message not in BALANCED)
    return min((time for time in down if start <= time < end), default=end)


class GaitRow(NamedTuple):
    """Rows of the canonical states in one gait, or one row of a blend.

    Attributes
    ----------
    rows : slice
        Rows.
    gait : Gait or BlendedGait
        In force.
    """

    rows: slice
    gait: GaitInForce


def gait_rows(recording: Recording, context: RunContext) -> list[GaitRow] | None:
    """Gaits in force, in order; None where the recording and its context do not tell.

    A recording without names of gaits (from before gaits could change) was walked in the gait of
    the context.
    """
    count = len(recording.canonical.time)
    if context.gait is None or not count:
        return None
    shares = recording.canonical.gaits or (shares_of(context.gait),) * count
    known = KnownGaits({**context.gaits, context.gait.name: context.gait})
    borders = [0, *(k for k in range(1, count) if shares[k] is not shares[k - 1]
                    and shares[k] != shares[k - 1]), count]
    try:
        return [GaitRow(slice(first, past), known.in_force(shares[first]))
                for first, past in zip(borders, borders[1:], strict=False)]
    except DataError:
        return None


def phase_offsets(recording: Recording, context: RunContext) -> Array | None:
    """Phases of the legs relative to fl that the gait in force plans, ndarray (n, 4) [rad]."""
    found = gait_rows(recording, context)
    if found is None:
        return None
    offsets = np.empty((len(recording.canonical.time), 4))
    for rows, gait in found:
        offsets[rows] = gait.phases
    return offsets


def planned_stance(recording: Recording, context: RunContext) -> tuple[NDArray[np.bool_], Array]:
    """Feet that the gait in force plans on the ground, and its duty factor.

    Returns
    -------
    stance : ndarray of bool (n, 4)
        No rows where gait, robot or reference are not known.
    duty : ndarray (n,)
    """
    found, reference = gait_rows(recording, context), recording.reference
    if found is None or context.robot is None or not reference.time.size:
        return np.zeros((0, 4), dtype=bool), np.zeros(0)
    scale, phi = body_scale(context.robot), phase(recording.canonical.x)
    r = held(reference.time, reference.value, recording.canonical.time)
    duty, position = np.empty(len(phi)), np.empty(phi.shape)
    for rows, gait in found:
        changes = np.flatnonzero((np.diff(r[rows], axis=0, prepend=np.nan) != 0.0).any(axis=1))
        duty[rows] = np.repeat(
            [gait.duty(scale.foot_speed(*value), scale) for value in r[rows][changes].tolist()],
            np.diff([*changes, rows.stop - rows.start]))
        position[rows] = gait.cycle_position(phi[rows])
    return np.abs(position) >= 0.5 * (1.0 - duty[:, None]), duty


def gaits_walked(recording: Recording) -> list[str]:
    """Names of the gaits in force, each time one takes over; empty in old recordings."""
    names = [gait.before for gait in recording.canonical.gaits if not gait.after]
    return [name for name, _ in groupby(names)]
