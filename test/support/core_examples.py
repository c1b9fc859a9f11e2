# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Examples that the tests of the core share: a quadruped, how it stands, gaits. No MuJoCo."""

from __future__ import annotations

import dataclasses

import numpy as np

from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold
from dmp_cpg_ros.suite import load_gaits

GAITS = load_gaits()
TICK_NS = 4_000_000
TICK = 0.004
GRAVITY = 9.81


def geometry(name: str = 'fl', front: float = 1.0, left: float = 1.0,
             **changes: object) -> LegGeometry:
    """A leg of Mini Cheetah size, with changes."""
    leg = LegGeometry(
        name=name, hip_in_base=np.array([0.19 * front, 0.05 * left, 0.0]),
        hip_offset=np.array([0.0, 0.06 * left, 0.0]), thigh=np.array([0.0, 0.0, -0.2]),
        shank=np.array([0.0, 0.0, -0.19]), axis_sign=np.ones(3), knee_sign=-1,
        position_lower=np.full(3, -3.0), position_upper=np.full(3, 3.0),
        torque_limit=np.array([17.0, 17.0, 26.0]), velocity_limit=np.full(3, 40.0),
        rotor_inertia=np.full(3, 0.003), foot_radius=0.02)
    return dataclasses.replace(leg, **changes)  # type: ignore[arg-type]


def quadruped() -> RobotDescription:
    """A robot of Mini Cheetah size."""
    legs = tuple(geometry(name, front, left) for name, front, left in zip(
        LEGS, (1.0, 1.0, -1.0, -1.0), (1.0, -1.0, 1.0, -1.0), strict=True))
    return RobotDescription('example', legs, 9.0, np.diag([0.09, 0.26, 0.32]), np.zeros(3), 0.28,
                            np.full(3, 60.0), np.full(3, 1.8))


def standing_state(robot: RobotDescription, time_ns: int = 0, **changes: object) -> RobotState:
    """State of a robot that stands still at its footholds."""
    q = np.concatenate([LegKinematics(leg).inverse(nominal_foothold(robot, leg.name))
                        for leg in robot.legs])
    state = RobotState(
        time_ns, q, np.zeros(12), np.zeros(12), np.array([0.0, 0.0, robot.stance_height]),
        np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3), np.array([0.0, 0.0, GRAVITY]),
        np.full(4, robot.mass * GRAVITY / 4.0))
    return dataclasses.replace(state, **changes)  # type: ignore[arg-type]


def network(gait: str | Gait = 'amble', paced: float = 1.0, **changes: object) -> GaitNetwork:
    """The oscillators of a gait, with a factor on its cadences, on the example robot; changes of
    CanonicalParameters.
    """
    known = GAITS[gait] if isinstance(gait, str) else gait
    return GaitNetwork(CanonicalParameters(**changes),  # type: ignore[arg-type]
                       known.scaled(paced), body_scale(quadruped()))


def suite_parameters(**changes: object) -> SuiteParameters:
    """Parameters of all parts with a command that does not time out; changes by part."""
    return SuiteParameters(**{'reference': ReferenceParameters(cmd_vel_timeout=0.0),
                              **changes})  # type: ignore[arg-type]


def differences(function, at: np.ndarray, step: float = 1e-6) -> np.ndarray:
    """Derivative of a function by central differences, (outputs, inputs)."""
    columns = []
    for i in range(len(at)):
        shift = np.zeros(len(at))
        shift[i] = step
        change = np.asarray(function(at + shift)) - np.asarray(function(at - shift))
        columns.append(change / (2.0 * step))
    return np.stack(columns, axis=-1)
