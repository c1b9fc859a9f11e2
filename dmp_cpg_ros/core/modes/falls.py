# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Support state of the body and fall detection, from orientation, joints and foot forces alone.

A robot has fallen when it is tilted, low, or carries nothing on its feet, for too long.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, inf

import numpy as np

from dmp_cpg_ros.core.clock import carried
from dmp_cpg_ros.core.maths import Array, clamped
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.maths.vec3 import dot, upward
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.state import RobotState

FALLEN_HEIGHT_SHARE, FALLEN_TILT = 0.5, np.deg2rad(60.0)
"""Share of the standing height below which, and tilt [rad] beyond which, whoever looks on from
outside says that the robot has fallen; the suite itself goes by its parameters.
"""

CERTAIN_SUPPORT = 0.5
"""Share of the weight on the contact sensors from which the joint torques need not be asked."""


@made_often
@dataclass(frozen=True, eq=False)
class BodyCondition:
    """Support state of the body at one tick.

    Attributes
    ----------
    down_in_base : ndarray (3,)
        Direction of gravity seen in ``base_link``; (0, 0, −1) when level.
    tilt : float
        Angle between the base's z and the vertical [rad].
    height : float
        Height of ``base_link`` over the sole of the lowest foot [m].
    support : float
        Share of the weight that the feet carry, by the contact sensors, or by the joint torques
        where these say more and the sensors little.
    """

    down_in_base: Array
    tilt: float
    height: float
    support: float


class BodySense:
    """Support state of one robot from its measured states, and the torques that carry its weight.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    legs : RobotLegs, optional
        Its legs, where others ask them too.
    """

    def __init__(self, description: RobotDescription, legs: RobotLegs | None = None) -> None:
        """Prepare the legs."""
        self._legs = legs or RobotLegs(description)
        self._radius = [leg.foot_radius for leg in description.legs]
        self._com_in_base = description.com_in_base
        self._weight = description.mass * GRAVITY
        self._limit = np.concatenate([leg.torque_limit for leg in description.legs])

    def condition(self, state: RobotState) -> BodyCondition:
        """Condition in a measured state."""
        x, y, z = upward(state.base_quaternion.tolist())
        towards, height = (-x, -y, -z), -inf
        legs, down = self._legs.at(state.joint_position.tolist()), np.array(towards)
        for (foot, _), radius in zip(legs, self._radius, strict=True):
            height = max(height, dot(towards, foot) + radius)
        support = sum(state.foot_force.tolist()) / self._weight
        if support < CERTAIN_SUPPORT:
            support = max(support, self._pressed(state, down))
        return BodyCondition(down, acos(clamped(-towards[2], -1.0, 1.0)), height, support)

    def _pressed(self, state: RobotState, down: Array) -> float:
        """Share of the weight that the joint torques press onto the ground.

        Forces are those of statics, f = −J⁻ᵀ τ at each foot, damped near singular postures.
        """
        J = self._jacobians(state)
        tau = state.joint_effort.reshape(4, 3, 1)
        damped = J @ J.transpose(0, 2, 1) + 1e-4 * np.eye(3)
        forces = -np.linalg.solve(damped, J @ tau)[:, :, 0]
        return float(np.maximum(-(forces @ down), 0.0).sum()) / self._weight

    def carrying_torque(self, state: RobotState, share: float) -> Array:
        """Joint torques (12,) with which the feet carry a share of the weight [N m].

        Vertical forces of least norm without a moment about the centre of mass, none of them
        pulling.
        """
        if share <= 0.0:
            return np.zeros(12)
        up = np.array(upward(state.base_quaternion.tolist()))
        feet = np.array([foot for foot, _ in self._legs.at(state.joint_position.tolist())])
        arms = feet - self._com_in_base
        arms -= np.outer(arms @ up, up)
        balance = np.concatenate((np.ones((1, 4)), arms.T))
        normal = balance @ balance.T + 1e-9 * np.eye(4)
        wanted = np.array((share * self._weight, 0.0, 0.0, 0.0))
        force = np.clip(balance.T @ np.linalg.solve(normal, wanted), 0.0, self._weight)
        torque = -np.einsum('lij,i,l->lj', self._jacobians(state), up, force).ravel()
        return np.asarray(np.clip(torque, -self._limit, self._limit))

    def _jacobians(self, state: RobotState) -> Array:
        return np.array([J for _, J in self._legs.at(state.joint_position.tolist())])


@dataclass(frozen=True)
class FallParameters(Parameters):
    """Limits beyond which the robot counts as fallen."""

    fall_tilt: float = parameter(
        0.9, 'tilt beyond which the robot has fallen', 0.1, 3.2, unit='rad')
    fall_height: float = parameter(
        0.5, 'height over its feet below which a robot that should stand has fallen, as a '
        'fraction of the standing height', 0.0, 0.95)
    fall_delay: float = parameter(
        0.1, 'time with a large tilt or a low body after which a robot has fallen', 0.0, 5.0,
        unit='s')
    fall_support: float = parameter(
        0.08, 'load on the legs below which a robot that should stand has lost ground contact, as '
        'a fraction of the weight; 0: never', 0.0, 0.9)
    fall_support_delay: float = parameter(
        0.6, 'time without ground contact after which a robot has fallen', 0.05, 10.0, unit='s')


@dataclass(frozen=True)
class FallState:
    """Since when the robot has been tilted, low and unsupported [ns]; −1 while it is not."""

    since_ns: tuple[int, ...] = (-1, -1, -1)

    def carried(self, last_ns: int, now_ns: int) -> FallState:
        """The same on a clock that was set back, see :func:`~dmp_cpg_ros.core.clock.carried`."""
        return FallState(tuple(carried(stamp, last_ns, now_ns) for stamp in self.since_ns))


NOT_FALLING = FallState()
"""Of a robot that shows no sign of a fall."""


class FallDetector:
    """Fall detector; state in, state out.

    Parameters
    ----------
    parameters : FallParameters
        Limits.
    stance_height : float
        Height of ``base_link`` when standing [m].
    """

    def __init__(self, parameters: FallParameters, stance_height: float) -> None:
        """Keep the limits."""
        self.parameters, self._stance_height = parameters, stance_height

    def step(self, state: FallState, condition: BodyCondition, time_ns: int, standing: bool
             ) -> tuple[FallState, str]:
        """Advance to the condition at a stamp; returns what says that the robot has fallen, empty
        while it has not. Unless it should stand on its feet, only its tilt is watched.
        """
        p, height = self.parameters, condition.height / self._stance_height
        signs = (condition.tilt > p.fall_tilt, standing and height < p.fall_height,
                 standing and condition.support < p.fall_support)
        if not any(signs):  # as it always is
            return NOT_FALLING, ''
        since = tuple((before if before >= 0 else time_ns) if present else -1
                      for before, present in zip(state.since_ns, signs, strict=True))
        delays = (p.fall_delay, p.fall_delay, p.fall_support_delay)
        for i, (begun, delay) in enumerate(zip(since, delays, strict=True)):
            if begun >= 0 and (time_ns - begun) * 1e-9 >= delay:
                return FallState(since), self._sign(i, condition)
        return FallState(since), ''

    def _sign(self, i: int, condition: BodyCondition) -> str:
        """What says that the robot has fallen, in words."""
        p = self.parameters
        return (
            f'tilted by {condition.tilt:.2f} rad, more than {p.fall_tilt:g} rad',
            f'{condition.height:.3f} m over its feet, less than {p.fall_height:g} of '
            f'{self._stance_height:.3f} m',
            f'no ground under its feet for {p.fall_support_delay:g} s')[i]
