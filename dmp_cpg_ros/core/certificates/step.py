# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The step that runs: what capture, contraction and synchronisation are for it and not for the
differential equation.

In locked coordinates a tick is y⁺ = Φ(y) with ẏ = −M y + α x_d + N(y), M = L + diag α,
N = (ρ(r² − |y|²) − iω) y. No entry of M beside its diagonal is positive, so that its exponentials
have none that is negative, and N = q y + Q(y) with q = −κ − iω leaves a Q that is small and, for κ
= 2ρr², bounded by 2ρr³ wherever |y| ≤ 2r. What follows for |Φ(y)| and |Φ(y) − Φ(z)| are
nonnegative inequalities (:mod:`~dmp_cpg_ros.core.maths.step_comparison`), which become those of
the differential equation as the tick vanishes. doc/certificate.md has the proof.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.certificates.network import NetworkAnalysis, Setting
from dmp_cpg_ros.core.contraction.capture import radius_tolerance
from dmp_cpg_ros.core.contraction.finding import PROVED, SAMPLED
from dmp_cpg_ros.core.contraction.hopf_bounds import largest_radial, largest_shifted, mild_rate
from dmp_cpg_ros.core.contraction.synchronisation import (
    cascade_weights,
    comparison_laplacian,
    synchronisation_complement,
)
from dmp_cpg_ros.core.gait.network import LONGEST_STEP
from dmp_cpg_ros.core.inhibition.step_timing import QUICKEST
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.roots import sign_change
from dmp_cpg_ros.core.maths.step_comparison import StepBounds, step_comparison

STEP_ERROR = 0.025
"""c: with s = tick · ℓ, a mode that decays by more than c s⁴ per tick decays in the step too."""

LARGEST_MILD_STEP = 1.4
"""Largest s = tick · ℓ for which that is so with some room."""

_FARTHEST_STAGE = 1.29  # |a|, |b| over r up to which the bounds of Q are what they are taken for
_CASCADE = 2.0**-64  # weight of a component of a graph, as a share of those before it
_MOST_TRIALS = 40
_CYCLE = 1e-13  # precision of its radius


def longest_step(rho: float, radius: float, omega: float, rate: float) -> float:
    """Longest step in which every mode that decays at ``rate`` or faster decays too [s].

    The linear part is exact whatever its gains, so that only the mild part limits the step. On the
    test equation ẏ = (z + w) y / h, with z ≤ 0 the exact and |w| ≤ s the mild part, decay by more
    than c s⁴ per step is decay of the step, for every z: sampled densely, and tested.

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillators, the largest ω.
    rate : float
        Slowest decay rate that must not be lost [1/s].

    Returns
    -------
    float
        0 when there is no decay to keep.
    """
    if not rate > 0.0:
        return 0.0
    ell = mild_rate(rho, radius, omega)
    return min(LARGEST_MILD_STEP / ell, (rate / (STEP_ERROR * ell**4)) ** (1.0 / 3.0))


def cycle_radius_error(rho: float, radius: float, omega: float, tick_s: float) -> float:
    """Share by which the integrated limit cycle's radius differs from r.

    A locked network feels no coupling, so that each oscillator is stepped as if it were alone: by
    the method of the suite without a linear part, which is Kutta's third-order one. Its circle is
    where its radius neither grows nor shrinks.

    Parameters
    ----------
    rho, radius, omega : float
        Parameters of the oscillators.
    tick_s : float
        Step [s].

    Returns
    -------
    float
        |R/r − 1|; infinite when the step has no cycle near r.
    """
    def rate(z: complex) -> complex:
        return complex(rho * (radius**2 - abs(z) ** 2), -omega) * z

    def change(R: float) -> float:
        first = rate(R)
        middle = rate(R + 0.5 * tick_s * first)
        last = rate(R + tick_s * (2.0 * middle - first))
        return abs(R + tick_s / 6.0 * (first + 4.0 * middle + last)) - R

    low, high = 0.5 * radius, 1.5 * radius
    grows, shrinks = change(low), change(high)
    if not grows > 0.0 > shrinks:
        return math.inf
    cycle, _ = sign_change(lambda R: -change(R), low, high, _CYCLE, (-grows, -shrinks))
    return abs(cycle / radius - 1.0)


