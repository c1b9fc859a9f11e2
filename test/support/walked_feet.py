# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Demonstrations of feet: drawn from a foot path, or from a walk of the plain loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.loop import Tick, WalkingLoop
from dmp_cpg_ros.core.maths.vec3 import upward
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.learned_motion import FootSamples, LearnedMotion, learn_motion
from dmp_cpg_ros.core.transformation.leg import nominal_foothold
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.suite import load_gaits, load_suite

Lift = Callable[[float], float]


def drawn_motion(
    path: FootPath, stance_height: float, lift: Lift | None = None, cycles: int = 3
) -> LearnedMotion:
    """Motion that is learned from a path; its height at a share of the swing may be another."""
    c = (np.arange(cycles * 200) / 200.0 + 0.5) % 1.0 - 0.5
    foot = np.array([path.at(float(at))[0] for at in c]) - np.array(path.foothold_in_base)
    if lift is not None:
        foot[:, 2] = [lift(path.swung(float(at))) for at in c]
    samples = FootSamples(
        c, np.full(len(c), path.duty), np.full(len(c), 2.0 * np.pi / path.omega), foot)
    return LearnedMotion(learn_motion([[samples]] * 4, stance_height)[0])


class Walk:
    """Robot and loop under parameters by name."""

    def __init__(self, overrides: Mapping[str, Any]) -> None:
        suite = load_suite(overrides={'cmd_vel_timeout': 0.0, **overrides})
        self.tick_s = suite.tick_ns * 1e-9
        self.robot = MujocoRobot(suite.robot_file, suite.tick_ns, sensors=suite.sensors)
        self.loop = WalkingLoop(
            self.robot.description, suite.gait, suite.parameters, load_gaits())
        self.state = self.robot.reset()
        self.states, self.ticks = list[RobotState](), list[Tick]()

    def go(self, duration: float) -> float:
        """Walk on; returns the mean forward speed [m/s]."""
        speeds = []
        for _ in range(round(duration / self.tick_s)):
            self.states.append(self.state)
            self.ticks.append(self.loop.tick(self.state))
            self.state = self.robot.step(self.ticks[-1].targets)
            assert not self.robot.fallen, f'fell at {self.state.time_ns * 1e-9:.2f} s'
            speeds.append(self.state.base_velocity_in_base[0])
        return float(np.mean(speeds))

    def motion(self, seconds: float) -> LearnedMotion:
        """Motion that is learned from the last seconds, in which it walked steadily."""
        description, gait, scale = (
            self.robot.description, self.loop.network.gait, self.loop.network.scale)
        feet = []
        for i, leg in enumerate(control.primitive for control in self.loop.legs):
            rows, last = [], -round(seconds / self.tick_s)
            joints = slice(3 * i, 3 * i + 3)
            targets = [tick.targets for tick in self.ticks[last - 1 :]]
            goals = leg.transformation.goals(
                np.array([target.position[joints] for target in targets]),
                np.array([target.velocity[joints] for target in targets]),
                np.full(-last, self.tick_s))
            for tick, state, goal in zip(
                self.ticks[last:], self.states[last:], goals, strict=True
            ):
                speed = scale.foot_speed(*tick.r.tolist())
                duty, omega = gait.duty(speed, scale), gait.omega(speed, scale)
                c = float(gait.cycle_position(phase(tick.x[i])))
                foot = leg.kinematics.foot_in_base(goal)
                away = foot - nominal_foothold(description, LEGS[i])
                up = np.array(upward(state.base_quaternion.tolist()))
                away[2] = up @ foot + gait.bounce(c, duty, omega).height
                rows.append((c, duty, 2.0 * np.pi / omega, *away))
            c, duty, cycle, *foot = np.array(rows).T
            feet.append([FootSamples(c, duty, cycle, np.transpose(foot))])
        return LearnedMotion(learn_motion(feet, description.stance_height)[0])
