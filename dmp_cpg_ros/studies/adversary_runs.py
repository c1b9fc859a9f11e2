# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Certified networks under requests, releases and changes, and what their certificates promise.

The time step of the canonical system is stacked over the settings of many networks.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from copy import copy
from dataclasses import dataclass
from math import ceil, log2

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.step import STEP_ERROR, mild_rate
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.studies.draws import Case


@dataclass(frozen=True)
class Setting:
    """One network with its inhibition."""

    system: CanonicalSystem
    omega: Array
    gains: Array
    region_radius: float
    name: str = ''

    @property
    def node(self) -> int:
        """The inhibited oscillator."""
        return int(np.argmax(self.gains))


class Batch:
    """Steps many networks at once; inhibition is switched by region where it is armed.

    Parameters
    ----------
    settings : list of Setting
        Of networks of the same size N.
    dt : float or ndarray (settings,)
        Length of the step [s].
    """

    def __init__(self, settings: list[Setting], dt: ArrayLike) -> None:
        """Compute the matrices of the step, free and inhibited, of every setting."""
        self._settings = settings
        rho = np.stack([s.system.rho for s in settings])
        self._stacked = {
            'omega': np.stack([s.omega for s in settings]), 'rho': rho,
            'gains': np.stack([s.gains for s in settings]),
            'target': np.stack([s.system.target for s in settings]),
            'region': np.array([s.region_radius for s in settings])[:, None],
            'pull': rho * np.stack([s.system.radius for s in settings]) ** 2}
        parts = [s.system.linear_part(gains) for s in settings for gains in (0.0 * s.gains,
                                                                             s.gains)]
        dts = np.repeat(np.broadcast_to(dt, len(settings)), 2)
        self._steps = step_matrices(np.stack([M for M, _ in parts]),
                                    np.stack([c for _, c in parts]), dts)
        self.rows = np.arange(0)
        self.use(np.arange(len(settings)))

    def use(self, rows: NDArray[np.intp]) -> None:
        """Step the states (rows,) by these settings from now on."""
        if len(rows) != len(self.rows):
            self._now = [np.empty((len(rows), *part.shape[1:])) for part in self._steps]
            self._at = np.full(len(rows), -1)
        self.rows = rows
        for name, values in self._stacked.items():
            setattr(self, name, values[rows])

    omega: Array
    rho: Array
    gains: Array
    target: Array
    region: Array
    pull: Array

    @property
    def settings(self) -> list[Setting]:
        """The setting of each state."""
        return [self._settings[row] for row in self.rows]

    def subset(self, keep: NDArray[np.bool_]) -> Batch:
        """The same batch with only the states whose mask (states,) is true."""
        part = copy(self)
        part._now, part._at = [now[keep] for now in self._now], self._at[keep]
        part.rows = self.rows[keep]
        part.use(part.rows)
        return part

    def inside(self, x: Array) -> NDArray[np.bool_]:
        """Which states (states, N, 2) have their inhibited oscillators in C, (states,)."""
        close = np.linalg.norm(x - self.target, axis=2) <= self.region
        return np.asarray(np.all(close | (self.gains == 0.0), axis=1))

    def step(self, x: Array, armed: bool | NDArray[np.bool_] = True) -> Array:
        """One step of all states (states, N, 2)."""
        at = 2 * self.rows + (self.inside(x) & armed)
        if (moved := at != self._at).any():
            for now, every in zip(self._now, self._steps, strict=True):
                now[moved] = every[at[moved]]
            self._at = at
        half, end, final, c_half, c = self._now
        flat, linear = x.reshape(len(x), -1), self.pull - 1j * self.omega

        def nonlinear(state: Array) -> Array:
            z = np.ascontiguousarray(state).view(complex)
            return np.asarray(((linear - self.rho * (z.real**2 + z.imag**2)) * z).view(float))

        n0 = nonlinear(flat)
        n_half = nonlinear(_times(half, flat, n0) + c_half)
        n_end = nonlinear(_times(end, flat, n0, n_half) + c)
        return np.asarray((_times(final, flat, n0, n_half, n_end) + c).reshape(x.shape))

    def speed(self, x: Array, armed: bool | NDArray[np.bool_] = True) -> Array:
        """Largest |ẋ_i| of each state, by its own vector field."""
        acting = self.inside(x) & armed
        return np.array([np.linalg.norm(s.system.field(x[k], s.omega, s.gains * acting[k]),
                                        axis=1).max() for k, s in enumerate(self.settings)])


