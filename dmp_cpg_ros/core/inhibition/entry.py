# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Entering C: how close to their places legs must be for it, and which leg is taken where any may
be.

Each oscillator may be the one that is inhibited, at its own x_d = [1, 0]; in a gait of four beats
one of them comes there within a quarter of a turn. Nothing in the oscillators depends on the phase
at which they are held, so that what is certified for a leg holds wherever it is caught.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import asin, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.coupling import degrees
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import scalar_phase
from dmp_cpg_ros.core.contraction.capture import capture_set, place_tolerance, radius_tolerance
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.inhibited import NONE, inhibited_contraction
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.network import (
    CanonicalParameters,
    GaitNetwork,
    at_own_cadence,
    network_system,
)
from dmp_cpg_ros.core.gait.running import CADENCE_RATE
from dmp_cpg_ros.core.gait.transition import BlendedGait
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.state import LEGS

SMALLEST_RADIUS = 0.5
"""Radius that every oscillator must keep at rest for its phase to be sound, as a fraction of r."""


def entry_tolerances(network: GaitNetwork, region_radius: float) -> tuple[float, float]:
    """Distance of legs from each other's places, and of radii from r, at which C may be entered.

    With :func:`~dmp_cpg_ros.core.contraction.capture.place_tolerance` at the cadence of rest, not
    above the one that capture is certified for.
    """
    p = network.parameters
    degree = p.coupling_gain * max(degrees(p.coupling_graph, len(LEGS)))
    return (place_tolerance(network.omega(np.zeros(3)), degree, p.radius),
            radius_tolerance(p.radius, region_radius))


def locked(network: GaitNetwork, x: Array) -> NDArray[np.complex128]:
    """States (4, 2) in the places' own frames, as complex numbers (4,): alike in the gait."""
    return np.exp(1j * network.gait.phases) * (x[:, 0] + 1j * x[:, 1])


def in_places(network: GaitNetwork, x: Array, region_radius: float) -> bool:
    """Whether legs and radii are within :func:`entry_tolerances`."""
    (places, radii), z = entry_tolerances(network, region_radius), locked(network, x)
    return bool(np.abs(np.abs(z) - network.parameters.radius).max() <= radii
                and np.abs(z[:, None] - z).max() <= places)


def eligible_legs(network: GaitNetwork, inhibition: InhibitionParameters) -> tuple[int, ...]:
    """Legs of which ``auto`` takes one: those that hold the network at the highest cadence of the
    gait, of both gaits while they change, and the first of the best connected in any case, with
    which the gait starts.
    """
    p, gait = network.parameters, network.gait
    share = (gait.transition.fastest(network.change_rate) if isinstance(gait, BlendedGait)
             else 0.0)
    fastest = max(float(end.cadence.max()) / end.cadence_scale for end in gait.ends)
    omega = (2.0 * pi * sqrt(GRAVITY / network.scale.leg_length) * (1.0 + share) * fastest
             * max(gait.cadence_scale, p.cadence_scale))
    return _holding(at_own_cadence(p), inhibition.inhibition_gain,
                    inhibition.region_radius, omega)


@lru_cache(256)
def _holding(p: CanonicalParameters, gain: float, region_radius: float, omega: float
             ) -> tuple[int, ...]:
    number = degrees(p.coupling_graph, len(LEGS))
    # of the first leg itself nothing is asked
    asked = {number[leg] for leg in range(len(LEGS)) if leg != p.first_leg}
    able = {one for one in asked if _holds(p, number.index(one), gain, region_radius, omega)}
    return tuple(leg for leg in range(len(LEGS)) if leg == p.first_leg or number[leg] in able)


def _holds(p: CanonicalParameters, leg: int, gain: float, region_radius: float, omega: float
           ) -> bool:
    """Whether one leg captures the network and holds it at rest at a cadence."""
    system, gains = network_system(p, np.zeros(len(LEGS))), np.zeros(len(LEGS))
    gains[leg] = gain
    try:
        capture = capture_set(system, omega, gains, region_radius)
    except ParameterError:                     # a gain of zero, or a family without bounds
        return False
    if not capture.holds or inhibited_contraction(system, capture).reach == NONE:
        return False
    rest = inhibited_equilibrium(system, omega, gains)
    return (rest is not None and rest.slowest_rate > 0.0 and rest.distance[leg] < region_radius
            and float(rest.radius.min()) > SMALLEST_RADIUS * p.radius)


def next_leg(network: GaitNetwork, inhibition: InhibitionParameters, x: Array,
             ahead: float = 0.0, aimed: int | None = None) -> tuple[int, float]:
    """Eligible leg whose oscillator is in its C, or the next to come there, when inhibition that
    is armed now acts, and the phase of fl at which the gait then rests [rad].

    Parameters
    ----------
    network, inhibition
        What runs.
    x : ndarray (4, 2)
        States.
    ahead : float
        Largest way of the oscillators until then [rad].
    aimed : int, optional
        Leg for which it was armed before, which is kept until it has been in its C, for it is
        there when that acts.
    """
    places, region = network.gait.phases.tolist(), inhibition.region_radius
    half = half_arc(region, network.parameters.radius)
    found = (2.0 * pi + 1.0, 0, 0.0)
    for leg in eligible_legs(network, inhibition):
        x_1, x_2 = x[leg].tolist()
        at = scalar_phase(x_1, x_2)
        if ahead > 0.0:
            inside = (at + ahead + half) % (2.0 * pi) <= 2.0 * half
            if leg == aimed and (half - at) % (2.0 * pi) <= ahead + 2.0 * half:
                return leg, -places[leg] % (2.0 * pi)
        else:
            off = x_1 - network.parameters.radius
            inside = off * off + x_2 * x_2 <= region * region
        way = 0.0 if inside else (-half - at - ahead) % (2.0 * pi)
        # legs that go together are told apart by their order, not by rounding
        found = min(found, (round(way, 6), leg, -places[leg] % (2.0 * pi)))
    return found[1], found[2]


def way_in(network: GaitNetwork, speed: float, rates: Sequence[float], span_s: float) -> float:
    """Largest way of the oscillators within a time in which the feet get no faster [rad]; none
    where they are held.

    Parameters
    ----------
    network : GaitNetwork
        That acts; its cadence may be on its way to that of its parameters.
    speed : float
        Of the feet [m/s].
    rates : sequence of float
        Phase rates of the oscillators, of which some are near ω where nothing holds them [rad/s].
    span_s : float
        The time [s].
    """
    acting, scale = network.gait.cadence_scale, network.scale
    rising = min(max(network.parameters.cadence_scale, acting), acting + CADENCE_RATE * span_s)
    omega = network.gait.omega(speed, scale)
    if max(map(abs, rates)) <= 0.5 * omega:
        return 0.0
    return span_s * max(omega, network.gait.omega(0.0, scale)) * rising / acting


def farthest_way(network: GaitNetwork, inhibition: InhibitionParameters) -> float:
    """Largest way of the oscillators to the next place where one can be caught, from one where
    one could [rad]: a turn for legs that are named or change their places.
    """
    if not inhibition.auto or isinstance(network.gait, BlendedGait):
        return 2.0 * pi
    places = np.sort(np.round(-network.gait.phases[list(eligible_legs(network, inhibition))]
                              % (2.0 * pi), 9))
    return float(np.diff(np.append(places, places[0] + 2.0 * pi)).max())


def half_arc(region_radius: float, radius: float) -> float:
    """Half of the arc of the limit cycle that lies in C [rad]."""
    return 2.0 * asin(min(1.0, region_radius / (2.0 * radius)))
