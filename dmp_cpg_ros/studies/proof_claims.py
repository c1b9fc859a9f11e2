# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Claims of a proof, each looked at in floating point without the checker: what does not hold."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates import step
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.synchronisation import connectivity
from dmp_cpg_ros.core.maths import Array

Values = dict[str, Any]

_CLEARLY = 1e-7
"""Share by which a claim must fail, so that rounding does not refute it."""

_LESS = 1.0 - _CLEARLY

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)  # (a, 2)


def refuted(p: Values, w: Values) -> list[str]:
    """Claims of a proof that do not hold, in floating point.

    States on faces of the box and the half-planes are sampled with the field and the Jacobian of
    the oscillators, connectivity is an eigenvalue and equilibria are found by Newton's method, so
    that nothing is shared with the checker. Time to rest is compared with what the reference's and
    the swings' filters alone need.
    """
    K, gains = (np.array(p[name], dtype=float) for name in ('coupling', 'gains'))
    numbers = [float(x) for x in p.values() if isinstance(x, Fraction)]
    fastest = float(max(p['omega_at_rest'], p['omega_armed_max']))
    if min(*numbers, K.min(), gains.min()) < 0.0 or fastest > float(p['omega_max']) / _LESS:
        return ['premises']
    if min(float(p['rho']), float(p['radius']), gains.max(), K.sum(axis=1).max()) <= 0.0 or min(
            map(float, (*w['v'], *w['xi']))) <= 0.0:
        return ['positive']
    claimed = _Claimed(p, w)
    claims = claimed.box() | claimed.sampled() | claimed.times() | claimed.half_planes()
    claims |= claimed.rest() or {'equilibrium': False}
    return [name for name, holds in claims.items() if not holds]


