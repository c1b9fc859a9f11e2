# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Stopping by vote: every oscillator inhibits with a weight α_i ≥ 0 (the paper's discussion).

f_inh = −L x + [α_1 g_1(x_1), …, α_N g_N(x_N)] contracts faster the larger the weights. Clamped to
a common α, the votes of a majority hold all rotors inside their regions C_i while fewer votes do
not. The nodes must be in their places when they vote, so that they enter their regions together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations, permutations

import numpy as np

from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import capture_set, shared_capture
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL, NONE, inhibited_contraction
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array

MOST_PERMUTED = 5
"""Nodes of which all permutations are tried in search of symmetries."""

_PRECISION = 1e-4


@dataclass(frozen=True)
class MajorityClamp:
    """Clamp of the voters' weights for which a majority stops the gait and fewer do not.

    Attributes
    ----------
    lowest : float
        Certified: with this α any majority stops the gait [1/s].
    highest : float
        Below this α no smaller vote has an equilibrium inside its regions [1/s].
    majority : int
        Number of votes that is needed.
    """

    lowest: float
    highest: float
    majority: int

    @property
    def possible(self) -> bool:
        """Whether there is a clamp between the two."""
        return self.lowest < self.highest


def rest_threshold(system: CanonicalSystem, omega: float | Array, voters: Sequence[int],
                   region_radius: float) -> float:
    """Smallest common α at which the voters' network can rest inside their regions.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators.
    omega : float or ndarray (N,)
        Angular frequencies [rad/s].
    voters : sequence of int
        Nodes that vote.
    region_radius : float
        r0 of the regions C_i.

    Returns
    -------
    float
        Found by bisection on the equilibrium [1/s], rounded down to where there is none:
        necessary for a stop, and tight; infinite when no weight is enough.
    """
    near: Array | None = None

    def rests(alpha: float) -> bool:
        nonlocal near
        gains = _votes(system, voters, alpha)
        rest = inhibited_equilibrium(system, omega, gains, near)
        if rest is None or not rest.slowest_rate > 0.0:
            return False
        near = rest.state
        return bool(np.all(rest.distance[gains > 0.0] <= region_radius))

    return _threshold(rests, _scale(system, omega, region_radius))[0]


def certified_threshold(system: CanonicalSystem, omega: float | Array, voters: Sequence[int],
                        region_radius: float) -> float:
    """Smallest common α for which capture by the voters is proved to hold and to contract.

    Parameters are those of :func:`rest_threshold`.

    Returns
    -------
    float
        Sufficient for a stop [1/s]; infinite when no weight is certified.
    """
    box = capture_set(system, omega, _votes(system, voters, 1.0), region_radius)

    def certified(alpha: float) -> bool:
        gains = _votes(system, voters, alpha)
        capture = shared_capture(system, omega, replace(box, gains=gains, rate=-np.inf),
                                 region_radius)
        if not capture.holds:
            return False
        if inhibited_contraction(system, capture).reach == GLOBAL:
            return True
        rate = capture_set(system, omega, gains, region_radius, known=box).rate
        return inhibited_contraction(system, replace(capture, rate=rate)).reach != NONE

    return _threshold(certified, _scale(system, omega, region_radius))[1]


def majority_clamp(system: CanonicalSystem, omega: float, region_radius: float,
                   majority: int, slowest_omega: float | None = None) -> MajorityClamp:
    """Clamp for which ``majority`` votes are enough, whoever casts them, and one less is not.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators.
    omega : float
        Largest angular frequency [rad/s]: at it a majority is enough.
    region_radius : float
        r0 of the regions C_i.
    majority : int
        Number of votes, 1 to N.
    slowest_omega : float, optional
        Smallest angular frequency [rad/s]: down to it a smaller vote is not enough; ``omega``
        without.

    Returns
    -------
    MajorityClamp

    Raises
    ------
    ParameterError
        If the number of votes is impossible.
    """
    size = system.graph.size
    if not 1 <= majority <= size:
        raise ParameterError(f'majority = {majority} must lie between 1 and {size}, the number of '
                             'oscillators')
    lowest = max(certified_threshold(system, omega, voters, region_radius)
                 for voters in different_voters(system, majority))
    slowest = omega if slowest_omega is None else slowest_omega
    highest = min((rest_threshold(system, slowest, voters, region_radius)
                   for voters in different_voters(system, majority - 1)), default=np.inf)
    return MajorityClamp(lowest, highest, majority)


def different_voters(system: CanonicalSystem, count: int) -> list[tuple[int, ...]]:
    """Sets of voters that the network can tell apart, of every size one for each orbit.

    Two sets behave alike when a symmetry of the network, seen in locked coordinates, takes one
    into the other. Symmetries are looked for among all permutations of up to
    ``MOST_PERMUTED`` nodes; beyond, every set is listed.

    Parameters
    ----------
    system : CanonicalSystem
        Coupled oscillators with the targets of all nodes in their places.
    count : int
        Number of voters.

    Returns
    -------
    list of tuple of int
        Empty for no voters.
    """
    size = system.graph.size
    sets = list(combinations(range(size), count)) if count > 0 else []
    if size > MOST_PERMUTED:
        return sets
    symmetries = _symmetries(system)
    chosen: list[tuple[int, ...]] = []
    seen: set[tuple[int, ...]] = set()
    for voters in sets:
        if voters not in seen:
            chosen.append(voters)
            seen.update(tuple(sorted(turn[i] for i in voters)) for turn in symmetries)
    return chosen


@lru_cache(8)
def _symmetries(system: CanonicalSystem) -> list[tuple[int, ...]]:
    """Permutations of the nodes that leave couplings and oscillators as they are."""
    size = system.graph.size
    L = system.graph.block_laplacian().reshape(size, 2, size, 2)
    kinds = np.stack([system.rho, system.radius], axis=1)
    scale = 1e-9 * (1.0 + float(np.abs(L).max()))
    turns = np.array(list(permutations(range(size))))                         # (N!, N)
    turned = L.transpose(0, 2, 1, 3)[turns[:, :, None], turns[:, None, :]]    # (N!, N, N, 2, 2)
    alike = np.all(kinds[turns] == kinds, axis=(1, 2)) & (
        np.abs(turned - L.transpose(0, 2, 1, 3)).max(axis=(1, 2, 3, 4)) <= scale)
    return [tuple(turn) for turn in turns[alike].tolist()]


def _votes(system: CanonicalSystem, voters: Sequence[int], alpha: float) -> Array:
    gains = np.zeros(system.graph.size)
    gains[list(voters)] = alpha
    return gains


def _scale(system: CanonicalSystem, omega: float | Array, region_radius: float) -> float:
    """Order of magnitude of what one node needs to hold all others [1/s]."""
    omega = np.broadcast_to(np.abs(omega), (system.graph.size,))
    return float(np.sum(omega * system.radius)) / region_radius + 1e-3


def _threshold(works: Callable[[float], bool], scale: float) -> tuple[float, float]:
    """An α at which something does not work and one, ``_PRECISION`` higher, at which it does,
    searched from 1/30 to 1000 times a scale.
    """
    low, high = scale / 30.0, 3.0 * scale
    while not works(high):
        low, high = high, 3.0 * high
        if high > 1000.0 * scale:
            return np.inf, np.inf
    while high > low * (1.0 + _PRECISION):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if works(middle) else (middle, high)
    return low, high
