# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trials of walking: steady velocities, pushes, rough ground, changes of the gait.

All in the plain loop with the MuJoCo robot, which equals the nodes in lock-step. Equal trials give
equal outcomes.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache, partial
from math import ceil, cos, hypot, isnan, log2, nan, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.metrics.robot import cost_of_transport
from dmp_cpg_ros.analysis.motion import roll_pitch_yaw
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.robot_model.world import World
from dmp_cpg_ros.core.robot_model.world_choice import WORLDS
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import recording_of
from dmp_cpg_ros.studies.loop_run import LoopRun
from dmp_cpg_ros.suite import Suite, load_gait, load_gaits, load_suite

Array = NDArray[np.float64]
Velocity = tuple[float, float, float]
Values = tuple[tuple[str, Any], ...]

STANDING, RAMP = 0.5, 1.0
"""Time before the start [s]; rate at which commands rise [m/s^2], and three times that for
turning [rad/s^2].
"""

MEASURED, MEASURED_WAY = 5.0, 2.0
"""Least time [s] and, where it goes somewhere, least way [m] over which a steady velocity and the
heading are averaged: over half a metre the sway of single steps would be taken for drift.
"""

RECOVERY = 3.0
"""Time for which the robot must stay on its feet after a push [s]."""

FINISH, CROSSING_TIME = 5.0, 30.0
"""Distance to cross on rough ground [m], and the time after which a trial ends [s]."""


@lru_cache
def suite_of(robot: str | None, gait: str, file: str | None = None,
             values: Values = ()) -> Suite:
    """Parameter file with a robot and gait, and a command that needs no repetition."""
    overrides = {'gait': gait, 'cmd_vel_timeout': 0.0, 'auto_inhibit': False, **dict(values)}
    return load_suite(file, overrides if robot is None else overrides | {'robot': robot})


class Walk(LoopRun[WalkingLoop]):
    """A run of one robot in one gait, started from rest.

    Parameters
    ----------
    gait : str
        Name of the gait.
    robot : str, optional
        Robot file; the suite's own without.
    world : World, optional
        Flat without.
    seed : int
        Seed of the joints' initial spread of ±0.03 rad; none with 0.
    file : str, optional
        Parameter file; the package's own without.
    values : tuple of (str, value)
        Parameters that differ from the file.
    """

    def __init__(self, gait: str, robot: str | None = None, world: World | None = None,
                 seed: int = 0, file: str | None = None, values: Values = ()) -> None:
        suite = suite_of(robot, gait, file, values)
        body = MujocoRobot(suite.robot_file, suite.tick_ns, seed, 0.03 if seed else 0.0,
                           world=world or suite.world, sensors=suite.sensors)
        super().__init__(body, WalkingLoop(
            body.description, load_gait(gait), suite.parameters, load_gaits()))
        self.asked: Velocity = (0.0, 0.0, 0.0)
        self.walk(STANDING)
        self.loop.request(False)

    def reach(self, velocity: Velocity) -> bool:
        """Ramp the command to a velocity; return whether the robot is on its feet."""
        begin = np.array(self.asked)
        rates = np.abs(np.array(velocity) - begin) / np.array((RAMP, RAMP, 3.0 * RAMP))
        steps = max(1, ceil(rates.max() / 0.1))
        for i in range(1, steps + 1):
            v_x, v_y, gamma = (begin + (np.array(velocity) - begin) * i / steps).tolist()
            self.loop.command(v_x, v_y, gamma)
            if not self.walk(0.1):
                return False
        self.asked = velocity
        return True


@dataclass(frozen=True)
class SteadyOutcome:
    """A velocity that was held.

    Attributes
    ----------
    fell : bool
        Whether the robot fell.
    velocity : tuple of float
        Means of v_x, v_y [m/s] in the base frame and of the turn rate [rad/s].
    yaw_drift : float
        Heading gained beyond what was commanded, per 10 m of way [deg]; NaN without way.
    cost_of_transport : float
        Positive mechanical work over m g d; NaN without way.
    """

    fell: bool
    velocity: Velocity = (nan, nan, nan)
    yaw_drift: float = nan
    cost_of_transport: float = nan


def steady(gait: str, velocity: Velocity, robot: str | None = None,
           file: str | None = None) -> SteadyOutcome:
    """Walk at a velocity until it is steady, then for ``MEASURED`` and ``MEASURED_WAY``."""
    run = Walk(gait, robot, file=file)
    if not (run.reach(velocity) and run.walk(3.0)):
        return SteadyOutcome(True)
    run.states = [run.state]
    speed = hypot(*velocity[:2])
    if not run.walk(max(MEASURED, MEASURED_WAY / speed if speed else 0.0)):
        return SteadyOutcome(True)
    states = run.states
    mean = np.mean([(*state.base_velocity_in_base[:2], state.base_rate_in_base[2])
                    for state in states], axis=0)
    way = float(np.hypot(*(states[-1].base_position_in_world
                           - states[0].base_position_in_world)[:2]))
    drift = work = nan
    if way > 0.1 and velocity[2] == 0.0:
        yaw = np.unwrap(roll_pitch_yaw(np.array([s.base_quaternion for s in states]))[:, 2])
        # a straight line through all samples, which the swaying of a cycle does not turn
        gained = np.polyfit(np.linspace(0.0, 1.0, len(yaw)), yaw, 1)[0]
        drift = abs(float(np.rad2deg(gained))) * 10.0 / way
        work = cost_of_transport(
            recording_of(states), RunContext(robot=run.robot.description), way)[0] or nan
    v_x, v_y, gamma = mean.tolist()
    return SteadyOutcome(False, (v_x, v_y, gamma), drift, work)


