# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The path of a foot over one cycle, as a function of the oscillator's phase and the reference.

In stance the foot stays where it is in the world while the base moves with (v, γ), so in the base
frame it follows ṗ = −v − γ ẑ × p exactly, turning included. A round foot rolls while it stands:
its centre needs only the share ``rolling`` of the way that the contact point makes
(:func:`rolling_share`). In swing a cubic Hermite curve carries it back with matching velocities at
both ends, lifted by :func:`swing_height`. The whole path is C¹ in the phase.

When inhibition stops a phase inside the swing, the foot must come down; when the phase moves again
it must lift. The swing's height is therefore scaled by an amplitude (*activity*) that follows the
phase speed (notes on the paper: for duty factors below 3/4 no phase has all four feet down),
through a first-order filter as the paper uses for amplitudes (:func:`activity_step`).

A :class:`Motion` says where the paths of the feet come from; this is the one place at which
another source plugs in. A leg asks a :class:`FootMotion` for its foot at every tick and adds the
feedback of the body (shifts, stumbling reflex) before inverse kinematics makes joint goals of it.
The default is :class:`~dmp_cpg_ros.core.transformation.foot_path.FootPath`; learned primitives are
in :mod:`~dmp_cpg_ros.core.transformation.learned_motion`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, exp, pi, sin
from typing import Any, NamedTuple, Protocol

import numpy as np

from dmp_cpg_ros.core.maths import Array, clamped
from dmp_cpg_ros.core.maths.vec3 import Triple, moved
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics

LIFTING, LOWERING = 0.35, 0.5
"""Shares of the swing in which the foot rises and comes down. It rises sooner, so that it is clear
of the ground before it is moved along it.
"""


class FootPath(NamedTuple):
    """Path of one foot for a held reference.

    Attributes
    ----------
    foothold_in_base : sequence of three floats
        Where the foot is at mid-stance [m].
    v_x, v_y, gamma : float
        Reference velocity of the base [m/s], [rad/s].
    omega : float
        Angular frequency of the oscillator on its limit cycle [rad/s].
    duty : float
        Duty factor β in (0, 1).
    clearance : float
        Height of the swing [m].
    rolling : tuple of float
        Share of the stance displacement, along x and y, that the foot's centre makes.
    """

    foothold_in_base: Sequence[float]
    v_x: float
    v_y: float
    gamma: float
    omega: float
    duty: float
    clearance: float
    rolling: tuple[float, float] = (1.0, 1.0)

    def at(self, cycle_position: float) -> tuple[Triple, Triple]:
        """Foot position and its derivative with respect to the cycle position.

        Parameters
        ----------
        cycle_position : float
            0 at mid-swing, ±1/2 at mid-stance, in [−1/2, 1/2].

        Returns
        -------
        position_in_base : tuple of float
            [m]
        slope : tuple of float
            ∂p/∂c [m per cycle]; the velocity is slope · φ̇ / 2π.
        """
        period, swing = 6.283185307179586 / self.omega, 1.0 - self.duty
        height = self.foothold_in_base[2]
        if abs(cycle_position) >= 0.5 * swing:
            from_mid_stance = (
                cycle_position - 0.5 if cycle_position > 0.0 else cycle_position + 0.5)
            x, y, x_dot, y_dot = self.stance(from_mid_stance * period)
            return (x, y, height), (x_dot * period, y_dot * period, 0.0)
        half_stance = 0.5 * self.duty * period
        x0, y0, dx0, dy0 = self.stance(half_stance)
        x1, y1, dx1, dy1 = self.stance(-half_stance)
        s, scale = cycle_position / swing + 0.5, swing * period
        x, x_slope = _hermite(s, x0, x1, dx0 * scale, dx1 * scale)
        y, y_slope = _hermite(s, y0, y1, dy0 * scale, dy1 * scale)
        bump, bump_slope = swing_height(s)
        return (
            (x, y, height + self.clearance * bump),
            (x_slope / swing, y_slope / swing, self.clearance * bump_slope / swing))

    def swung(self, cycle_position: float) -> float:
        """Share of the swing that has passed; outside of [0, 1] in stance."""
        return cycle_position / (1.0 - self.duty) + 0.5

    def stance(self, t: float) -> tuple[float, float, float, float]:
        """Position (x, y) [m] and velocity [m/s] in the base of a foot that stands, t seconds
        after mid-stance.
        """
        (x0, y0, _), v_x, v_y, gamma, _, _, _, (share_x, share_y) = self
        angle = gamma * t
        s, c = sin(angle), cos(angle)
        if abs(angle) > 1e-6:
            along, across = s / gamma, (1.0 - c) / gamma
        else:
            along, across = t, 0.5 * angle * t
        x = c * x0 + s * y0 - along * v_x - across * v_y
        y = c * y0 - s * x0 - along * v_y + across * v_x
        return (
            x0 + share_x * (x - x0), y0 + share_y * (y - y0),
            share_x * (-v_x + gamma * y), share_y * (-v_y - gamma * x))


