# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What became of one stop and start, and what a set of them has in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.analysis import motion
from dmp_cpg_ros.analysis.metrics.summary import STILL_SPEED
from dmp_cpg_ros.analysis.recording import Recording, taken
from dmp_cpg_ros.core.robot_model.description import RobotDescription

STANDING_WINDOW = 0.5
"""Time at the end of the hold in which the robot must stand still [s]."""

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
    """

    fell: bool
    standing: bool = False
    walked_on: bool = False
    predicted_s: float = np.nan
    bound_s: float = np.nan
    measured_s: float = np.nan
    body_rest_s: float = np.nan
    slip_m: float = np.nan
    displacement_m: float = np.nan
    tilt: float = np.nan
    deceleration: float = np.nan
    resumed_speed: float = np.nan

    @property
    def prediction_error(self) -> float:
        """Share of the measured time by which the prediction missed it; NaN without either."""
        return abs(self.predicted_s - self.measured_s) / self.measured_s

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
    until_rest = Recording(**{name: taken(getattr(hold, name), slice(rest + 1))
                              for name in ('joints', 'odometry', 'feet')})
    slip = motion.foot_slip(until_rest, robot, contact_force)
    velocity = motion.velocity_in_world(odometry)[:, :2]
    rows = round(DECELERATION_WINDOW / float(np.diff(time).mean()))
    change = np.hypot(*(velocity[rows:] - velocity[:-rows]).T)
    return StopOutcome(
        fell=False, standing=bool(still.all() and loaded.all()), body_rest_s=float(time[rest]),
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
