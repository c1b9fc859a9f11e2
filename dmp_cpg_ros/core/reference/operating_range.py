# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The range in which a gait operates: speeds and cadences that its reference's limits allow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.reference.filter import ReferenceParameters

REST_SPEED = 0.01
"""Reference foot speed below which the reference is at rest [m/s]."""

BORNE = 0.2
"""Foot speed of a reference that a body on legs which are caught can bear, in √(g l): its capture
point is that share of a leg ahead, where standing feet hold it (``CALM`` of
:mod:`~dmp_cpg_ros.core.inhibition.push_recovery`).
"""


@dataclass(frozen=True)
class OperatingRange:
    """Extremes over everything that can be commanded.

    Attributes
    ----------
    foot_speed : float
        Largest foot speed [m/s].
    armed_speed : float
        Largest foot speed while inhibition is armed during a stop [m/s].
    omega : tuple of float
        Smallest and largest ω over all speeds [rad/s].
    omega_armed : tuple of float
        The same over the speeds at which inhibition is armed [rad/s].
    omega_at_rest : float
        ω at zero reference [rad/s].
    omega_slope : float
        Largest |dω/du| over the speeds at which inhibition is armed [rad/m].
    """

    foot_speed: float
    armed_speed: float
    omega: tuple[float, float]
    omega_armed: tuple[float, float]
    omega_at_rest: float
    omega_slope: float


def operating_range(network: GaitNetwork, inhibition: InhibitionParameters,
                    reference: ReferenceParameters) -> OperatingRange:
    """Extremes of speed and cadence.

    Parameters
    ----------
    network : GaitNetwork
        Gait and scale.
    inhibition : InhibitionParameters
        For the speed at which inhibition is armed.
    reference : ReferenceParameters
        Limits of the commands.

    Returns
    -------
    OperatingRange
    """
    fastest, armed = _fastest(network.scale, reference), armed_speed(
        network.scale, inhibition, reference)
    speeds, omegas = _cadences(network, armed)
    slopes = (abs((omegas[k + 1] - omegas[k]) / max(speeds[k + 1] - speeds[k], 1e-12))
              for k in range(len(speeds) - 1))
    return OperatingRange(fastest, armed, _extremes(_cadences(network, max(fastest, armed))[1]),
                          _extremes(omegas), network.gait.omega(0.0, network.scale),
                          max(slopes, default=0.0))


def armed_speed(scale: BodyScale, inhibition: InhibitionParameters,
                reference: ReferenceParameters) -> float:
    """Largest foot speed at which a stop arms inhibition [m/s].

    Not above the limits of the commands, for cadences beyond them are not certified: after limits
    were lowered the reference comes down to them first. And where nobody steps out of a stop that
    standing legs cannot bear, not above what they can.
    """
    most = min(inhibition.capture_speed, max(_fastest(scale, reference), REST_SPEED))
    return most if inhibition.push_recovery else min(most, scale.speed(BORNE))


def _fastest(scale: BodyScale, reference: ReferenceParameters) -> float:
    """Largest foot speed that can be commanded [m/s]."""
    return scale.foot_speed(
        reference.max_speed, reference.max_lateral_speed, reference.max_turn_rate)


def _cadences(network: GaitNetwork, largest: float) -> tuple[list[float], list[float]]:
    """Speeds from 0 to the largest between which ω is linear, and ω there."""
    unit = sqrt(GRAVITY * network.scale.leg_length)
    knots = (unit * knot for end in network.gait.ends for knot in end.speed.tolist())
    speeds = sorted({0.0, largest, *(knot for knot in knots if 0.0 < knot < largest)})
    return speeds, [network.gait.omega(u, network.scale) for u in speeds]


def _extremes(values: Sequence[float]) -> tuple[float, float]:
    return min(values), max(values)
