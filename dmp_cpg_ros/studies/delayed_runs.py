# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Captures whose samples are late, held or carried on, in simulation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.contraction.delays import Capture
from dmp_cpg_ros.core.maths import Array

Complex = NDArray[np.complex128]

PATTERNS = ('one age', 'edges', 'kept', 'kept from inhibited', 'chosen')
"""How ages are distributed and vary."""

_CHOICES = 12  # ages of which one is chosen
_MOST_RUNS = 6  # times as long as rest is waited for where something moves


def fails(capture: Capture, kind: str, ages: Array, pattern: str, rng: np.random.Generator
          ) -> NDArray[np.bool_]:
    """Whether C is left or rest is not reached, for all ages at once.

    Parameters
    ----------
    capture : Capture
        What is captured.
    kind : str
        ``late`` for the switch; of samples ``held``, ``carried``, and what nothing certifies:
        ``held at once`` from the entry on and not before, so that they lag by more than a walk
        with them lets them, and ``always carried``, in C too.
    ages : ndarray (count,)
        Largest ages [s].
    pattern : str
        One of ``PATTERNS``.
    rng : Generator
        Random numbers.

    Returns
    -------
    ndarray (count,) of bool
    """
    run = _DelayedRun(capture, kind, ages, pattern, rng)
    for tick in range(_MOST_RUNS * run.steps):
        run.let_samples_age()
        acts = run.acts()
        run.judge(acts, tick)
        run.advance(acts)
        if run.note_way(tick) and np.all(run.rests | run.bad):
            break
    return (run.bad | ~run.acted | run.moves) & ~run.aside


