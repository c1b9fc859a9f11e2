# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How large votes must be: the common weight from which on some voters stop the network for
certain, and below which they cannot; the clamp for which a majority does and fewer do not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from math import log

import numpy as np

from dmp_cpg_ros.core.canonical.system import MOST_KEPT, CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import capture_set
from dmp_cpg_ros.core.contraction.equilibrium import (
    InhibitedEquilibrium,
    described,
    equilibrium_near,
    equilibrium_up_to,
)
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL, NONE, inhibited_contraction
from dmp_cpg_ros.core.contraction.synchronisation import grounded_connectivity
from dmp_cpg_ros.core.contraction.voting import (
    SPARE,
    Relieved,
    different_voters,
    growth_in,
    relieved,
)
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.maths.roots import sign_change

_PRECISION = 1e-4
_MOST_STEPS = 8
_FIRM = 0.01  # share of r0 by which a rest has to move for a share of α, and of α its rate


@dataclass(frozen=True)
class MajorityClamp:
    """Clamp of the voters' weights for which a majority stops the gait and fewer do not; each end
    is computed when it is first asked for.

    Attributes
    ----------
    system, region_radius : CanonicalSystem, float
        Coupled oscillators, r0 of the regions C_i.
    fastest, slowest : float
        Largest and smallest angular frequency [rad/s].
    majority : int
        Number of votes that is needed.
    """

    system: CanonicalSystem
    region_radius: float
    fastest: float
    slowest: float
    majority: int

    @cached_property
    def lowest(self) -> float:
        """Certified: with this α any majority stops the gait [1/s]."""
        return enough_for_all(self.system, self.fastest, different_voters(
            self.system, self.majority), self.region_radius)

    @cached_property
    def highest(self) -> float:
        """Below this α no smaller vote has an equilibrium inside its regions [1/s]."""
        return too_weak_for_all(self.system, self.slowest, different_voters(
            self.system, self.majority - 1), self.region_radius)

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
    rest: InhibitedEquilibrium | None = None

    def room(alpha: float) -> float:
        nonlocal rest
        gains = votes_of(system, voters, alpha)
        found = None if rest is None else equilibrium_near(system, omega, gains, rest.state)
        if found is None:
            found, share = equilibrium_up_to(system, omega, gains)
            if found is None:                     # which needs ω/share, or about α/share
                return log(share) if share > 0.0 else -np.inf
        rest, stable = found, found.slowest_rate / alpha          # it passes 0 at a threshold
        if not stable > 0.0:
            return stable if stable < 0.0 else -np.inf
        farthest = float(rest.distance[gains > 0.0].max())
        return min(stable, log(region_radius / farthest)) if farthest > 0.0 else stable

    scale = _scale(system, omega, region_radius)
    first = min(known, 1.2 * scale / len(voters))
    if room(first) < 0.0 and first == known:
        return known
    if rest is not None:
        low, passes = _at_the_edge(system, omega, voters, rest, first, region_radius)
        low /= 1.0 + 0.5 * _PRECISION
        if 0.0 < low < first and (
                passes or room(low) < 0.0 <= room(low * (1.0 + _PRECISION))):
            return low
    return _threshold(room, scale, highest=known)[0]


