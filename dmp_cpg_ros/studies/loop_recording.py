# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MuJoCo robot under the plain loop, what it did as a recording, and what became
of a stop: studies need no bag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, isnan
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from dmp_cpg_ros.analysis import motion, recording
from dmp_cpg_ros.analysis.metrics.summary import STILL_SPEED
from dmp_cpg_ros.analysis.recording import Recording, taken
from dmp_cpg_ros.core.gait.known_gaits import shares_of
from dmp_cpg_ros.core.loop import Array, Tick
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.suite import Suite, load_suite

PUSH_DURATION = 0.1
"""Time over which the impulse of a push is spread [s]."""

RAMP = 1.0
"""Rate at which commands rise [m/s^2]; three times that for turning [rad/s^2]."""

Velocity = tuple[float, float, float]


@lru_cache
def suite_of(file: str | None = None, **values: Any) -> Suite:
    """A parameter file, the package's own without, with values that are not None in place of its
    own, and a command that needs no repetition.
    """
    return load_suite(file, {'cmd_vel_timeout': 0.0, **{
        name: value for name, value in values.items() if value is not None}})


class Controller(Protocol):
    """What walks a robot."""

    def tick(self, state: RobotState) -> Any:
        """Advance by a tick, and give what has ``targets``."""

    def command(self, v_x: float, v_y: float = 0.0, gamma: float = 0.0) -> None:
        """Command a velocity [m/s], [rad/s]."""


Loop = TypeVar('Loop', bound=Controller)


class LoopRun(Generic[Loop]):
    """Robot and loop, and the states since they were last cleared.

    A ``copy.deepcopy`` goes on bit for bit as the original would have.

    Parameters
    ----------
    robot : MujocoRobot
        Is reset.
    loop : Controller
        At its start.

    Attributes
    ----------
    state : RobotState
        The newest.
    states : list of RobotState
        Those that ticks gave.
    tick_s : float
        Control tick [s].
    asked : tuple of float
        Velocity that :meth:`reach` has come to [m/s], [rad/s].
    """

    def __init__(self, robot: MujocoRobot, loop: Loop) -> None:
        self.robot, self.loop = robot, loop
        self.state: RobotState = robot.reset()
        self.states: list[RobotState] = []
        self.tick_s = robot.tick_ns * 1e-9
        self.asked: Velocity = (0.0, 0.0, 0.0)

    def fell(self) -> bool:
        """Whether the robot lies on the ground."""
        return self.robot.fallen

    def tick(self, seconds: float) -> None:
        """Tick for a time [s], upright or not."""
        for _ in range(round(seconds / self.tick_s)):
            self.state = self.robot.step(self.acting(self.loop.tick(self.state)))
            self.states.append(self.state)

    def acting(self, tick: Any) -> JointTargets:
        """Targets that act in a tick."""
        targets: JointTargets = tick.targets
        return targets

    def walk(self, seconds: float) -> bool:
        """Tick for a time [s], or until the robot falls; return whether it is on its feet."""
        for _ in range(round(seconds / self.tick_s)):
            if self.fell():
                return False
            self.tick(self.tick_s)
        return not self.fell()

    def reach(self, velocity: Velocity) -> bool:
        """Ramp the command to a velocity; return whether the robot is on its feet."""
        begin, change = np.array(self.asked), np.array(velocity) - self.asked
        steps = max(1, ceil(np.max(np.abs(change) / (RAMP, RAMP, 3.0 * RAMP)) / 0.1))
        for i in range(1, steps + 1):
            self.loop.command(*(begin + change * i / steps).tolist())
            if not self.walk(0.1):
                return False
        self.asked = velocity
        return True

    def settle(self, velocity: Velocity) -> bool:
        """Ramp to a velocity and hold it; return whether the robot is on its feet."""
        return self.reach(velocity) and self.walk(3.0)

    def push(self, impulse: Array) -> None:
        """Push the base by an impulse in the world (3,) [N s], from the next tick on."""
        self.robot.apply_push(impulse / PUSH_DURATION, round(PUSH_DURATION * 1e9))


