# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ages of carried states that capture bears where ω changes slowly (Section 4.2).

:func:`~dmp_cpg_ros.core.contraction.delays.carried_margin` lets ω jump. A sharper bound compares
with the solution ȳ without delay from the same entry. Samples of it miss it by ∫(t − τ)|ȳ''(τ)|dτ
over their age d, and those of y depart from those of ȳ by |(1 − dκ)I + dF'| |y − ȳ| + d Σ_l k_jl
(what their own samples do): that is small where the second derivative along ȳ is, and y stays in C
and comes to rest as ȳ does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dmp_cpg_ros.core.contraction.delays import (
    PRESENT,
    ROUNDS,
    Capture,
    carried_margin,
    largest_samples,
    most_carried,
)
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import phi_functions
from dmp_cpg_ros.core.maths.roots import last_that_holds

_PARTS = 8  # steps in an age
_STEPS = 320  # at most, until solutions with and without delay are told to stay together
_PASSES = 80  # at most, for what samples of a step may be
_ROOM = 0.02  # of r0, added to what solutions have departed by where bounds are looked for

Bounds = Callable[[Array], tuple[Array, Array]]
"""Decay κ − e, and |(1 − dκ)I + dF'|, within a distance of the solution without delay."""


def slowly_carried_margin(capture: Capture, omega_rate: float) -> float:
    """Largest age of samples ŷ_j = y_j(t − d) + d ẏ_j(t − d) with which capture holds [s].

    Parameters
    ----------
    capture : Capture
        As for :func:`~dmp_cpg_ros.core.contraction.delays.carried_margin`.
    omega_rate : float
        Largest |ω̇| from twice the age before the entry on [rad/s²].

    Returns
    -------
    float
        0 without a certificate, and not below that of an ω that may jump.
    """
    boxed = carried_margin(capture)
    if not capture.undelayed.holds:
        return boxed
    return last_that_holds(lambda age: _follows(capture, age, omega_rate), boxed,
                           most_carried(capture), ROUNDS)


