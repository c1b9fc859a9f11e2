# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Conditions for votes of the legs: lost footing, collision, tilt, and sensor timeout.

Feet: no load in stance, a load in swing. Planned and real touchdown differ by a few hundredths of
a cycle on any ground, and by more on rough ground, so that only the central share of stance and
swing is judged, and nothing until the gait has run for a while.

Tilt: a complementary filter (Mahony, Hamel and Pflimlin 2008) on the upward direction, from the
IMU alone. It detects a fall independently of the state estimate, which balance uses.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import acos, exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.maths.rotations import turned
from dmp_cpg_ros.core.maths.vec3 import rotation
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.core.voting.parameters import VoteSourceParameters

Stamps = NDArray[np.int64]
Mask = NDArray[np.bool_]

NEVER = -1
"""Stamp of what is not the case."""

TIME_CONSTANT = 1.0
"""Time in which the accelerometer wins over the gyroscope [s]: longer than a step."""

PLAUSIBLE = (0.5, 1.5)
"""Specific forces that can be gravity, as multiples of it; others are blows."""

LONGEST_GAP = 0.1
"""Longest time over which a turn rate is held [s]."""


@made_often
@dataclass(frozen=True)
class VoteSensors:
    """Readings of contact sensors and IMU that votes are derived from; NaN where there is none.

    Attributes
    ----------
    contact_ns, imu_ns : int
        Stamps of the readings [ns]; those of the tick unless a message is late or missing.
    foot_force : ndarray (4,)
        Normal forces [N].
    rate_in_base, specific_force_in_base : ndarray (3,)
        Gyroscope [rad/s] and accelerometer [m/s^2].
    """

    contact_ns: int
    imu_ns: int
    foot_force: Array
    rate_in_base: Array
    specific_force_in_base: Array

    @property
    def imu_is_good(self) -> bool:
        """Whether gyroscope and accelerometer both say something."""
        return bool(np.isfinite((self.rate_in_base, self.specific_force_in_base)).all())


def vote_sensors(state: RobotState) -> VoteSensors:
    """Readings that a state of the robot holds."""
    return VoteSensors(state.time_ns, state.time_ns, state.foot_force,
                       state.measured_rate_in_base, state.acceleration_in_base)


@dataclass(frozen=True)
class LastGood:
    """Stamps of the sensors' last good values.

    Attributes
    ----------
    contact_ns : ndarray (4,) of int
        Of each foot [ns].
    imu_ns : int
        Of the IMU [ns].
    """

    contact_ns: Stamps
    imu_ns: int

    @classmethod
    def at(cls, time_ns: int) -> LastGood:
        """All sensors get their time from this stamp on."""
        return cls(np.full(len(LEGS), time_ns), time_ns)

    def after(self, sensors: VoteSensors) -> LastGood:
        """Stamps after a reading."""
        good = np.isfinite(sensors.foot_force) & (self.contact_ns < sensors.contact_ns)
        newer = sensors.imu_ns > self.imu_ns and sensors.imu_is_good
        return LastGood(np.where(good, sensors.contact_ns, self.contact_ns),
                        sensors.imu_ns if newer else self.imu_ns)

    def silent(self, time_ns: int, silence_ns: int) -> tuple[Mask, bool]:
        """Legs whose contact sensor, and whether the IMU, has said nothing good for a time [ns].

        Returns
        -------
        contact : ndarray (4,) of bool
        imu : bool
        """
        return time_ns - self.contact_ns > silence_ns, time_ns - self.imu_ns > silence_ns


@dataclass(frozen=True)
class FootWatch:
    """Since when the feet feel what they should not.

    Attributes
    ----------
    lost_ns : ndarray (4,) of int
        Stamp since which a standing foot bears nothing [ns]; −1 while it does.
    hit_ns : ndarray (4,) of int
        Stamp since which a swinging foot bears something [ns]; −1 while it does not.
    walking_ns : int
        Stamp since which the gait runs [ns]; −1 while it does not.
    """

    lost_ns: Stamps = field(default_factory=lambda: np.full(len(LEGS), NEVER))
    hit_ns: Stamps = field(default_factory=lambda: np.full(len(LEGS), NEVER))
    walking_ns: int = NEVER


