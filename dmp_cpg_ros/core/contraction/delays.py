# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What capture bears of delay: messages that come late, are held, or are lost (Section 4.2).

With samples of the others, ŷ_j of an age of at most d that may differ from edge to edge and vary
in any way, the distances from the target obey in locked coordinates

    u̇_i ≤ g_i(u_i) + Σ_j k_ij û_j − (Σ_j k_ij + α_i) u_i.

This is a comparison system with no negative feedback that is late: a box is invariant when it is
without delay and the samples lie in it too (Halanay's inequality; Smith 1995, *Monotone Dynamical
Systems*, chapter 5), and differences of solutions vanish whenever those of the undelayed system
do. What limits d are the samples from before the capture. Held as they are they lag; carried on
by the flow of the gait, ŷ_j = e^(iφ) y_j with φ the turn of ω over the age until the receiver came
into C, they do not: there the free flow ends. Locked legs walk, and captured ones rest, as they do
without delay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import acos, asin, cos, exp, inf, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.contraction.capture import (
    CaptureSet,
    capture_set,
    outward_growth,
    outward_growth_within,
)
from dmp_cpg_ros.core.contraction.hopf_bounds import growth
from dmp_cpg_ros.core.contraction.synchronisation import comparison_laplacian, slowest_rate
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.roots import last_that_holds

_ROUNDS = 7  # of a bisection
_ROOM = 1.02  # factor on distances for which what grows with them is taken


