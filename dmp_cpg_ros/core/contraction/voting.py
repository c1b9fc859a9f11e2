# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Stopping by vote: every oscillator inhibits with a weight α_i ≥ 0 (the paper's discussion).

f_inh = −L x + [α_1 g_1(x_1), …, α_N g_N(x_N)] contracts faster the larger the weights. Clamped to
a common α, the votes of a majority hold all rotors inside their regions C_i while fewer votes do
not. The nodes must be in their places when they vote, so that they enter their regions together.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.system import MOST_KEPT, CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import (
    CaptureSet,
    outward_growth_within,
    target_radius,
)
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import exponential
from dmp_cpg_ros.core.maths.records import replace_unchecked

MOST_PERMUTED = 5
"""Nodes of which all permutations are tried in search of symmetries."""

SPARE = 1e-3  # share of r0 that is left where they relieve each other
_DOUBLINGS = 13  # of the number of pieces


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
    found = None if capture.holds else relieved(
        system, capture.gains, growth_in(system, omega, capture), region_radius)
    if found is None or found.spare < 1.0 + SPARE or (
            found.kept(capture.tolerance, region_radius) < 0.0):
        return capture
    return replace_unchecked(capture, needed_gain=found.needed(region_radius))


def growth_in(system: CanonicalSystem, omega: float | Array, capture: CaptureSet) -> Array:
    """Largest growth of the nodes of a box, ndarray (N,) [1/s]."""
    held = ~np.isnan(capture.needed_gain)
    return outward_growth_within(system, np.broadcast_to(np.abs(omega), held.shape),
                                 target_radius(system, held), capture.distance)


class Relieved(NamedTuple):
    """What nodes bear that relieve each other.

    Attributes
    ----------
    M : ndarray (N, N)
        L + diag α [1/s].
    g : ndarray (N,)
        Growth of a box [1/s].
    borne : ndarray (N,)
        Distances M⁻¹ g that nodes bear together.
    spare : float
        r0 over the largest of those of inhibited nodes.
    held : ndarray (N,) of bool
        Which nodes are inhibited.
    gains : ndarray (N,)
        α [1/s].
    """

    M: Array
    g: Array
    borne: Array
    spare: float
    held: NDArray[np.bool_]
    gains: Array

    def needed(self, region_radius: float) -> Array:
        """Gains that inhibited nodes need (N,) [1/s]; NaN for the others."""
        return np.where(self.held, self.gains * self.borne / region_radius, np.nan)

    def kept(self, tolerance: float, region_radius: float) -> float:
        """How far nodes that enter C in their places stay inside, as a share of r0 at the tightest
        piece of their way; negative where they may not, −∞ where it does not end, as without
        anything to spare.

        At times that are evenly spaced w with ẇ = g − M w is known. Between two of them it lies
        below a straight line with ẇ ≥ g − M w at both ends. Below a share of what they bear more
        than M⁻¹g it stays.
        """
        M, held, N, beside = self.M, self.held, len(self.g), 0.1
        h = beside / float(M.diagonal().max())
        known = np.where(held, region_radius, region_radius + tolerance) - self.borne
        end = (min(self.spare, 1.05) - 1.0) * self.borne
        if not self.spare >= 1.0:
            return -np.inf
        if (known <= end).all():
            return np.inf
        carries = [exponential(-h * M)]
        for _ in range(_DOUBLINGS):
            carries.append(carries[-1].dot(carries[-1]))
        if not (carries[-1].dot(known) <= end).all():
            return -np.inf
        ws, pieces = known[:, None], 0
        for carry in carries:
            ws = np.concatenate([ws, carry.dot(ws)], axis=1)
            if (ws[:, -1] <= end).all():
                pieces = int((ws <= end[:, None]).all(axis=0).argmax())
                break
        if pieces == 0:  # by rounding alone
            return -np.inf
        both = np.eye(N) + h * M
        both = np.concatenate([np.linalg.inv(both), 2.0 * np.eye(N) - both])
        late, early = both.dot(ws[:, :pieces]).reshape(2, N, -1)
        ahead = np.maximum(late, early)
        line = ahead + beside * (ahead - late).max(axis=0)
        return float((region_radius - self.borne[held, None] - line[held]).min()) / region_radius


def relieved(system: CanonicalSystem, gains: Array, growth: Array, region_radius: float
             ) -> Relieved | None:
    """What nodes that grow by at most :func:`growth_in` (N,) [1/s] bear together under gains (N,)
    [1/s]; None where nothing is known of it.
    """
    graph, M = system.graph, system.graph.comparison.copy()
    M.ravel()[::len(M) + 1] += gains
    most = graph.strongest + max(gains.tolist())
    if graph.least_pull < -1e-9 * most:
        return None
    g = 1e-9 * most * region_radius + growth
    try:
        borne = np.linalg.solve(M, g)
    except np.linalg.LinAlgError:
        return None
    bears, held = borne.tolist(), gains > 0.0
    if not min(bears) > 0.0:  # so that M is no M-matrix (Berman & Plemmons 1994, 6.2.3)
        return None
    most = max(each for each, acts in zip(bears, held.tolist(), strict=True) if acts)
    return Relieved(M, g, borne, region_radius / most, held, gains)


@lru_cache(MOST_KEPT)
def different_voters(system: CanonicalSystem, count: int) -> tuple[tuple[int, ...], ...]:
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
    tuple of tuple of int
        Empty for no voters.
    """
    sets = combinations(range(system.graph.size), count) if count > 0 else ()
    turns = _turns(system)
    return tuple(voters for voters in sets if voters == _first(turns, voters))


def alike(system: CanonicalSystem, nodes: Sequence[int]) -> tuple[int, ...]:
    """First of the sets of nodes that the network cannot tell from one."""
    return _first(_turns(system), nodes)


def _first(turns: Sequence[tuple[int, ...]], nodes: Sequence[int]) -> tuple[int, ...]:
    return min(tuple(sorted(turn[i] for i in nodes)) for turn in turns)


def _turns(system: CanonicalSystem) -> Sequence[tuple[int, ...]]:
    """Permutations of the nodes that the network cannot tell from none."""
    graph = system.graph
    if graph.size > MOST_PERMUTED:
        return [tuple(range(graph.size))]
    L = graph.block_laplacian() if graph.weights is None else graph.comparison
    shape = np.round(L / max(float(np.abs(L).max()), 1e-300), 9) + 0.0        # no negative zero
    return _symmetries(graph.size, shape.tobytes(),
                       np.stack([system.rho, system.radius], axis=1).tobytes())


@lru_cache(MOST_KEPT)
def _symmetries(size: int, couplings: bytes, kinds: bytes) -> list[tuple[int, ...]]:
    """Permutations of the nodes that leave couplings and oscillators as they are."""
    L, each = np.frombuffer(couplings), np.frombuffer(kinds).reshape(size, 2)
    blocks = L.reshape(size, round((L.size / size**2) ** 0.5), size, -1).swapaxes(1, 2)
    turns = np.array(list(permutations(range(size))))                         # (N!, N)
    turned = blocks[turns[:, :, None], turns[:, None, :]]                     # (N!, N, N, n, n)
    same = np.all(each[turns] == each, axis=(1, 2)) & (
        np.abs(turned - blocks).max(axis=(1, 2, 3, 4)) <= 2e-9)
    return [tuple(turn) for turn in turns[same].tolist()]