class Undelayed:
    """Bounds on the solution ȳ without delay, from the entry on: its distances u from the target,
    |ȳ'| and |ȳ''|, step by step.

    ȳ' = a + b, where ȧ = (iω − M) a begins as ȳ' does, turning with all legs but for the
    inhibition that sets in, and is known; ḃ = (F' − M) b + N'a + iω̇ȳ, with N the part of F that
    does not turn, ‖N'‖ ≤ ν. So u̇ ≤ g − Mu, |b|˙ ≤ −J|b| + ν|a| + |ω̇|R, and c = ḃ − iω̇ȳ has
    |c|˙ ≤ −J|c| + 6ρR|ȳ'|² + ν|ȧ| + |ω̇|(|b| + (κ + ‖F'‖ + Σk)R), R = r + radii, J = M −
    diag(growth).

    Parameters
    ----------
    capture : Capture
        What is captured.
    step : float
        Length of a step [s].
    omega_rate : float
        Largest |ω̇| from the entry on [rad/s²].
    """

    def __init__(self, capture: Capture, step: float, omega_rate: float) -> None:
        """Bound what is known at the entry."""
        system, k, found = capture.system, capture.coupling, capture.undelayed
        rho, r, omega, r0 = (float(system.rho.max()), capture.radius, capture.omega,
                             capture.region_radius)
        degree, R = k.sum(axis=1), r + capture.radii
        kappa = degree + capture.gains
        fall = kappa - growth(system.rho, system.radius, found.smallest_radius)
        M, J = np.diag(kappa) - k, np.diag(fall) - k
        self.k, self.box, self._step, self._M, self._J = k, found.distance, step, M, J
        self._kappa, self._fall, self._omega, self._rate = kappa, fall, omega, omega_rate
        self._out = capture.growth_out(found.distance)
        self.borne = np.linalg.solve(M, self._out)
        self._to, self._kept = phi_functions(-M * step, 0)[0], np.eye(len(k))
        self._to_b, by = phi_functions(-J * step, 1)
        self._by = step * by
        self._most = phi_functions((k + np.diag(kappa - fall)) * step, 0)[0]
        self._mild = rho * (3.0 * R * R - r * r)                             # ν
        self.drive = np.full(len(k), omega_rate * R)
        self._sharp = 6.0 * rho * R
        self._turn = (kappa + omega + self._mild + degree) * self.drive
        near = 3.0 * rho * R * R * capture.radii + degree * capture.places
        jump = capture.gains * r0                                            # of ȳ', at the entry
        self._jump, self._first = jump, np.stack([omega * R + near + jump, omega * R + near], 1)
        uneven = omega * capture.places + near
        self._common = omega * R * capture.gains
        self._uneven = np.stack([uneven + jump, uneven], 1)
        self.u = np.where(capture.held, r0, r0 + capture.places)
        self._b, self._v = np.zeros(len(k)), self._first[:, 0]
        self._c = omega * near + self._mild * (near + jump)
        self._p = self._c + omega * self._v + omega * capture.places * degree + (
            kappa * near + k @ near + self._common + kappa * jump + k @ jump)

    def _largest(self, at: Array, fed: Array, fall: Array, others: Array) -> Array:
        """Largest x_i in a step, of ẋ = fed − fall x + k x from ``at``, where others are known."""
        kept = np.exp(-fall * self._step)
        return np.maximum(at, kept * at + (1.0 - kept) / fall * (fed + self.k @ others))

    def _grown(self, at: Array, fed: Array) -> Array:
        """Largest of ẋ ≤ fed − Jx in a step."""
        return self._largest(at, fed, self._fall, self._most @ (at + self._step * fed))

    def _first_part(self) -> tuple[Array, Array]:
        """|a|, and |ȧ| but for what turns, now: of all, and but for the inhibition, (N, 2)."""
        M = np.abs(self._M @ self._kept)
        return self._kept @ self._first, (self._kept @ self._common)[:, None] + M @ self._uneven

    @property
    def moved(self) -> Array:
        """How far the inhibition by itself has moved nodes by now."""
        return np.asarray(np.linalg.solve(self._M, self._jump - self._kept @ self._jump))

    def _feed(self, v: Array) -> Array:
        return np.asarray(self._sharp * v * v + self._rate * v + self._turn)

    def advance(self) -> tuple[Array, Array, Array]:
        """Make a step; the largest distances and second derivatives in it, and those but for what
        the inhibition by itself moves.
        """
        nothing = np.zeros_like(self.u)
        u = np.minimum(self.box, self._largest(self.u, self._out, self._kappa, self.box))
        u = np.minimum(u, self._largest(self.u, self._out, self._kappa, u))
        (a, turning), (a_rate, rest) = (
            [self._largest(x, nothing, self._kappa, self._most @ x) for x in part.T]
            for part in self._first_part())
        a_rate, rest = a_rate + self._omega * a, rest + self._omega * turning
        fed = self._mild * a + self.drive
        v = np.minimum(self._grown(self._v, self.drive), a + self._grown(self._b, fed))
        feed = self._feed(v)
        feed_c = feed + self._mild * a_rate
        c = self._grown(self._c, feed_c)
        bend = np.minimum(self._grown(self._p, feed), a_rate + c)
        self.u = self.borne + self._to @ (self.u - self.borne)
        self._kept = self._to @ self._kept
        for name, gained in (('_b', fed), ('_v', self.drive), ('_c', feed_c), ('_p', feed)):
            setattr(self, name, self._to_b @ getattr(self, name) + self._by @ gained)
        return u, bend + self.drive, rest + c + self.drive

    def ever(self) -> tuple[Array, Array]:
        """The largest from now on."""
        nothing = np.zeros_like(self.u)
        a, a_rate = (_later(self._M, part[:, 0], nothing) for part in self._first_part())
        a_rate = a_rate + self._omega * a
        v = np.minimum(_later(self._J, self._v, self.drive), a + _later(
            self._J, self._b, self._mild * a + self.drive))
        feed = self._feed(v)
        bend = np.minimum(_later(self._J, self._p, feed), a_rate + _later(
            self._J, self._c, feed + self._mild * a_rate))
        u = self.borne + max(0.0, float((self.u - self.borne).max()))
        return np.minimum(u, self.box), bend + self.drive


def _later(M: Array, now: Array, fed: Array) -> Array:
    """Largest that x with ẋ ≤ fed − Mx can be from now on."""
    last, shape = np.linalg.solve(M, np.stack([fed, np.ones(len(M))], axis=1)).T
    return np.asarray(last + max(0.0, float(((now - last) / shape).max())) * shape)


