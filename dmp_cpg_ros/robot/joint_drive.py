# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The low-level joint drive that runs at every physics step."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JointTargets

_STACKED = (3, len(JOINT_NAMES))

ROLL_OFF_FROM = 0.7
"""Share of the speed limit above which torque along the motion falls, linearly to zero."""


class JointDrive:
    """τ = kp (q_d − q) + kd (q̇_d − q̇) + b q̇_d + τ_ff of twelve joints, within their limits.

    Between two arrivals of targets q_d moves on with q̇_d, for one tick at most; then it stands
    still. A joint whose targets are the same numbers as before has received nothing new.

    Parameters
    ----------
    description : RobotDescription
        Gains and limits.
    steps : int
        Physics steps per control tick.
    step_s : float
        Physics step [s].
    damping : array_like (12,), optional
        Viscous friction of the joints [N m s/rad], which the drive makes up for at the target
        velocity (the measured one would feed on itself). Without gains it makes up for nothing:
        then torques go to the joints as they come.
    """

    def __init__(self, description: RobotDescription, steps: int, step_s: float,
                 damping: ArrayLike = 0.0) -> None:
        self._kp, self._kd = np.tile(description.kp, 4), np.tile(description.kd, 4)
        self._limit = np.concatenate([leg.torque_limit for leg in description.legs])
        speed = np.concatenate([leg.velocity_limit for leg in description.legs])
        self._unlimited = 0.999 * ROLL_OFF_FROM * speed  # below this rounding decides nothing
        self._slow, self._weak = (0.999 * float(limit.min()) ** 2
                                  for limit in (self._unlimited, self._limit))
        self._slope = self._limit / (speed * (1.0 - ROLL_OFF_FROM))  # [N m s/rad]
        self._stall = self._limit / (1.0 - ROLL_OFF_FROM)  # the falling line at zero speed
        self._forward = self._kd + (self._kp > 0.0) * np.asarray(damping, dtype=float)
        self._steps, self._step_s, self._new = steps, step_s, np.zeros(12)
        self._nothing = np.zeros(12)  # NumPy needs longer for a number than for an array of them
        # whole arrays, since NumPy takes five times as long for operands of different shapes
        self._ahead, self._kp_of_steps, self._forward_of_steps = (
            np.array(np.broadcast_to(of, (steps, 12))) for of in (
                step_s * np.arange(steps)[:, None], self._kp, self._forward))
        self._told = np.zeros((3, steps, 12))  # position, velocity, effort at each step
        self.reset()

    def reset(self) -> None:
        """Forget all targets."""
        self._last = np.full((3, 12), np.nan)
        self._age = self._new  # physics steps since arrival
        self._command = np.zeros((self._steps, 12))

    def accept(self, targets: JointTargets) -> None:
        """Take the targets for the coming tick.

        Parameters
        ----------
        targets : JointTargets
            Arrays of shape (12,) in the order of ``JOINT_NAMES``.

        Raises
        ------
        DataError
            If an array has another shape or holds a value that is not finite.
        """
        new, last = checked_targets(targets), self._last
        self._last = new
        if not np.count_nonzero(new == last):  # the usual case, at a third of the general price
            self._age = self._new
            self._told[:] = new[:, None]
            position, velocity, effort = self._told
            reference = position + velocity * self._ahead
            self._command = (
                self._kp_of_steps * reference + self._forward_of_steps * velocity + effort)
            return
        position, velocity, effort = new
        arrived = (new != last).any(axis=0)
        self._age = np.where(arrived, 0.0, self._age + self._steps)
        age = self._age + np.arange(self._steps)[:, None]  # (steps, 12)
        moving = velocity * (age < self._steps)
        reference = position + velocity * (np.minimum(age, self._steps) * self._step_s)
        self._command = self._kp * reference + self._forward * moving + effort

    def torque(self, step: int, position: Array, velocity: Array) -> Array:
        """Return the joint torques of one physics step.

        Parameters
        ----------
        step : int
            Number of the physics step within the tick, from 0.
        position, velocity : ndarray (12,)
            Measured [rad], [rad/s].

        Returns
        -------
        ndarray (12,)
            [N m].
        """
        torque = self._command[step] - self._kp * position - self._kd * velocity
        if velocity.dot(velocity) <= self._slow and torque.dot(torque) <= self._weak:
            return torque  # as nearly always: their lengths are not even beyond the least limits
        return self.limited(torque, velocity)

    def limited(self, torque: Array, velocity: Array) -> Array:
        """Clip torques (..., 12) to what the actuators can give at these speeds.

        Torque along the motion is limited to τ_max up to 0.7 of the speed limit and falls linearly
        to zero at the speed limit; torque against the motion is limited to τ_max only.
        """
        if _within(velocity, self._unlimited) and _within(torque, self._limit):
            return torque
        lost = self._slope * velocity
        upper = np.minimum(self._limit, np.maximum(self._stall - lost, self._nothing))
        lower = np.minimum(self._limit, np.maximum(self._stall + lost, self._nothing))
        clipped: Array = np.minimum(upper, np.maximum(-lower, torque))
        return clipped


def _within(values: Array, limits: Array) -> bool:
    """Whether no value is beyond its limit."""
    return bool(np.count_nonzero(np.abs(values) <= limits) == values.size)


def checked_targets(targets: JointTargets) -> Array:
    """Return position, velocity and effort as one array (3, 12).

    Raises
    ------
    DataError
        If an array has another shape or holds a value that is not finite.
    """
    named = vars(targets)
    try:
        stacked = np.array([*named.values()], dtype=float)
    except (TypeError, ValueError):
        stacked = np.empty(0)
    if stacked.shape != _STACKED:
        name = next(name for name, value in named.items() if np.shape(value) != _STACKED[1:])
        raise DataError(f'joint targets: {name} has shape {np.shape(named[name])}, it must be '
                        f'{_STACKED[1:]}')
    numbers = stacked.ravel()
    if not isfinite(numbers.dot(numbers)) and not np.isfinite(stacked).all():
        bad = [JOINT_NAMES[i] for i in np.flatnonzero(~np.isfinite(stacked).all(axis=0))]
        raise DataError(f"joint targets: the values for {', '.join(bad)} are not finite")
    return stacked