def recording_of(states: Sequence[RobotState], ticks: Sequence[Tick] = ()) -> recording.Recording:
    """Make a recording of the robot's states and, when they are given, of the loop's ticks.

    Parameters
    ----------
    states : sequence of RobotState
        In order of time.
    ticks : sequence of Tick
        In order of time; none for a recording of the robot alone.

    Returns
    -------
    Recording
    """
    work_is_known = all(state.joint_work is not None for state in states)
    robot = recording.Recording(
        joints=recording.JointSeries(*_columns(
            states, 'time_ns', 'joint_position', 'joint_velocity', 'joint_effort')),
        odometry=recording.OdometrySeries(*_columns(
            states, 'time_ns', 'base_position_in_world', 'base_quaternion',
            'base_velocity_in_base', 'base_rate_in_base')),
        feet=recording.FootForceSeries(*_columns(states, 'time_ns', 'foot_force')),
        work=recording.WorkSeries(*_columns(
            states, 'time_ns', 'joint_work', 'joint_peak_effort', 'joint_loss'
        ) if work_is_known else ()))
    if not ticks:
        return robot
    time, r, x, x_dot = _columns(ticks, 'time_ns', 'r', 'x', 'x_dot')
    targets = _columns([tick.targets for tick in ticks], 'position', 'velocity', 'effort')
    shares = tuple(shares_of(tick.gait) for tick in ticks)
    return replace(
        robot, targets=recording.JointSeries(time, *targets),
        canonical=recording.CanonicalSeries(time, x, x_dot, shares),
        reference=recording.VelocitySeries(time, r),
        inhibition=_changes(time, [(tick.supervisor.state, {}) for tick in ticks]),
        modes=_changes(time, [(tick.mode.mode, {'reason': tick.mode.reason}) for tick in ticks]))


def _columns(rows: Sequence[object], *names: str) -> list[Array]:
    """Arrays of some attributes; times in seconds."""
    return [np.array([getattr(row, name) for row in rows]) * (1e-9 if name == 'time_ns' else 1)
            for name in names]


def _changes(time: Array, states: Sequence[tuple[str, dict[str, str]]]
             ) -> tuple[recording.StatusEvent, ...]:
    """Words and values where the word changed."""
    return tuple(recording.StatusEvent(float(at), 0, word, values)
                 for k, (at, (word, values)) in enumerate(zip(time, states, strict=True))
                 if k == 0 or word != states[k - 1][0])


STANDING_WINDOW = 0.5
"""Time at the end of the hold in which the robot must stand still [s]."""

STANDING_SPEED = 0.02
"""Speed below which a body with four feet down stands [m/s]."""

DECELERATION_WINDOW = 0.04
"""Time over which the deceleration is averaged [s]."""

WALKING_ERROR = 0.1
"""Share of the commanded speed by which a robot that walks on may miss it."""


@dataclass(frozen=True)
class StopOutcome:
    """Outcome of one stop and start.

    Attributes
    ----------
    fell : bool
        Whether the robot fell between request and end.
    standing : bool
        Whether it stood at the end of the hold: all feet loaded, body below 1 cm/s.
    walked_on : bool
        Whether it walked at the commanded speed within 10 % after the resume.
    predicted_s, bound_s, measured_s : float
        Time to rest of the oscillators: predicted, bounded, measured [s]; NaN where there is none.
    body_rest_s : float
        Time after which the body stays below 1 cm/s [s].
    still_s : float
        Time after which all feet stay loaded and the body below 2 cm/s [s].
    slip_m : float
        Distance slid under load before the body was at rest, the mean over the feet [m].
    displacement_m : float
        Horizontal distance that the body moved from the request to rest [m].
    tilt : float
        Largest angle between the base's z and the vertical during the hold [rad].
    deceleration : float
        Largest horizontal acceleration of the body during the hold, over 40 ms [m/s^2].
    resumed_speed : float
        Mean forward speed after the resume [m/s].
    stands_s, within_s, within_m : float
        Predicted of the body: time until it stands, time and way within which it does [s], [m].
    stepped : bool
        Whether the robot stepped out of the stop, which then begins anew.
    """

    fell: bool
    standing: bool = False
    walked_on: bool = False
    predicted_s: float = np.nan
    bound_s: float = np.nan
    measured_s: float = np.nan
    body_rest_s: float = np.nan
    still_s: float = np.nan
    slip_m: float = np.nan
    displacement_m: float = np.nan
    tilt: float = np.nan
    deceleration: float = np.nan
    resumed_speed: float = np.nan
    stands_s: float = np.nan
    within_s: float = np.nan
    within_m: float = np.nan
    stepped: bool = False

    @property
    def prediction_error(self) -> float:
        """Share of the measured time by which the prediction missed it; NaN without either."""
        return abs(self.predicted_s - self.measured_s) / self.measured_s

    @property
    def late(self) -> bool:
        """Whether the body stood later than was said although no step began the stop anew."""
        return not (self.fell or self.stepped or self.still_s <= self.within_s + 1e-9)

    @property
    def far(self) -> bool:
        """Whether it stood farther on than was said, likewise."""
        return not (self.fell or self.stepped or self.displacement_m <= self.within_m)

    @property
    def broken(self) -> bool:
        """Whether it did not become of the body what was said."""
        return self.fell or self.late or self.far

    @property
    def bounded(self) -> bool:
        """Whether there is a bound."""
        return bool(np.isfinite(self.bound_s))

    @property
    def bound_exceeded(self) -> bool:
        """Whether the measured time is longer than its bound; false without a bound."""
        return self.measured_s > self.bound_s + 1e-9