def swing_height(s: float) -> tuple[float, float]:
    """Relative height of a swinging foot, in [0, 1], and its slope: up, along, down.

    Parameters
    ----------
    s : float
        Share of the swing that has passed, in [0, 1].

    Returns
    -------
    height, slope : float
    """
    if s < LIFTING:
        u, scale = s / LIFTING, 1.0 / LIFTING
    elif s > 1.0 - LOWERING:
        u, scale = (1.0 - s) / LOWERING, -1.0 / LOWERING
    else:
        return 1.0, 0.0
    return u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) * scale


RESTING = 0.3
"""Activity of a leg below which it rests unless it begins to move."""


def activity_step(activity: float, phase_rate: float, omega: float, rate: float,
                  dt: float) -> float:
    """Advance ȧ = rate · (sat(φ̇/ω) − a) exactly for a held phase rate.

    Parameters
    ----------
    activity : float
        a in [0, 1].
    phase_rate : float
        φ̇ [rad/s].
    omega : float
        Free-running ω > 0 [rad/s].
    rate : float
        Rate of the filter [1/s].
    dt : float
        [s]

    Returns
    -------
    float
    """
    wanted = clamped(phase_rate / omega, 0.0, 1.0)
    return wanted + (activity - wanted) * exp(-rate * dt)


def activities_step(activities: Sequence[float], phase_rates: Sequence[float],
                    omegas: Sequence[float], rate: float, dt: float) -> tuple[float, ...]:
    """As :func:`activity_step` for a few legs."""
    kept, after = exp(-rate * dt), []
    for i, activity in enumerate(activities):
        wanted = clamped(phase_rates[i] / omegas[i], 0.0, 1.0)
        after.append(wanted + (activity - wanted) * kept)
    return tuple(after)


def resting(activity: float, before: float) -> bool:
    """Whether a leg with an activity, and another one tick before, rests: on uneven ground it
    stands then, wherever in its cycle it is held.
    """
    return activity < RESTING and activity <= before


def rolling_share(kinematics: LegKinematics, foothold_in_base: Array) -> tuple[float, float]:
    """Share of the stance displacement that the centre of a rolling foot makes, along x and y.

    A foot of radius ρ on a shank that turns by θ rolls ρ θ on the ground, so with the base's
    velocity v the centre moves at ẋ = −v / (1 − ρ ∂θ/∂x) in the base; to first order at the
    foothold, with θ the pitch of the shank for x and its roll (with the opposite sign) for y.

    Parameters
    ----------
    kinematics : LegKinematics
        The leg.
    foothold_in_base : ndarray (3,)
        Where to take the derivatives [m].

    Returns
    -------
    tuple of float
    """
    geometry = kinematics.geometry
    inverse = np.linalg.inv(kinematics.jacobian_in_base(kinematics.inverse(foothold_in_base)))
    turning = geometry.axis_sign[:, None] * inverse  # (3, 3) axis angles per metre
    pitch_per_x = turning[1, 0] + turning[2, 0]
    roll_per_y = turning[0, 1]
    return (
        float(1.0 / (1.0 - geometry.walking_radius * pitch_per_x)),
        float(1.0 / (1.0 + geometry.walking_radius * roll_per_y)))


def _hermite(s: float, p0: float, p1: float, m0: float, m1: float) -> tuple[float, float]:
    """Cubic Hermite curve on [0, 1] and its derivative."""
    s2, s3 = s * s, s * s * s
    value = (
        (2.0 * s3 - 3.0 * s2 + 1.0) * p0
        + (s3 - 2.0 * s2 + s) * m0
        + (3.0 * s2 - 2.0 * s3) * p1
        + (s3 - s2) * m1)
    slope = (
        6.0 * (s2 - s) * (p0 - p1) + (3.0 * s2 - 4.0 * s + 1.0) * m0 + (3.0 * s2 - 2.0 * s) * m1)
    return value, slope


class FootMotion(Protocol):
    """Motion of one foot in the base."""

    def step(self, state: Any, path: FootPath, cycle_position: float, rate: float,
             dt: float) -> tuple[Any, Triple, Triple]:
        """Advance to the time at which the inputs hold.

        Parameters
        ----------
        state : object
            What the source returned one tick before; None at the first.
        path : FootPath
            What the gait and the reference ask: velocity, frequency, duty factor, foothold, and
            the height of the swing that acts now, which is 0 for a leg at rest.
        cycle_position : float
            0 at mid-swing, ±1/2 at mid-stance, in [−1/2, 1/2].
        rate : float
            Rate of the phase [rad/s].
        dt : float
            Time since the last tick [s]; 0 at the first.

        Returns
        -------
        state : object
        position_in_base, velocity_in_base : tuple of float
            [m], [m/s]
        """


class Motion(Protocol):
    """Motions of all feet of any robot."""

    @property
    def clearance(self) -> float:
        """Height of the swing as a fraction of the standing height."""

    def of_leg(self, leg: str, description: RobotDescription) -> FootMotion:
        """Motion of one foot, scaled to a robot."""


class HermiteMotion:
    """The foot path itself."""

    def step(self, state: None, path: FootPath, cycle_position: float, rate: float,
             dt: float) -> tuple[None, Triple, Triple]:
        """Foot on its path, as :meth:`FootMotion.step`."""
        foot, slope = path.at(cycle_position)
        return None, foot, moved((0.0, 0.0, 0.0), slope, rate / (2.0 * pi))
