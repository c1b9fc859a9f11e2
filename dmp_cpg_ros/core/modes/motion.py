# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motion player: a leg's discrete primitives, from wherever its joints are to a configuration.

The joints are the state of the discrete transformation system (eqs. p2p_trans, p2p_phase), which
begins with the angles and velocities at which another primitive left them; so nothing jumps.
The canonical phase x is common to the four legs and comes with the command.

One unit movement 0 → 1 of least jerk is learned once, and so is the path of each movement that has
one. The weights of a movement from θ_0 to θ_g follow by linearity: those of the path from p_0 less
(θ_0 − p_0) times those of the unit movement (for a straight movement p_0 = θ_g; the scaling of
Ijspeert et al. 2013).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.body_command import BodyCommand
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.modes.motion_library import Movement, Movements
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, minimum_jerk
from dmp_cpg_ros.core.primitives.discrete import DiscreteInput, DiscretePrimitive, DiscreteState
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper, SpringState
from dmp_cpg_ros.core.transformation.leg import LegState

Array = NDArray[np.float64]

BASES = 15
"""Number of basis functions; the unit movement is met within 2e-4 of its length."""


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

    def __init__(
        self, joints: slice, movements: Movements, transformation: SpringDamper
    ) -> None:
        """Learn the paths."""
        self._joints, self._movements = joints, movements
        self._transformation = transformation
        self._paths: dict[str, DiscretePrimitive] = {}

    def step(
        self,
        motion: MotionState | None,
        leg: LegState,
        command: BodyCommand,
        measured: Array,
        dt: float,
    ) -> tuple[MotionState | None, LegState, Array, Array]:
        """Advance the leg in a mode in which the gait's primitive does not move it.

        Parameters
        ----------
        motion : MotionState or None
            Movement under way at the tick before.
        leg : LegState
            State of the leg at the tick before.
        command : BodyCommand
            Mode of this tick.
        measured : ndarray (3,)
            Measured joint angles [rad].
        dt : float
            Time since the last tick [s]; 0 at the leg's first, which begins where its joints are.

        Returns
        -------
        motion : MotionState or None
        leg : LegState
        goal, goal_velocity : ndarray (3,)
            [rad], [rad/s]

        Raises
        ------
        DataError
            If there is no such movement.
        """
        joints = leg.joints
        if command.mode == 'damped' or dt <= 0.0:
            joints = SpringState(measured.copy(), np.zeros(len(measured)))
        goal, goal_velocity = joints.position, np.zeros(len(measured))
        if command.movement:
            motion = self._moved(motion, joints, command, dt)
            goal, goal_velocity = motion.state.position, motion.state.velocity
            joints = SpringState(goal, goal_velocity)
        else:
            motion = None
            if command.mode != 'damped' and dt > 0.0:
                joints = self._transformation.follow(joints, goal, goal_velocity, dt)
        return motion, LegState(joints, 0.0, np.zeros(3)), goal, goal_velocity

    def _moved(
        self, motion: MotionState | None, joints: SpringState, command: BodyCommand,
        dt: float,
    ) -> MotionState:
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
        goal = movement.goal[self._joints]
        weights, begin = np.zeros((BASES, len(goal))), goal
        if movement.path is not None:
            path = self._path(movement)
            weights, begin = path.weights, movement.path[0, self._joints]
        primitive = replace(
            unit,
            weights=weights - unit.weights * (joints.position - begin),
            transformation=replace(unit.transformation, stiffness=unit.transformation.stiffness[0],
                                   damping=unit.transformation.damping[0]),
            start=joints.position,
            goal=goal,
            start_velocity=0.0,
        )
        state = primitive.initial_state(velocity=joints.velocity, tau=movement.duration)
        return MotionState(
            command.movement, primitive, movement.duration, replace(state, x=command.x)
        )

    def _path(self, movement: Movement) -> DiscretePrimitive:
        """Primitive of a movement's path, learned when it is first needed."""
        if movement.name not in self._paths:
            assert movement.path is not None
            self._paths[movement.name] = _learned(movement.path[:, self._joints])
        return self._paths[movement.name]


@cache
def unit_movement() -> DiscretePrimitive:
    """Movement 0 → 1 in a unit of time with least jerk."""
    return _learned(minimum_jerk(np.linspace(0.0, 1.0, 101))[:, None])


def phase_at(share: float) -> float:
    """Phase x of the canonical system when a share of a movement's duration has passed."""
    return float(np.exp(-unit_movement().phase_decay * share))


def _learned(path: Array) -> DiscretePrimitive:
    return learn_discrete(Demonstration(np.linspace(0.0, 1.0, len(path)), path), BASES)