@dataclass(frozen=True)
class PushCase:
    """Pushes of a walking robot at one phase.

    Attributes
    ----------
    gait : str
        Name of the gait.
    speed : float
        Commanded forward speed [m/s].
    phase : float
        Fraction of a cycle at which the push begins.
    directions : tuple of float
        Directions of the pushes in the base frame [rad].
    resolution, largest : float
        Of the speed change that is looked for [m/s].
    """

    gait: str
    speed: float
    phase: float
    directions: tuple[float, ...]
    resolution: float = 0.1
    largest: float = 3.2


@dataclass(frozen=True)
class PushOutcome:
    """Largest speed change Δv = J/m that is survived in each of the directions [m/s]."""

    speed_change: tuple[float, ...]


def survived_pushes(case: PushCase, robot: str | None = None) -> PushOutcome:
    """Look for the largest speed change that is survived, per direction, by bisection.

    Every impulse below it that the bisection tried was survived too; NaN where the robot fell
    before any push.
    """
    run = Walk(case.gait, robot)
    upright = run.reach((case.speed, 0.0, 0.0)) and run.walk(3.0) and run.walk(
        case.phase * 2.0 * pi / run.loop.network.omega(run.loop.r))
    return PushOutcome(tuple(
        _largest(run, angle, case) if upright else nan for angle in case.directions))


def _largest(run: Walk, angle: float, case: PushCase) -> float:
    if survives(run, angle, case.largest):
        return case.largest
    halvings = ceil(log2(case.largest / case.resolution) - 1e-9)
    return last_that_holds(partial(survives, run, angle), 0.0, case.largest, max(0, halvings))


def survives(run: Walk, angle: float, speed_change: float) -> bool:
    """Whether a copy of a run stays on its feet for ``RECOVERY`` after a push in a direction of
    the base frame [rad] that would change the free body's speed by so much [m/s].
    """
    after = deepcopy(run)
    yaw = float(roll_pitch_yaw(run.state.base_quaternion[None])[0, 2]) + angle
    impulse = after.robot.description.mass * speed_change
    after.push(np.array((impulse * cos(yaw), impulse * sin(yaw), 0.0)))
    return after.walk(RECOVERY)


@dataclass(frozen=True)
class CrossingCase:
    """One crossing of rough ground.

    Attributes
    ----------
    gait : str
        Name of the gait.
    kind : str
        World by name.
    numbers : tuple of (str, float)
        The world's parameters.
    seed : int
        Seed of the start, the speed and, where it has one, the world.
    speed : float
        Mean of the commanded speed [m/s]; each seed draws its own within a tenth of it.
    values : tuple of (str, value)
        Parameters that differ from the parameter file.
    """

    gait: str
    kind: str
    numbers: tuple[tuple[str, float], ...]
    seed: int
    speed: float = 0.5
    values: Values = ()


@dataclass(frozen=True)
class CrossingOutcome:
    """Whether the robot crossed, how far and in what time it came [m], [s], and the root mean
    square of its tilt on the way [deg].
    """

    crossed: bool
    fell: bool
    distance: float
    time: float
    tilt: float


def cross(case: CrossingCase, robot: str | None = None) -> CrossingOutcome:
    """Walk straight ahead until ``FINISH``, a fall, or ``CROSSING_TIME``."""
    numbers: Mapping[str, float] = dict(case.numbers)
    if case.kind == 'blocks':
        numbers = {**numbers, 'seed': case.seed}
    world = WORLDS[case.kind](**numbers)
    speed = case.speed * float(np.random.default_rng(case.seed).uniform(0.9, 1.1))
    run = Walk(case.gait, robot, world, seed=case.seed + 1, values=case.values)
    run.loop.command(speed)
    begin, tilt = run.state.time_ns, []
    run.states.clear()
    while run.walk(0.1):
        tilt.append(_mean_squared_tilt(run.states))
        run.states.clear()
        elapsed = (run.state.time_ns - begin) * 1e-9
        if _distance(run.state) >= FINISH or elapsed >= CROSSING_TIME:
            break
    distance = _distance(run.state)
    return CrossingOutcome(distance >= FINISH and not run.fell(), run.fell(), distance,
                           (run.state.time_ns - begin) * 1e-9,
                           float(np.rad2deg(np.sqrt(np.mean(tilt)))) if tilt else nan)


def _mean_squared_tilt(states: list[RobotState]) -> float:
    quaternions = np.array([state.base_quaternion for state in states])
    return float(np.mean(np.sum(roll_pitch_yaw(quaternions)[:, :2] ** 2, axis=1)))


def _distance(state: RobotState) -> float:
    return float(state.base_position_in_world[0])


def relative_error(outcome: SteadyOutcome, velocity: Velocity) -> float:
    """Size of the velocity error over that of the commanded velocity, along its direction;
    turning alone counts in turn rates.
    """
    if outcome.fell or isnan(outcome.velocity[0]):
        return nan
    speed = hypot(*velocity[:2])
    if speed == 0.0:
        return abs(outcome.velocity[2] - velocity[2]) / abs(velocity[2])
    along = float(np.dot(outcome.velocity[:2], velocity[:2])) / speed
    return abs(along - speed) / speed
