# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Contraction along tubes: what an inhibited network does from where inhibition sets in.

A constant metric that contracts on a convex set asks for a stable Jacobian wherever the set is,
the origin included; the oscillators need it only where they go. The entry set (legs in their
places, the inhibited ones in C) is cut into cells. From the middle of each a nominal motion ŷ is
integrated, and u_i = |T(y_i − ŷ_i)| of every other motion obeys, with one T for all nodes,

    u̇_i ≤ e_i(ŷ_i, u_i) u_i + Σ_j k_ij (u_j − u_i) − α_i u_i + |T d_i|

with e the largest growth of a displacement of that size and d what ŷ lacks of being a motion. A
piecewise linear u that satisfies this is kept until the tube lies in a box around the equilibrium
in which all displacements shrink. Every bound is enlarged by 1e-9 of its terms' magnitudes, 10^5
times the rounding errors of the few dozen operations that make it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import asin, hypot, pi, sinh, sqrt

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import PLACE_TOLERANCE, RADIUS_TOLERANCE
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.synchronisation import (
    comparison_laplacian,
    overshoot,
    slowest_rate,
)
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array

Complex = NDArray[np.complex128]

ROUNDING = 1e-9
"""Share of the magnitude of its terms by which every bound is enlarged."""

_DIRECTIONS = 24
_POINTS = 0.5 + 0.5 * np.cos(np.pi * (np.arange(10) + 0.5) / 10.0)
_LEBESGUE = 2.5  # of ten Chebyshev points: 1 + (2/pi) ln 10 and less
_STEP = 0.7      # of the fastest time constant
_WIDEST = 0.5    # of a tube, as a share of r


@dataclass(frozen=True)
class EntryTube:
    """What tubes prove of an inhibited network at one cadence.

    Attributes
    ----------
    holds : bool
        Whether all motions from the entry set come to one equilibrium.
    time : float
        Time after which all are so near that they approach it exponentially [s]; infinite where
        nothing is proved.
    rate : float
        at this rate [1/s].
    """

    holds: bool
    time: float = np.inf
    rate: float = 0.0


@dataclass(frozen=True)
class _Metric:
    """|T δ| with T δ = a δ + c δ*, det T = 1, in complex numbers, and growth in it."""

    rho: float
    radius: float
    omega: float
    c: complex

    @property
    def a(self) -> float:
        return sqrt(1.0 + abs(self.c) ** 2)

    @property
    def norm(self) -> float:
        """‖T‖ = ‖T⁻¹‖."""
        return self.a + abs(self.c)

    def size(self, y: Complex) -> Array:
        return np.abs(self.a * y + self.c * np.conj(y))

    def parts(self, y: Complex) -> tuple[Array, Array]:
        """Growth of small displacements at y in each direction, and how it rises with their size,
        two ndarray (..., D).

        T δ = u n, δ = u m and q = T n: the mean of the Jacobian over [y, y + δ] grows it by
        ρ(r² − |y|² − 2(q·y)(m·y) − u(2 m·y + (q·y)|m|²) − u²|m|²) + ω q·Jm; the last but one
        part is left out.
        """
        q, m = self._directions()
        qy, my = ((np.conj(way) * y[..., None]).real for way in (q, m))
        small = (self.rho * (self.radius**2 - np.abs(y)[..., None] ** 2 - 2.0 * qy * my)
                 + self.omega * (np.conj(q) * 1j * m).real)
        return small, self.rho * np.abs(2.0 * my + qy * np.abs(m) ** 2)

    def largest(self, small: Array, rise: Array, u: Array, reach: Array, off: Array | float
                ) -> Array:
        """Largest growth of displacements of sizes up to u, ndarray (...).

        Between the directions a trigonometric polynomial exceeds its values by half the squared
        distance times its second derivative; ``reach`` bounds |y|, which is known up to ``off``.
        """
        rho, norm = self.rho, self.norm
        between = 0.125 * (pi / _DIRECTIONS) ** 2 * (
            rho * reach * (4.0 * norm**2 * reach + u * (2.0 * norm + 9.0 * norm**3))
            + 2.0 * abs(self.omega) * (norm**2 - norm**-2))
        unknown = rho * ((1.0 + 2.0 * norm**2) * (2.0 * reach * off + off**2)
                         + u * (2.0 * norm + norm**3) * off)
        top = (small + u[..., None] * rise).max(axis=-1)
        magnitude = norm * (rho * (self.radius + norm * (reach + u + off)) ** 2
                            + norm * abs(self.omega))
        return np.asarray(top + between + unknown + ROUNDING * magnitude)

    def _directions(self) -> tuple[Complex, Complex]:
        n = np.exp(1j * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS)
        return self.a * n + self.c * np.conj(n), self.a * n - self.c * np.conj(n)


