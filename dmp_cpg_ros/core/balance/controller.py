# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Balance controller: from the body's state to torques, footholds and stance velocity of the legs.

The virtual model (:mod:`~dmp_cpg_ros.core.balance.virtual_model`) says which wrench the body
needs, the stance feet share it, and the forces become joint torques τ_fb = −Jᵀ f. Swinging feet
are placed so as to catch the body (:mod:`~dmp_cpg_ros.core.balance.footholds`), and slow loops
correct what the model does not know (:mod:`~dmp_cpg_ros.core.balance.corrections`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.balance import virtual_model
from dmp_cpg_ros.core.balance.body_command import STANDING, BodyCommand
from dmp_cpg_ros.core.balance.capture_point import WIDE, support_margins
from dmp_cpg_ros.core.balance.corrections import MassOffset, VelocityCorrection
from dmp_cpg_ros.core.balance.footholds import FootPlacement, ground_from_base, lean
from dmp_cpg_ros.core.balance.motion_plan import MotionPlan
from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.balance.progress import feet_behind
from dmp_cpg_ros.core.balance.terrain import (
    LEVEL_FEET,
    NOTHING_FELT,
    QUIET,
    ROLLING,
    SLOW,
    Terrain,
    contacts,
)
from dmp_cpg_ros.core.balance.unfelt import as_planned
from dmp_cpg_ros.core.balance.virtual_model import BodyMotion, VirtualModel, distribute
from dmp_cpg_ros.core.canonical.phase import scalar_phase, scalar_phase_rates
from dmp_cpg_ros.core.gait.com_height import LEVEL, Bounce
from dmp_cpg_ros.core.gait.contact_feedback import believed, quarter_weight
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.maths import Array, clamped, vec3
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Matrix, Pair, Triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.core.transformation.foot_path import activities_step, resting
from dmp_cpg_ros.core.transformation.leg import LegFeedback, body_scale, nominal_foothold

__all__ = ['PostureController', 'PostureFeedback', 'PostureParameters', 'PostureState']

LEFT = (0.0, 1.0, 0.0)

LARGEST_LOAD = 2.0
"""Largest normal force of a fully loaded foot, in weights of the robot."""

LEVEL_WITH_GROUND: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Rotation from the base to the frame of the ground as planned."""

FELT = (True,) * len(LEGS)


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
    command : BodyCommand
        What the body does.
    measured : ndarray (12,)
        Measured joint angles that the feedback was made of [rad].
    foot_force : ndarray (4,)
        Measured normal forces of the feet [N]; 0 where there is none to be believed.
    felt : tuple of 4 bool
        Whose joints were measured; those of other legs are planned.
    margins : tuple of float
        Of the capture point to the edges of the support polygon [m]; ``WIDE`` while nobody asks.
    progress : Progress or None
        Whether the body comes ahead, where it balances, and how rough its ground is.
    level : tuple of 4 float
        How far over the plane that the body follows the feet are to stand [m].
    """

    torque: Array
    shift_in_base: Array
    drift_in_base: Array
    correction: Array
    command: BodyCommand = STANDING
    measured: Array = field(default_factory=lambda: np.zeros(12))
    foot_force: Array = field(default_factory=lambda: np.zeros(4))
    margins: tuple[float, ...] = WIDE
    progress: Progress | None = None
    felt: tuple[bool, ...] = FELT
    level: tuple[float, ...] = LEVEL_FEET

    def of_leg(self, i: int) -> LegFeedback:
        """What the path of leg ``i`` takes of it."""
        return LegFeedback(
            self.measured[3 * i : 3 * i + 3], self.shift_in_base[i], self.drift_in_base[i],
            self.correction, float(self.foot_force[i]),
            self.level[i], self.progress.rough if self.progress else 0.0)


class PostureState(NamedTuple):
    """The controller's own state.

    Attributes
    ----------
    activity : ndarray (4,)
        Swing activity of the legs.
    integral : VelocityCorrection
        State of the slow loop of velocity and heading.
    plan : MotionPlan
        What the reference has the body do.
    offset : MassOffset
        Where the centre of mass is found to be.
    terrain : Terrain
        What the feet have felt of the ground.
    """

    activity: Array
    integral: VelocityCorrection = VelocityCorrection()
    plan: MotionPlan = MotionPlan()
    offset: MassOffset = MassOffset()
    terrain: Terrain = NOTHING_FELT


class PostureController:
    """Feedback for one robot; state in, state out.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    parameters : PostureParameters
        Gains.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(self, description: RobotDescription, parameters: PostureParameters,
                 legs: RobotLegs | None = None) -> None:
        """Scale all parts by the robot's lengths, mass and inertia."""
        self.description, self.parameters = description, parameters
        self.legs = legs or RobotLegs(description)
        self.kinematics = self.legs.kinematics
        self.scale = body_scale(description)
        footholds = np.array([nominal_foothold(description, leg.name) for leg in description.legs])
        self.model = VirtualModel(description, self.scale.leg_length)
        self.placement = FootPlacement(self.kinematics, footholds, self.scale.leg_length)
        self._across: list[float] = footholds[:, 1].tolist()
        self._nominal = [vec3.triple(foot) for foot in footholds.tolist()]
        self._footholds = [
            vec3.triple(foot) for foot in (footholds - description.com_in_base).tolist()]
        self._room = self.placement.room(parameters.reach)
        self.foot_radius = float(np.mean([leg.foot_radius for leg in description.legs]))
        self._quarter_weight = quarter_weight(description)
        self._com_in_base = vec3.triple(description.com_in_base.tolist())
        self._torque_limit = [
            float(most) for leg in description.legs for most in leg.torque_limit]
        inertia = description.base_inertia.diagonal()
        # moments count as the accelerations that they cause at the length of a leg
        importance = description.mass * self.scale.leg_length / inertia
        self._importance = vec3.triple(importance.tolist())

    def initial_state(self) -> PostureState:
        """State of a robot that stands."""
        return PostureState(np.zeros(len(self.kinematics)))

    def step(self, memory: PostureState, state: RobotState, gait: GaitInForce, x: Array,
             x_dot: Array, r: Array, dt: float,
             command: BodyCommand = STANDING) -> tuple[PostureState, PostureFeedback]:
        """Compute the feedback of one tick.

        Parameters
        ----------
        memory : PostureState
            The controller's state one tick before.
        state : RobotState
            Measured state.
        gait : Gait or BlendedGait
            In force.
        x, x_dot : ndarray (4, 2)
            Canonical states and rates.
        r : ndarray (3,)
            Reference v_x, v_y [m/s], γ [rad/s].
        dt : float
            Time since the last tick [s].
        command : BodyCommand
            What the body does.

        Returns
        -------
        memory : PostureState
        feedback : PostureFeedback
        """
        p, leg_length = self.parameters, self.scale.leg_length
        reference, omega, own_omegas, duty = gait.pace(r, self.scale)
        rates = [rate + gait.rest_rate for rate in scalar_phase_rates(x, x_dot)]
        activity = activities_step(memory.activity, rates, own_omegas, p.activity_rate, dt)
        swings = activity.tolist()
        positions = [gait.scalar_cycle_position(scalar_phase(x_1, x_2) + p.target_lead * rate)
                     for (x_1, x_2), rate in zip(x.tolist(), rates, strict=True)]
        load = virtual_model.contact_weights(positions, duty, swings, p.load_transfer)
        R_ground_base, upward = ground_from_base(
            state, p.slope_following * memory.terrain.followed)
        felt = state.felt_legs
        if felt is not None:
            if state.feels_nothing:
                R_ground_base = LEVEL_WITH_GROUND
            state = as_planned(state, self.kinematics, self._nominal, reference, own_omegas, duty,
                               positions)
        velocity = vec3.times(R_ground_base, vec3.triple(state.base_velocity_in_base.tolist()))
        rate = vec3.times(R_ground_base, vec3.triple(state.base_rate_in_base.tolist()))
        moving = sum(swings) / len(swings)
        plan = memory.plan.followed(reference, moving, self.model.push_rate(p),
                                    p.friction * GRAVITY, dt)
        integral = memory.integral.integrated(
            p, leg_length, moving, state.base_quaternion.tolist(), velocity, plan,
            reference[2], dt)
        offset = memory.offset.found(p, leg_length, moving, R_ground_base, dt)
        aside_x, aside_y = offset.place
        com_x, com_y, com_z = self._com_in_base
        com_in_base = com_x + aside_x, com_y + aside_y, com_z
        correction = integral.acting(p, leg_length, moving)
        sway = self._sway(positions, duty, omega, reference, moving)
        measured = (velocity[0], velocity[1] - sway.velocity, rate[2])
        planned = vec3.plus(reference, correction)
        lasting = integral.lasting(p, leg_length, plan)
        lean_x, lean_y = lean(upward, self.model.height)
        outside = -self.model.height / GRAVITY
        beside = (p.slope_lean * lean_x + outside * plan.curve[0] + aside_x,
                  p.slope_lean * lean_y + outside * plan.curve[1] + aside_y)
        caught = self.placement.caught(measured, planned, gait.apart)
        beside_x, beside_y = beside
        shift = [
            (along + beside_x, across + beside_y) for along, across in self.placement.shift(
                p, caught, planned, pi * duty / omega)]
        raised = self.placement.raised(p, shift, R_ground_base)
        legs = self.legs.at(state.joint_position.tolist())
        feet = [vec3.times(R_ground_base, vec3.minus(foot, com_in_base)) for foot, _ in legs]
        body = BodyMotion(R_ground_base, upward, velocity, rate, self._height(feet, load))
        bounce = self._bounce(gait, positions, duty, omega, moving)
        acceleration = plan.acceleration[0], plan.acceleration[1] + sway.acceleration
        terrain, level = self._ground(
            memory.terrain, state, R_ground_base[2], legs,
            [position / (1.0 - duty) + 0.5 for position in positions], gait, (reference, measured),
            [resting(*of) for of in zip(swings, memory.activity.tolist(), strict=True)], dt
        ) if p.climbing else (NOTHING_FELT, LEVEL_FEET)
        return PostureState(activity, integral, plan, offset, terrain), PostureFeedback(
            self._torque(body, legs, feet, load, planned, bounce, acceleration),
            np.array([part for (x, y), up in zip(shift, raised, strict=True)
                      for part in (x, y, up)]).reshape(-1, 3),
            np.array(self.placement.drift(
                self.placement.yielding(p, reference[0], gait.firm), measured, planned, swings,
                sway.velocity)),
            np.array(correction), command, state.joint_position, believed(state.foot_force),
            self._margins(R_ground_base, feet, swings, (lean_x, lean_y), (
                measured[0] - (planned[0] - lasting[0]),
                measured[1] - (planned[1] - lasting[1]))),
            Progress((measured[0], measured[1]), feet_behind(
                plan.expected, beside, feet, self._footholds, positions, duty, omega),
                terrain.rough, terrain.gaps), felt or FELT, level)

    def _ground(self, terrain: Terrain, state: RobotState, normal_in_base: Triple,
                legs: Sequence[tuple[Triple, Matrix]], swung: Sequence[float],
                gait: GaitInForce, velocities: Sequence[Triple], rests: Sequence[bool], dt: float
                ) -> tuple[Terrain, tuple[float, ...]]:
        """Memory of the ground, and heights of the feet over the plane with a normal that the body
        follows [m]; a body tells a first step at low velocities (v_x, v_y [m/s], γ [rad/s]) of the
        reference and its own only.
        """
        R_world_base = vec3.rotation(state.base_quaternion.tolist())
        place = vec3.triple(state.base_position_in_world.tolist())
        n = vec3.times(R_world_base, normal_in_base)
        limit = SLOW * self.scale.speed(gait.highest(self.scale))
        calm = (gait.firm >= 1.0 and abs(vec3.dot(n, vec3.times(R_world_base, LEFT))) < ROLLING
                and all(self.scale.foot_speed(*velocity) < limit for velocity in velocities))
        touches, rests = contacts(state, rests, legs, self._quarter_weight)
        quiet = self.scale.foot_speed(*velocities[1]) < self.scale.speed(QUIET)
        return terrain.felt(
            place, [vec3.plus(place, vec3.times(R_world_base, foot)) for foot, _ in legs],
            n, swung, touches, self.scale.leg_length, calm,
            all(end.steps == len(LEGS) for end in gait.ends), rests, quiet * dt)

    def _margins(self, R_ground_base: Matrix, feet: list[Triple], swings: list[float],
                 under: Pair, error: Pair) -> tuple[float, ...]:
        """Margins of the capture point with an error of the velocity [m/s]; legs that swing count
        at their footholds.
        """
        places = []
        for foot, foothold, swing in zip(feet, self._footholds, swings, strict=True):
            place = vec3.times(R_ground_base, foothold)
            places.append(vec3.moved(foot, vec3.minus(place, foot), swing))
        return support_margins(
            places, under, error, self.model.height, self.parameters.friction, self._room)

    def _height(self, feet: list[Triple], load: list[float]) -> float:
        """Height of the centre of mass over the ground under the feet that carry [m]."""
        total, heights = sum(load), [z for _, _, z in feet]
        if total <= 1e-6:
            return self.foot_radius - min(heights)
        carried = sum(share * z for share, z in zip(load, heights, strict=True))
        return self.foot_radius - carried / total

    def _bounce(self, gait: GaitInForce, positions: list[float], duty: float, omega: float,
                moving: float) -> Bounce:
        """Planned bounce of the body: what the legs give way to, in the mean."""
        if gait.bounce(positions[0], duty, omega) is LEVEL:  # wherever the legs are
            return LEVEL
        each = [gait.bounce(position, duty, omega) for position in positions]
        share = moving / len(each)
        return Bounce(*(share * sum(values) for values in zip(*each, strict=True)))

    def _sway(self, positions: list[float], duty: float, omega: float, reference: Triple,
              moving: float) -> virtual_model.LateralPlan:
        """Planned sway of the body; it fades with the legs' activity and with speed sideways."""
        sway = virtual_model.lateral_plan(positions, duty, omega, self._across, self.model.height)
        if sway is virtual_model.STRAIGHT:
            return virtual_model.STRAIGHT
        sideways = abs(reference[1]) / self.scale.speed(virtual_model.SIDEWAYS)
        share = moving * max(0.0, 1.0 - sideways)
        return virtual_model.LateralPlan(*(share * value for value in sway))

    def _torque(self, body: BodyMotion, legs: Sequence[tuple[Triple, Matrix]], feet: list[Triple],
                load: list[float], r: Triple, bounce: Bounce, acceleration: Pair) -> Array:
        """Torques τ_fb by which the stance feet make the virtual model's wrench, ndarray (12,)."""
        force, moment = self.model.wrench(self.parameters, body, r, bounce, acceleration)
        forces = distribute(
            force, moment, feet, load, self.parameters.friction,
            LARGEST_LOAD * self.description.mass * GRAVITY, self._importance)
        torques: list[float] = []
        for on_foot, (_, J) in zip(forces, legs, strict=True):
            torques += vec3.transposed_times(
                J, vec3.transposed_times(body.R_ground_base, on_foot))
        return np.array([clamped(-torque, -most, most) for torque, most in zip(
            torques, self._torque_limit, strict=True)])
