# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One leg's rhythmic primitive: oscillator state and reference in, joint targets out.

The goals g_θ(x_i, r), g_θ̇(x_i, r) are the foot path through the leg's inverse kinematics and
Jacobian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.core.canonical.phase import scalar_phase, scalar_phase_rate
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.contact_feedback import LOADED, quarter_weight
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.vec3 import Pair, Triple, damped_solution, minus, moved, plus, triple
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper, SpringState
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics, RobotLegs
from dmp_cpg_ros.core.robot_model.state import LEGS, LegTargets
from dmp_cpg_ros.core.transformation import stumble as reflex
from dmp_cpg_ros.core.transformation.foot_path import (
    FootMotion,
    FootPath,
    HermiteMotion,
    Motion,
    activity_step,
    resting,
    rolling_share,
    swing_height,
)
from dmp_cpg_ros.core.transformation.foothold_offset import OffsetRates


@dataclass(frozen=True)
class LegParameters(Parameters):
    """Parameters of a leg's transformation systems."""

    stiffness: float = parameter(
        6400.0, 'stiffness k of the transformation system', 1.0, 1e6, unit='1/s^2')
    damping: float = parameter(
        160.0, 'damping b of the transformation system', 0.1, 1e4, unit='1/s')
    reading: str = parameter(
        'kinematic', 'whether the joint follows the primitive or receives its torque',
        choices=('kinematic', 'torque'))
    clearance: float = parameter(
        0.2, 'height of the swing as a fraction of the standing height', 0.0, 0.6)
    motion: str = parameter(
        '', 'file of a learned motion of the feet, scaled to the clearance; empty: the foot path')
    activity_rate: float = parameter(
        12.0, 'rate at which the swing height follows the phase speed', 0.1, 1e3, unit='1/s')
    placement_rate: float = parameter(
        40.0, 'rate at which a swinging foot follows its placement shift', 0.1, 1e3, unit='1/s')
    yielding_rate: float = parameter(
        20.0, 'rate at which the target of a standing foot approaches the measured foot position',
        0.0, 1e3, unit='1/s')
    levelling_rate: float = parameter(
        10.0, 'rate at which a standing foot returns the height that compensated the tilt',
        0.1, 1e3, unit='1/s')
    stumble_lift: float = parameter(
        0.13, 'additional height of a swinging foot that meets an obstacle, as a fraction of the '
        'standing height; 0: no reflex', 0.0, 0.4)
    stumble_lag: float = parameter(
        0.035, 'distance from its target at which a swinging foot at rest has met an obstacle, as '
        'a fraction of the standing height', 0.005, 1.0)
    target_rate: float = parameter(
        2.0, 'largest speed at which the target of a joint changes, over the speed limit of the '
        'joint', 0.1, 100.0)
    target_lead: float = parameter(
        0.0, 'time after its tick at which a target acts, for which it is computed', 0.0, 0.06,
        unit='s')


class LegState(NamedTuple):
    """State of one leg's primitive.

    Attributes
    ----------
    joints : SpringState
        θ, θ̇ of the kinematic reading, three each.
    activity : float
        Swing activity a in [0, 1].
    shift_in_base : tuple of float
        Shift of the foot's path that acts now [m].
    stumble : Stumble
        What the stumbling reflex does.
    motion : object
        Of the foot's motion.
    sent : tuple of tuples of three floats
        Angles that were sent, from those that act now on [rad].
    """

    joints: SpringState
    activity: float
    shift_in_base: Triple = (0.0, 0.0, 0.0)
    stumble: reflex.Stumble = reflex.Stumble()
    motion: Any = None
    sent: tuple[tuple[float, ...], ...] = ()


class LegFeedback(NamedTuple):
    """The part of the body's feedback that one leg's path takes.

    Attributes
    ----------
    joint_position : sequence of 3 floats
        Measured angles [rad].
    shift_in_base : tuple of 3 floats
        Wanted foot placement shift, for a swinging foot [m].
    drift_in_base : pair of floats
        Added to the velocity of a standing foot [m/s].
    correction : tuple of 3 floats
        Added to the reference for the stance velocity, not the cadence [m/s], [m/s], [rad/s].
    foot_force : float
        Measured normal force of the foot [N]; 0 without a contact sensor.
    level : float
        How far over the plane that the body follows the foot is to stand [m].
    rough : float
        Height of what the feet are to be lifted over [m]; 0 on even ground.
    """

    joint_position: Sequence[float]
    shift_in_base: Triple
    drift_in_base: Pair
    correction: Triple
    foot_force: float = 0.0
    level: float = 0.0
    rough: float = 0.0


