# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stance detection of a foot: its normal force over a quarter of the weight, with hysteresis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.sensor_readings import LARGEST_FORCE
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]

LOADED, UNLOADED = 0.25, 0.1
"""Share of a quarter of the weight above which a foot has touched down, and below which it has
left the ground. In a trot a standing foot bears two of these quarters."""


def quarter_weight(description: RobotDescription) -> float:
    """Force on each foot of a robot that stands evenly [N]."""
    return description.mass * GRAVITY / len(LEGS)


def believed(force: Array) -> Array:
    """Forces [N], (n,), with 0 for those that no contact sensor can have measured."""
    return np.array([
        value if -LARGEST_FORCE <= value <= LARGEST_FORCE else 0.0 for value in force.tolist()])


def standing(before: NDArray[np.bool_], force: Array, quarter: float) -> NDArray[np.bool_]:
    """Which feet stand.

    Parameters
    ----------
    before : ndarray (n,) of bool
        Which stood at the last tick.
    force : ndarray (n,)
        Normal forces [N]; where one is not a number, the foot counts as it did before.
    quarter : float
        As from :func:`quarter_weight` [N].

    Returns
    -------
    ndarray (n,) of bool
    """
    return (force > LOADED * quarter) | (before & ~(force < UNLOADED * quarter))
