# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Certified networks under requests, releases and changes, against what certificates promise."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.certificates.step import STEP_ERROR
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.hopf_bounds import growth, mild_rate
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.studies.draws import Case
from dmp_cpg_ros.studies.network_batch import Batch, Setting

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
