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
from functools import lru_cache, reduce
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import (
    CaptureSet,
    capture_set,
    outward_growth_within,
    target_radius,
)
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL, NONE, inhibited_contraction
from dmp_cpg_ros.core.contraction.synchronisation import comparison_laplacian, slowest_rate
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.roots import sign_change

MOST_PERMUTED = 5
"""Nodes of which all permutations are tried in search of symmetries."""

_PRECISION = 1e-4
_SPARE = 1e-3  # share of r0 that is left where nodes relieve each other
_MOST_PIECES = 5000


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
                   region_radius: float, known: float = np.inf) -> float:
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
    known : float
        What is returned where the threshold is not smaller [1/s].

    Returns
    -------
    float
        Found by bisection on the equilibrium [1/s], rounded down to where there is none:
        necessary for a stop, and tight; infinite when no weight is enough.
    """
    near: Array | None = None

    def room(alpha: float) -> float:
        nonlocal near
        gains = _votes(system, voters, alpha)
        rest = inhibited_equilibrium(system, omega, gains, near)
        if rest is None or not rest.slowest_rate > 0.0:
            return -np.inf
        near = rest.state
        return region_radius - float(rest.distance[gains > 0.0].max())

    if known < np.inf and room(known) < 0.0:
        return known
    return _threshold(room, _scale(system, omega, region_radius), highest=known)[0]


def certified_threshold(system: CanonicalSystem, omega: float | Array, voters: Sequence[int],
                        region_radius: float, known: float = 0.0) -> float:
    """Smallest common α for which capture by the voters is proved to hold and to contract.

    Parameters are those of :func:`rest_threshold`, but that ``known`` is returned where the
    threshold is not larger.

    Returns
    -------
    float
        Sufficient for a stop [1/s]; infinite when no weight is certified.
    """
    box = capture_set(system, omega, _votes(system, voters, 1.0), region_radius)
    needed = float(np.nanmax(box.needed_gain))

    def room(alpha: float) -> float:
        gains = _votes(system, voters, alpha)
        capture = replace(box, gains=gains, rate=-np.inf)
        spare = max(alpha / needed - 1.0, room_to_share(system, omega, capture, region_radius))
        if spare < 0.0:
            return spare
        capture = shared_capture(system, omega, capture, region_radius)
        if not capture.holds:
            return -np.inf
        if inhibited_contraction(system, capture).reach == GLOBAL:
            return spare
        rate = capture_set(system, omega, gains, region_radius, known=box).rate
        found = inhibited_contraction(system, replace(capture, rate=rate))
        return -np.inf if found.reach == NONE else spare

    if known > 0.0 and (known == np.inf or room(known) >= 0.0):
        return known
    return _threshold(room, _scale(system, omega, region_radius), lowest=known)[1]


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
    slowest = omega if slowest_omega is None else slowest_omega
    return MajorityClamp(
        enough_for_all(system, omega, different_voters(system, majority), region_radius),
        too_weak_for_all(system, slowest, different_voters(system, majority - 1), region_radius),
        majority)


def enough_for_all(system: CanonicalSystem, omega: float | Array,
                   sets: Sequence[Sequence[int]], region_radius: float) -> float:
    """Largest :func:`certified_threshold` of some sets of voters: each is certified at it."""
    return reduce(lambda known, voters: certified_threshold(
        system, omega, voters, region_radius, known), sets, 0.0)


def too_weak_for_all(system: CanonicalSystem, omega: float | Array,
                     sets: Sequence[Sequence[int]], region_radius: float) -> float:
    """Smallest :func:`rest_threshold` of some sets of voters: none rests at it."""
    return reduce(lambda known, voters: rest_threshold(
        system, omega, voters, region_radius, known), sets, np.inf)


def shared_capture(system: CanonicalSystem, omega: float | Array, capture: CaptureSet,
                   region_radius: float) -> CaptureSet:
    """Capture by several nodes of which those with less to hold relieve the others.

    The box has every inhibited node at the edge of C for ever. From where C is entered, legs in
    their places, distances stay below every w with ẇ ≥ g − M w, M = L + diag α and g that of the
    box: none leaves C when w comes below the distances M⁻¹g that all bear before it passes r0.

    Parameters
    ----------
    system, omega, region_radius
        Those of :func:`capture_set`.
    capture : CaptureSet
        Its set, which not even states that are out of their places leave.

    Returns
    -------
    CaptureSet
        The same where it holds, or where this does not. Else with the gains that nodes which enter
        C in their places need, α (M⁻¹g)/r0; they do not leave the box either.
    """
    found = None if capture.holds else _relieved(system, omega, capture, region_radius)
    if found is None or found.spare < 1.0 + _SPARE:
        return capture
    held, borne = ~np.isnan(capture.needed_gain), found.borne
    entered = np.where(held, region_radius, region_radius + capture.tolerance)
    if not _comes_below(found.M, found.g, entered, min(found.spare, 1.05) * borne, held):
        return capture
    return replace(capture, needed_gain=np.where(
        held, capture.gains * borne / region_radius, np.nan))


def room_to_share(system: CanonicalSystem, omega: float | Array, capture: CaptureSet,
                  region_radius: float) -> float:
    """Share by which C is larger than what nodes bear that relieve each other, less what
    :func:`shared_capture` needs, whose parameters these are: where it is negative that fails.
    """
    found = _relieved(system, omega, capture, region_radius)
    return -np.inf if found is None else found.spare - 1.0 - _SPARE


class _Relieved(NamedTuple):
    """M = L + diag α, the growth g of a box, the distances M⁻¹g that nodes bear together, and r0
    over the largest of those that are inhibited.
    """

    M: Array
    g: Array
    borne: Array
    spare: float


def _relieved(system: CanonicalSystem, omega: float | Array, capture: CaptureSet,
              region_radius: float) -> _Relieved | None:
    """What nodes bear together; None where nothing is known of it."""
    held, L = ~np.isnan(capture.needed_gain), comparison_laplacian(system.graph)
    M, most = L + np.diag(capture.gains), float(np.abs(L).max() + capture.gains.max())
    if L.sum(axis=1).min() < -1e-9 * most or slowest_rate(M) <= 1e-9 * most:
        return None
    g = 1e-9 * most * region_radius + outward_growth_within(
        system, np.broadcast_to(np.abs(omega), held.shape), target_radius(system, held),
        capture.distance)
    borne = np.asarray(np.linalg.solve(M, g), dtype=float)
    return _Relieved(M, g, borne, float((region_radius / borne[held]).min()))


def _comes_below(M: Array, g: Array, w: Array, end: Array, held: NDArray[np.bool_]) -> bool:
    """Whether a piecewise linear w with ẇ ≥ g − M w at both ends of each piece comes below its
    end, the held entries never above where they begin.
    """
    beside = 0.1
    h, N = beside / float(M.diagonal().max()), len(w)
    implicit = np.linalg.inv(np.eye(N) + h * M)
    both, pushed = np.concatenate([implicit, np.eye(N) - h * M]), np.concatenate(
        [implicit @ (h * g), h * g])
    most = np.where(held, w, np.inf)
    for _ in range(_MOST_PIECES):
        late, early = (both @ w + pushed).reshape(2, N)
        ahead = np.maximum(late, early)
        w = ahead + beside * (ahead - late).max()
        if (w > most).any():
            return False
        if (w <= end).all():
            return True
    return False


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


def _threshold(room: Callable[[float], float], scale: float, lowest: float = 0.0,
               highest: float = np.inf) -> tuple[float, float]:
    """An α at which there is no room (below 0) and one, ``_PRECISION`` higher, at which there is,
    searched from 1/30 to 1000 times a scale, or from where there is none to where there is.
    """
    low, high = max(scale / 30.0, lowest), min(3.0 * max(scale, lowest), highest)
    while high < highest and room(high) < 0.0:
        low, high = high, 3.0 * high
        if high > 1000.0 * scale:
            return np.inf, np.inf
    return sign_change(room, low, high, _PRECISION)
