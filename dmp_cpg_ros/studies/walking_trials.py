# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Trials of walking: steady velocities, rough ground, obstacles.

All in the plain loop with the MuJoCo robot, which equals the nodes in lock-step, as those of
pushes and changes (:mod:`~dmp_cpg_ros.studies.push_trials`,
:mod:`~dmp_cpg_ros.studies.change_trials`). Equal trials give equal outcomes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import hypot, isnan, nan, pi
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.metrics.robot import cost_of_transport, cost_without_losses
from dmp_cpg_ros.analysis.motion import roll_pitch_yaw
from dmp_cpg_ros.core.errors import MissingFileError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.loop import Array, WalkingLoop
from dmp_cpg_ros.core.robot_model.grounds import Steps, World
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.robot_model.world import WORLDS
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import LoopRun, Velocity, recording_of, suite_of

Values = tuple[tuple[str, Any], ...]

STANDING = 0.5
"""Time before the start [s]."""

MEASURED, MEASURED_WAY = 5.0, 2.0
"""Least time [s] and, where it goes somewhere, least way [m] over which a steady velocity and the
heading are averaged: over half a metre the sway of single steps would be taken for drift.
"""

RECOVERY = 3.0
"""Time for which the robot must stay on its feet after a push [s]."""

FINISH, CROSSING_TIME = 5.0, 30.0
"""Distance to cross on rough ground [m], and the time after which a trial ends [s]."""

OBSTACLE_TIME, AWAY = 12.0, 3.0
"""Time for which a robot walks at an obstacle, and for which it then walks back [s]."""


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
    values : tuple of (str, value)
        Parameters that differ from the package's own.
    start : bool
        Whether the gait is released; without it rests.
    file : str, optional
        Parameter file; the package's own without.
    gaits : mapping of str to Gait, optional
        Gaits by name; those of the parameter file without.
    """

    def __init__(self, gait: str, robot: str | None = None, world: World | None = None,
                 seed: int = 0, values: Values = (), start: bool = True,
                 file: str | None = None, gaits: Mapping[str, Gait] | None = None) -> None:
        suite = suite_of(file, robot=robot, gait=None if gaits else gait,
                         **{'auto_inhibit': False, **dict(values)})
        known = gaits or suite.gaits.gaits
        body = MujocoRobot(suite.robot_file, suite.tick_ns, seed, 0.03 if seed else 0.0,
                           world=world or suite.world, sensors=suite.sensors,
                           mismatch=suite.mismatch)
        super().__init__(body, WalkingLoop(
            body.description, known[gait], suite.parameters, known))
        self.walk(STANDING)
        if start:
            self.loop.request(False)

    def period(self) -> float:
        """Length of a cycle [s]."""
        return 2.0 * pi / self.loop.network.omega(self.loop.r)

    def stop(self) -> None:
        """Ask for a stop by inhibition."""
        self.loop.request(True)


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
    without_losses : float
        The same less what damping and dry friction in the joints took.
    """

    fell: bool
    velocity: Velocity = (nan, nan, nan)
    yaw_drift: float = nan
    cost_of_transport: float = nan
    without_losses: float = nan


@cache
def is_there(file: str) -> bool:
    """Whether a robot's file and its model are installed."""
    try:
        MujocoRobot(suite_of(robot=file).robot_file)
    except MissingFileError:
        return False
    return True


def steady(gait: str, velocity: Velocity, robot: str | None = None, seed: int = 0,
           values: Values = ()) -> SteadyOutcome:
    """Walk at a velocity until it is steady, then for ``MEASURED`` and ``MEASURED_WAY``."""
    return held(Walk(gait, robot, seed=seed, values=values), velocity)


def held(run: LoopRun[Any], velocity: Velocity) -> SteadyOutcome:
    """Let a run walk as :func:`steady` does."""
    upright = run.settle(velocity)
    run.states = states = [run.state]
    speed = hypot(*velocity[:2])
    if not (upright and run.walk(max(MEASURED, MEASURED_WAY / speed if speed else 0.0))):
        return SteadyOutcome(True)
    v_x, v_y, gamma = np.mean([(*state.base_velocity_in_base[:2], state.base_rate_in_base[2])
                               for state in states], axis=0).tolist()
    outcome = SteadyOutcome(False, (v_x, v_y, gamma))
    way = float(np.hypot(*(states[-1].base_position_in_world
                           - states[0].base_position_in_world)[:2]))
    if way <= 0.1 or velocity[2] != 0.0:
        return outcome
    # a straight line through all samples, which the swaying of a cycle does not turn
    yaw = np.unwrap(attitude(states)[:, 2])
    gained = np.polyfit(np.linspace(0.0, 1.0, len(yaw)), yaw, 1)[0]
    of = recording_of(states), RunContext(robot=run.robot.description), way
    cost, _ = cost_of_transport(*of)
    return replace(outcome, yaw_drift=abs(float(np.rad2deg(gained))) * 10.0 / way,
                   cost_of_transport=cost or nan, without_losses=cost_without_losses(*of) or nan)


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
    blocked: bool = False


