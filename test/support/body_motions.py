# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A body that moves over feet that stand still, exactly: what its sensors read is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from core_examples import GRAVITY, TICK, TICK_NS, quadruped

from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.leg import nominal_foothold

UP = np.array([0.0, 0.0, 1.0])


def point_footed() -> RobotDescription:
    """The example robot on feet without radius: they do not roll."""
    robot = quadruped()
    legs = tuple(dataclasses.replace(leg, foot_radius=0.0) for leg in robot.legs)
    return dataclasses.replace(robot, legs=legs)


@dataclass(frozen=True)
class Sway:
    """Motion of the body: sines in six coordinates that begin at rest after a time.

    Attributes
    ----------
    amplitude, rate : ndarray (6,)
        Of x, y, z [m] and roll, pitch, yaw [rad]; [rad/s].
    begin : float
        Time for which the body stands still [s].
    slope : ndarray (2,)
        Of the ground under the feet.
    """

    amplitude: np.ndarray
    rate: np.ndarray
    begin: float = 0.5
    slope: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(2))

    def pose(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Position in the world (3,) and rotation (3, 3)."""
        t = max(t - self.begin, 0.0)
        x, y, z, roll, pitch, yaw = self.amplitude * (1.0 - np.cos(self.rate * t))
        (sr, sp, sy), (cr, cp, cy) = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
        R = np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                      [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                      [-sp, cp * sr, cp * cr]])
        return np.array([x, y, z + 0.28]), R

    def velocity(self, t: float, step: float = 1e-5) -> tuple[np.ndarray, np.ndarray]:
        """Velocity in the world and turn rate in the base, (3,) each."""
        (before, R_before), (after, R_after) = self.pose(t - step), self.pose(t + step)
        W = self.pose(t)[1].T @ (R_after - R_before) / (2 * step)
        return (after - before) / (2 * step), np.array([W[2, 1], W[0, 2], W[1, 0]])

    def specific_force(self, t: float) -> np.ndarray:
        """What a perfect accelerometer reads on average over the tick that ends at t."""
        change = self.velocity(t)[0] - self.velocity(t - TICK)[0]
        return self.pose(t - 0.5 * TICK)[1].T @ (change / TICK + GRAVITY * UP)


SWAY = Sway(np.array([0.02, 0.015, 0.01, 0.05, 0.06, 0.05]), np.array([5.0, 7, 9, 6, 8, 4]))


def readings(robot: RobotDescription, sway: Sway, seconds: float) -> Iterator[SensorReadings]:
    """Exact readings of all sensors, tick by tick."""
    legs = [LegKinematics(leg) for leg in robot.legs]
    feet = np.array([nominal_foothold(robot, leg) for leg in LEGS]) + 0.28 * UP
    feet[:, 2] += feet[:, :2] @ sway.slope
    for k in range(round(seconds / TICK)):
        t = k * TICK
        place, R = sway.pose(t)
        velocity, rate = sway.velocity(t)
        feet_in_base = (feet - place) @ R
        q = np.array([leg.inverse(foot) for leg, foot in zip(legs, feet_in_base, strict=True)])
        moving = -(R.T @ velocity) - np.cross(rate, feet_in_base)
        q_dot = np.array([np.linalg.solve(leg.jacobian_in_base(angles), foot)
                          for leg, angles, foot in zip(legs, q, moving, strict=True)])
        load = np.array([0.0, 0.0, robot.mass * GRAVITY / 4.0]) @ R
        torque = np.array([-leg.jacobian_in_base(angles).T @ load
                           for leg, angles in zip(legs, q, strict=True)])
        yield SensorReadings(k * TICK_NS, q.ravel(), q_dot.ravel(), torque.ravel(), rate,
                             sway.specific_force(t), np.full(4, robot.mass * GRAVITY / 4.0))