def body_at_rest(hold: Recording, robot: RobotDescription, contact_force: float) -> StopOutcome:
    """Standing, time to rest, slip and displacement of the recorded hold.

    Parameters
    ----------
    hold : Recording
        Joints, odometry and foot forces from the request to the resume.
    robot : RobotDescription
        The robot.
    contact_force : float
        Load from which a foot counts as standing [N].

    Returns
    -------
    StopOutcome
        Without what the oscillators and the resume tell.
    """
    odometry = hold.odometry
    time, path = odometry.time - odometry.time[0], odometry.position_in_world[:, :2]
    speed = np.linalg.norm(odometry.velocity_in_base, axis=1)
    last = time > time[-1] - STANDING_WINDOW
    still, loaded = speed[last] < STILL_SPEED, hold.feet.force[last] > contact_force
    moving = np.flatnonzero(speed >= STILL_SPEED)
    rest = min(moving[-1] + 1, len(time) - 1) if moving.size else 0
    loaded_feet = (hold.feet.force > contact_force).all(axis=1)
    unsteady = np.flatnonzero((speed >= STANDING_SPEED) | ~loaded_feet)
    still_s = time[min(unsteady[-1] + 1, len(time) - 1)] if unsteady.size else 0.0
    until_rest = Recording(**{name: taken(getattr(hold, name), slice(rest + 1))
                              for name in ('joints', 'odometry', 'feet')})
    slip = motion.foot_slip(until_rest, robot, contact_force)
    velocity = motion.velocity_in_world(odometry)[:, :2]
    rows = round(DECELERATION_WINDOW / float(np.diff(time).mean()))
    change = np.hypot(*(velocity[rows:] - velocity[:-rows]).T)
    return StopOutcome(
        fell=False, standing=bool(still.all() and loaded.all()), body_rest_s=float(time[rest]),
        still_s=float(still_s),
        slip_m=0.0 if slip is None else float(slip.mean()),
        displacement_m=float(np.hypot(*(path[rest] - path[0]))),
        tilt=float(motion.tilt(odometry.quaternion).max()),
        deceleration=float(change.max() / DECELERATION_WINDOW))


@dataclass(frozen=True)
class StopSummary:
    """What a set of outcomes has in common; those that fell count, but have no times or lengths.

    Attributes
    ----------
    outcomes : sequence of StopOutcome
        The set.
    """

    outcomes: Sequence[StopOutcome]

    def number(self, name: str) -> int:
        """In how many outcomes something is so, such as ``standing`` or ``bound_exceeded``."""
        return sum(bool(getattr(outcome, name)) for outcome in self.outcomes)

    def spread(self, name: str) -> tuple[float, float]:
        """Median and worst of a number, such as ``slip_m``; NaN where no outcome has it."""
        values = np.array([getattr(outcome, name) for outcome in self.outcomes
                           if not outcome.fell])
        values = values[np.isfinite(values)]
        return (float(np.median(values)), float(values.max())) if values.size else (np.nan, np.nan)

    def cell(self, name: str, scale: float, digits: int) -> str:
        """Median and worst of a number in another unit, as a cell."""
        of = self.spread(name)
        return '-' if isnan(of[0]) else ' / '.join(f'{scale * one:.{digits}f}' for one in of)
