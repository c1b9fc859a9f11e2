# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Support state of the body and fall detection, from orientation, joints and foot forces alone.

A robot has fallen when it is tilted, low, or carries nothing on its feet, for too long.

Without IMU nothing tells the tilt: a vertical that goes on by the feet stays upright in a robot
that walks on its back. The momentum does. Whatever the gait, and in flight too, the feet carry the
weight in the mean of some tenths of a second, or the body falls: ∫ Σ F dt = m (g t + Δv). So a
robot whose IMU is not believed does not stand whose feet carried less than half of its weight in
that mean; unless the joint torques tell as steadily that they carry it, as they do where it is the
contact sensors that are stuck.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, exp, inf, isnan

import numpy as np

from dmp_cpg_ros.core.clock import carried
from dmp_cpg_ros.core.maths import Array, clamped
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.maths.vec3 import Triple, dot, upward
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

LOAD_S, LEAST_LOAD = 0.3, 0.5
"""Time constant of the mean of what feet carry [s], and the share of the weight below which it
tells without IMU that a robot does not stand: gaits that fly leave the ground for less than that.
"""

MOST_LOAD = 1.5
"""Mean up to which what the torques tell is the weight: who thrashes about presses more."""

LONGEST_TICK_NS = 50_000_000
"""Longest time that one reading stands for [ns]."""

FORGOTTEN = 0.01
"""Distance of these means from 1 from which on they are forgotten."""


@made_often
@dataclass(frozen=True, eq=False)
class BodyCondition:
    """Support state of the body at one tick.

    Attributes
    ----------
    down_in_base : tuple of 3 floats
        Direction of gravity seen in ``base_link``; (0, 0, −1) when level.
    tilt : float
        Angle between the base's z and the vertical [rad].
    height : float
        Height of ``base_link`` over the sole of the lowest foot [m].
    support : float
        Share of the weight that the feet carry, by the contact sensors, or by the joint torques
        where these say more and the sensors little, or nothing.
    load : tuple of float, optional
        Where the IMU is not believed, but legs are felt: share of the weight that the feet carry
        by the contact sensors, of which one that tells nothing is taken to tell a quarter, and by
        the joint torques, negative where these pull.
    """

    down_in_base: Triple
    tilt: float
    height: float
    support: float
    load: tuple[float, float] | None = None


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
        down, legs = (-x, -y, -z), self._legs.at(state.joint_position.tolist())
        height = max(-inf, *[
            dot(down, foot) + self._radius[i] for i, (foot, _) in enumerate(legs)])
        support = sum([force for force in state.foot_force.tolist() if force == force])  # no NaN
        support /= self._weight
        if support < CERTAIN_SUPPORT:
            support = max(support, self._pressed(state, down))
        load = None
        if isnan(state.measured_rate_in_base[0]) and not state.feels_nothing:
            told = np.where(np.isnan(state.foot_force), 0.25 * self._weight, state.foot_force)
            load = (float(told.sum()) / self._weight,
                    float(self._pressing(state, down).sum()) / self._weight)
        return BodyCondition(down, acos(clamped(-down[2], -1.0, 1.0)), height, support, load)

    def _pressed(self, state: RobotState, down: Triple) -> float:
        """Share of the weight that the joint torques press onto the ground."""
        return float(np.maximum(self._pressing(state, down), 0.0).sum()) / self._weight

    def _pressing(self, state: RobotState, down: Triple) -> Array:
        """Forces (4,) with which the joint torques press each foot downwards [N].

        They are those of statics, f = −J⁻ᵀ τ at each foot, damped near singular postures.
        """
        J = self._jacobians(state)
        tau = state.joint_effort.reshape(4, 3, 1)
        damped = J @ J.transpose(0, 2, 1) + 1e-4 * np.eye(3)
        forces = -np.linalg.solve(damped, J @ tau)[:, :, 0]
        return np.asarray(-(forces @ np.array(down)))

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
    """Signs of a fall, and what the feet carried without IMU.

    Attributes
    ----------
    since_ns : tuple of int
        Since when the robot has been tilted, low, unsupported, and without load on its feet [ns];
        −1 while it is not.
    load : tuple of float
        Means of what its feet carry by contact sensors and by torques, as shares of its weight;
        1 while the IMU is believed.
    time_ns : int
        Stamp of these [ns]; −1 where they begin.
    """

    since_ns: tuple[int, ...] = (-1, -1, -1, -1)
    load: tuple[float, float] = (1.0, 1.0)
    time_ns: int = -1

    def carried(self, last_ns: int, now_ns: int) -> FallState:
        """The same on a clock that was set back, see :func:`~dmp_cpg_ros.core.clock.carried`."""
        return FallState(tuple(carried(stamp, last_ns, now_ns) for stamp in self.since_ns),
                         self.load, carried(self.time_ns, last_ns, now_ns))


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
        watched = standing and p.fall_support > 0.0 and (
            condition.load is not None or state.time_ns >= 0)
        load, at_ns = _mean_load(state, condition, time_ns) if watched else ((1.0, 1.0), -1)
        contacts, torques = load
        signs = (condition.tilt > p.fall_tilt, standing and height < p.fall_height,
                 standing and condition.support < p.fall_support,
                 contacts < LEAST_LOAD and not LEAST_LOAD < torques < MOST_LOAD)
        if not (any(signs) or watched):  # as it always is
            return NOT_FALLING, ''
        since = tuple((before if before >= 0 else time_ns) if present else -1
                      for before, present in zip(state.since_ns, signs, strict=True))
        after = FallState(since, load, at_ns)
        delays = (p.fall_delay, p.fall_delay, p.fall_support_delay, p.fall_delay)
        for i, (begun, delay) in enumerate(zip(since, delays, strict=True)):
            if begun >= 0 and (time_ns - begun) * 1e-9 >= delay:
                return after, self._sign(i, condition)
        return after, ''

    def _sign(self, i: int, condition: BodyCondition) -> str:
        """What says that the robot has fallen, in words."""
        p = self.parameters
        return (
            f'tilted by {condition.tilt:.2f} rad, more than {p.fall_tilt:g} rad',
            f'{condition.height:.3f} m over its feet, less than {p.fall_height:g} of '
            f'{self._stance_height:.3f} m',
            f'no ground under its feet for {p.fall_support_delay:g} s',
            f'less than {LEAST_LOAD:g} of its weight on its feet, and no IMU to tell why')[i]


def _mean_load(state: FallState, condition: BodyCondition, time_ns: int
               ) -> tuple[tuple[float, float], int]:
    """Means of what the feet carry after a tick, and the stamp to go on from; −1 once they are
    what they are with an IMU that has been believed for a while.
    """
    since_ns = clamped(time_ns - state.time_ns, 0, LONGEST_TICK_NS) if state.time_ns >= 0 else 0
    share = 1.0 - exp(-1e-9 * since_ns / LOAD_S)
    contacts, torques = (
        mean + share * (now - mean)
        for mean, now in zip(state.load, condition.load or (1.0, 1.0), strict=True))
    over = condition.load is None and abs(contacts - 1.0) + abs(torques - 1.0) < FORGOTTEN
    return ((1.0, 1.0), -1) if over else ((contacts, torques), time_ns)
