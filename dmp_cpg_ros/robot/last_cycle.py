# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Memory of the legs' last targets, and the rhythm with which they go on when no more come.

A steady gait is a limit cycle, so its last period is all that is left to know of it: the targets
a time t after the last ones are those of a period T before, q_d(t) = q_d(t − T). T is the lag at
which the memory resembles its own end most. A robot that was disturbed a moment ago returns to the
cycle that it had; where it has no other rhythm a leg alone takes that one up at once, at the phase
that is nearest, and all legs where they have been followed again for a while.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS, JointTargets

SHORTEST_S, LONGEST_S = 0.2, 1.6
"""Range of periods that are looked for [s]."""

END_S = 0.1
"""Part at the end of the memory that is compared with what was before [s]."""

ALIKE, CLOSELY, REPEATS = 0.25, 0.15, 0.6
"""Largest mean squared deviation, as a share of the variance, of what counts as a rhythm: of its
end, also where less than half a cycle is there to be compared, and of the last cycle. In walks
whose legs died, those that were the gait's had 0.22 and 0.53 at most; what resembled the end of a
robot that speeds up by chance had 0.22 and 0.41, and 2.1 over its cycle.
"""

KNOWN_NS, NEAREST = 8_000_000_000, 0.6
"""Time for which a cycle that was found is known [ns], and how little it may differ at its nearest
phase from the end of the memory, as a share of its variance.
"""

GRID_S = 0.004
"""Time step of the memory [s]."""

KEEPING_S, KEEPS, STEADY = 0.04, 0.25, 1.0
"""Time constant with which a rhythm keeps time with legs that are heard [s], by which share it is
faster or slower at most, and speed of joints below which their angles tell little of it [rad/s].
"""

GAP_NS = 60_000_000
"""Time without targets of a leg that nothing is known of [ns]."""

SHORTEST, COMPARED = round(SHORTEST_S / GRID_S), round(END_S / GRID_S)
"""The same in steps of that."""

KEPT = 2048
"""Targets of each leg that are remembered, at most."""


class LastCycle:
    """Memory of the targets of four legs, and of what their joints did instead while these were
    away: a leg that is back has the rhythm of before with which to go on, should it be away again.
    """

    def __init__(self) -> None:
        """Start without any."""
        self._heard: list[deque[tuple[int, Array]]] = [deque(maxlen=KEPT) for _ in LEGS]
        self._done: list[deque[tuple[int, Array]]] = [deque(maxlen=KEPT) for _ in LEGS]
        self._known: Rhythm | None = None

    def accept(self, place: int, stamp_ns: int, targets: JointTargets) -> None:
        """Remember the targets of one leg, in the place of what it did from their time on."""
        entry = stamp_ns, np.array(tuple(vars(targets).values()))
        done = self._done[place]
        while done and done[-1][0] >= stamp_ns:
            done.pop()
        done.append(entry)
        self._heard[place].append(entry)

    def went_on(self, place: int, time_ns: int, values: Array) -> None:
        """Remember with what (3, 3) the joints of a leg that is away went on."""
        done = self._done[place]
        if done and done[-1][0] < time_ns:
            done.append((time_ns, values.copy()))

    def acting(self, place: int, time_ns: int) -> tuple[int, Array] | None:
        """Stamp and values (3, 3) of a leg's newest targets up to a time, else of its first ones;
        None where it sent none.
        """
        heard = self._heard[place]
        return next((entry for entry in reversed(heard) if entry[0] <= time_ns),
                    heard[0] if heard else None)

    def rhythm(self, *, of_before: bool = False) -> Rhythm | None:
        """Rhythm of the last targets up to the last that all legs sent; None where they have
        none, and that of before will not do, at the phase that is nearest to them.
        """
        if not all(self._done):
            return None
        end_ns = min(done[-1][0] for done in self._done)
        begin_ns = end_ns - round((LONGEST_S + END_S) * 1e9)
        begin_ns = max(begin_ns, *(_unbroken_since(done, begin_ns) for done in self._done))
        count = round((end_ns - begin_ns) * 1e-9 / GRID_S)
        if count < COMPARED:
            return None
        times = GRID_S * np.arange(-count, 1, dtype=np.float64)
        memory = np.concatenate([_sampled(_since(done, end_ns - round(1e9 * GRID_S * count)),
                                          end_ns, times) for done in self._done], axis=2)
        lag, known = _period(memory[:, 0]), self._known
        if lag:
            self._known = Rhythm(end_ns, memory[-lag - 1:])
            return self._known
        if known is None or not of_before or end_ns - known.end_ns > KNOWN_NS:
            return None
        return known.from_phase_of(memory[-COMPARED:], end_ns)