def _follows(capture: Capture, age: float, omega_rate: float) -> bool:
    """Whether solutions with carried samples of at most an age stay in C and come to rest with
    those without delay, from which they depart by at most D: Ḋ ≤ (e − κ) D + k σ, where samples
    received are σ = X + ∫(t − τ)|ȳ''|dτ off, with X = max(D, |(1 − dκ)I + dF'| D + d k σ) when
    they were taken.
    """
    found, system, k = capture.undelayed, capture.system, capture.coupling
    if not found.rate > 0.0 or found.tolerance < capture.places * (1.0 - 1e-12):
        return False
    r, r0, rho, omega = capture.radius, capture.region_radius, float(system.rho.max()), (
        capture.omega)
    degree, h, R = k.sum(axis=1), age / _PARTS, r + capture.radii
    kappa, turned, nothing = degree + capture.gains, age * omega, np.zeros(len(k))
    kept = 1.0 - age * kappa
    bent = 0.5 * r * turned**2
    off = float(degree.max()) * (capture.places + bent) + 3.0 * rho * r**2 * capture.radii
    entry = r0 + capture.places + bent + 2.0 * age * off
    path, taken = Undelayed(capture, h, omega_rate), [nothing] * _PARTS
    bends = apart = [nothing] * (_PARTS + 1)
    weights = h * h * (np.arange(_PARTS, 0.0, -1.0) - 0.5)                   # the oldest first
    D = X = nothing

    def bounds(departed: Array) -> tuple[Array, Array]:
        reach = 2.0 * rho * (R + departed) ** 2
        grows = growth(system.rho, system.radius, np.maximum(
            0.0, found.smallest_radius - departed))
        norm = np.sqrt(np.maximum(np.abs(kept + age * grows), np.abs(kept - 1.5 * age * reach))**2
                       + turned**2 + turned * age * reach)
        return kappa - grows, norm

    for n in range(_STEPS):
        u, bend, rest = path.advance()
        bends, apart = [*bends[1:], bend], [*apart[1:], rest]
        missed = np.maximum(weights @ bends[1:], weights[1:] @ bends[1:-1] + age * h * bends[0])
        old = np.max(taken, axis=0)
        before = np.minimum(2.0 * bent + 3.0 * age * off + age * age * path.drive
                            + path.moved + weights @ apart[1:] + age * h * apart[0],
                            entry + u) if n <= _PARTS else nothing
        known = np.maximum(old + missed, before)
        departed = _departed(capture, age, (D, X), (known, missed), bounds)
        if departed is None:
            return False
        end, X = departed
        seen = np.maximum(u + np.maximum(old, X) + missed, entry if n <= _PARTS else 0.0)
        if not np.all(capture.room(k @ seen - degree * r0) > 0.0):
            return False
        D, taken = end, [*taken[1:], X]
        if n > _PARTS and n % 2 and _stay_together(
                capture, age, path, np.max(bends, axis=0), D, taken, bounds):
            return True
    return False


def _departed(capture: Capture, age: float, so_far: tuple[Array, Array],
              samples: tuple[Array, Array], bounds: Bounds) -> tuple[Array, Array] | None:
    """How far solutions have departed at the end of a step, D, and X within it; None where no X is
    found.

    Parameters
    ----------
    capture, age
        As for :func:`_follows`.
    so_far : tuple of ndarray (N,)
        D and X at the end of the step before.
    samples : tuple of ndarray (N,)
        How far samples received are off at least, and what they miss beyond X.
    bounds : callable
        Decay and norm within a distance of ȳ.
    """
    (D, X), (known, missed), k, h = so_far, samples, capture.coupling, age / _PARTS
    within = 1.5 * D + _ROOM * capture.region_radius
    for _ in range(_PASSES):
        pull = k @ np.maximum(known, X + missed)
        decay, norm = bounds(within)
        if not decay.min() > 0.0:
            return None
        faded = np.exp(-decay * h)
        end = faded * D + (1.0 - faded) / decay * pull
        most = np.maximum(D, end)
        new = np.maximum(most, norm * most + age * pull)
        if np.all(new <= X) and np.all(most <= within):
            settled, X = bool(np.all(new > 0.999 * X)), new  # no more than what X allows
            if settled:
                return end, X
            continue
        X, within = 1.0005 * np.maximum(X, new) + 1e-12, np.maximum(within, 1.05 * most)
        if X.max() > 5.0 * capture.radius:
            return None
    return None


def _stay_together(capture: Capture, age: float, path: Undelayed, bend: Array, D: Array,
                   taken: list[Array], bounds: Bounds) -> bool:
    """Whether what solutions with and without delay have departed by now is within a multiple of
    what they can for ever, and C is not left then.
    """
    k, old = capture.coupling, np.max(taken, axis=0)
    u, later = path.ever()
    missed, none = 0.5 * age * age * np.maximum(bend, later), np.zeros(len(k))
    within = 1.5 * np.maximum(D, old) + _ROOM * capture.region_radius
    decay, norm = bounds(within)
    if not decay.min() > 0.0:
        return False
    last = largest_samples(k, age, decay, k @ missed, norm, age * (k @ missed), none, none > 0.0,
                           np.full(len(k), PRESENT))
    if last is None:
        return False
    departed, samples, _ = last
    times = 1.000001 * max(1.0, float((D / departed).max()), float((old / samples).max()))
    seen = u + times * (samples + missed)
    return bool(np.all(times * departed <= within) and np.all(capture.room(
        k @ seen - k.sum(axis=1) * capture.region_radius) > 0.0))