def _at_the_edge(system: CanonicalSystem, omega: float | Array, voters: Sequence[int],
                 rest: InhibitedEquilibrium, alpha: float, region_radius: float
                 ) -> tuple[float, bool]:
    """Common α at which the farthest voter rests at the edge of its region, by Newton's method
    from a rest at another one [1/s], 0 where it finds none; whether the rest there is certain to
    be stable, with the others inside, and to pass the edge where α changes by ``_PRECISION``.
    """
    x, N = rest.state, system.graph.size
    node = max(voters, key=lambda voter: float(rest.distance[voter]))
    for _ in range(_MOST_STEPS):
        gains = votes_of(system, voters, alpha)
        off = system.target - x
        field = system.field(x, omega, gains)
        beyond = off[node] @ off[node] - region_radius**2
        slope = np.zeros((2 * N + 1, 2 * N + 1))
        slope[:-1, :-1] = system.jacobian(x, omega, gains)
        slope[:-1, -1] = (off * (gains > 0.0)[:, None]).ravel()
        slope[-1, 2 * node:2 * node + 2] = -2.0 * off[node]
        try:
            step = np.linalg.solve(slope, np.append(field.ravel(), beyond))
        except np.linalg.LinAlgError:
            break
        x, change = x - step[:-1].reshape(x.shape), float(step[-1])
        if not change < alpha:
            break
        alpha -= change
        if abs(change) < 1e-3 * _PRECISION * alpha:
            there = described(system, x, omega, gains)
            if not there.slowest_rate > _FIRM * alpha:  # so that the Jacobian is not singular
                return alpha, False
            moved = np.linalg.solve(slope[:-1, :-1], slope[:-1, -1]).reshape(x.shape)  # −dx/dα
            inwards = -alpha * (off * moved).sum(axis=1) / region_radius**2
            ahead = there.distance - 0.5 * _PRECISION * region_radius * inwards
            return alpha, bool(inwards[node] > _FIRM
                               and ahead[list(voters)].max() < region_radius)
    return 0.0, False


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
    box = capture_set(
        system, omega, votes_of(system, voters, 1.0), region_radius, contracts=False)
    needed, growth = float(np.nanmax(box.needed_gain)), growth_in(system, omega, box)

    def together(alpha: float) -> Relieved | None:
        return relieved(system, votes_of(system, voters, alpha), growth, region_radius)

    def spare(alpha: float, found: Relieved | None) -> float:
        return log(max(alpha / needed, found.spare / (1.0 + SPARE) if found else 0.0))

    def room(alpha: float) -> float:
        found = together(alpha)
        beyond = spare(alpha, found)
        capture = replace_unchecked(box, gains=votes_of(system, voters, alpha))
        if beyond >= 0.0 and found is not None and found.spare >= 1.0 and not capture.holds:
            beyond = found.kept(box.tolerance, region_radius)
            capture = replace_unchecked(capture, needed_gain=found.needed(region_radius))
        if beyond < 0.0 or inhibited_contraction(system, capture).reach == GLOBAL:
            return beyond
        rate = capture_set(system, omega, capture.gains, region_radius).rate
        reach = inhibited_contraction(system, replace_unchecked(capture, rate=rate)).reach
        if reach == NONE:
            return rate / alpha if rate < 0.0 else -np.inf
        return beyond

    if known > 0.0 and (known == np.inf or room(known) >= 0.0):
        return known
    scale = _scale(system, omega, region_radius)
    low = _threshold(lambda alpha: spare(alpha, together(alpha)), scale, lowest=known)[1]
    if low == np.inf or (below := room(low)) >= 0.0:
        return low
    alone = needed * (1.0 + _PRECISION)
    if alone > low and (above := room(alone)) >= 0.0:
        return sign_change(room, low, alone, _PRECISION, (below, above), jumps=True)[1]
    return _threshold(room, scale, lowest=low)[1]


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
    return MajorityClamp(system, region_radius, omega,
                         omega if slowest_omega is None else slowest_omega, majority)


def enough_for_all(system: CanonicalSystem, omega: float | Array,
                   sets: Sequence[Sequence[int]], region_radius: float) -> float:
    """Largest :func:`certified_threshold` of some sets of voters: each is certified at it."""
    return reduce(lambda known, voters: certified_threshold(
        system, omega, voters, region_radius, known), _weakest_first(system, sets), 0.0)


def too_weak_for_all(system: CanonicalSystem, omega: float | Array,
                     sets: Sequence[Sequence[int]], region_radius: float) -> float:
    """Smallest :func:`rest_threshold` of some sets of voters: none rests at it."""
    return reduce(lambda known, voters: rest_threshold(
        system, omega, voters, region_radius, known), _weakest_first(system, sets)[::-1], np.inf)


def _weakest_first(system: CanonicalSystem, sets: Sequence[Sequence[int]]
                   ) -> tuple[tuple[int, ...], ...]:
    """Sets of voters in the order in which they hold the network, so that of most that come later
    it only has to be seen that they do not matter.
    """
    return _in_order(system, tuple(map(tuple, sets)))


@lru_cache(MOST_KEPT)
def _in_order(system: CanonicalSystem, sets: tuple[tuple[int, ...], ...]
              ) -> tuple[tuple[int, ...], ...]:
    """By what springs in place of couplings and votes put on the voter that bears most, then by
    how firmly all are held.
    """
    graph, strong = system.graph, max(system.graph.strongest, 1e-300)

    def place(voters: tuple[int, ...]) -> tuple[float, float]:
        gains = votes_of(system, voters, strong)
        try:
            lags = np.linalg.solve(graph.comparison + np.diag(gains), np.full(graph.size, strong))
        except np.linalg.LinAlgError:
            return -np.inf, 0.0
        return (-round(float(lags[list(voters)].max()), 9),
                round(grounded_connectivity(graph, gains) / strong, 9))

    return tuple(sorted(sets, key=place))


def votes_of(system: CanonicalSystem, voters: Sequence[int], alpha: float) -> Array:
    """Gains of voters with a common weight and of nobody else, ndarray (N,) [1/s]."""
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
    return sign_change(room, low, high, _PRECISION, jumps=True)
