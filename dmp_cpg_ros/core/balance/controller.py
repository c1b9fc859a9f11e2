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
from math import pi
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.balance import unfelt, virtual_model
from dmp_cpg_ros.core.balance.body_command import STANDING, BodyCommand
from dmp_cpg_ros.core.balance.capture_point import support_margins
from dmp_cpg_ros.core.balance.corrections import MassOffset, VelocityCorrection
from dmp_cpg_ros.core.balance.feedback import FELT, PostureFeedback
from dmp_cpg_ros.core.balance.footholds import FootPlacement
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
from dmp_cpg_ros.core.balance.virtual_model import BodyMotion, VirtualModel
from dmp_cpg_ros.core.canonical.phase import scalar_phase, scalar_phase_rates
from dmp_cpg_ros.core.gait.com_height import LEVEL, Bounce
from dmp_cpg_ros.core.gait.contact_feedback import believed, quarter_weight
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.maths import Array, vec3
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import Matrix, Pair, Triple
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.ground_frame import ground_from_base, lean, turned_back
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.core.transformation.foot_path import activities_step, resting
from dmp_cpg_ros.core.transformation.lanes import Lanes
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold

__all__ = ['PostureController', 'PostureFeedback', 'PostureParameters', 'PostureState']

LARGEST_LOAD = 2.0
"""Largest normal force of a fully loaded foot, in weights of the robot."""

