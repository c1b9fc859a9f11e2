# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Leg block: the gait's rhythmic primitive or a movement's discrete one, as the mode says.

Discrete primitives bring a leg from wherever its joints are to a configuration.
The joints are the state of the discrete transformation system (eqs. p2p_trans, p2p_phase), which
begins with the angles and velocities at which another primitive left them; so nothing jumps.
The canonical phase x is common to the four legs and comes with the command.

One unit movement 0 → 1 of least jerk is learned once, and so is the path of each movement that has
one. The weights of a movement from θ_0 to θ_g follow by linearity: those of the path from p_0 less
(θ_0 − p_0) times those of the unit movement (for a straight movement p_0 = θ_g; the scaling of
Ijspeert et al. 2013).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.balance.body_command import STANDING, BodyCommand
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.modes.motion_library import BASES, Movements, learned, unit_movement
from dmp_cpg_ros.core.primitives.discrete import DiscreteInput, DiscretePrimitive, DiscreteState
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper, SpringState
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LegTargets
from dmp_cpg_ros.core.robot_model.target_limits import TargetLimits
from dmp_cpg_ros.core.transformation.foot_path import Motion
from dmp_cpg_ros.core.transformation.leg import LegParameters, LegPrimitive, LegState


@dataclass(frozen=True, eq=False)
class MotionState:
    """A movement of one leg under way.

    Attributes
    ----------
    movement : str
        Its name.
    primitive : DiscretePrimitive
        With the weights of this movement.
    duration : float
        τ [s].
    state : DiscreteState
        Of the primitive.
    """

    movement: str
    primitive: DiscretePrimitive
    duration: float
    state: DiscreteState


class LegMotion:
    """Discrete primitives of one leg; state in, state out.

    Parameters
    ----------
    joints : slice
        Which of the twelve joints are the leg's.
    movements : Movements
        The robot's movements.
    transformation : SpringDamper
        The leg's; it brings the joints to rest after a movement.
    """

    def __init__(self, joints: slice, movements: Movements, transformation: SpringDamper) -> None:
        """Keep; a path is learned when it is first needed."""
        self._joints, self._movements, self._transformation = joints, movements, transformation
        self._paths: dict[str, DiscretePrimitive] = {}

    def step(self, motion: MotionState | None, leg: LegState, command: BodyCommand,
             measured: Sequence[float], dt: float
             ) -> tuple[MotionState | None, LegState, Sequence[float], Sequence[float]]:
        """Advance the leg in a mode in which the gait's primitive does not move it.

        Parameters
        ----------
        motion : MotionState or None
            Movement under way at the tick before.
        leg : LegState
            State of the leg at the tick before.
        command : BodyCommand
            Mode of this tick.
        measured : sequence of three floats
            Measured joint angles [rad].
        dt : float
            Time since the last tick [s]; 0 at the leg's first, which begins where its joints are.

        Returns
        -------
        motion : MotionState or None
        leg : LegState
        goal, goal_velocity : sequence of three floats
            [rad], [rad/s]

        Raises
        ------
        DataError
            If there is no such movement.
        """
        joints = leg.joints
        if command.mode == 'damped' or dt <= 0.0:
            joints = SpringState(tuple(measured), (0.0,) * len(measured))
        goal, goal_velocity = joints.position, (0.0,) * len(measured)
        if command.movement:
            motion = self._moved(motion, joints, command, dt)
            goal, goal_velocity = (
                tuple(of.tolist()) for of in (motion.state.position, motion.state.velocity))
            joints = SpringState(goal, goal_velocity)
        else:
            motion = None
            if command.mode != 'damped' and dt > 0.0:
                joints = self._transformation.follow(joints, goal, goal_velocity, dt)
        return motion, LegState(joints, 0.0), goal, goal_velocity

    def _moved(self, motion: MotionState | None, joints: SpringState, command: BodyCommand,
               dt: float) -> MotionState:
        """Begin the command's movement, or advance it to the command's phase."""
        if (motion is None or motion.movement != command.movement
                or command.x > motion.state.x):
            motion = self._begun(joints, command)
        if dt <= 0.0:
            return motion
        held = DiscreteInput(motion.state.goal, motion.duration)
        state = motion.primitive.step(motion.state, held, dt)
        return replace(motion, state=replace(state, x=command.x))

    def _begun(self, joints: SpringState, command: BodyCommand) -> MotionState:
        movement, unit = self._movements.named(command.movement), unit_movement()
        goal, spring = movement.goal[self._joints], unit.transformation
        weights, begin = np.zeros((BASES, len(goal))), goal
        if movement.path is not None:
            path = movement.path[:, self._joints]
            if movement.name not in self._paths:
                self._paths[movement.name] = learned(path)
            weights, begin = self._paths[movement.name].weights, path[0]
        primitive = replace(
            unit, weights=weights - unit.weights * (np.array(joints.position) - begin),
            transformation=replace(
                spring, stiffness=spring.stiffness[0], damping=spring.damping[0]),
            start=np.array(joints.position), goal=goal, start_velocity=0.0)
        state = primitive.initial_state(velocity=np.array(joints.velocity), tau=movement.duration)
        return MotionState(
            command.movement, primitive, movement.duration, replace(state, x=command.x))