class _DelayedRun:
    """The legs of one network about to enter C, a run for every age.

    Locked coordinates as complex numbers that turn anticlockwise; the pull of coupling and
    inhibition is integrated exactly for samples that are held for one small step.

    Attributes
    ----------
    steps : int
        Number of steps until rest should be reached.
    acted, bad, aside : ndarray (count,)
        Whether inhibition has acted; whether C was left, or something diverged; whether a leg
        turned backwards before, of which nothing is certified.
    """

    def __init__(self, capture: Capture, kind: str, ages: Array, pattern: str,
                 rng: np.random.Generator) -> None:
        self._capture, self._pattern = capture, pattern
        self._kind, self._late, self._carried = kind, kind == 'late', kind[-7:] == 'carried'
        self._k, self._rho = capture.coupling, float(capture.system.rho.max())
        count, degree = len(ages), float(self._k.sum(axis=1).max())
        self._step = min(float(ages[0]) / 10.0, 0.1 / capture.omega, 0.2 / degree)
        # a sample is held for a step
        self._most = np.maximum(0, np.floor(ages / self._step).astype(int) - 1)
        rest = 4.0 * float(ages[-1]) + 6.0 / max(capture.undelayed.rate, 1.0)
        self.steps = int(rest / self._step)
        self._walk_up_to_the_region(capture.omega / (1.0 + degree * ages * (kind == 'held')), rng)
        self._draw_ages(rng)
        self._way = self._before = self._end_way = np.full(count, np.inf)
        self._from = self._end_from = self._z
        self._backwards = np.full(count, -len(self._past))
        self._inside = np.full(self._z.shape, -1)    # ticks since nodes came into C, or -1
        self.acted, self.bad, self.aside = np.zeros((3, count), dtype=bool)

    def _walk_up_to_the_region(self, omega: Array, rng: np.random.Generator) -> None:
        """Fill the past with a walk of that pace (count,), legs as far from places as may be."""
        capture, r = self._capture, self._capture.radius
        length, size = int(self._most.max()) + 2, len(self._k)
        start = (-2.0 * np.arcsin(min(1.0, capture.region_radius / (2.0 * r)))
                 - 0.5 * self._step * capture.omega)
        turn = np.exp(1j * self._step * np.arange(1 - length, 1)[:, None] * omega)[:, :, None]
        apart = rng.uniform(-0.5, 0.5, (len(omega), size)) * capture.places / r
        apart *= 0.5 if self._carried else 1.0
        apart[:, capture.held] = 0.0
        self._past = r * np.exp(1j * (start + apart)) * turn           # (length, count, N), a ring
        self._z, self._now = self._past[-1], length - 1
        self._rate = 1j * omega[:, None] * self._z

    def _draw_ages(self, rng: np.random.Generator) -> None:
        """Ages (count, N, N) of samples at the begin, in steps, and of what the switch sees."""
        count, size = self._z.shape
        edges, each = rng.random((size, size)), rng.random((count, size, size))
        shares = {'one age': np.ones((size, size)), 'edges': edges}.get(self._pattern, each)
        self._age = (shares * self._most[:, None, None]).astype(int)
        self._seen_age = self._most
        self._of = np.arange(count)[:, None, None], np.arange(size)[None, None, :]

    def let_samples_age(self) -> None:
        """By a step, until others come, by the pattern."""
        if self._pattern == 'chosen' and self.acted.any():
            self._age = chosen_ages(self._z - self._capture.radius, self._past, self._now,
                                    self._most, self._age, self._turned)
        elif self._pattern[:4] in ('kept', 'chos'):
            self._age = np.where(self._age >= self._most[:, None, None], 0, self._age + 1)
            self._seen_age = np.where(self._seen_age >= self._most, 0, self._seen_age + 1)
            if self._pattern == 'kept from inhibited':
                self._age[:, :, ~self._capture.held] = 0

    def acts(self) -> NDArray[np.bool_]:
        """Whether inhibition acts, by what is seen of the inhibited legs, (count,)."""
        capture, count = self._capture, len(self._most)
        seen = self._past[(self._now - self._seen_age) % len(self._past),
                          np.arange(count)] if self._late else self._z
        return np.asarray(np.all(
            np.abs(seen[:, capture.held] - capture.radius) <= capture.region_radius, axis=1))

    def judge(self, acts: NDArray[np.bool_], tick: int) -> None:
        """Note what is wrong now."""
        capture, z = self._capture, self._z
        entered = acts & ~self.acted
        self._inside = np.where((self._inside >= 0) | (
            np.abs(z - capture.radius) <= capture.region_radius), self._inside + 1, -1)
        self._backwards[np.any((self._rate * np.conj(z)).imag < 0.0, axis=1)] = tick
        self.aside |= entered & (tick - self._backwards <= self._most) & (
            self._kind != 'held at once')
        self.acted |= acts
        outside = np.abs(z[:, capture.held] - capture.radius) > (
            capture.region_radius * (1.0 + 1e-9))
        self.bad |= self.acted & (np.any(outside, axis=1) | ~acts)
        self.bad |= ~np.all(np.abs(z) < 1e3, axis=1)                    # diverged

    def advance(self, acts: NDArray[np.bool_]) -> None:
        """One step with the samples that there are."""
        capture, k = self._capture, self._k
        gains = np.where(acts[:, None], capture.gains, 0.0)
        decay = k.sum(axis=1) + gains
        pulled = np.einsum('ij,bij->bi', k, self._samples()) + gains * capture.radius
        faded = np.exp(-decay * self._step)
        feed = np.divide(1.0 - faded, decay, out=np.full_like(decay, self._step),
                         where=decay > 0.0)
        z = np.where(np.abs(self._z) < 1e3, self._z, 0.0)
        ahead = faded * z + feed * (self._field(z) + pulled)
        z = faded * z + 0.5 * feed * (self._field(z) + self._field(ahead) + 2.0 * pulled)
        self._now = (self._now + 1) % len(self._past)
        self._z = self._past[self._now] = z
        self._rate = self._field(z) + pulled - decay * z

    def _samples(self) -> Complex:
        """What each leg hears of each other, (count, N, N)."""
        at = ((self._now - (0 if self._late else 1) * self._age) % len(self._past), *self._of)
        return np.asarray(self._past[at] * self._turned(self._age))

    def _turned(self, age: NDArray[np.int_]) -> Complex:
        """What samples (count, N, ...) of such ages are turned by at their receivers."""
        if not self._carried:
            return np.ones(1, dtype=complex)
        ended = np.maximum(self._inside, 0)[:, :, None] * (self._kind == 'carried')
        free = np.maximum(0, age - ended)
        return np.asarray(np.exp(1j * self._capture.omega * self._step * free))

    def _field(self, z: Complex) -> Complex:
        """ż without any pull."""
        r = self._capture.radius
        return np.asarray((self._rho * (r * r - np.abs(z) ** 2) + 1j * self._capture.omega) * z)

    def note_way(self, tick: int) -> bool:
        """Note how far nodes go in a run and in its last quarter; whether it is over."""
        now, last = tick % self.steps, 3 * self.steps // 4
        if now == 0:
            self._earlier, self._before = self._before, self._way
            self._way, self._from = np.zeros(len(self._way)), self._z
        if now == last:
            self._end_way, self._end_from = np.zeros(len(self._way)), self._z
        np.maximum(self._way, np.abs(self._z - self._from).max(axis=1), out=self._way)
        if now >= last:
            np.maximum(self._end_way, np.abs(self._z - self._end_from).max(axis=1),
                       out=self._end_way)
        return now == self.steps - 1

    @property
    def rests(self) -> NDArray[np.bool_]:
        """Whether nothing has moved far in the last quarter, (count,)."""
        return np.asarray(self._end_way < 3e-3 * self._capture.radius)

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Whether something has moved nearly as far as two runs before, (count,): with samples
        that are old and chosen ill, captured legs come to rest, but slowly and not evenly.
        """
        return np.asarray(~self.rests & (self._way > 0.9 * self._earlier))


def chosen_ages(away: Complex, past: Complex, now: int, most: NDArray[np.int_],
                age: NDArray[np.int_], turned: Callable[[NDArray[np.int_]], Complex]
                ) -> NDArray[np.int_]:
    """Ages of the samples that pull each node farthest away from the target now, of those that do
    not come before the last that it had, (count, N, N).

    Parameters
    ----------
    away : ndarray (count, N)
        From the target to the nodes.
    past : ndarray (length, count, N)
        States by tick, a ring.
    now : int
        Where the present is in it.
    most : ndarray (count,)
        Largest ages in ticks.
    age : ndarray (count, N, N)
        Ages at the last tick.
    turned : callable
        Ages in ticks (count, N, ...) to what receivers turn samples by, as complex numbers.
    """
    length, count, row = len(past), len(away), np.arange(len(away))[:, None]
    age = age + 1
    shares = np.minimum(np.linspace(0.0, 1.0, _CHOICES), 1.0)
    ages = np.round(shares * most[:, None]).astype(int)                    # (count, choices)
    seen = past[(now - ages) % length, row]                                # (count, choices, N)
    out = np.conj(away / np.maximum(np.abs(away), 1e-12))[:, :, None]
    worth = np.einsum('bic,bcj->bcij', out * turned(ages[:, None, :]), seen).real
    worth[ages[:, :, None, None] > age[:, None]] = -np.inf
    old = past[(now - age) % length, row[:, :, None], np.arange(age.shape[2])] * turned(age)
    kept = np.where(age > most[:, None, None], -np.inf, (out * old).real)
    best = worth.argmax(axis=1)
    better = np.take_along_axis(worth, best[:, None], axis=1)[:, 0] > kept
    return np.where(better, ages[np.arange(count)[:, None, None], best], age)
