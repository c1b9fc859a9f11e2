# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""By how much joints are late that tell what they have told before.

Noise changes the last bits of every reading, and no joint comes back to the same angle at the same
velocity to the last bit. A leg that does so while the robot moves is late by the age of what it
told then, and goes on to be late by as much.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import LEGS

PAST_NS = 250_000_000
"""How long what was told is known again [ns]."""

FROZEN_NS = 50_000_000
"""Time over which readings repeat before they count as frozen [ns]."""

MOVING = 0.5
"""Velocity of a joint from which the robot moves [rad/s]."""

N = len(LEGS)


def told_late(past: Sequence[SensorReadings], last: SensorReadings, readings: SensorReadings
              ) -> Array:
    """By how much legs of a robot that moves are late that tell what they told before the last
    tick, (4,) [ns]; 0 for those that do not, or repeat what they told last.

    Parameters
    ----------
    past, last, readings : sequence of SensorReadings, SensorReadings, SensorReadings
        Of the ticks before the last one, of the last one, and of this one.
    """
    if not (past and np.abs(np.nan_to_num(readings.joint_velocity)).max() > MOVING):
        return np.zeros(N, int)
    before = last, *past
    repeated = ((np.array([of.joint_position for of in before]) == readings.joint_position)
                & (np.array([of.joint_velocity for of in before]) == readings.joint_velocity))
    same = repeated.reshape(-1, N, 3).all(axis=2)  # (n, 4)
    age_ns = readings.time_ns - np.array([of.time_ns for of in past])
    return np.where(same[0], 0, (same[1:] * age_ns[:, None]).max(axis=0))


def unknown(past: Sequence[SensorReadings], heard_ns: Sequence[int], readings: SensorReadings
            ) -> Array:
    """Of which legs it is not known any more whether they are late, (4,) bool: those that have
    told nothing for a while, and those at rest, of which nobody can tell.

    Parameters
    ----------
    past, readings : sequence of SensorReadings, SensorReadings
        Of the ticks before, and of this one.
    heard_ns : sequence of 12 int
        Stamps at which each joint's angle was new [ns].
    """
    unheard = readings.joints_ns - np.array(heard_ns) > FROZEN_NS
    rates = np.array([of.joint_velocity for of in (*past, readings)])
    moves = (np.abs(np.nan_to_num(rates)) > MOVING).any(axis=0)
    return np.asarray(unheard.reshape(N, 3).all(axis=1) | ~moves.reshape(N, 3).any(axis=1))