@dataclass(frozen=True)
class _Network:
    """ẏ = (ρ(r² − |y|²) + iω) y − M y + α r in locked coordinates, complex."""

    M: Array
    pull: Array
    rho: float
    radius: float
    omega: float

    def field(self, y: Complex) -> Complex:
        free = (self.rho * (self.radius**2 - np.abs(y) ** 2) + 1j * self.omega) * y
        return np.asarray(free - y @ self.M.T + self.pull)

    def moved(self, y: Complex, h: float) -> Complex:
        a = self.field(y)
        b = self.field(y + 0.5 * h * a)
        c = self.field(y + 0.5 * h * b)
        d = self.field(y + h * c)
        return np.asarray(y + h / 6.0 * (a + 2.0 * b + 2.0 * c + d))


def entry_tube(system: CanonicalSystem, omega: float, gains: Array, region_radius: float,
               cells: tuple[int, int] = (24, 1), longest: float = 4.0) -> EntryTube:
    """Prove that an inhibited network comes to rest from every state in which inhibition sets in.

    These are the states with the inhibited nodes in C, all nodes within ``PLACE_TOLERANCE`` of
    each other's places and the first inhibited one within ``RADIUS_TOLERANCE`` of its cycle. That
    inhibition goes on is for :func:`~dmp_cpg_ros.core.contraction.capture.capture_set` to say.

    Parameters
    ----------
    system : CanonicalSystem
        Alike oscillators, K_ij = k_ij I, targets of radius r in their places.
    omega : float
        Angular frequency, which stands still [rad/s].
    gains : ndarray (N,)
        Inhibition gains α_i [1/s].
    region_radius : float
        r0 of C.
    cells : (int, int)
        Numbers of cells along the cycle and across it.
    longest : float
        Time after which tubes are given up [s].

    Returns
    -------
    EntryTube

    Raises
    ------
    ParameterError
        If the oscillators or their couplings are of another kind.
    """
    network = _network(system, omega, gains)
    rest = inhibited_equilibrium(system, omega, gains)
    if rest is None or not rest.slowest_rate > 0.0:
        return EntryTube(False)
    y = (rest.state[:, 0] - 1j * rest.state[:, 1]) * np.exp(-1j * system.graph.phases)
    middle, half = _cells(network.radius, region_radius, cells)
    start = np.repeat(middle[:, None], len(gains), axis=1)
    width = np.full(start.shape, half + PLACE_TOLERANCE * network.radius)
    width[:, np.flatnonzero(gains)[0]] = half
    for metric in _metrics(network, y):
        box = _box(network, metric, y)
        if box is not None:
            time = _tubes(network, metric, start, metric.norm * width, (y, box[0]), longest)
            if np.isfinite(time):
                return EntryTube(True, time, box[1])
    return EntryTube(False)


def _network(system: CanonicalSystem, omega: float, gains: Array) -> _Network:
    L, rho, radius = comparison_laplacian(system.graph), system.rho, system.radius
    locked = (system.target[:, 0] - 1j * system.target[:, 1]) * np.exp(-1j * system.graph.phases)
    if (overshoot(L) > 0.0 or np.ptp(rho) > 0.0 or np.ptp(radius) > 0.0
            or np.abs(locked - radius[0])[gains > 0.0].max(initial=np.inf * (not gains.any()))
            > 1e-12 * radius[0]):
        raise ParameterError('tubes are known of alike oscillators with K_ij = k_ij I, of which '
                             'some are inhibited towards their places')
    return _Network(L + np.diag(gains), gains * radius[0], float(rho[0]), float(radius[0]), omega)


def _cells(radius: float, region_radius: float, cells: tuple[int, int]) -> tuple[Complex, float]:
    """Middles of the cells of the states in C near the cycle, and their half width."""
    arc = pi if region_radius >= radius else asin(region_radius / radius)
    along, across = arc / cells[0], RADIUS_TOLERANCE / cells[1]
    angles = -arc + along * (2.0 * np.arange(cells[0]) + 1.0)
    radii = 1.0 - RADIUS_TOLERANCE + across * (2.0 * np.arange(cells[1]) + 1.0)
    half = radius * hypot(across, (1.0 + RADIUS_TOLERANCE) * along) * (1.0 + ROUNDING)
    return np.asarray(radius * np.outer(radii, np.exp(1j * angles)).ravel(), complex), half


def _metrics(network: _Network, y: Complex) -> list[_Metric]:
    """Halfway to the best of some metrics for the equilibrium, the identity, and that best one."""
    def metric(size: float, angle: float) -> _Metric:
        return _Metric(network.rho, network.radius, network.omega,
                       sinh(size) * complex(np.exp(1j * angle)))

    def rate(size: float, angle: float) -> float:
        small, _ = metric(size, angle).parts(y)
        return slowest_rate(network.M - np.diag(small.max(axis=-1)))

    size, angle = max(((size, angle) for size in (0.05, 0.1, 0.2, 0.3, 0.45, 0.6)
                       for angle in np.linspace(-pi, pi, 16, endpoint=False)),
                      key=lambda tried: rate(*tried))
    return [metric(0.5 * size, angle), metric(0.0, 0.0), metric(size, angle)]