def watch_feet(state: FootWatch, parameters: VoteSourceParameters, time_ns: int, walking: bool,
               position: Array, duty: float, omega: float, load: Array
               ) -> tuple[FootWatch, Mask, Mask]:
    """Compare what the feet feel with where their legs are in the cycle.

    Parameters
    ----------
    state : FootWatch
        Before this tick.
    parameters : VoteSourceParameters
        Loads, times, shares.
    time_ns : int
        Stamp of this tick [ns].
    walking : bool
        Whether the gait runs, its legs in their places and swinging.
    position : ndarray (4,)
        Cycle positions, 0 at mid-swing, in [−1/2, 1/2).
    duty : float
        Planned duty factor.
    omega : float
        Cadence [rad/s].
    load : ndarray (4,)
        Normal force as a fraction of the weight; NaN where it is not known.

    Returns
    -------
    state : FootWatch
    lost, hit : ndarray (4,) of bool
        Legs that have had no footing in stance, or a load in swing, for long enough.
    """
    p = parameters
    walking_ns = (time_ns if state.walking_ns == NEVER else state.walking_ns) if walking else NEVER
    judged = walking and time_ns - walking_ns >= round(p.judged_after * 1e9)
    from_swing = np.abs(position)
    standing = judged & (0.5 - from_swing < 0.5 * p.judged_share * duty)
    swinging = judged & (from_swing < 0.5 * p.judged_share * (1.0 - duty))
    lost = _since(state.lost_ns, standing & (load < p.footing_load), time_ns)
    hit = _since(state.hit_ns, swinging & (load > p.collision_load), time_ns)
    stance_ns = 2e9 * pi * duty / omega
    return (FootWatch(lost, hit, walking_ns),
            (lost != NEVER) & (time_ns - lost >= p.footing_share * stance_ns),
            (hit != NEVER) & (time_ns - hit >= round(p.collision_time * 1e9)))


def _since(before: Stamps, now: Mask, time_ns: int) -> Stamps:
    """Stamps since which something is the case."""
    return np.where(now, np.where(before == NEVER, time_ns, before), NEVER)


@dataclass(frozen=True)
class UpFilter:
    """Complementary filter of gyroscope and accelerometer for the upward direction.

    Attributes
    ----------
    up_in_base : ndarray (3,)
        Of length 1.
    time_ns : int
        Stamp of the last reading [ns]; −1 before the first.
    """

    up_in_base: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    time_ns: int = NEVER

    @property
    def tilt(self) -> float:
        """Angle between the vertical and the upright of the body [rad]."""
        return acos(min(max(float(self.up_in_base[2]), -1.0), 1.0))

    def after(self, sensors: VoteSensors) -> UpFilter:
        """Estimate after a reading; one that is bad or not newer than the last changes nothing.

        At the first reading and after a gap the accelerometer alone counts.
        """
        if not sensors.imu_is_good or sensors.imu_ns <= self.time_ns:
            return self
        force, dt = sensors.specific_force_in_base, (sensors.imu_ns - self.time_ns) * 1e-9
        strength = sqrt(float(force @ force))
        plausible = PLAUSIBLE[0] * GRAVITY < strength < PLAUSIBLE[1] * GRAVITY
        if self.time_ns < 0 or dt > LONGEST_GAP:
            up = force / strength if plausible else self.up_in_base
            return replace(self, up_in_base=up, time_ns=sensors.imu_ns)
        # What stands still in the world turns back in the body.
        turn = turned((0.0, 0.0, 0.0, 1.0), (sensors.rate_in_base * dt).tolist())
        up = self.up_in_base @ np.array(rotation(turn))
        if plausible:
            up = up + (force / strength - up) * (1.0 - exp(-dt / TIME_CONSTANT))
        length = sqrt(float(up @ up))
        return UpFilter(up / length if length > 1e-6 else self.up_in_base, sensors.imu_ns)