@dataclass(frozen=True)
class Capture:
    """A capture whose delays are asked for; all oscillators have one radius r = |x_d|.

    Attributes
    ----------
    system : CanonicalSystem
        Oscillators, coupled by K_ij = k_ij I.
    omega : float
        Largest angular frequency from arming to rest [rad/s].
    gains : ndarray (N,)
        Inhibition gains α_i that act together [1/s].
    region_radius : float
        r0 of C.
    places, radii : float
        How far legs may be from each other's places, and radii from r, when C is entered.

    Raises
    ------
    ParameterError
        If ω is not positive and finite.
    """

    system: CanonicalSystem
    omega: float
    gains: Array
    region_radius: float
    places: float
    radii: float

    def __post_init__(self) -> None:
        """Refuse oscillators that do not turn as they are to."""
        if not 0.0 < self.omega < inf:
            raise ParameterError(f'omega = {self.omega} rad/s must be positive and finite')

    @cached_property
    def undelayed(self) -> CaptureSet:
        """The capture set without delays."""
        return capture_set(self.system, self.omega, self.gains, self.region_radius)

    @cached_property
    def coupling(self) -> Array:
        """k_ij, ndarray (N, N) [1/s]."""
        L = comparison_laplacian(self.system.graph)
        return np.asarray(np.diag(np.diag(L)) - L)

    @property
    def radius(self) -> float:
        """Radius r of the limit cycle."""
        return float(self.system.radius[0])

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which nodes are inhibited."""
        return self.gains > 0.0

    @cached_property
    def _global(self) -> bool:
        M = np.diag(self.coupling.sum(axis=1) + self.gains) - self.coupling
        return slowest_rate(M - np.diag(growth(self.system.rho, self.system.radius))) > 0.0

    def contracts(self, places: float) -> bool:
        """Whether captured trajectories approach each other whatever the delays of held samples,
        for entries with nodes this far from their places: the comparison matrix is the undelayed
        one.
        """
        if self._global:
            return True
        found = capture_set(self.system, self.omega, self.gains, self.region_radius,
                            places / self.radius)
        return found.rate > 0.0 and found.tolerance >= places * (1.0 - 1e-12)

    def growth_out(self, u: Array) -> Array:
        """Largest g_i within distances u_i, ndarray (N,) [1/s]."""
        return outward_growth_within(self.system, np.asarray(self.omega), self.radius, u)

    def room(self, pull: Array) -> Array:
        """What is left to an inhibited node against a pull from outside on the edge of C [1/s]."""
        r0 = self.region_radius
        out = outward_growth(self.system, np.asarray(self.omega), self.radius,
                             np.full(len(self.gains), r0))
        return (self.gains * r0 - out - pull)[self.held]

    def backwards(self, pull: float, behind: float) -> float:
        """What a pull by samples from before the capture takes of what rotation leads back by;
        they are outside of C by at most ``behind``. Above 1 it may lead out, infinite where
        nothing is known.

        Such a sample pulls outwards along n where rotation leads back: with an angle of at most χ
        between the sample's direction from x_d and the flow there, −ω r cos(n, flow) + pull
        cos(n, sample) ≤ ω r (2 sin(χ/2) + max(0, pull/ω r − 1)), not above ω r where this is 1.
        """
        r, r0 = self.radius, self.region_radius
        sine = self.radii * (1.0 + self.radii / (2.0 * r)) / r0 + (r0 + behind) / (2.0 * r)
        more = max(0.0, pull / (self.omega * r) - 1.0)
        return 2.0 * sin(0.5 * asin(sine)) + more if sine <= 1.0 else inf

    def outweighs(self, pull: float, behind: float) -> bool:
        """Whether rotation outweighs such a pull."""
        return self.backwards(pull, behind) <= 1.0


class Premise(NamedTuple):
    """What has to be so where couplings are split over nodes: value ≤ limit.

    Attributes
    ----------
    name : str
        A word with underscores.
    value, limit : float
        Both sides.
    unit : str
        Of both, empty for pure numbers.
    sentence : str
        What it says.
    """

    name: str
    value: float
    limit: float
    unit: str
    sentence: str

    @property
    def holds(self) -> bool:
        """Whether it is so beyond rounding."""
        return self.value <= self.limit * (1.0 + 1e-9)


def late_margin(capture: Capture) -> float:
    """Longest time from entering C until inhibition acts, for capture as without that delay [s].

    Meanwhile the legs run freely and none goes ahead of the foremost, which turns at ω: they are
    still inside C when it acts, and what the gate allowed has grown by exp(∫ρ(r² − |x|²)).

    Parameters
    ----------
    capture : Capture
        What is to be captured.

    Returns
    -------
    float
        0 without a certificate.
    """
    r, r0, omega, found = (capture.radius, capture.region_radius, capture.omega,
                           capture.undelayed)
    if not found.holds:
        return 0.0
    degree, rho = float(capture.coupling.sum(axis=1).max()), float(capture.system.rho.max())
    room = min(2.0 * capture.places, float(found.distance[~capture.held].min(initial=inf)) - r0)
    inwards = degree * room**2 / (2.0 * r)                                   # of radii [1/s]
    off = capture.radii + inwards * 4.0 * asin(min(1.0, r0 / (2.0 * r))) / omega
    arc = min(_arc(r, R, r0) for R in (max(r - off, 1e-9), r + off))
    crossing = (arc - 2.0 * asin(min(1.0, capture.places / (2.0 * max(r - off, 1e-9))))) / omega

    def bears(delay: float) -> bool:
        apart = capture.places * exp(rho * delay * max(0.0, r * r - (r - off)**2 + room**2))
        return apart <= room * (1.0 + 1e-12) and capture.contracts(apart)

    return _longest(bears, crossing) if off < r else 0.0


def held_margin(capture: Capture) -> float:
    """Largest age of held samples ŷ_j = y_j(t − d) with which capture holds [s].

    The samples from before the capture are up to ω r d behind. A node that does not turn
    backwards is pulled back by no more than ω r and what nodes ahead of it add, Σ_j k_ij p: later
    samples pull less, so that no age is too long where rotation makes up for that. Else those of
    free nodes must lie in the box, the largest that the inhibition holds, and those of inhibited
    ones at most ω r/k outside of it.

    Parameters
    ----------
    capture : Capture
        What is to be captured, by nodes that for as long before were in their places and turned
        neither backwards nor faster than ω.

    Returns
    -------
    float
        0 without a certificate, infinite where capture does not depend on delays.
    """
    r, r0, omega, held = capture.radius, capture.region_radius, capture.omega, capture.held
    if not capture.undelayed.holds:
        return 0.0
    k = capture.coupling
    pulled = omega * r + float(k.sum(axis=1).max()) * capture.places
    lag = asin(min(1.0, pulled / (float(k[k > 0.0].min(initial=inf)) * (r - capture.radii))))
    farthest = 2.0 * r * sin(0.5 * lag) + capture.radii
    if (capture.outweighs(pulled / cos(0.5 * lag), farthest)
            and capture.contracts(capture.places + farthest)):
        return inf
    edge, nearest = _largest_box(capture)
    together = capture.places if np.count_nonzero(held) > 1 else 0.0
    most = float(k[:, held].sum(axis=1).max())

    def bears(age: float) -> bool:
        behind = omega * r * age
        beyond = r0 + behind + together - edge
        return (r0 + behind + capture.places <= nearest * (1.0 + 1e-12)
                and (beyond <= 0.0 or capture.outweighs(most * beyond, behind + together))
                and capture.contracts(capture.places + behind))

    return _longest(bears, min(nearest - r0 - capture.places, 0.5 * pi * r) / (omega * r))


def carried_margin(capture: Capture) -> float:
    """Largest age d of samples carried on by the flow of the gait with which capture holds [s].

    ŷ_j = e^(iφ) y_j(t − d), where φ is what ω turns by over the age, but for the part of it after
    the receiver itself came into C with inhibition armed. All nodes come there at about one time:
    older samples are then where their nodes were at that time, in their places, so that nothing
    lags, and younger ones are as they were taken.

    Parameters
    ----------
    capture : Capture
        What is to be captured, by nodes that for as long before were within half of ``places`` of
        each other in the frame that turns with ω, came into C from outside, and knew inhibition to
        be armed then.

    Returns
    -------
    float
        0 without a certificate, infinite otherwise: capture does not depend on the age.
    """
    return inf if (capture.undelayed.holds and capture.contracts(capture.places)
                   and capture.radii < capture.radius
                   and all(premise.holds for premise in carried_premises(capture))) else 0.0


def carried_premises(capture: Capture) -> list[Premise]:
    """Premises of :func:`carried_margin` that follow from parameters."""
    r, r0, p, omega = capture.radius, capture.region_radius, capture.places, capture.omega
    ahead = float(capture.coupling.sum(axis=1).max()) * p
    crossed = min(_arc(r, R, r0) * R for R in (max(r - capture.radii, 1e-9), r + capture.radii))
    share = capture.backwards(float(capture.coupling[:, capture.held].sum(axis=1).max()) * p, p)
    weighed = Premise('older_samples', share, 1.0, '',
                      'what samples from before the capture pull outwards, over what rotation '
                      'leads back')
    if not weighed.holds:
        weighed = Premise('older_samples', r0 + p, _largest_box(capture)[0], '',
                          'distance of samples from before the capture that inhibition bears')
    return [
        Premise('not_backwards', ahead, omega * r, '1/s',
                'what legs in their places pull each other back by, against what they turn'),
        Premise('length_of_c', 4.0 * p, crossed, '',
                'C is as long as legs may be apart while they come in'), weighed]


def asked_premises(capture: Capture, age: float) -> list[Premise]:
    """Premises of :func:`carried_margin` that a gate would have to keep: what the suite's admits,
    against what samples of an age [s] need.
    """
    return [
        Premise('places_before', capture.places, 0.5 * capture.places, '',
                'legs this close to their places for the age of samples before one comes into C'),
        Premise('armed_before', capture.omega * age, 0.0, 'rad',
                'turn before C at which all nodes know that inhibition is armed, and no leg is '
                'inside; the gate leaves none')]


def _arc(radius: float, R: float, region_radius: float) -> float:
    """Arc of the circle |x| = R that lies in C [rad]."""
    cosine = (R * R + radius * radius - region_radius**2) / (2.0 * R * radius)
    return 2.0 * acos(min(1.0, max(-1.0, cosine)))


def _longest(bears: Callable[[float], bool], most: float) -> float:
    """Longest delay that is borne, not above ``most``; 0 when there is none [s]."""
    if not most > 0.0:
        return 0.0
    return most if bears(most) else last_that_holds(bears, 0.0, most, _ROUNDS)


def _largest_box(capture: Capture) -> tuple[float, float]:
    """Largest distance R that inhibited nodes may show to the others while those that see them
    there cannot pull them out of C, and the smallest ū_f of the free nodes then.
    """
    k, held, r0 = capture.coupling, capture.held, capture.region_radius
    free, base = ~held, capture.undelayed.distance
    if not free.any():
        return r0 + _least_room(capture.room(0.0 * base), k), inf
    grounded = (np.diag(k.sum(axis=1)) - k)[np.ix_(free, free)]
    if slowest_rate(grounded) <= 1e-9 * float(k.max()):
        return r0, float(base[free].min())
    edge, u = r0, base
    for _ in range(6):
        most = _ROOM * u
        beyond = np.zeros(len(k))
        beyond[free] = np.linalg.solve(grounded, capture.growth_out(most)[free])
        edge = r0 + _least_room(capture.room(k @ beyond), k[held])
        u = edge + beyond
        if edge > r0 and np.all(u <= most):
            return edge, float(u[free].min())
    return r0, float(base[free].min())


def _least_room(room: Array, k: Array) -> float:
    """Smallest of rooms (M,) over the sums of couplings (M, N); a node that feels none has any."""
    degree = k.sum(axis=1)
    return float(np.divide(room, degree, out=np.full(len(room), inf), where=degree > 0.0).min())