def cross(gait: str, kind: str, numbers: Mapping[str, float], seed: int, speed: float = 0.5,
          values: Values = (), robot: str | None = None) -> CrossingOutcome:
    """Walk straight ahead until ``FINISH``, a fall, or ``CROSSING_TIME``.

    Parameters
    ----------
    gait : str
        Name of the gait.
    kind : str
        World by name.
    numbers : mapping of str to float
        The world's parameters.
    seed : int
        Seed of the start, the speed and, where it has one, the world.
    speed : float
        Mean of the commanded speed [m/s]; each seed draws its own within a tenth of it.
    values : tuple of (str, value)
        Parameters that differ from the parameter file.
    robot : str, optional
        Robot file; the suite's own without.

    A robot that stops because it takes the ground for an obstacle has not crossed.
    """
    drawn: dict[str, Any] = {'seed': seed} if hasattr(WORLDS[kind], 'seed') else {}
    run = Walk(gait, robot, WORLDS[kind](**numbers, **drawn), seed + 1, values)
    run.loop.command(speed * float(np.random.default_rng(seed).uniform(0.9, 1.1)))
    begin, tilt, distance, time = run.state.time_ns, [], 0.0, 0.0
    while distance < FINISH and time < CROSSING_TIME:
        run.states.clear()
        upright = run.walk(0.1)
        distance = float(run.state.base_position_in_world[0])
        time = (run.state.time_ns - begin) * 1e-9
        if not upright or run.loop.stop.block.acts:
            break
        tilt.append(float(np.mean(np.sum(attitude(run.states)[:, :2] ** 2, axis=1))))
    return CrossingOutcome(distance >= FINISH and not run.fell(), run.fell(), distance, time,
                           float(np.rad2deg(np.sqrt(np.mean(tilt)))) if tilt else nan,
                           run.loop.stop.block.acts)


class ObstacleOutcome(NamedTuple):
    """What a robot did that walked at an obstacle.

    Attributes
    ----------
    fell, over, stopped : bool
        Whether it fell, was over it, or stopped before it.
    time : float
        From the start of the gait to the stop [s].
    rests : bool
        Whether the gait came to rest.
    away : float
        Way back from there when it is then asked to walk backwards [m].
    """

    fell: bool
    over: bool = False
    stopped: bool = False
    time: float = nan
    rests: bool = False
    away: float = nan


def obstacle(gait: str, height: float, seed: int, speed: float = 0.5, robot: str | None = None
             ) -> ObstacleOutcome:
    """Walk at a step of some height [m] with a platform behind it, within a tenth of a speed
    [m/s]; after a stop, wait for rest and walk back.
    """
    draw = np.random.default_rng(3000 + seed)
    run = Walk(gait, robot, Steps(height=height, platform=4.0), 3000 + seed)
    run.walk(draw.uniform(0.0, 0.5))
    run.loop.command(speed * float(draw.uniform(0.9, 1.1)))
    begin = run.state.time_ns
    while not run.loop.stop.block.acts:
        if not run.walk(run.tick_s):
            return ObstacleOutcome(True)
        if run.state.base_position_in_world[0] > 2.0 or (
                run.state.time_ns - begin > 1e9 * OBSTACLE_TIME):
            return ObstacleOutcome(False, bool(run.state.base_position_in_world[0] > 2.0))
    time = (run.state.time_ns - begin) * 1e-9
    if not run.walk(RECOVERY):
        return ObstacleOutcome(True, stopped=True, time=time)
    rests, place = run.loop.stop.state == 'at_rest', run.state.base_position_in_world[0]
    run.loop.command(-0.3)
    upright = run.walk(AWAY)
    return ObstacleOutcome(not upright, False, True, time, rests,
                           float(place - run.state.base_position_in_world[0]))


def attitude(states: Sequence[RobotState]) -> Array:
    """Roll, pitch and yaw (n, 3) [rad]."""
    return roll_pitch_yaw(np.array([state.base_quaternion for state in states]))