def _box(network: _Network, metric: _Metric, y: Complex) -> tuple[Array, float] | None:
    """Sizes |T(y_i − y_i*)| from which all motions approach the equilibrium y*, and their rate.

    The box of 1e-5 around y is not left, so that it holds an equilibrium.
    """
    tiny, none, most = 1e-5 * network.radius, np.zeros(len(y)), float(np.abs(network.M).sum())
    off, (small, rise) = metric.norm * tiny, metric.parts(y)
    lacking = metric.size(network.field(y)) + ROUNDING * tiny * most

    def shrinks(u: Array) -> Array:
        found = metric.largest(small, rise, u, np.abs(y) + off, off)
        return np.asarray(network.M - np.diag(found))

    v = _perron(shrinks(none))
    for share in network.radius * _WIDEST * 0.8 ** np.arange(24):
        v = _perron(shrinks(share * v))
        rate = float((shrinks(share * v) @ v / v).min()) - ROUNDING * most
        if rate > 0.0 and np.all(rate * tiny * v > lacking):
            return np.asarray(share * v - off), rate
    return None


def _perron(M: Array) -> Array:
    """Positive eigenvector of the slowest rate, its largest entry 1."""
    values, vectors = np.linalg.eig(M)
    v = np.abs(vectors[:, values.real.argmin()].real)
    return np.asarray(np.maximum(v / v.max(), 1e-6))


def _tubes(network: _Network, metric: _Metric, y: Complex, u: Array, box: tuple[Complex, Array],
           longest: float) -> float:
    """Time after which all tubes lie in the box; infinite when one is not known to get there."""
    h = _STEP / float(network.M.diagonal().max())
    parts, flow = metric.parts(y), network.field(y)
    for step in range(1, int(longest / h) + 2):
        ahead = network.moved(y, h)
        ahead_parts, ahead_flow = metric.parts(ahead), network.field(ahead)
        lacking, off = _between(network, metric, (y, flow, ahead - y, ahead_flow), h)
        small, rise = (np.maximum(*pair) for pair in zip(parts, ahead_parts, strict=True))
        bulge = 0.25 * network.rho * (1.0 + 2.0 * metric.norm**2) * np.abs(ahead - y) ** 2
        growth = partial(metric.largest, small + bulge[..., None], rise,
                         reach=np.maximum(np.abs(y), np.abs(ahead)) + off, off=off)
        wider = _wider(network, growth, u, lacking, h)
        if wider is None or wider.max() > _WIDEST * network.radius:
            return np.inf
        y, u, flow, parts = ahead, wider, ahead_flow, ahead_parts
        if step % 20 == 0 and np.all(u + metric.size(y - box[0]) < box[1]):
            return step * h
    return np.inf


def _between(network: _Network, metric: _Metric,
             ends: tuple[Complex, Complex, Complex, Complex], h: float) -> tuple[Array, Array]:
    """What a cubic ŷ with given state, flow, chord and flow at its end lacks of being a motion,
    and how far it is from its chord.

    ŷ' − f(ŷ) is a polynomial of degree 9, which ten Chebyshev points bound.
    """
    y0, v0, chord, v1 = ends
    lacking = np.zeros(y0.shape)
    for s in _POINTS:
        y = y0 + s * (h * v0 + s * (3.0 * chord - h * (2.0 * v0 + v1)
                                    + s * (h * (v0 + v1) - 2.0 * chord)))
        v = v0 + s * (6.0 * chord / h - 4.0 * v0 - 2.0 * v1
                      + s * (3.0 * (v0 + v1) - 6.0 * chord / h))
        lacking = np.maximum(lacking, metric.size(v - network.field(y)))
    bend = np.maximum(np.abs(6.0 * chord - h * (4.0 * v0 + 2.0 * v1)),
                      np.abs(6.0 * chord - h * (2.0 * v0 + 4.0 * v1)))       # h² |ŷ''|, at ends
    magnitude = (np.abs(network.M).sum() + 1.0 / h) * metric.norm * network.radius
    return _LEBESGUE * lacking + ROUNDING * magnitude, 0.125 * bend


def _wider(network: _Network, growth: Callable[[Array], Array], u: Array, lacking: Array,
           h: float) -> Array | None:
    """Sizes after h so that the line from u to them rises no slower than displacements may; None
    where none is found.
    """
    def slope(e: Array, at: Array) -> Array:
        return np.asarray(e * at - at @ network.M.T + lacking)

    high = 1.02 * (u + h * np.maximum(slope(growth(u), u), 0.0)) + ROUNDING
    e, own = growth(high), network.M.diagonal()
    early, ahead = u + h * slope(e, u), u
    for _ in range(8):
        others = ahead * own - ahead @ network.M.T + lacking
        ahead = np.maximum(early, (u + h * others) / (1.0 + h * (own - e)))
    ahead = ahead * (1.0 + 1e-6) + 1e-12
    steepest = np.maximum(slope(e, u), slope(e, ahead))
    sound = np.all(ahead <= high) and np.all(ahead - u >= h * steepest + 1e-13)
    return ahead if sound else None
