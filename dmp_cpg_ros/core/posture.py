# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feedback from the body's state to the legs: torques, foot placement, stance velocity.

The virtual model (:mod:`~dmp_cpg_ros.core.virtual_model`) says which wrench the body needs, the
stance feet share it (:mod:`~dmp_cpg_ros.core.force_distribution`), and the forces become joint
torques τ_fb = −Jᵀ f. Swinging feet are placed so as to catch the body
(:mod:`~dmp_cpg_ros.core.foot_placement`), and a slow loop keeps speed and heading
(:mod:`~dmp_cpg_ros.core.speed_keeping`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.bounce import Bounce
from dmp_cpg_ros.core.foot_placement import FootPlacement
from dmp_cpg_ros.core.force_distribution import distribute
from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.gait_transition import GaitInForce
from dmp_cpg_ros.core.ground_frame import ground_from_base, lean
from dmp_cpg_ros.core.leg_primitive import LegFeedback, body_scale, nominal_foothold
from dmp_cpg_ros.core.phase import phase, scalar_phase_rates
from dmp_cpg_ros.core.posture_parameters import PostureParameters
from dmp_cpg_ros.core.robot_description import RobotDescription
from dmp_cpg_ros.core.robot_legs import RobotLegs
from dmp_cpg_ros.core.robot_state import RobotState
from dmp_cpg_ros.core.speed_keeping import SpeedKeeping
from dmp_cpg_ros.core.stance_load import planned_load
from dmp_cpg_ros.core.swing_activity import activities_step
from dmp_cpg_ros.core.virtual_model import BodyMotion, VirtualModel

__all__ = ['PostureController', 'PostureFeedback', 'PostureParameters', 'PostureState']

Array = NDArray[np.float64]

LARGEST_LOAD = 2.0
"""Largest normal force of a fully loaded foot, in weights of the robot."""


@dataclass(frozen=True)
class PostureFeedback:
    """What the posture controller sends to the legs.

    Attributes
    ----------
    torque : ndarray (12,)
        τ_fb in the order of the joint names [N m].
    shift_in_base : ndarray (4, 3)
        Foot placement shifts for swinging feet [m].
    drift_in_base : ndarray (4, 2)
        What standing feet add to the velocity of their paths [m/s].
    correction : ndarray (3,)
        What the legs add to the reference velocity of the stance feet: v_x, v_y [m/s], γ [rad/s].
    mode : str
        What the body does, see :mod:`~dmp_cpg_ros.core.body_command`.
    measured : ndarray (12,)
        Measured joint angles that the feedback was made of [rad].
    """

    torque: Array
    shift_in_base: Array
    drift_in_base: Array
    correction: Array
    mode: str = 'standing'
    measured: Array = field(default_factory=lambda: np.zeros(12))

    def of_leg(self, i: int) -> LegFeedback:
        """What the path of leg ``i`` takes of it."""
        return LegFeedback(
            self.measured[3 * i : 3 * i + 3], self.shift_in_base[i], self.drift_in_base[i],
            self.correction)


@dataclass(frozen=True)
class PostureState:
    """The controller's own state.

    Attributes
    ----------
    activity : ndarray (4,)
        Swing activity of the legs.
    keeping : SpeedKeeping
        State of the slow loop.
    """

    activity: Array
    keeping: SpeedKeeping


class PostureController:
    """Feedback for one robot; state in, state out.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    gait : Gait
        The gait in force; the attribute is set when it changes.
    parameters : PostureParameters
        Gains; the attribute is set when they change.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(
        self, description: RobotDescription, gait: GaitInForce, parameters: PostureParameters,
        legs: RobotLegs | None = None,
    ) -> None:
        """Scale all parts by the robot's lengths, mass and inertia."""
        self.description, self.gait, self.parameters = description, gait, parameters
        self.legs = legs or RobotLegs(description)
        self.kinematics = self.legs.kinematics
        self.scale = body_scale(description)
        footholds = np.array([nominal_foothold(description, leg.name) for leg in description.legs])
        self.model = VirtualModel(description, self.scale.leg_length)
        self.placement = FootPlacement(self.kinematics, footholds, self.scale.leg_length)
        self.foot_radius = float(np.mean([leg.foot_radius for leg in description.legs]))
        self.torque_limit = np.array([leg.torque_limit for leg in description.legs])
        inertia = np.diag(description.base_inertia)
        # moments count as the accelerations that they cause at the length of a leg
        self.importance = np.concatenate(
            [np.ones(3), description.mass * self.scale.leg_length / inertia])

    def initial_state(self) -> PostureState:
        """State of a robot that stands."""
        return PostureState(
            np.zeros(len(self.kinematics)), SpeedKeeping(np.zeros(2), 0.0, float('nan')))

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
        p, leg_length = self.parameters, self.scale.leg_length
        speed = self.scale.foot_speed(float(r[0]), float(r[1]), float(r[2]))
        gait = self.gait
        omega, duty = gait.omega(speed, self.scale), gait.duty(speed, self.scale)
        rates = [rate + gait.rest_rate for rate in scalar_phase_rates(x, x_dot)]
        activity = activities_step(
            memory.activity, rates, gait.own_omegas(omega), p.activity_rate, dt)
        place = gait.cycle_position(phase(x))
        load = planned_load(place, duty, activity, p.load_transfer)
        R_ground_base, upward = ground_from_base(state, p.slope_following)
        velocity = R_ground_base @ state.base_velocity_in_base
        rate = R_ground_base @ state.base_rate_in_base
        moving = float(activity.mean())
        keeping = memory.keeping.following(
            p, leg_length, moving, state.base_quaternion, velocity, r, dt)
        correction = keeping.acting(p, leg_length, moving)
        measured = np.array((velocity[0], velocity[1], rate[2]))
        planned = r + correction
        shift = self.placement.shift(p, measured, planned, np.pi * duty / omega)
        shift = shift + p.slope_lean * lean(upward, self.model.height)
        raised = self.placement.raised(p, shift, R_ground_base)
        body = BodyMotion(R_ground_base, upward, velocity, rate, 0.0)
        bounce = self._bounce(place, duty, omega, moving)
        return replace(memory, activity=activity, keeping=keeping), PostureFeedback(
            self._torque(state, body, load, planned, bounce),
            np.column_stack([shift, raised]),
            self.placement.drift(p, measured, planned, activity),
            correction,
            measured=state.joint_position,
        )

    def _bounce(self, place: Array, duty: float, omega: float, moving: float) -> Bounce:
        """Planned bounce of the body: what the legs give way to, in the mean."""
        each = [self.gait.bounce(position, duty, omega) for position in place.tolist()]
        share = moving / len(each)
        return Bounce(*(share * sum(values) for values in zip(*each, strict=True)))

    def _torque(
        self, state: RobotState, body: BodyMotion, load: Array, r: Array, bounce: Bounce
    ) -> Array:
        """Torques τ_fb by which the stance feet make the virtual model's wrench, ndarray (12,)."""
        legs = self.legs.at(state.joint_position.tolist())
        feet_in_base = np.array([foot for foot, _ in legs])
        # from the centre of mass, in the frame of the ground
        feet = (feet_in_base - self.description.com_in_base) @ body.R_ground_base.T
        total = float(load.sum())
        ground = float(load @ feet[:, 2]) / total if total > 1e-6 else float(feet[:, 2].min())
        body = replace(body, height=self.foot_radius - ground)
        forces = distribute(
            self.model.wrench(self.parameters, body, r, bounce), feet, load,
            self.parameters.friction, LARGEST_LOAD * self.description.mass * GRAVITY,
            self.importance)
        J = np.array([jacobian for _, jacobian in legs])
        torque = -np.einsum('lij,li->lj', J, forces @ body.R_ground_base)
        return np.clip(torque, -self.torque_limit, self.torque_limit).ravel()
