# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the first readings tell of a robot that moves already, as of a node that is started again.

A robot at rest is where its accelerometer and its feet say. In the middle of a stride one reading
of the accelerometer is off the vertical by up to 45 degrees, feet hang in the air, and the body
has a speed: who takes that for rest throws a pace over (at 12 of 16 phases).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dmp_cpg_ros.core.estimation.leg_odometry import FootMotion
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Triple, triple
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings

MOVING_JOINT = 0.15
"""Velocity of a joint from which a robot does not stand still [rad/s]."""

UPRIGHT, SHAKEN_SHARE = 0.8, 0.2
"""Cosine of the tilt beyond which a body that moves does not walk, and share of one reading of the
accelerometer in the tilt of one that does.
"""

GENTLE = (0.7, 1.3)
"""Length of a reading of the accelerometer that may tell such a tilt; others are blows [g]."""

CARRIED = 0.3
"""Share of what the accelerometer feels that is the feet's force, from which the body is on its
feet, and its tilt is not told by one reading: of a trot at 1 m/s whose nodes died now and then,
some 50 of 18,000 were as long as in rest and off the vertical by 37 to 130 degrees.
"""


def moves(readings: SensorReadings) -> bool:
    """Whether joints move as in a walk, of a robot whose joints are all known."""
    return bool(all(readings.usable_legs)
                and float(np.abs(readings.joint_velocity).max()) >= MOVING_JOINT)


def on_feet(readings: SensorReadings, weight: float) -> bool:
    """Whether what the accelerometer feels of a body, of a weight [N], is the force of its feet:
    who lies is carried by the ground. Feet whose sensors tell nothing carry nothing.
    """
    feet = sum(force for force, usable in zip(
        readings.foot_force.tolist(), readings.usable_contacts, strict=True) if usable)
    felt = float(np.linalg.norm(readings.specific_force_in_base)) / GRAVITY
    return feet >= CARRIED * weight * felt


def steadied(force: Array, *, walks: bool = False) -> Array:
    """Upward direction of a body that moves, from one reading of its accelerometer: near that of a
    level body, for steps shake it by more than walking bodies are tilted, unless it is far off.

    Parameters
    ----------
    force : ndarray (3,)
        Specific force in the base frame [m/s^2].
    walks : bool
        Whether it is known to be on its feet; then what is far off tells nothing.

    Returns
    -------
    ndarray (3,)
        Of any length.
    """
    along, size = float(force[2]), float(np.linalg.norm(force))
    if along <= UPRIGHT * size:
        calm = GENTLE[0] * GRAVITY <= size <= GENTLE[1] * GRAVITY
        return force if calm and not walks else np.array((0.0, 0.0, 1.0))
    return np.array((SHAKEN_SHARE * force[0], SHAKEN_SHARE * force[1], along))


def velocity_of_feet(motion: FootMotion, rate: Triple, trust: Sequence[float]) -> Triple:
    """Velocity of the body by the feet that stand, their mean by trust [m/s].

    Parameters
    ----------
    motion : FootMotion
        Of the feet.
    rate : tuple of float
        Turn rate of the body [rad/s].
    trust : sequence of float
        In each foot; one at least is not 0.
    """
    contact, velocity = np.array(motion.contact_in_base), np.array(motion.velocity_in_base)
    return triple(np.average(
        velocity - np.cross(rate, contact), axis=0, weights=trust).tolist())