@dataclass(frozen=True)
class SteppedNetwork:
    """What is proved of the step.

    Attributes
    ----------
    distance : ndarray (N,)
        ū_i of a box |x_i − x_d| ≤ ū_i that holds the one of capture.
    farthest : float
        Distance of an inhibited node from x_d after a step out of the box, as a share of r0;
        infinite where the others may leave the box.
    disc : float
        R of a disc |x_i| ≤ R that neither free nor inhibited oscillators leave.
    approach : float
        Rate at which two states in the box approach each other, and at which |ẋ| falls [1/s].
    locking : float
        Rate at which disagreement of the free oscillators shrinks [1/s].
    step_s : float
        Length of the step [s].
    differences, moved : ndarray (N, N)
        Bounds in the box of |Φ(x) − Φ(z)| over |x − z|, and of |Φ(x) − x| over |ẋ|.
    rates : tuple of ndarray (N, N)
        Bounds of |ẋ| after a step over |Φ(x) − x| and over |ẋ| before it.
    forced : ndarray (N,)
        What a frequency that is off by 1/r does to a state in a step.
    """

    distance: Array
    farthest: float
    disc: float
    approach: float
    locking: float
    step_s: float
    differences: Array
    moved: Array
    rates: tuple[Array, Array]
    forced: Array

    @property
    def proved(self) -> bool:
        """Whether all of it holds."""
        return self.farthest < 1.0 and min(self.approach, self.locking) > 0.0


def step_of(tick_s: float) -> float:
    """Length of the oscillators' step in a tick [s]."""
    return tick_s / math.ceil(tick_s / LONGEST_STEP - 1e-9)


def stepped_network(s: Setting, analysis: NetworkAnalysis) -> SteppedNetwork | None:
    """Prove of the step what can be; None for couplings that are not k_ij I.

    Parameters
    ----------
    s : Setting
        Oscillators, region, tick.
    analysis : NetworkAnalysis
        Of the differential equation; its box is enlarged until no step leaves it.
    """
    graph, capture, rho = s.network.system.graph, analysis.capture, s.network.parameters.rho
    if graph.weights is None:
        return None
    r, omega, h = s.network.parameters.radius, s.span.omega[1], step_of(s.tick_s)
    L, alpha = comparison_laplacian(graph), capture.gains
    held, free = step_comparison(L + np.diag(alpha), h), step_comparison(L, h)
    kappa = 2.0 * rho * r**2
    bounds, quick = held.moduli(kappa, omega), free.moduli(kappa, QUICKEST * omega)
    disc = max(r, *(_disc(bound, gains * r, rho * r**3)
                    for bound, gains in ((bounds, alpha), (quick, 0.0 * alpha))))
    plain, plain_quick = held.moduli(0.0, omega), free.moduli(0.0, QUICKEST * omega)
    a, b = _stages(plain, alpha * r, disc, rho, r)
    free_stage = max(_stages(plain_quick, 0.0 * alpha, disc, rho, r))
    if not max(disc, a, b, free_stage) < _FARTHEST_STAGE * r:
        return None
    box = _Box(bounds, plain, omega * r, rho, r, (disc, a, b))
    u, (u_a, u_b, after) = box.closed(capture.distance, alpha > 0.0)
    kept = bool(((after <= u) | (alpha > 0.0) | (u >= disc + r)).all())
    farthest = float((after / u)[alpha > 0.0].max()) if kept else math.inf

    # ‖κ + ∂(ρ(r² − |y|²) y)/∂y‖ is the larger of κ + ρ(r² − |y|²) and ρ(3|y|² − r²) − κ
    inner = [np.maximum(r - far, 0.0) for far in (
        u, np.maximum(u, u_a), np.maximum(np.maximum(u, u_a), u_b))]
    most = 3.0 * max(disc, a, b) ** 2 - r**2
    kappa = 0.5 * rho * (most - r**2 + float(inner[2].min()) ** 2)
    bounds = held.moduli(kappa, omega)
    start, middle, end = (np.maximum(kappa + rho * (r**2 - least**2), rho * most - kappa)
                          for least in inner)
    Z, rates = bounds.difference(start, middle, end), bounds.rates(end)
    slowest = float(np.abs(np.linalg.eigvals(np.array([Z, rates[1]]))).max())
    return SteppedNetwork(
        u, farthest, disc, -math.log(max(slowest, 1e-300)) / h,
        _locking(s, analysis, L, h, max(disc, free_stage)), h, Z, bounds.moved(end), rates,
        bounds.forced(middle, end).sum(axis=1) * max(disc, a, b) / r)