class _Claimed:
    """Parameters and witnesses of a proof as floating-point numbers, and whether they fit."""

    def __init__(self, p: Values, w: Values) -> None:
        self.p, self.w = p, w
        self.rho, self.r, self.r0, self.tick, self.omega, self.slow = (float(p[name]) for name in (
            'rho', 'radius', 'region_radius', 'tick', 'omega_max', 'omega_at_rest'))
        self.K, self.gains = (np.array(p[name], dtype=float) for name in ('coupling', 'gains'))
        self.u, self.v, self.xi = (np.array(w[name], dtype=float) for name in ('u', 'v', 'xi'))
        self.connectivity, self.rate = float(w['connectivity']), float(w['rate'])
        self.planes = [[np.array(part, dtype=float) for part in plane[:3]]
                       for plane in w['half_planes']]
        size, K = len(self.K), self.K
        self.oscillator = AndronovHopf(self.rho, self.r)
        self.graph = graph_from_edges(
            size, tuple((int(i), int(j)) for i, j in np.argwhere(K > 0.0)), K[K > 0.0])
        self.system = CanonicalSystem(self.graph, self.oscillator)
        self.target, self.held = np.array([self.r, 0.0]), self.gains > 0.0
        self.growth, self.kept = self.rho * self.r**2, self.gains + K.sum(axis=1)
        self.scale = _CLEARLY * (self.omega + K.max()) * self.r
        self.places = self.r * min(0.02, self.slow / K.sum(axis=1).max())

    def box(self) -> dict[str, bool]:
        """Synchronisation, entry, the faces of the box, and contraction in it."""
        r, u, v, K, kept = self.r, self.u, self.v, self.K, self.kept
        x = self.target + u[:, None, None] * _CIRCLE                           # (N, a, 2)
        field = (self.oscillator.field(x, self.omega) * _CIRCLE).sum(axis=2)
        on_face = np.where(self._in_disc(x), field, -np.inf).max(axis=1) + K @ u - kept * u
        inner = np.max([np.maximum(0.0, r - u), *(h for *_, h in self.planes)],
                       axis=0) if self.planes else 0 * u
        J = self.oscillator.jacobian(inner[:, None, None] * _CIRCLE, self.omega)
        most = np.linalg.eigvalsh(0.5 * (J + np.swapaxes(J, 2, 3)))[..., 1].max(axis=1)
        known = connectivity(self.graph.block_laplacian(), len(K), self.xi)
        return {
            'synchronisation': self.growth * _LESS < self.connectivity
            and abs(self.xi.sum() - 1.0) < _CLEARLY and self.connectivity * _LESS <= known,
            'entry': bool(np.all(np.abs(u - self.r0)[self.held] <= _CLEARLY * r) and np.all(
                u[~self.held] >= min(2.0 * r, self.r0 + self.places) * _LESS)),
            'box': bool(np.all((on_face <= self.scale) | (u >= 2.0 * r * _LESS))),
            'contraction': self.rate > 0.0 and bool(np.all(
                most - kept + (K @ v) / v <= -self.rate + _CLEARLY * kept.max()))}

    def sampled(self) -> dict[str, bool]:
        """The sampled step."""
        rho, r, r0, omega, tick = self.rho, self.r, self.r0, self.omega, self.tick
        decay = min(self.connectivity - self.growth, self.rate, 2.0 * self.growth)
        return {
            'time_step': tick * _LESS <= step.longest_step(rho, r, omega, decay),
            'mild_root': float(self.w['mild_root']) >= math.hypot(omega, self.growth) * _LESS,
            'cycle_radius': step.cycle_radius_error(rho, r, omega, tick) * _LESS - 1e-10 <= float(
                self.w['cycle_error']) <= min(0.02, (r0 / r)**2),
            'region_per_tick': omega * tick * _LESS <= 4.0 * math.asin(min(1.0, 0.5 * r0 / r))}

    def times(self) -> dict[str, bool]:
        """Rates of the filters, and the times that they take at least."""
        p, fast = self.p, float(self.p['foot_speed'])
        return {
            'rates': min(p['alpha_r'], p['slowest_filter'], p['stiffness'], p['damping']) > 0,
            'rest_posture': float(p['clearance']) * 0.02 * _LESS <= 0.01,
            'arming_time': fast == 0.0 or fast * _LESS * math.exp(
                -float(p['alpha_r'] * self.w['arming_time'])) <= float(p['armed_speed']),
            'time_to_rest': p['activity_rate'] > 0 and p['alpha_r'] > 0 and max(
                math.log(50.0) / float(p['activity_rate']),
                math.log(max(100.0 * fast, 1.0)) / float(p['alpha_r'])) < 10.0}

    def half_planes(self) -> dict[str, bool]:
        """States on the half-planes move inwards, and entries lie behind them."""
        r, u, held = self.r, self.u, []
        entry = np.concatenate([0.98 * r * _CIRCLE, r * _CIRCLE])
        entry = entry[np.hypot(*(entry - self.target).T) <= self.r0]
        for c, s, h in self.planes:
            n, along = np.array([c, -s]), np.array([s, c])
            x = h[:, None, None] * n + np.linspace(-r, r, len(_CIRCLE))[:, None] * along
            near = np.hypot(*np.moveaxis(x - self.target, 2, 0)) <= u[:, None]
            inwards = np.where(self._in_disc(x) & near, self.oscillator.field(x, self.omega) @ n,
                               np.inf).min(axis=1)
            held.append(bool(np.all(
                inwards + self.K @ h + self.gains * r * c - self.kept * h >= -self.scale)
                and np.all(h.max() + self.places <= entry @ n + self.scale) and h.min() >= 0.0))
        return {'half-planes': all(held)} if held else {}

    def rest(self) -> dict[str, bool]:
        """Equilibria at the slowest and the fastest cadence; empty where one is not found."""
        claims = dict[str, bool]()
        for at, (y, _, error) in zip((self.slow, self.omega), self.w['equilibria'][::-1],
                                     strict=True):
            rest, states = inhibited_equilibrium(self.system, at, self.gains), np.array(
                y, dtype=float)
            if rest is None:
                return {}
            found = 2.0 * rest.residual / max(rest.slowest_rate, 1.0)  # how exactly it is
            off = (np.linalg.norm(rest.state - states, axis=1) - found) / self.v
            claims[f'equilibrium at {at:.3g}'] = (
                float(off.max()) * _LESS - 1e-9 * self.r <= float(error))
            near = np.linalg.norm(states - self.target, axis=1)[self.held].max()
            claims['rest_in_region'] = bool(  # of the fastest, which comes last
                rest.distance[self.held].max() * _LESS < self.r0
                and near * _LESS <= float(self.w['rest_distance']))
            claims.setdefault('rest_radius', bool(
                rest.radius.min() > 0.5 * self.r * _LESS
                and np.hypot(*states.T).min() >= float(self.w['rest_size']) * _LESS))
        return claims

    def _in_disc(self, x: Array) -> Array:
        return np.asarray(np.hypot(x[..., 0], x[..., 1]) <= self.r)
