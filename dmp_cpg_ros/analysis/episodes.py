# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When the robot walked, when its command was constant, when it was stopping and starting."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.motion import stretches
from dmp_cpg_ros.analysis.recording import Array, Recording, StatusEvent
from dmp_cpg_ros.core.balance.body_command import BALANCED
from dmp_cpg_ros.core.canonical.phase import phase

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
    """Which times (n,) lie in one of some half-open intervals, boolean ndarray (n,)."""
    inside = np.zeros(len(time), dtype=bool)
    for start, end in intervals:
        inside |= (time >= start) & (time < end)
    return inside


def changing_intervals(recording: Recording) -> list[tuple[float, float]]:
    """Intervals in which gaits changed [s]."""
    time = recording.canonical.time
    changing = np.array([gait.after != '' for gait in recording.canonical.gaits], dtype=bool)
    return [(float(time[first]), float(time[min(past, len(time) - 1)]))
            for first, past in stretches(changing)]


def unwrapped_phases(recording: Recording) -> Array:
    """Growing phases of the four oscillators, ndarray (n, 4) [rad]."""
    return np.unwrap(phase(recording.canonical.x), axis=0)


def cycle_starts(recording: Recording, start: float, end: float) -> Array:
    """Times in an interval at which oscillator fl passes phase 0, ndarray (m,) [s]."""
    time = recording.canonical.time
    inside = (time >= start) & (time <= end)
    if np.count_nonzero(inside) < 2:
        return np.array([])
    phi, time = unwrapped_phases(recording)[inside, 0] / (2.0 * np.pi), time[inside]
    turns = np.arange(np.ceil(phi[0]), np.floor(phi[-1]) + 1.0)
    return np.interp(turns, np.maximum.accumulate(phi), time)


def cycle_count(recording: Recording, start: float, end: float) -> float:
    """Gait cycles of oscillator fl between two times; 0 when no oscillators were recorded."""
    if not recording.canonical.time.size:
        return 0.0
    turns = unwrapped_phases(recording)[:, 0] / (2.0 * np.pi)
    return float(np.diff(np.interp([start, end], recording.canonical.time, turns))[0])


def gait_period(recording: Recording) -> float | None:
    """Median duration of a gait cycle while running [s], None where there is none."""
    lengths = np.concatenate([np.array([]), *(
        np.diff(cycle_starts(recording, *interval)) for interval in running_intervals(recording))])
    return float(np.median(lengths)) if lengths.size else None


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
    changes = np.array([event.time for event in recording.modes])
    standing = np.array([event.message in BALANCED for event in recording.modes])
    return np.asarray(standing[np.maximum(np.searchsorted(changes, time, 'right') - 1, 0)])


def stands_until(recording: Recording, start: float, end: float) -> float:
    """First time in an interval at which the robot is not to stand, or the interval's end [s]."""
    down = (event.time for event in recording.modes if event.message not in BALANCED)
    return min((time for time in down if start <= time < end), default=end)


def fall_noticed(recording: Recording) -> bool:
    """Whether the suite noticed a fall; a robot that was found fallen has not fallen since."""
    return any(event.message == 'damped' for event in recording.modes[1:])
