# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot behind a low-level interface as Unitree's robots have it, with MuJoCo as its body.

Every motor takes q, dq, tau, kp and kd, as ``LowCmd`` of unitree_go has them, and applies
τ = tau + kp (q_d − q) + kd (dq_d − dq) at a rate of its own. Motors that hear nothing for a while
are damped: kp = tau = 0, and kd of the robot file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_reader import read_description
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.robot_file import RobotFile, load_robot_file

PERIOD_NS, MOTOR_NS = 2_000_000, 1_000_000
"""Period of states and commands; of the motors' own loops [ns]."""

TIMEOUT_NS = 100_000_000
"""Silence after which motors are damped [ns]."""

LARGEST = 1e6
"""Numbers beyond this are refused."""


@dataclass(frozen=True)
class MotorCommand:
    """What all motors are told; each (12,), in the order of the robot file's joints.

    Attributes
    ----------
    position, velocity, effort : ndarray (12,)
        q_d [rad], dq_d [rad/s], tau [N m].
    kp, kd : ndarray (12,)
        [N m/rad], [N m s/rad]
    """

    position: Array
    velocity: Array
    effort: Array
    kp: Array
    kd: Array

    def torque(self, position: Array, velocity: Array) -> Array:
        """Torques (12,) at some angles and speeds [N m]."""
        return (self.effort + self.kp * (self.position - position)
                + self.kd * (self.velocity - velocity))


COMMANDED = tuple(field.name for field in fields(MotorCommand))
"""What a motor can be told."""

POWER = 'power'
"""What its supply can be told besides: 1 or 0."""


class LowLevelRobot:
    """Motors and body; its time goes on when it is told.

    Parameters
    ----------
    robot_file : RobotFile, Path, str or None
        The robot; None is the package's own.
    interfaces : sequence of str
        Of ``COMMANDED`` and ``POWER``, those that are commanded. Gains that are not are the robot
        file's where positions are commanded, and 0 where they are not; all motors have power.
    timeout_ns : int
        Silence of one of them after which the motors are damped [ns].
    start_pose : str
        ``lying``, ``standing`` or ``fallen``.

    Attributes
    ----------
    robot : MujocoRobot
        The body.
    state : RobotState
        What is measured now.
    command : dict of str to ndarray (12,)
        What was told last.
    timeouts : int
        How often commanded motors were damped.

    Raises
    ------
    MissingFileError, DataError, ParameterError
        If the robot cannot be used.
    """

    def __init__(self, robot_file: RobotFile | Path | str | None = None,
                 interfaces: Sequence[str] = COMMANDED, timeout_ns: int = TIMEOUT_NS,
                 start_pose: str = 'lying') -> None:
        """Power on: the motors are damped until all interfaces have been commanded."""
        file = load_robot_file(robot_file)
        self.joint_names = file.joint_names
        self.robot = MujocoRobot(file.without_gains(), MOTOR_NS, start_pose=start_pose)
        gains = read_description(load_model(file.model, file.base), file)
        own = {'kp': np.tile(gains.kp, 4), 'kd': np.tile(gains.kd, 4)}
        nothing = np.zeros(12)
        self._damping = own['kd']
        self.command = {name: own[name] if name in own and 'position' in interfaces else nothing
                        for name in COMMANDED} | {POWER: np.ones(12)}
        self._timeout_ns, self._told_ns = timeout_ns, dict.fromkeys(interfaces, -1)
        self.state, self.timeouts, self._was_damped = self.robot.reset(), 0, True

    @property
    def damped(self) -> bool:
        """Whether the motors are damped now."""
        oldest, now = min(self._told_ns.values()), self.state.time_ns
        return oldest < 0 or now - oldest > self._timeout_ns

    def take(self, name: str, values: ArrayLike) -> None:
        """Take a command of all motors.

        Raises
        ------
        DataError
            If these are not twelve finite numbers, or gains are negative; the motors keep what
            they were told before.
        """
        if name not in self._told_ns:
            raise DataError(f"'{name}' is not commanded; valid are {', '.join(self._told_ns)}")
        told = np.array(values, dtype=float)
        if told.shape != (12,):
            raise DataError(f'{name}: {told.size} numbers for 12 motors')
        if not (np.abs(told) <= LARGEST).all():
            raise DataError(f'{name} must be finite and at most {LARGEST:g}')
        if name in ('kp', 'kd') and (told < 0.0).any():
            raise DataError(f'{name} must not be negative')
        if name == POWER and not np.isin(told, (0.0, 1.0)).all():
            raise DataError(f'{name} must be 0 or 1')
        self.command[name] = told
        self._told_ns[name] = self.state.time_ns

    def step(self) -> None:
        """Go on by a period.

        Raises
        ------
        RobotError
            If the simulation leaves the finite numbers.
        """
        damped = self.damped
        self.timeouts += damped and not self._was_damped
        self._was_damped = damped
        told = MotorCommand(**{name: self.command[name] for name in COMMANDED})
        power, nothing = self.command[POWER], np.zeros(12)
        for _ in range(PERIOD_NS // MOTOR_NS):
            q, q_dot = self.state.joint_position, self.state.joint_velocity
            torque = -self._damping * q_dot if damped else told.torque(q, q_dot)
            self.state = self.robot.step(JointTargets(nothing, nothing, power * torque))
