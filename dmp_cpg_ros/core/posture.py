# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Virtual model control of the body: feedback torques and foot placement.

Virtual springs and dampers hold the base at its height, level, and at the reference velocity
(Pratt et al. 2001; Ajallooeian et al. 2013, as the paper's experiment). Their wrench is shared by
the stance feet (:mod:`~dmp_cpg_ros.core.force_distribution`) and becomes joint torques τ_fb = −Jᵀ
f. Swinging feet are placed further along a velocity that exceeds the reference (Raibert 1986), and
a slow loop corrects the velocity with which the stance feet move, so that speed and heading are
kept without a steady error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, isnan

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.force_distribution import distribute
from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.gait_transition import GaitInForce
from dmp_cpg_ros.core.leg_kinematics import LegKinematics
from dmp_cpg_ros.core.leg_primitive import body_scale
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.phase import phase, phase_rate, wrapped
from dmp_cpg_ros.core.robot_description import RobotDescription
from dmp_cpg_ros.core.robot_state import RobotState
from dmp_cpg_ros.core.swing_activity import activity_step

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PostureParameters(Parameters):
    """Gains of the virtual model, per unit of mass or inertia: squares and products of rates."""

    height_stiffness: float = parameter(
        80.0, 'virtual spring of the height, per mass', unit='1/s^2', minimum=0.0, maximum=1e4
    )
    height_damping: float = parameter(
        12.0, 'virtual damper of the height, per mass', unit='1/s', minimum=0.0, maximum=1e3
    )
    attitude_stiffness: float = parameter(
        150.0,
        'virtual spring of roll and pitch, per inertia',
        unit='1/s^2',
        minimum=0.0,
        maximum=1e4,
    )
    attitude_damping: float = parameter(
        15.0, 'virtual damper of roll and pitch, per inertia', unit='1/s', minimum=0.0, maximum=1e3
    )
    velocity_gain: float = parameter(
        4.0,
        'force per mass and error of horizontal velocity',
        unit='1/s',
        minimum=0.0,
        maximum=1e3,
    )
    yaw_rate_gain: float = parameter(
        8.0, 'moment per inertia and error of the turn rate', unit='1/s', minimum=0.0, maximum=1e3
    )
    friction: float = parameter(
        0.6, 'friction coefficient that the forces respect', minimum=0.05, maximum=2.0
    )
    load_transfer: float = parameter(
        0.08,
        'fraction of the cycle over which a foot takes and gives load',
        minimum=0.001,
        maximum=0.3,
    )
    placement_gain: float = parameter(
        0.12, 'foot placement per error of horizontal velocity', unit='s', minimum=0.0, maximum=1.0
    )
    placement_limit: float = parameter(
        0.12, 'largest foot placement shift', unit='m', minimum=0.0, maximum=0.5
    )
    speed_integral: float = parameter(
        0.8,
        'rate at which the stance velocity is corrected by the velocity error',
        unit='1/s',
        minimum=0.0,
        maximum=10.0,
    )
    speed_correction_limit: float = parameter(
        0.2,
        'largest correction of the stance velocity, as a fraction of '
        'the speed, at least of 0.5 m/s',
        minimum=0.0,
        maximum=1.0,
    )
    heading_gain: float = parameter(
        1.5, 'turn rate per error of heading', unit='1/s', minimum=0.0, maximum=20.0
    )
    heading_limit: float = parameter(
        0.3, 'largest error of heading that is remembered', unit='rad', minimum=0.0, maximum=1.5
    )
    activity_rate: float = parameter(
        12.0,
        'rate at which planned swings fade when the phase stops',
        unit='1/s',
        minimum=0.1,
        maximum=1e3,
    )


@dataclass(frozen=True)
class PostureFeedback:
    """What the posture controller sends to the legs.

    Attributes
    ----------
    torque : ndarray (12,)
        τ_fb in the order of the joint names [N m].
    shift_in_base : ndarray (4, 2)
        Foot placement shifts [m].
    correction : ndarray (3,)
        What the legs add to the reference velocity of the stance feet: v_x, v_y [m/s], γ [rad/s].
    mode : str
        What the body does, see :mod:`~dmp_cpg_ros.core.body_command`.
    measured : ndarray (12,)
        Measured joint angles where the mode's primitives begin from them [rad]; else zeros.
    """

    torque: Array
    shift_in_base: Array
    correction: Array
    mode: str = 'standing'
    measured: Array = field(default_factory=lambda: np.zeros(12))


@dataclass(frozen=True)
class PostureState:
    """The controller's own state.

    Attributes
    ----------
    activity : ndarray (4,)
        Swing activity of the legs.
    correction : ndarray (2,)
        Correction of the stance velocity [m/s].
    heading_error : float
        Commanded minus measured heading [rad].
    yaw : float
        Heading at the last tick [rad].
    """

    activity: Array
    correction: Array
    heading_error: float
    yaw: float


class PostureController:
    """Virtual model of one robot in one gait; state in, state out.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    gait : Gait
        The gait in force; the attribute is set when it changes.
    parameters : PostureParameters
        Gains.
    """

    def __init__(
        self, description: RobotDescription, gait: GaitInForce, parameters: PostureParameters
    ) -> None:
        """Scale the virtual model by the robot's mass and inertia."""
        self.description, self.gait, self.parameters = description, gait, parameters
        self.kinematics = [LegKinematics(leg) for leg in description.legs]
        self.scale = body_scale(description)
        self.foot_radius = float(np.mean([leg.foot_radius for leg in description.legs]))
        self.torque_limit = np.array([leg.torque_limit for leg in description.legs])
        self.inertia = np.diag(description.base_inertia).copy()

    def initial_state(self) -> PostureState:
        """State of a robot that stands."""
        return PostureState(np.zeros(len(self.kinematics)), np.zeros(2), 0.0, float('nan'))

    def step(
        self, memory: PostureState, state: RobotState, x: Array, x_dot: Array, r: Array, dt: float
    ) -> tuple[PostureState, PostureFeedback]:
        """Compute the feedback of one tick.

        Parameters
        ----------
        memory : PostureState
            The controller's state one tick before.
        state : RobotState
            Measured state.
        x, x_dot : ndarray (4, 2)
            Canonical states and rates.
        r : ndarray (3,)
            Reference v_x, v_y [m/s], γ [rad/s].
        dt : float
            Time since the last tick [s].

        Returns
        -------
        memory : PostureState
        feedback : PostureFeedback
        """
        p = self.parameters
        speed = self.scale.foot_speed(float(r[0]), float(r[1]), float(r[2]))
        gait = self.gait
        own, duty = gait.own_omegas(gait.omega(speed, self.scale)), gait.duty(speed, self.scale)
        rates = phase_rate(x, x_dot) + gait.rest_rate
        activity = activity_step(memory.activity, rates, own, p.activity_rate, dt)
        load = self._load(gait.cycle_position(phase(x)), duty, activity)
        R_level_base = level_from_base(state.base_quaternion)
        velocity = R_level_base @ state.base_velocity_in_base
        memory = self._corrected(memory, activity, state, velocity, r, dt)
        rate = R_level_base @ state.base_rate_in_base
        q = state.joint_position.reshape(4, 3).tolist()
        feet_in_base = np.array(
            [leg.foot_in_base(angles) for leg, angles in zip(self.kinematics, q, strict=True)]
        )
        feet = (
            feet_in_base - self.description.com_in_base
        ) @ R_level_base.T  # from the COM, levelled
        wrench = self._wrench(R_level_base, velocity, rate, feet, load, r)
        forces = distribute(wrench, feet, load, p.friction, 2.0 * self.description.mass * GRAVITY)
        J = np.array(
            [leg.jacobian_in_base(angles) for leg, angles in zip(self.kinematics, q, strict=True)]
        )
        torque = -np.einsum('lij,li->lj', J, forces @ R_level_base)
        torque = np.clip(torque, -self.torque_limit, self.torque_limit).ravel()
        shift = p.placement_gain * np.array((velocity[0] - r[0], velocity[1] - r[1]))
        length = float(np.hypot(shift[0], shift[1]))
        if length > p.placement_limit:
            shift *= p.placement_limit / length
        moving = float(activity.mean())
        correction = np.array(
            (
                moving * memory.correction[0],
                moving * memory.correction[1],
                moving * p.heading_gain * memory.heading_error,
            )
        )
        return memory, PostureFeedback(torque, np.tile(shift, (4, 1)), correction)

    def _corrected(
        self,
        memory: PostureState,
        activity: Array,
        state: RobotState,
        velocity: Array,
        r: Array,
        dt: float,
    ) -> PostureState:
        """Integrate the errors of speed and heading while the legs move; forget them at rest."""
        p = self.parameters
        x, y, z, w = state.base_quaternion.tolist()
        yaw = atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
        moving = float(activity.mean())
        limit = p.speed_correction_limit * max(float(np.hypot(r[0], r[1])), 0.5)
        wanted = memory.correction + (p.speed_integral * moving * dt) * (r[:2] - velocity[:2])
        correction = np.clip(wanted, -limit, limit) * np.exp(
            -(1.0 - moving) * p.activity_rate * dt
        )
        turned = 0.0 if isnan(memory.yaw) else float(wrapped(yaw - memory.yaw))
        heading_error = (memory.heading_error + float(r[2]) * dt - turned) * moving
        heading_error = min(max(heading_error, -p.heading_limit), p.heading_limit)
        return PostureState(activity, correction, heading_error, yaw)

    def _load(self, cycle_position: Array, duty: float, activity: Array) -> Array:
        """Share of the load that each foot may take, in [0, 1]: a trapezoid over the planned
        stance.
        """
        into_stance = np.abs(cycle_position) - 0.5 * (1.0 - duty)
        planned = np.clip(into_stance / self.parameters.load_transfer, 0.0, 1.0)
        return np.maximum(planned, 1.0 - activity)

    def _wrench(
        self, R_level_base: Array, velocity: Array, rate: Array, feet: Array, load: Array, r: Array
    ) -> Array:
        """Force and moment about the centre of mass in the levelled base frame, ndarray (6,)."""
        p, m = self.parameters, self.description.mass
        total = load.sum()
        ground = float(load @ feet[:, 2]) / total if total > 1e-6 else float(feet[:, 2].min())
        height = self.foot_radius - ground
        wanted = self.description.stance_height + float(self.description.com_in_base[2])
        roll, pitch = R_level_base[2, 1], -R_level_base[2, 0]  # small-angle axes of the tilt
        moment_x = self.inertia[0] * (-p.attitude_stiffness * roll - p.attitude_damping * rate[0])
        moment_y = self.inertia[1] * (-p.attitude_stiffness * pitch - p.attitude_damping * rate[1])
        return np.array(
            (
                m * p.velocity_gain * (r[0] - velocity[0]),
                m * p.velocity_gain * (r[1] - velocity[1]),
                m
                * (
                    GRAVITY
                    + p.height_stiffness * (wanted - height)
                    - p.height_damping * velocity[2]
                ),
                moment_x,
                moment_y,
                self.inertia[2] * p.yaw_rate_gain * (r[2] - rate[2]),
            )
        )


def level_from_base(quaternion: Array) -> Array:
    """Rotation from ``base_link`` to a frame of the same heading with z up.

    Parameters
    ----------
    quaternion : ndarray (4,)
        Orientation of ``base_link`` in ``odom``, x, y, z, w.

    Returns
    -------
    ndarray (3, 3)
        R_level_base.
    """
    x, y, z, w = quaternion.tolist()
    z_world = np.array((2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)))
    forward = np.array((1.0, 0.0, 0.0)) - z_world[0] * z_world
    forward /= np.sqrt(forward @ forward) + 1e-12
    left = np.array(
        (
            z_world[1] * forward[2] - z_world[2] * forward[1],
            z_world[2] * forward[0] - z_world[0] * forward[2],
            z_world[0] * forward[1] - z_world[1] * forward[0],
        )
    )
    return np.stack((forward, left, z_world))
