# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A scenario on the plain loop, as its nodes in lock-step must play it bit for bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from played_scenario import loop_takers, play, robot_takers

from dmp_cpg_ros.commands.walk import load_scenario
from dmp_cpg_ros.core.loop import Tick, WalkingLoop
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.robot.watchdog import CommandWatchdog
from dmp_cpg_ros.suite import load_gaits, load_suite


def plain_run(scenario_file: Path, **values: Any) -> tuple[list[RobotState], list[Tick]]:
    """Run a scenario on the plain loop behind the robot's watchdog; states and ticks."""
    scenario = load_scenario(scenario_file)
    suite = load_suite(None, {**scenario.parameters, **values})
    perfect = suite.robot.physics == 'perfect_tracking'
    robot: MujocoRobot | PerfectTrackingRobot = PerfectTrackingRobot(
        load_description(suite.robot_file), suite.tick_ns, suite.robot.start_pose,
    ) if perfect else MujocoRobot(
        suite.robot_file, suite.tick_ns, world=suite.world, sensors=suite.sensors,
        start_pose=suite.robot.start_pose)
    loop = WalkingLoop(robot.description, suite.gait, suite.parameters, load_gaits())
    states, ticks = [robot.reset()], list[Tick]()
    guard = CommandWatchdog(robot.description, round(1e9 * suite.robot.target_timeout),
                            round(1e9 * suite.parameters.leg.target_lead))
    guard.drives.watches = not perfect  # as the robot's node does: what tracks perfectly has none

    def step() -> None:
        ticks.append(loop.tick(states[-1]))
        for leg, targets in ticks[-1].targets.by_leg().items():
            guard.accept(leg, states[-1].time_ns, targets)
        states.append(robot.step(guard.targets(states[-1])))

    play(scenario, suite.tick_ns, step, {**loop_takers(loop), **robot_takers(robot)})
    return states, ticks