LEVEL_WITH_GROUND: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Rotation from the base to the frame of the ground as planned."""


class PostureState(NamedTuple):
    """The controller's own state.

    Attributes
    ----------
    activity : tuple of four floats
        Swing activity of the legs.
    integral : VelocityCorrection
        State of the slow loop of velocity and heading.
    plan : MotionPlan
        What the reference has the body do.
    offset : MassOffset
        Where the centre of mass is found to be.
    terrain : Terrain
        What the feet have felt of the ground.
    back : unfelt.ComingBack
        Whether what is felt again is late.
    """

    activity: tuple[float, ...]
    integral: VelocityCorrection = VelocityCorrection()
    plan: MotionPlan = MotionPlan()
    offset: MassOffset = MassOffset()
    terrain: Terrain = NOTHING_FELT
    back: unfelt.ComingBack = unfelt.SOUND


class Stride(NamedTuple):
    """What the gait has the legs do in a tick.

    Attributes
    ----------
    reference : tuple of float
        v_x, v_y [m/s], γ [rad/s].
    omega, own_omegas, duty : float, sequence of four floats, float
        Rates of the cycle and of those of the legs [rad/s], and share of stance.
    positions : list of four floats
        In the cycle when the targets act, 0 at mid-swing, ±1/2 at mid-stance.
    activity, moving : tuple of four floats, float
        Swing activity of the legs, and its mean.
    load : list of four floats
        What the feet carry, in shares.
    """

    reference: Triple
    omega: float
    own_omegas: Sequence[float]
    duty: float
    positions: list[float]
    activity: tuple[float, ...]
    moving: float
    load: list[float]


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
        self.lanes = Lanes(description)
        self._nominal = [vec3.triple(foot) for foot in footholds.tolist()]
        self._footholds = [
            vec3.triple(foot) for foot in (footholds - description.com_in_base).tolist()]
        self._room = self.placement.room(parameters.reach)
        self.foot_radius = float(np.mean([leg.foot_radius for leg in description.legs]))
        self._quarter_weight = quarter_weight(description)
        self._com_in_base = vec3.triple(description.com_in_base.tolist())
        self._torque_limit = [float(most) for leg in description.legs for most in leg.torque_limit]
        # moments count as the accelerations that they cause at the length of a leg
        importance = description.mass * self.scale.leg_length / description.base_inertia.diagonal()
        self._importance = vec3.triple(importance.tolist())

    def initial_state(self) -> PostureState:
        """State of a robot that stands."""
        return PostureState((0.0,) * len(self.kinematics))

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
        stride = self._stride(memory.activity, gait, x, x_dot, r, dt)
        R_world_base = vec3.rotation(state.base_quaternion.tolist())
        normal, share = state.ground_normal_in_world, memory.terrain.followed
        R_ground_base, upward = ground_from_base(R_world_base, normal, p.slope_following * share)
        back = memory.back
        if back.lost or state.felt_legs is not None:
            back, state = back.felt(state, unfelt.PlannedFeet(
                self.kinematics, self._nominal, stride.reference, stride.own_omegas, stride.duty,
                stride.positions), stride.moving, leg_length, dt)
            if state.feels_nothing:
                R_ground_base = LEVEL_WITH_GROUND
        velocity = vec3.times(R_ground_base, vec3.triple(state.base_velocity_in_base.tolist()))
        rate = vec3.times(R_ground_base, vec3.triple(state.base_rate_in_base.tolist()))
        plan, integral, offset = self._slow_loops(
            memory, stride, gait, R_ground_base, state.base_quaternion, velocity, dt)
        correction = integral.acting(p, leg_length, stride.moving)
        planned = vec3.plus(stride.reference, correction)
        across = self.placement.across(
            p.friction, self.model.height, 1.0 - stride.moving * (1.0 - gait.wide))
        sway = self._sway(stride, across)
        measured = (velocity[0], velocity[1] - sway.velocity, rate[2])
        under = lean(upward, self.model.height)
        beside = self._beside(under, plan, offset)
        angles = state.joint_position.tolist()
        legs = self.legs.at(angles)
        com = vec3.plus(self._com_in_base, (*offset.place, 0.0))
        feet = [vec3.times(R_ground_base, vec3.minus(foot, com)) for foot, _ in legs]
        body = BodyMotion(R_ground_base, upward, velocity, rate,
                          self.foot_radius - virtual_model.ground_height(feet, stride.load))
        acceleration = plan.acceleration[0], plan.acceleration[1] + sway.acceleration
        lasting = integral.lasting(p, leg_length, plan)
        error = (measured[0] - (planned[0] - lasting[0]), measured[1] - (planned[1] - lasting[1]))
        forces = believed(state.foot_force)
        terrain, level = self._ground(memory, state, forces, R_world_base, R_ground_base[2], legs,
                                      stride, gait, measured, dt)
        memory = PostureState(stride.activity, integral, plan, offset, terrain, back)
        return memory, PostureFeedback(
            self._torque(body, legs, feet, stride, planned, self._bounce(gait, stride),
                         acceleration, terrain.empty),
            self._shift(stride, gait, plan.expected, measured, planned, turned_back(
                beside, under, R_ground_base[2], self.model.height, terrain.rough),
                across, R_ground_base, level if terrain.barred else LEVEL_FEET),
            self.placement.drift(
                self.placement.yielding(p, stride.reference[0], gait.firm, plan.acceleration),
                measured, planned, stride.activity, sway.velocity),
            correction, command, angles, forces,
            self._margins(R_ground_base, feet, stride, under, error),
            Progress((measured[0], measured[1]), feet_behind(
                plan.expected, beside, feet, self._footholds, stride.positions, stride.duty,
                stride.omega), terrain.rough, terrain.gaps, float(terrain.high >= 0)),
            state.felt_legs or FELT, level)

    def _stride(self, activity: tuple[float, ...], gait: GaitInForce, x: Array, x_dot: Array,
                r: Array, dt: float) -> Stride:
        """What the gait has the legs do, from their activity one tick before."""
        p = self.parameters
        reference, omega, own_omegas, duty = gait.pace(r, self.scale)
        rates = [rate + gait.rest_rate for rate in scalar_phase_rates(x, x_dot)]
        activity = activities_step(activity, rates, own_omegas, p.activity_rate, dt)
        positions = [gait.scalar_cycle_position(scalar_phase(x_1, x_2) + p.target_lead * rates[i])
                     for i, (x_1, x_2) in enumerate(x.tolist())]
        load = virtual_model.contact_weights(positions, duty, activity, p.load_transfer)
        return Stride(reference, omega, own_omegas, duty, positions, activity,
                      sum(activity) / len(activity), load)

    def _slow_loops(self, memory: PostureState, stride: Stride, gait: GaitInForce,
                    R_ground_base: Matrix, quaternion: Array, velocity: Triple, dt: float
                    ) -> tuple[MotionPlan, VelocityCorrection, MassOffset]:
        """Plan of the body's motion, and what is learned of its errors."""
        p, leg_length, moving = self.parameters, self.scale.leg_length, stride.moving
        plan = memory.plan.followed(stride.reference, moving, self.model.push_rate(p),
                                    p.friction * GRAVITY, dt)
        integral = memory.integral.integrated(
            p, leg_length, moving, quaternion.tolist(), velocity, plan, stride.reference[2], dt,
            gait.room(stride.reference, self.scale))
        return plan, integral, memory.offset.found(p, leg_length, moving, R_ground_base, dt)

    def _beside(self, under: Pair, plan: MotionPlan, offset: MassOffset) -> Pair:
        """How far from their footholds a slope, a curve and an offset have the feet [m]."""
        (lean_x, lean_y), (aside_x, aside_y) = under, offset.place
        slope_lean, outside = self.parameters.slope_lean, -self.model.height / GRAVITY
        return (slope_lean * lean_x + outside * plan.curve[0] + aside_x,
                slope_lean * lean_y + outside * plan.curve[1] + aside_y)

    def _shift(self, stride: Stride, gait: GaitInForce, expected: Pair, measured: Triple,
               planned: Triple, beside: Pair, across: Sequence[float], R_ground_base: Matrix,
               level: Sequence[float]) -> list[Triple]:
        """Shift of the footholds of swinging feet, to their levels [m]."""
        p, (beside_x, beside_y) = self.parameters, beside
        caught = self.placement.caught(measured, planned, gait.apart)
        lanes = self.lanes.aside(
            gait, (*expected, stride.reference[2]), stride.omega, stride.duty)
        wanted = self.placement.shift(
            p, caught, planned, pi * stride.duty / stride.omega, across)
        shift = [(x + beside_x, y + (beside_y + lanes[i])) for i, (x, y) in enumerate(wanted)]
        raised = self.placement.raised(p, shift, R_ground_base)
        return [(x, y, raised[i] + level[i]) for i, (x, y) in enumerate(shift)]

    def _ground(self, memory: PostureState, state: RobotState, forces: Sequence[float],
                R_world_base: Matrix, normal_in_base: Triple,
                legs: Sequence[tuple[Triple, Matrix]], stride: Stride, gait: GaitInForce,
                measured: Triple, dt: float) -> tuple[Terrain, tuple[float, ...]]:
        """Memory of the ground, and heights of feet over the plane that the body follows [m]."""
        if not self.parameters.climbing:
            return NOTHING_FELT, LEVEL_FEET
        (_, left_x, _), (_, left_y, _), (_, left_z, _) = R_world_base
        place, scale = vec3.triple(state.base_position_in_world.tolist()), self.scale
        n, left = vec3.times(R_world_base, normal_in_base), (left_x, left_y, left_z)
        speed, limit = scale.foot_speed(*measured), SLOW * scale.speed(gait.highest(scale))
        calm = (gait.firm >= 1.0 and abs(vec3.dot(n, left)) < ROLLING
                and speed < limit and scale.foot_speed(*stride.reference) < limit)
        swung = [position / (1.0 - stride.duty) + 0.5 for position in stride.positions]
        touches, rests = contacts(
            state, forces, [*map(resting, stride.activity, memory.activity)], legs,
            self._quarter_weight)
        quiet = speed < scale.speed(QUIET)
        return memory.terrain.felt(
            place, [vec3.plus(place, vec3.times(R_world_base, foot)) for foot, _ in legs],
            n, swung, touches, self.scale.leg_length, calm,
            all([end.steps == len(LEGS) for end in gait.ends]), rests, quiet * dt, dt)

    def _margins(self, R_ground_base: Matrix, feet: list[Triple], stride: Stride,
                 under: Pair, error: Pair) -> tuple[float, ...]:
        """Margins of the capture point for an error of the velocity [m/s]; swings at footholds."""
        places, slope_lean = [], self.parameters.slope_lean
        aside_x, aside_y = slope_lean * under[0], slope_lean * under[1]
        for i, (foot_x, foot_y, _) in enumerate(feet):
            x, y, _ = vec3.times(R_ground_base, self._footholds[i])
            share = stride.activity[i]
            places.append((foot_x + (x + aside_x - foot_x) * share,
                           foot_y + (y + aside_y - foot_y) * share))
        return support_margins(
            places, under, error, self.model.height, self.parameters.friction, self._room)

    def _bounce(self, gait: GaitInForce, stride: Stride) -> Bounce:
        """Planned bounce of the body: what the legs give way to, in the mean."""
        duty, omega = stride.duty, stride.omega
        if gait.bounce(stride.positions[0], duty, omega) is LEVEL:  # wherever the legs are
            return LEVEL
        each = [gait.bounce(position, duty, omega) for position in stride.positions]
        share = stride.moving / len(each)
        return Bounce(*(share * sum(values) for values in zip(*each, strict=True)))

    def _sway(self, stride: Stride, across: Sequence[float]) -> virtual_model.LateralPlan:
        """Planned sway of the body; it fades with the legs' activity and with speed sideways."""
        sway = virtual_model.lateral_plan(
            stride.positions, stride.duty, stride.omega, across, self.model.height)
        if sway is virtual_model.STRAIGHT:
            return virtual_model.STRAIGHT
        sideways = abs(stride.reference[1]) / self.scale.speed(virtual_model.SIDEWAYS)
        share = stride.moving * max(0.0, 1.0 - sideways)
        return virtual_model.LateralPlan(
            share * sway.place, share * sway.velocity, share * sway.acceleration)

    def _torque(self, body: BodyMotion, legs: Sequence[tuple[Triple, Matrix]], feet: list[Triple],
                stride: Stride, r: Triple, bounce: Bounce, acceleration: Pair,
                empty: Sequence[bool]) -> list[float]:
        """Torques τ_fb (12) by which the stance feet make the virtual model's wrench."""
        force, moment = self.model.wrench(self.parameters, body, r, bounce, acceleration)
        forces = unfelt.borne_by_others(
            force, moment, feet, stride.load, empty, self.parameters.friction,
            LARGEST_LOAD * self.description.mass * GRAVITY, self._importance)
        torques = [torque for i, (_, J) in enumerate(legs) for torque in vec3.transposed_times(
            J, vec3.transposed_times(body.R_ground_base, forces[i]))]
        return [-most if torque > most else most if torque < -most else -torque
                for torque, most in zip(torques, self._torque_limit, strict=True)]
