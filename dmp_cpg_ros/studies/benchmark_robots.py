# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark's table of robots: each walks, stops, starts and is pushed with its file alone."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, pi

from dmp_cpg_ros.analysis.stop_outcome import StopSummary
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.stop_trial import StopCase, run_trials
from dmp_cpg_ros.studies.walking_trials import (
    PushCase,
    SteadyOutcome,
    relative_error,
    steady,
    survived_pushes,
)
from dmp_cpg_ros.suite import load_gait, load_suite

ROBOTS = tuple(f'robots/{name}.yaml' for name in
               ('mini_quadruped', 'mini_cheetah', 'go1', 'go2', 'aliengo'))
"""Robots by their files; all but the first need the extra ``robots``."""

SIDES = (0.5 * pi, 1.5 * pi)
"""Directions of the pushes [rad]."""

TOP_SPEEDS = (1.0, 1.5, 2.0, 2.5, 3.0)
"""Speeds that are tried in a trot, one after the other [m/s]."""

TOP_ERROR = 0.05
"""Share of the commanded speed that counts as having reached it."""


@dataclass(frozen=True)
class RobotCase:
    """A robot by its file, and the number of phases of its stops and pushes."""

    file: str
    phases: int


@dataclass(frozen=True)
class RobotOutcome:
    """What a robot did.

    Attributes
    ----------
    mass : float
        [kg]
    amble, trot : SteadyOutcome
        At 0.5 and 1 m/s.
    top_speed : float
        Fastest trot of ``TOP_SPEEDS`` that was reached [m/s]; NaN if none was.
    stops, stood, walked_on, stop_falls : int
        Stops from an amble at 0.5 m/s, and what became of them.
    pushed : float
        Sideways speed change survived at every phase of the amble at 0.5 m/s [m/s].
    """

    mass: float
    amble: SteadyOutcome
    trot: SteadyOutcome
    top_speed: float
    stops: int
    stood: int
    walked_on: int
    stop_falls: int
    pushed: float


def run_robot(case: RobotCase) -> RobotOutcome:
    """Walk, trot faster and faster, stop, start, and be pushed."""
    # a zero command is no request here, but the first command starts the gait
    suite = load_suite(None, {'robot': case.file, 'cmd_vel_timeout': 0.0})
    robot = MujocoRobot(suite.robot_file, suite.tick_ns)
    phases = [i / case.phases for i in range(case.phases)]
    stops = StopSummary(list(run_trials(
        robot, [StopCase('amble', 0.5, phase) for phase in phases], load_gait('amble'),
        suite.parameters)))
    pushed = [change for phase in phases
              for change in survived_pushes(PushCase('amble', 0.5, phase, SIDES), case.file)]
    return RobotOutcome(
        robot.description.mass, steady('amble', (0.5, 0.0, 0.0), case.file),
        steady('trot', (1.0, 0.0, 0.0), case.file), top_speed(case.file),
        len(stops.outcomes), stops.number('standing'), stops.number('walked_on'),
        stops.number('fell'), min(pushed))


def top_speed(file: str) -> float:
    """Fastest trot that is reached within ``TOP_ERROR``, trying faster ones until one is not."""
    top = nan
    for speed in TOP_SPEEDS:
        velocity = (speed, 0.0, 0.0)
        if not relative_error(steady('trot', velocity, file), velocity) <= TOP_ERROR:
            break
        top = speed
    return top