def _disc(bound: StepBounds, pull: Array, rho_r3: float) -> float:
    """R of a disc that no step leaves whose stages are within 2r, where |Q| ≤ 2ρr³."""
    pushed = bound.C.dot(pull) + (bound.C_y + bound.C_a + bound.C_b).sum(axis=1) * 2.0 * rho_r3
    kept = 1.0 - bound.T.sum(axis=1)
    return float((pushed / kept).max()) if kept.min() > 0.0 else math.inf


def _stages(bound: StepBounds, pull: Array, disc: float, rho: float, r: float
            ) -> tuple[float, float]:
    """Largest |a| and |b| of states within a disc."""
    start = largest_radial(rho, r, disc)
    a = float((bound.A.sum(axis=1) * disc + bound.A_y.dot(pull + start)).max())
    middle = largest_radial(rho, r, a)
    return a, float((bound.B.sum(axis=1) * disc + bound.B_c.dot(pull)
                     + bound.B_y.sum(axis=1) * start + bound.B_a.sum(axis=1) * middle).max())


@dataclass(frozen=True)
class _Box:
    """Boxes |y_i − x_d| ≤ u_i under a step: bounds with κ = 2ρr² and with κ = 0, ωr, and the
    largest |y|, |a|, |b|.
    """

    bound: StepBounds
    plain: StepBounds
    turning: float
    rho: float
    r: float
    largest: tuple[float, float, float]

    @cached_property
    def _steady(self) -> tuple[Array, ...]:
        """What does not depend on the distances: ωr, and what it is to b, by either bound, and to
        the end of the step.
        """
        at, plain, size = self.bound, self.plain, len(self.bound.T)
        turning, radial = np.full(size, self.turning), largest_radial(
            self.rho, self.r, self.largest[1])
        return (turning, at.B_c.dot(turning), plain.B_c.dot(turning),
                (plain.B_y + plain.B_a).dot(np.full(size, radial)), at.C.dot(turning))

    def _off(self, u: Array, R: float) -> Array:
        return largest_shifted(self.rho, self.r, u, R)

    def after(self, u: Array) -> tuple[Array, Array, Array]:
        """Distances of a, of b and after a step."""
        at, (turning, to_b, plain_to_b, radial, to_end) = self.bound, self._steady
        R, R_a, R_b = self.largest
        off = self._off(u, R)
        pushed = at.A_y.dot(turning + off)
        a = np.minimum(at.A.dot(u) + pushed, R_a + self.r)
        moved = at.A_moved.dot(u) + pushed
        inner = np.maximum(self.r - np.maximum(u, a), 0.0)
        change = self.rho * (3.0 * self.r**2 - inner * inner) * moved       # |Q(a) − Q(y)|
        off_a = self._off(a, R_a)
        either = np.minimum(at.B_y.dot(off) + at.B_a.dot(off_a),
                            at.B_c.dot(off) + at.B_a.dot(change))
        b = np.minimum(np.minimum(at.B.dot(u) + to_b + either, self.plain.B.dot(u) + plain_to_b
                                  + radial), R_b + self.r)
        return a, b, (at.T.dot(u) + to_end + at.C_y.dot(off) + at.C_a.dot(off_a)
                      + at.C_b.dot(self._off(b, R_b)))

    def closed(self, u: Array, held: NDArray[np.bool_]
               ) -> tuple[Array, tuple[Array, Array, Array]]:
        """Box that free nodes do not leave, enlarged from one, and the distances of :meth:`after`;
        a node is anywhere in the disc where there is none.
        """
        edge, slope = self.largest[0] + self.r, 2.0 * self.rho * self.r**2
        J = self.bound.T + (self.bound.C_y + self.bound.C_a + self.bound.C_b) * slope
        u = np.minimum(u, edge)
        found = self.after(u)
        for _ in range(_MOST_TRIALS):
            after, moving = found[2], ~held & (u < edge)
            if (after[moving] <= u[moving]).all():
                break
            room = np.linalg.solve(np.eye(int(moving.sum())) - J[moving][:, moving],
                                   np.maximum(after - u, 0.0)[moving] + 1e-7 * self.r)
            u = u.copy()
            u[moving] = np.minimum(u[moving] + room, edge) if (room > 0.0).all() else edge
            found = self.after(u)
        return u, found