class LegPrimitive:
    """Transformation systems of one leg.

    Parameters
    ----------
    leg : str
        ``fl``, ``fr``, ``rl`` or ``rr``.
    description : RobotDescription
        The robot.
    parameters : LegParameters
        Gains and swing.
    motion : Motion, optional
        Where the path of the foot comes from; the
        :class:`~dmp_cpg_ros.core.transformation.foot_path.FootPath` itself without.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(self, leg: str, description: RobotDescription, parameters: LegParameters,
                 motion: Motion | None = None, legs: RobotLegs | None = None) -> None:
        """Derive foothold and scale from the description."""
        self.motion: FootMotion = (
            HermiteMotion() if motion is None else motion.of_leg(leg, description))
        self.parameters, self.place = parameters, LEGS.index(leg)
        geometry = description.legs[self.place]
        self._legs = legs or RobotLegs(description)
        self.kinematics = self._legs.kinematics[self.place]
        self.scale = body_scale(description)
        self.foothold_in_base = nominal_foothold(description, leg)
        self._foothold = triple(self.foothold_in_base.tolist())
        self.rolling = rolling_share(self.kinematics, self.foothold_in_base)
        self.offset_rates = OffsetRates(
            parameters.placement_rate, parameters.yielding_rate, parameters.levelling_rate)
        self.clearance = parameters.clearance * description.stance_height
        self.stumble_lift = parameters.stumble_lift * description.stance_height
        self.stumble_lag = parameters.stumble_lag * description.stance_height
        self.touch_force = LOADED * quarter_weight(description)
        self._inertia = [float(J) for J in geometry.rotor_inertia]
        self.transformation = SpringDamper(
            np.full(3, parameters.stiffness), np.full(3, parameters.damping))

    def initial_state(self) -> LegState:
        """State of a leg that stands at its foothold."""
        return LegState(SpringState(self.kinematics.angles(self._foothold), (0.0,) * 3), 0.0)

    def picked_up(self, gait: GaitInForce, x: Array, x_dot: Array, r: Array,
                  measured: Sequence[float]) -> LegState:
        """State in the middle of a motion, from what is on the topics: the leg's oscillator (2,),
        the reference (3,) and the three measured angles.
        """
        omega = gait.pace(r, self.scale)[2][self.place]
        rate = scalar_phase_rate(*x.tolist(), *x_dot.tolist()) + gait.rest_rate
        activity = activity_step(0.0, rate, omega, self.parameters.activity_rate, 10.0)
        return LegState(SpringState(tuple(measured), (0.0,) * 3), activity)

    def step(self, state: LegState, gait: GaitInForce, x: Array, x_dot: Array, r: Array,
             feedback: LegFeedback, dt: float) -> tuple[LegState, Triple, Triple]:
        """Advance the leg to ``target_lead`` after the time at which the inputs hold.

        Parameters
        ----------
        state : LegState
            State one tick before.
        gait : Gait or BlendedGait
            In force.
        x, x_dot : ndarray (2,)
            The leg's oscillator state and its derivative [1/s].
        r : ndarray (3,)
            Reference v_x, v_y [m/s], γ [rad/s].
        feedback : LegFeedback
            What the body's feedback asks of this leg.
        dt : float
            Time since the last tick [s].

        Returns
        -------
        state : LegState
        goal, goal_velocity : tuple of float
            g_θ [rad] and g_θ̇ [rad/s].
        """
        p = self.parameters
        reference, _, own_omegas, duty = gait.pace(r, self.scale)
        omega = own_omegas[self.place]
        (x_1, x_2), (x_1_dot, x_2_dot) = x.tolist(), x_dot.tolist()
        rate = scalar_phase_rate(x_1, x_2, x_1_dot, x_2_dot) + gait.rest_rate
        phi, lead = scalar_phase(x_1, x_2), p.target_lead
        position = acts = gait.scalar_cycle_position(phi)
        sent: tuple[tuple[float, ...], ...] = (state.joints.position,)
        if lead:
            position = gait.scalar_cycle_position(phi + lead * rate)
            ahead = round(lead / dt) if dt > 0.0 else 0
            sent = (*state.sent, *sent)[-1 - ahead:]
        activity = activity_step(state.activity, rate, omega, p.activity_rate, dt)
        path = self.path(reference, omega, duty, activity, state.stumble, feedback)
        motion, foot, path_velocity = self.motion.step(state.motion, path, position, rate, dt)
        offset_rate, stumble = self._offset_rate(
            state, activity, path, (acts, position), sent[0], path_velocity, feedback, dt)
        offset = moved(state.shift_in_base, offset_rate, dt)
        bounce = gait.bounce(position, duty, omega)
        p_x, p_y, p_z = plus(foot, offset)
        v_x, v_y, v_z = plus(offset_rate, path_velocity)
        goal = self.kinematics.angles(
            (p_x, p_y, p_z + (stumble.height - activity * bounce.height)))
        goal_velocity = damped_solution(self.kinematics.jacobian(goal), (
            v_x, v_y, v_z + stumble.rate - activity * bounce.velocity * (rate / omega)))
        joints = self.transformation.follow(state.joints, goal, goal_velocity, dt)
        return LegState(joints, activity, offset, stumble, motion, sent), goal, goal_velocity

    def path(self, reference: Triple, omega: float, duty: float, activity: float,
             stumble: reflex.Stumble, feedback: LegFeedback) -> FootPath:
        """Path of the foot for the corrected reference, higher over what was felt."""
        v_x, v_y, gamma = plus(reference, feedback.correction)
        clearance = reflex.swing_clearance(
            self.clearance, self.stumble_lift, stumble, feedback.rough, self.scale.leg_length)
        return FootPath(
            self._foothold, v_x, v_y, gamma, omega, duty, activity * clearance, self.rolling)

    def _offset_rate(self, state: LegState, activity: float, path: FootPath, positions: Pair,
                     acting: Sequence[float], path_velocity: Triple, feedback: LegFeedback,
                     dt: float) -> tuple[Triple, reflex.Stumble]:
        """Rate of the foothold offset [m/s]: placement and stumbling reflex in swing, following
        the ground in stance. The foot is where the targets that act now and the first of the
        positions in the cycle have it; its offset is for the second.
        """
        if dt <= 0.0:
            return (0.0, 0.0, 0.0), state.stumble
        edge, (now, then) = 0.5 * (1.0 - path.duty), positions
        stands, will_stand = abs(now) >= edge, abs(then) >= edge or (
            feedback.level != 0.0 and resting(activity, state.activity))
        measured = self._legs.foot(self.place, feedback.joint_position)
        target = self.kinematics.foot(acting)
        away, offset = minus(measured, target), state.shift_in_base
        lift, progress = reflex.lift_left(
            self.stumble_lift, path, feedback.rough, self.scale.leg_length), None
        if lift and not stands:
            progress = reflex.swing_progress(path, path.swung(now), measured, target,
                                             feedback.foot_force > self.touch_force)
        stumble = reflex.stumble_step(
            state.stumble, progress, lift if stands else activity * lift, self.stumble_lag,
            dt, feedback.rough > 0.0)
        if will_stand:
            slipped = away[:2] if stands else (0.0, 0.0)
            return self.offset_rates.in_stance(offset, feedback.drift_in_base, slipped, activity,
                                               dt, feedback.level), stumble
        height, _ = swing_height(path.swung(then))
        rate = self.offset_rates.in_swing(offset, feedback.shift_in_base, height, activity, dt)
        return reflex.compliant_offset_rate(stumble, rate, path_velocity, away), stumble

    def targets(self, state: LegState, goal: Sequence[float], goal_velocity: Sequence[float],
                feedback: Sequence[float], measured: SpringState | None = None) -> LegTargets:
        """Joint targets of the parameters' reading.

        Parameters
        ----------
        state : LegState
            State after :meth:`step`.
        goal, goal_velocity : sequence of three floats
            Goals from :meth:`step`.
        feedback : sequence of three floats
            τ_fb [N m].
        measured : SpringState, optional
            Measured angles and velocities, needed for the torque reading.

        Returns
        -------
        LegTargets
        """
        joints, p = state.joints if measured is None else measured, self.parameters
        y, y_dot, stiffness, damping = joints.position, joints.velocity, p.stiffness, p.damping
        effort = [J * (stiffness * (goal[i] - y[i]) - damping * (y_dot[i] - goal_velocity[i]))
                  + feedback[i] for i, J in enumerate(self._inertia)]
        return LegTargets(y, y_dot, effort)


def body_scale(description: RobotDescription) -> BodyScale:
    """Lengths that make the robot's speeds dimensionless."""
    foothold = nominal_foothold(description, LEGS[0])
    geometry, inertia = description.legs[0], description.base_inertia.diagonal()
    hip_height = description.stance_height + float(geometry.hip_in_base[2])
    kinematics = LegKinematics(geometry)
    straight, depth = (kinematics.thigh_length + kinematics.shank_length,
                       hip_height - geometry.foot_radius)
    x, y = (abs(float(place)) for place in foothold[:2])
    swing = min((float(leg.torque_limit[1]) * hip_height / leg.swing_inertia
                 for leg in description.legs if leg.swing_inertia > 0.0), default=inf)
    return BodyScale(
        hip_height, float(np.hypot(foothold[0], foothold[1])),
        float(np.sqrt(max(straight * straight - depth * depth, 0.0))), y,
        float(inertia[0] / inertia[1]) * y / x, swing)


def nominal_foothold(description: RobotDescription, leg: str) -> Array:
    """Foot centre at mid-stance: under the hip, shifted so that the feet are around the centre
    of mass.

    Returns
    -------
    ndarray (3,)
        In ``base_link`` [m].
    """
    geometry = description.legs[LEGS.index(leg)]
    kinematics = LegKinematics(geometry)
    x = geometry.hip_in_base[0] + geometry.hip_offset[0] + description.com_in_base[0]
    y = geometry.hip_in_base[1] + kinematics.lateral_offset
    return np.array((x, y, geometry.foot_radius - description.stance_height))