def step_matrices(M: Array, c: Array, dt: Array) -> list[Array]:
    """Matrices of :class:`~dmp_cpg_ros.core.maths.exponential.ExponentialStep`, stacked.

    φ₃ by its series where the norm is below 1/2, φ_k = M φ_{k+1} + 1/k!, and by doubling
    φ_k(2M) = 2^−k (φ₀ φ_k + Σ_j φ_j/(k − j)!).

    Parameters
    ----------
    M, c, dt : ndarray (s, n, n), (s, n), (s,)
        Linear parts [1/s], constants and lengths of the steps [s].

    Returns
    -------
    list of ndarray
        To half, to the end, final (s, n, 2n … 4n), and the constants of both (s, n).
    """
    unit, h = np.eye(M.shape[-1]), dt[:, None, None]
    norm = float(np.abs(M * h).sum(axis=-2).max())
    doublings = max(0, ceil(log2(norm))) if norm > 0.0 else 0
    A = M * (0.5 * h / 2.0**doublings)
    series = np.broadcast_to(unit, M.shape)
    for k in range(16, 3, -1):
        series = unit + A @ series / k
    p3 = series / 6.0
    p2 = A @ p3 + 0.5 * unit
    p1 = A @ p2 + unit
    phi = [A @ p1 + unit, p1, p2, p3]
    half = phi
    for _ in range(doublings + 1):
        half = phi
        p0, p1, p2, p3 = np.split(phi[0] @ np.concatenate(phi, axis=2), 4, axis=2)
        phi = [p0, (p1 + phi[1]) / 2.0, (p2 + phi[1] + phi[2]) / 4.0,
               (p3 + phi[1] / 2.0 + phi[2] + phi[3]) / 8.0]
    whole, p1, p2, p3 = phi
    to_half, to_end = 0.5 * h * half[1], h * p1
    return [np.concatenate([half[0], to_half], axis=2),
            np.concatenate([whole, -to_end, 2.0 * to_end], axis=2),
            np.concatenate([whole, h * (p1 - 3.0 * p2 + 4.0 * p3), h * (4.0 * p2 - 8.0 * p3),
                            h * (4.0 * p3 - p2)], axis=2),
            (to_half @ c[:, :, None])[:, :, 0], (to_end @ c[:, :, None])[:, :, 0]]


def _times(matrix: Array, *parts: Array) -> Array:
    return np.asarray(np.matmul(matrix, np.concatenate(parts, axis=1)[:, :, None])[:, :, 0])


TICKS = 900
EVENTS = {'request': 0.3, 'release': 0.2, 'change': 0.22, 'cadence': 0.08, 'scatter': 0.05,
          'gather': 0.04, 'edge': 0.07, 'box': 0.04}
"""How often each happens: a ``cadence`` is a share of the certified ω; the last four put states
anywhere, into their places, to the edge of C as inhibition sets in, and to the edge of the box.
"""

ROUNDING = 1e-5
"""Share by which rounding and the step may lead out of C or of the box."""


@dataclass(frozen=True)
class Certified:
    """A setting that is certified, and what its certificate says."""

    setting: Setting
    capture: CaptureSet
    radii: float
    rate: float
    shape: Array | None                # of the norm max |δ_i|/v_i; None: the 2-norm
    from_box: bool                     # whether the rate holds in all of the box
    free_rate: float
    weights: Array | None

    @property
    def lasting(self) -> float:
        """Slowest certified rate [1/s]."""
        system = self.setting.system
        return min(self.rate, self.free_rate, 2.0 * float(growth(system.rho, system.radius).min()))


@dataclass(frozen=True)
class Network:
    """A case with its certificates."""

    case: Case
    settings: list[Certified]


