# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Where an inhibited network comes to rest: per oscillator a phase and a radius.

An inhibited node holds all the others against their own rotation, so that it rests ahead of its
target, and a follower solves f(x_i) + Σ_j K_ij (R(φ_ij) x_j − x_i) = 0: it rests ahead of its
place by about atan(ω/k) with a smaller radius. Locked legs at rest are therefore not in their
places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.canonical.phase import phase, turned, wrapped
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.maths import Array

_CONVERGED = 1e-11
_ON_THE_WAY = 1e-6  # between zero and ω, where Newton's method only begins anew
_SMALLEST_STEP = 1e-3  # of ω, on the way from zero
_MOST_STEPS = 50


@dataclass(frozen=True)
class InhibitedEquilibrium:
    """An equilibrium of the inhibited network.

    Attributes
    ----------
    state : ndarray (N, 2)
        x_i*.
    phase_ahead : ndarray (N,)
        Phase by which each oscillator rests ahead of its place [rad].
    radius : ndarray (N,)
        |x_i*|.
    distance : ndarray (N,)
        |x_i* − x_{i,d}|.
    residual : float
        Largest |ẋ| that is left by the iteration [1/s].
    slowest_rate : float
        Smallest decay rate of its linearisation [1/s]; positive when it is stable.
    """

    state: Array
    phase_ahead: Array
    radius: Array
    distance: Array
    residual: float
    slowest_rate: float


def inhibited_equilibrium(system: CanonicalSystem, omega: float | Array, gains: Array,
                          known: Array | None = None, share: float = 0.0
                          ) -> InhibitedEquilibrium | None:
    """Equilibrium that grows out of the resting targets as ω rises from zero, by Newton's method.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators.
    omega : float or ndarray (N,)
        Angular frequencies [rad/s].
    gains : ndarray (N,)
        Inhibition gains α_i that act [1/s].
    known : ndarray (N, 2), optional
        Where it is at a share of ω.
    share : float
        That share.

    Returns
    -------
    InhibitedEquilibrium or None
        None when the equilibrium ceases to exist before ω is reached: the oscillators break free.
    """
    return equilibrium_up_to(system, omega, gains, known, share)[0]


def equilibrium_near(system: CanonicalSystem, omega: float | Array, gains: Array,
                     near: Array) -> InhibitedEquilibrium | None:
    """Equilibrium that Newton's method finds from another one's state (N, 2), on the same branch:
    no real eigenvalue passed 0, as at a fold, though a pair may have (Hopf); None: it finds none.
    """
    x = _newton(system, near, omega, gains)
    if x is None:
        return None
    found = described(system, x, omega, gains)
    if found.slowest_rate > 0.0:
        return found
    rates = np.linalg.eigvals(system.jacobian(x, omega, gains))
    return None if (rates.real[rates.imag == 0.0] >= 0.0).any() else found


def equilibrium_up_to(system: CanonicalSystem, omega: float | Array, gains: Array,
                      known: Array | None = None, share: float = 0.0
                      ) -> tuple[InhibitedEquilibrium | None, float]:
    """:func:`inhibited_equilibrium`, and the share of ω up to which it exists; 0 where there is
    none to begin with.

    It is looked for at once, near where it would be if couplings were springs. Where none is there
    that is stable, it is followed from where it is known or from the targets.
    """
    begin = _in_place(system, gains) if known is None else known
    near = _ahead(system, begin, (1.0 - share) * omega, gains)
    whole = None if near is None else _newton(system, near, omega, gains)
    if whole is not None:
        found = described(system, whole, omega, gains)
        if found.slowest_rate > 0.0:
            return found, 1.0
    x = known if known is not None else _newton(system, begin.copy(), 0.0 * omega, gains)
    if x is None:
        return None, 0.0
    step = 0.5
    for _ in range(_MOST_STEPS):
        ahead = min(1.0, share + step)
        following = _newton(system, x, ahead * omega, gains,
                            _CONVERGED if ahead == 1.0 else _ON_THE_WAY)
        if following is not None:
            x, share, step = following, ahead, 1.5 * step
        elif step > _SMALLEST_STEP:
            step *= 0.4
        if share == 1.0 or (following is None and step <= _SMALLEST_STEP):
            break
    return None if share < 1.0 else described(system, x, omega, gains), share


def _in_place(system: CanonicalSystem, gains: Array) -> Array:
    """Targets (N, 2); of nodes that are not inhibited, of which none acts, the places beside the
    first one that is.
    """
    first = int(np.argmax(gains > 0.0))
    places = turned(np.broadcast_to(system.target[first], system.target.shape),
                    system.graph.phases - system.graph.phases[first])
    away = (gains <= 0.0) & (_lengths(places - system.target) > 1e-6 * system.radius)
    return np.where(away[:, None] & bool(gains.any()), places, system.target)


def _ahead(system: CanonicalSystem, x: Array, omega: float | Array, gains: Array) -> Array | None:
    """About where an equilibrium x (N, 2) goes when ω rises by so much [rad/s]: as far ahead as if
    couplings and inhibition were springs of the phases; None where they do not hold all of them.
    """
    stiffness = system.graph.comparison.copy()
    stiffness.ravel()[::len(gains) + 1] += gains
    try:
        return turned(x, np.linalg.solve(stiffness, np.full(len(gains), omega)))
    except np.linalg.LinAlgError:
        return None


def described(system: CanonicalSystem, x: Array, omega: float | Array, gains: Array
              ) -> InhibitedEquilibrium:
    """Everything about an equilibrium x (N, 2) at ω [rad/s] under gains (N,) [1/s]."""
    rates = np.linalg.eigvals(system.jacobian(x, omega, gains)).real.tolist()
    left = _lengths(system.field(x, omega, gains))
    return InhibitedEquilibrium(
        x, wrapped(phase(x) - system.graph.phases), np.hypot(x[:, 0], x[:, 1]),
        _lengths(x - system.target), max(left.tolist()), -max(rates))


def _newton(system: CanonicalSystem, x: Array, omega: float | Array, gains: Array,
            converged: float = _CONVERGED) -> Array | None:
    """Newton's iteration; None when it does not settle close to where it began."""
    start, reach = x, 0.5 * max(system.radius.tolist())
    limit = converged * (_largest(system.linear_part(gains)[0]) + 1.0)
    for _ in range(12):
        field = system.field(x, omega, gains)
        if _largest(field) < limit:
            return x
        try:
            x = system.newton_step(x, omega, gains, field)
        except np.linalg.LinAlgError:
            return None
        if not _largest(x - start) <= reach:
            return None
    return None


def _lengths(vectors: Array) -> Array:
    squares = vectors * vectors
    return np.asarray(np.sqrt(squares[:, 0] + squares[:, 1]))


def _largest(values: Array) -> float:
    """Largest size of a few numbers, in less time than NumPy needs to begin."""
    return max(map(abs, values.ravel().tolist()))