class Rhythm:
    """Targets that repeat themselves.

    Parameters
    ----------
    end_ns : int
        Stamp of the last of them [ns].
    memory : ndarray (n + 1, 3, 12)
        Position, velocity and effort of one period, both ends included.
    last : ndarray (3, 12), optional
        The last targets, where the memory is one of before; default: its end.

    Attributes
    ----------
    of_before : bool
        Whether it is the cycle of before a disturbance, and not that of the last targets.
    """

    def __init__(self, end_ns: int, memory: Array, last: Array | None = None) -> None:
        """Keep one period, and by how much it differs from where it begins."""
        self.end_ns, self._memory = end_ns, memory
        self._ahead_s, self._kept_ns, self.of_before = 0.0, end_ns, last is not None
        self.period_s = GRID_S * (len(memory) - 1)
        self._gap = (memory[-1] if last is None else last) - memory[0]

    def from_phase_of(self, end: Array, end_ns: int) -> Rhythm | None:
        """The same, closed to a cycle, as what follows an end (m, 3, 12) of a memory; None where
        no phase resembles that.
        """
        steps = len(self._memory) - 1
        share = np.arange(steps)[:, None, None] / steps
        cycle = self._memory[:-1] - share * (self._memory[-1] - self._memory[0])
        position = cycle[:, 0]
        places = (np.arange(steps)[:, None] + np.arange(1 - len(end), 1)) % steps
        off = ((position[places] - end[:, 0]) ** 2).sum(axis=2).mean(axis=1)
        best = int(off.argmin())
        if off[best] > NEAREST * position.var(axis=0).sum():
            return None
        turned = np.roll(cycle, -best, axis=0)
        return Rhythm(end_ns, np.concatenate((turned, turned[:1])), end[-1])

    def at(self, time_ns: int) -> Array:
        """Targets (3, 12) at a stamp after the end; the ends' difference fades within a period."""
        ahead = (time_ns - self.end_ns) * 1e-9 + self._ahead_s
        place = (ahead % self.period_s) / GRID_S
        i = min(int(place), len(self._memory) - 2)
        now = self._memory[i] + (place - i) * (self._memory[i + 1] - self._memory[i])
        result: Array = now + self._gap * min(max(0.0, 1.0 - ahead / self.period_s), 1.0)
        return result

    def keep_time(self, time_ns: int, heard: Sequence[tuple[slice, Array]]) -> None:
        """Go a little faster or slower, so that some joints are where they are told to be at a
        stamp: those of legs that still send targets, positions [rad] and velocities [rad/s],
        (2, 3) each.
        """
        dt, self._kept_ns = (time_ns - self._kept_ns) * 1e-9, time_ns
        position, pull, power = self.at(time_ns)[0], 0.0, STEADY * STEADY
        for of, (told, velocity) in heard:
            pull += float(velocity @ (told - position[of]))
            power += float(velocity @ velocity)
        self._ahead_s += dt * min(max(pull / (KEEPING_S * power), -KEEPS), KEEPS)


def _period(position: Array) -> int:
    """Steps of the lag at which positions (n, 12) resemble their own end; 0 where none does."""
    count = len(position) - 1
    if count < SHORTEST + COMPARED:
        return 0
    spread = position[-SHORTEST:].var(axis=0).sum()
    lags = np.arange(SHORTEST, count - COMPARED + 1)
    parts = np.lib.stride_tricks.sliding_window_view(position, COMPARED, axis=0)
    off = ((parts[-1] - parts[-1 - lags]) ** 2).sum(axis=1).mean(axis=1)
    least = off.min()
    # the first dip that is about as low: not twice the period
    best = np.flatnonzero(off <= least + 0.02 * spread)[0]
    while best + 1 < len(off) and off[best + 1] < off[best]:
        best += 1
    lag = int(lags[best])
    wide = min(lag, count - lag)
    cycle = ((position[-wide:] - position[-wide - lag:-lag]) ** 2).sum(axis=1).mean()
    alike = ALIKE if 2 * wide >= lag else CLOSELY
    return lag if least <= alike * spread and cycle <= REPEATS * spread else 0


def _unbroken_since(heard: deque[tuple[int, Array]], begin_ns: int) -> int:
    """Stamp since which a leg has sent without a gap; it need not be looked for before a time."""
    since_ns = heard[-1][0]
    for stamp_ns, _ in reversed(heard):
        if since_ns - stamp_ns > GAP_NS:
            break
        since_ns = stamp_ns
        if stamp_ns <= begin_ns:
            break
    return since_ns


def _since(heard: deque[tuple[int, Array]], begin_ns: int) -> list[tuple[int, Array]]:
    """What a leg sent from a time on, and the last before it."""
    found = []
    for entry in reversed(heard):
        found.append(entry)
        if entry[0] < begin_ns:
            break
    return found[::-1]


def _sampled(heard: list[tuple[int, Array]], end_ns: int, times: Array) -> Array:
    """What a leg sent, (n, 3, 3), at times before an end [s]."""
    stamps = np.array([stamp - end_ns for stamp, _ in heard]) * 1e-9
    values = np.array([value.ravel() for _, value in heard])
    columns = [np.interp(times, stamps, column) for column in values.T]
    return np.stack(columns, axis=1).reshape(len(times), 3, len(JOINTS_OF_LEG))