class Runs:
    """Networks of one size under their events, and what is wrong with them."""

    def __init__(self, networks: list[Network], weaken: str, counts: Counter[str]) -> None:
        """Stack what is certified."""
        self.networks, self.weaken, self.counts = networks, weaken, counts
        every = [one for net in networks for one in net.settings]
        many = np.array([len(net.settings) for net in networks])
        self.first, count, size = np.cumsum(many) - many, len(networks), len(
            networks[0].case['phases'])
        self.dt = np.array([net.case['tick_s'] for net in networks])
        self.batch = Batch([one.setting for one in every], np.repeat(self.dt, many))
        self.turn = np.exp(1j * np.stack([net.case['phases'] for net in networks]))
        self.D = np.array([net.case['target_radius'] for net in networks])[:, None]
        self.stacked = {
            'box': np.stack([one.capture.distance for one in every]),
            'region': np.array([[one.setting.region_radius] for one in every]),
            'near': np.array([one.capture.tolerance for one in every]),
            'radii': np.array([one.radii for one in every]),
            'omega': np.stack([one.setting.omega for one in every]),
            'held': np.stack([one.setting.gains > 0.0 for one in every])}
        self.r = np.array([net.case['radius'] for net in networks])
        self.slip = np.array([STEP_ERROR * (dt * mild_rate(
            net.case['rho'], max(net.case['radius']), max(
                float(one.setting.omega[0]) for one in net.settings))) ** 4
            for net, dt in zip(networks, self.dt, strict=True)])
        self.requested, self.armed, self.acting, self.gathered, self.entered = np.zeros(
            (5, count), dtype=bool)
        self.since = np.zeros(count, dtype=int)
        self.measure, self.closest, self.turned = np.zeros((3, count))
        self.share, self.y = np.ones((count, size)), np.ones((count, size), dtype=complex)
        # networks lock on their cycle where all radii and the target's are one
        self.alike = np.array([set(net.case['radius']) == {net.case['target_radius']}
                               for net in networks])
        self.told: dict[int, str] = {}
        self.row = self.first.copy()
        self.tick, self.stale = 0, True
        self.box = self.region = self.near = self.radii = self.omega = np.zeros(0)
        self.held = np.zeros((count, size), dtype=bool)

    def run(self) -> None:
        """Step all to the end of their events."""
        due: defaultdict[int, list[tuple[int, str, int]]] = defaultdict(list)
        for k, net in enumerate(self.networks):
            at = 0
            for wait, kind, value in net.case['events']:
                due[at := at + wait].append((k, kind, value))
            due[min(at + 150, TICKS)].append((k, 'end', 0))
        for self.tick in range(max(due) + 1):
            for k, kind, value in due.get(self.tick, ()):
                self.check(k)
                self.do(k, kind, value)
                self.stale = True
            if len(self.told) == len(self.networks):
                break
            self.advance()

    def advance(self) -> None:
        """One tick of all networks."""
        if self.stale:
            self.stale = False
            self.batch.use(self.row)
            for name, values in self.stacked.items():
                setattr(self, name, values[self.row])
            self.batch.omega = self.omega * np.where(self.acting[:, None], self.share,
                                                     self.share[:, :1])
        arriving = np.flatnonzero(self.requested & ~self.armed)
        if len(arriving):
            good = self.in_places(arriving)
            self.armed[arriving[good]] = True
            self.turned[arriving[good]] = 0.0
            self.tell(arriving[~good & self.gathered[arriving]], 'is not in its places')
        distance = np.abs(self.y - self.D)
        inside = np.all(~self.held | (distance <= self.region), axis=1)
        for k in np.flatnonzero(self.armed & inside & ~self.acting):
            self.acting[k], self.gathered[k], self.share[k] = True, False, self.share[k, 0]
            self.counts['captures'] += 1
            self.clock(int(k))
        going = np.flatnonzero(self.armed & ~self.acting & self.alike)
        if len(going):
            ahead = self.dt[going] * self.batch.omega[going, 0]
            self.turned[going] += ahead
            late = self.turned[going] > 2.0 * np.pi + 0.05 + 2.0 * ahead
            self.tell(going[late], 'is not captured within a turn')
        x = np.conj(self.y * self.turn).view(float).reshape(*self.y.shape, 2)
        x = self.batch.step(x, self.armed)
        self.y = np.conj(x.reshape(len(x), -1).view(complex)) / self.turn
        distance = np.abs(self.y - self.D)
        left = self.held & (distance > self.region * (1.0 + ROUNDING))
        out = distance > self.box * (1.0 + ROUNDING) + 1e-9
        self.tell(np.flatnonzero(self.acting & left.any(axis=1)), 'leaves C')
        self.tell(np.flatnonzero(self.acting & out.any(axis=1)), 'leaves the invariant box')
        self.tell(np.flatnonzero(~np.isfinite(distance).all(axis=1)), 'diverges')

    def in_places(self, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether networks are as near to places and cycle as capture takes for granted."""
        y = self.y[rows]
        apart = np.abs(y[:, :, None] - y[:, None, :]).max(axis=(1, 2))
        off = np.abs(np.abs(y) - self.r[rows]).max(axis=1)
        return np.asarray((apart <= self.near[rows]) & (off <= self.radii[rows])
                          | (self.weaken == 'places'))

    def tell(self, rows: NDArray[np.intp], what: str) -> None:
        """Note what is wrong; of each network the first."""
        for k in rows:
            self.told.setdefault(int(k), f'{what} at tick {self.tick}')

    def certificate(self, k: int) -> Certified:
        """What is in force."""
        return self.networks[k].settings[self.row[k] - self.first[k]]

    def now(self, k: int) -> float:
        """|ẋ| under inhibition, or disagreement without, in the norm that shrinks."""
        one = self.certificate(k)
        if self.acting[k]:
            each = self.speeds(k)
            return float(np.hypot.reduce(each) if one.shape is None else (each / one.shape).max())
        if one.weights is None:
            return math.inf
        return float(np.sqrt(one.weights @ np.abs(self.y[k] - one.weights @ self.y[k]) ** 2))

    def speeds(self, k: int) -> Array:
        """|ẋ_i| under inhibition, (N,)."""
        one, x = self.certificate(k).setting, np.conj(self.y[k] * self.turn[k])
        return np.asarray(np.hypot(*one.system.field(
            x.view(float).reshape(-1, 2), self.share[k] * one.omega, one.gains).T))

    def clock(self, k: int) -> None:
        """Begin to measure anew."""
        self.since[k], self.stale = self.tick, True
        sure = not self.acting[k] or self.entered[k] or self.certificate(k).from_box
        self.measure[k] = self.now(k) if sure else math.inf

    def check(self, k: int) -> None:
        """Compare what was measured with what is certified since."""
        one, ticks = self.certificate(k), int(self.tick - self.since[k])
        if k in self.told or ticks == 0:
            return
        if self.acting[k]:
            distance = np.abs(self.y[k] - self.D[k])
            self.closest[k] = max(self.closest[k], float((distance / one.capture.distance).max()))
        rate = one.rate if self.acting[k] else one.free_rate
        # The step keeps decay, but no faster one than its own error in a tick.
        factor = math.exp(-min(rate * self.dt[k], 1.0)) + self.slip[k]
        bound = self.measure[k] * factor ** ticks
        floor = 1e-7 * self.D[k, 0] * (1e3 if self.acting[k] else 1.0)
        if math.isfinite(bound) and bound > floor:
            self.counts['bounds'] += 1
            needed = self.now(k) / bound
            self.closest[k] = max(self.closest[k], needed)
            if needed > 1.01:
                self.tell(np.array([k]), ('comes to rest' if self.acting[k] else 'synchronises')
                          + f' at {needed:.3g} times its bound')

    def do(self, k: int, kind: str, value: int) -> None:
        """Do what an event says."""
        self.counts[kind] += (kind not in ('request', 'release')
                              or bool(self.requested[k]) == (kind == 'release'))
        y, D, one = self.y[k], self.D[k, 0], self.certificate(k)
        rng, size = np.random.default_rng(value), len(self.y[k])
        if kind == 'request' and not self.requested[k]:
            self.requested[k] = self.entered[k] = True
        elif kind == 'release':
            self.requested[k] = self.armed[k] = self.acting[k] = False
        elif kind == 'change':
            others = max(1, len(self.networks[k].settings) - 1)
            before = int(self.row[k] - self.first[k])
            self.change(k, (before + 1 + value % others) % (others + 1))
        elif kind == 'cadence':
            self.counts['accepted'] += 1
            self.share[k] = rng.uniform(0.2, 1.0, size) ** rng.integers(0, 3)
        elif kind in ('scatter', 'gather', 'edge', 'box'):
            self.gathered[k] = kind == 'gather' and bool(self.alike[k])
            self.requested[k] &= kind != 'gather'
            self.requested[k] |= kind in ('edge', 'box')
            self.armed[k], self.acting[k] = kind in ('edge', 'box'), False
            self.entered[k], self.turned[k] = kind != 'box', 0.0
            disc = np.sqrt(rng.random(size)) * np.exp(6.3j * rng.random(size))
            r, region = self.r[k], one.setting.region_radius
            if kind == 'scatter':
                y[:] = r * disc
            elif kind == 'gather':
                y[:] = r * np.exp(6.3j * rng.random())
            elif kind == 'edge':
                ahead = 2.0 * math.asin(min(1.0, 0.4999 * region / D)) * rng.choice([-1.0, 1.0])
                near = D * np.exp(1j * ahead) + 0.45 * one.capture.tolerance * disc
                y[:] = np.where(one.setting.gains > 0.0, D * np.exp(1j * ahead),
                                near * np.minimum(1.0, D / np.abs(near)))
            else:
                y[:] = D + 0.999 * one.capture.distance * np.exp(6.3j * rng.random(size))
                y *= np.minimum(1.0, max(D, float(r.max())) / np.abs(y))
        if kind != 'request' or self.acting[k]:
            self.clock(k)

    def change(self, k: int, at: int) -> None:
        """Change to another certified setting where the suite would accept it."""
        settings = self.networks[k].settings
        if len(settings) == 1:
            return
        if self.acting[k]:
            new, distance = settings[at], np.abs(self.y[k] - self.D[k])
            resting = self.speeds(k).max() < 0.02 * self.D[k, 0] * new.setting.omega[0]
            if self.weaken != 'holding' and not (resting and np.all(
                    distance <= new.capture.distance)):
                return
            self.entered[k] = False
        else:
            self.armed[k] = False
        self.row[k] = self.first[k] + at
        self.counts['accepted'] += 1