class LegControlState(NamedTuple):
    """State of the leg block.

    Attributes
    ----------
    leg : LegState
        Joints, swing activity, foothold offset, stumbling reflex.
    motion : MotionState or None
        Movement under way.
    command : BodyCommand
        What the body did at the last tick.
    targets : LegTargets or None
        What was sent at the last tick.
    """

    leg: LegState
    motion: MotionState | None = None
    command: BodyCommand = STANDING
    targets: LegTargets | None = None


class LegControl:
    """One leg; state in, state out.

    Parameters
    ----------
    leg : str
        ``fl``, ``fr``, ``rl`` or ``rr``.
    description : RobotDescription
        The robot.
    parameters : LegParameters
        Gains and swing.
    movements : Movements
        The robot's movements.
    motion : Motion, optional
        Where the path of the foot comes from; the foot path without.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(self, leg: str, description: RobotDescription, parameters: LegParameters,
                 movements: Movements, motion: Motion | None = None,
                 legs: RobotLegs | None = None) -> None:
        """Build both primitives around one transformation system."""
        self.primitive = LegPrimitive(leg, description, parameters, motion, legs)
        count = len(JOINTS_OF_LEG)
        self.joints = slice(count * self.primitive.place, count * (self.primitive.place + 1))
        self._limits = TargetLimits(description.legs[self.primitive.place], parameters.target_rate)
        self._motion = LegMotion(self.joints, movements, self.primitive.transformation)

    def initial_state(self) -> LegControlState:
        """State of a leg that stands at its foothold."""
        return LegControlState(self.primitive.initial_state())

    def picked_up(self, gait: GaitInForce, x: Array, x_dot: Array, r: Array,
                  feedback: PostureFeedback) -> LegControlState:
        """State of a leg that comes to a robot in motion: where its joints are, its swing as high
        as its pace asks for; arguments as for :meth:`step`.
        """
        return LegControlState(self.primitive.picked_up(
            gait, x[self.primitive.place], x_dot[self.primitive.place], r,
            feedback.measured[self.joints]))

    def step(
        self, state: LegControlState, gait: GaitInForce, x: Array, x_dot: Array, r: Array,
        feedback: PostureFeedback, position: Array, velocity: Array, dt: float,
    ) -> tuple[LegControlState, LegTargets]:
        """Advance the leg by one tick.

        Parameters
        ----------
        state : LegControlState
            After the tick before.
        gait : Gait or BlendedGait
            In force.
        x, x_dot : ndarray (4, 2)
            Canonical states and rates.
        r : ndarray (3,)
            Reference.
        feedback : PostureFeedback
            Of the posture block, with what the body does.
        position, velocity : ndarray (12,)
            Measured joints [rad], [rad/s]; only the torque reading uses them.
        dt : float
            Time since the last tick [s].

        Returns
        -------
        state : LegControlState
        targets : LegTargets
        """
        place, joints, command = self.primitive.place, self.joints, feedback.command
        goal: Sequence[float]
        goal_velocity: Sequence[float]
        if command.balanced:
            motion, told = None, feedback.of_leg(place)
            if not feedback.felt[place]:  # its foot is where it was told to be
                told = told._replace(joint_position=(
                    *state.leg.sent[1:], state.leg.joints.position)[0])
            leg, goal, goal_velocity = self.primitive.step(
                state.leg, gait, x[place], x_dot[place], r, told, dt)
        else:
            motion, leg, goal, goal_velocity = self._motion.step(
                state.motion, state.leg, command, feedback.measured[joints], dt)
        measured = None
        if self.primitive.parameters.reading == 'torque':
            measured = SpringState(*(tuple(of[joints].tolist()) for of in (position, velocity)))
        targets = self.primitive.targets(
            leg, goal, goal_velocity, feedback.torque[joints], measured)
        # Targets that are what was measured follow the joints wherever those are.
        last = state.targets if measured is None and command.mode != 'damped' else None
        targets = self._limits.limited(targets, last, dt)
        return LegControlState(leg, motion, command, targets), targets
