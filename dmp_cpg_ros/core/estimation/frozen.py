# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors that look sound, one reading at a time: frozen ones, and a gyroscope that jumps.

What repeats to the last bit while the robot moves is no reading any more. Noise changes the last
bits of every real one, but those of joints at rest: joints are judged while others move, and so is
everything else; contacts while the force of another one changes. No body changes its turn rate by
``JUMP`` from one tick to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import LEGS

FROZEN_NS = 50_000_000
"""Time over which readings repeat before they count as frozen [ns]."""

JUMP, JUMPS_NS = 8.0, 100_000_000
"""Change of a turn rate that is none [rad/s], and for how long it is not believed [ns]."""

MOVING = 0.5
"""Velocity of a joint from which the robot moves [rad/s]."""

N = len(LEGS)


@dataclass(frozen=True)
class SensorWatch:
    """Memory of the last readings.

    Attributes
    ----------
    readings : SensorReadings
        Those of the last tick, as they were told.
    since_ns : tuple of int
        Stamp from which on the IMU, each leg's encoders and each contact repeat; −1: they do not.
    joint_position : ndarray (12,)
        Last usable angles [rad].
    imu_ns : int
        Stamp of the last turn rate that was believed [ns].
    """

    readings: SensorReadings
    since_ns: tuple[int, ...]
    joint_position: Array
    imu_ns: int


def first_watch(readings: SensorReadings) -> SensorWatch:
    """Memory after the first readings."""
    usable = np.where(np.isfinite(readings.joint_position), readings.joint_position, 0.0)
    return SensorWatch(readings, (-1,) * (1 + 2 * N), usable, readings.time_ns)


def without_frozen(watch: SensorWatch, readings: SensorReadings
                   ) -> tuple[SensorWatch, SensorReadings]:
    """Readings in which those of sensors that freeze or jump are missing (NaN)."""
    last, now = watch.readings, readings.time_ns
    x, y, z = (readings.rate_in_base - last.rate_in_base).tolist()
    if max(x, y, z) > JUMP or min(x, y, z) < -JUMP:
        if now - watch.imu_ns < JUMPS_NS:
            nothing = np.full(3, np.nan)
            readings = SensorReadings(
                now, readings.joint_position, readings.joint_velocity, readings.joint_effort,
                nothing, nothing, readings.foot_force)
            joints = _known(watch, readings)
            return replace_unchecked(watch, readings=_told(watch, readings, now),
                                     joint_position=joints), readings
    watch = replace_unchecked(watch, imu_ns=now)
    rates, q = readings.joint_velocity, readings.joint_position
    repeated = q == last.joint_position
    loaded = (readings.foot_force != 0.0) & (last.foot_force != 0.0)
    change = readings.foot_force - last.foot_force
    force = loaded & (change == 0.0) & (loaded & (np.abs(change) > 0.0)).any()
    # A simulated body may ride level, without any noise.
    imu = bool(readings.rate_in_base[0] == last.rate_in_base[0] and readings.rate_in_base.all())
    if not (imu or repeated.any() or force.any()):  # as it always is
        since = (-1,) * (1 + 2 * N)
        return SensorWatch(readings, since, q if all(readings.usable_legs) else _known(
            watch, readings), now), readings
    imu = imu and np.array_equal(readings.rate_in_base, last.rate_in_base) and np.array_equal(
        readings.specific_force_in_base, last.specific_force_in_base)
    legs = (repeated & (rates == last.joint_velocity)).reshape(N, 3).all(axis=1)
    moves = np.abs(np.nan_to_num(rates)).max() > MOVING  # also those say so that are frozen
    since = tuple((before if before >= 0 else now) if same and moves else -1
                  for before, same in zip(watch.since_ns, [imu, *legs, *force], strict=True))
    frozen = [begun >= 0 and now - begun >= FROZEN_NS for begun in since]
    if any(frozen):
        nothing, part = np.full(3, np.nan), np.repeat(frozen[1:1 + N], 3)
        readings = SensorReadings(
            now, np.where(part, np.nan, q), np.where(part, np.nan, rates),
            readings.joint_effort, nothing if frozen[0] else readings.rate_in_base,
            nothing if frozen[0] else readings.specific_force_in_base,
            np.where(frozen[1 + N:], np.nan, readings.foot_force))
    told = replace_unchecked(watch, readings=_told(watch, readings, now), since_ns=since)
    return replace_unchecked(told, joint_position=_known(watch, readings)), readings


def _told(watch: SensorWatch, readings: SensorReadings, now: int) -> SensorReadings:
    """Readings to compare the next ones with: a frozen sensor's are those that it still tells."""
    return replace_unchecked(readings, time_ns=now, **{
        name: np.where(np.isnan(new := getattr(readings, name)),
                       getattr(watch.readings, name), new)
        for name in ('joint_position', 'joint_velocity', 'rate_in_base',
                     'specific_force_in_base', 'foot_force')})


def _known(watch: SensorWatch, readings: SensorReadings) -> Array:
    """Angles, and the last usable ones of legs that have none."""
    usable = np.repeat(readings.usable_legs, 3)
    return np.where(usable, readings.joint_position, watch.joint_position)


def with_joints(watch: SensorWatch, readings: SensorReadings) -> SensorReadings:
    """Readings whose missing joints stand where they were known last."""
    usable = np.repeat(readings.usable_legs, 3)
    return replace_unchecked(
        readings, joint_position=watch.joint_position,
        joint_velocity=np.where(usable, readings.joint_velocity, 0.0),
        joint_effort=np.where(np.isfinite(readings.joint_effort), readings.joint_effort, 0.0))