def _locking(s: Setting, analysis: NetworkAnalysis, L: Array, h: float, farthest: float) -> float:
    """Rate at which steps of free oscillators shrink (Σ ξ_i |y_i − ȳ|²)^½ [1/s]."""
    p, xi = s.network.parameters, analysis.found.weights
    if not analysis.found.synchronises:
        return -math.inf
    if xi is None:
        xi = cascade_weights(s.network.system.graph, _CASCADE)
    V, root = synchronisation_complement(len(L), 1, xi), np.sqrt(xi)
    kappa = p.rho * (1.5 * farthest**2 - p.radius**2)
    bound = step_comparison(V @ (root[:, None] * L / root) @ V.T, h).norms(
        kappa, QUICKEST * s.span.omega[1])
    most = np.full(1, kappa + p.rho * p.radius**2)
    return -math.log(float(bound.difference(most, most, most)[0, 0])) / h


def step_inequalities(s: Setting, rate: float, found: SteppedNetwork | None) -> list[Inequality]:
    """Inequalities (d) of the step: for itself, and the tick against the mild part.

    Parameters
    ----------
    s : Setting
        Oscillators and tick.
    rate : float
        Slowest certified rate of the network [1/s].
    found : SteppedNetwork or None
        What is proved of the step.

    Returns
    -------
    list of Inequality
        See :func:`~dmp_cpg_ros.core.certificates.inequality.discharged` for which are required.
    """
    rho, radius = s.network.parameters.rho, s.network.parameters.radius
    limit = longest_step(rho, radius, s.span.omega[1], rate)
    farthest, captured, locking = (math.inf, -math.inf, -math.inf) if found is None else (
        found.farthest, found.approach, found.locking)
    return [
        Inequality('step_capture', farthest, 1.0, '', '|x_1 - x_d|/r0 after a step', 'edge of C',
                   PROVED, 'no step of the integration takes legs that are captured out of C',
                   required=False),
        Inequality('step_contraction', 0.0, captured, '1/s', 'zero', 'rate of the step', PROVED,
                   'steps take captured states towards each other and to rest', required=False),
        Inequality('step_synchronisation', 0.0, locking, '1/s', 'zero', 'rate of the step', PROVED,
                   'steps take the legs to their places', required=False),
        Inequality('time_step', s.tick_s, limit, 's', 'tick', 'longest stable step', SAMPLED,
                   'what decays in the equations decays in their numerical integration')]


def cycle_inequalities(s: Setting) -> list[Inequality]:
    """Inequalities (d) of the limit cycle: its radius as integrated, and ticks against the region
    C.
    """
    rho, radius = s.network.parameters.rho, s.network.parameters.radius
    omega, tick_s, r0 = s.span.omega[1], s.tick_s, s.parameters.inhibition.region_radius
    return [
        Inequality('cycle_radius', cycle_radius_error(rho, radius, omega, tick_s),
                   radius_tolerance(radius, r0) / radius, '',
                   '|R/r - 1| as integrated', 'what capture allows', PROVED,
                   'the integration keeps the radius of the limit cycle'),
        Inequality('region_per_tick', omega * tick_s, s.arc, 'rad', 'omega_max tick', 'arc of C',
                   PROVED, 'an oscillator cannot step over the region C between two ticks')]
