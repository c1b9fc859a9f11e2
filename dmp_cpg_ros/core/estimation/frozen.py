# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors that look sound, one reading at a time: frozen ones, and those that jump.

What repeats to the last bit while the robot moves is no reading any more. Noise changes the last
bits of every real one, but those of joints at rest: joints are judged while others move, and so is
everything else; contacts while the force of another one changes. No body changes its turn rate by
``JUMP`` from one tick to the next, and no foot is held by the ground: a contact that pulls tells
anything.

Angles and velocities of a joint tell the same motion twice: over a time t its angle changes by
the mean velocity times t, but for what accelerations change meanwhile, which goes with t²; t is
that between the stamps of the joints, which are not those of the ticks where messages come late or
get lost, and what is older than what was heard is not judged. A leg with a joint that breaks this
is doubted. Where all legs do at once it is what carries the readings
that fails, and nothing of it is believed. What comes late does so too, but only the legs that move
fast jump by enough as it begins: who tells to the last bit what it has told before, while another
one jumps, jumps back as well. To believe those that stand, of a tenth of a second ago, and not
those that swing, swung heavy robots up until they tipped over. What is late goes on without
another jump and about the same angles: a leg that is late
(:mod:`~dmp_cpg_ros.core.estimation.lateness`) is not believed until it has caught up by a jump.

What lasts is no proof: an offset that comes in one tick is told as steadily as the truth. A leg is
believed again once for a while it has not jumped and either its jumps have cancelled each other,
as those do by which an offset comes and goes, or its joints have moved about the angles about
which they moved before. One that jumped again and again told anything, not the truth and an
offset: it is believed after a longer while whatever it tells.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.estimation.lateness import FROZEN_NS, MOVING, PAST_NS, told_late, unknown
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import made_often, replace_unchecked
from dmp_cpg_ros.core.maths.vec3 import minus, triple
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import LEGS

JUMP, STEADY_NS = 8.0, 100_000_000
"""Change of a turn rate in a tick that is none [rad/s], and for how long a sensor must not have
repeated itself that was frozen, or jumped, to be believed [ns]: what is new now and then mostly
tells what was, and of what tells anything a reading now and then lies near the truth.
"""

HELD = 0.1
"""Pull on a foot that is none, in weights of the robot: sensors are off by less."""

APART, PULL, JOINTS_NS = 0.06, 2500.0, 600_000_000
"""Change of a joint's angle apart from what its velocity says [rad], more by that [rad/s²] times
the squared time between the readings, that is none, and for how long its leg is not believed at
least [ns]. Accelerations have made 0.007 rad in 4 ms in a walk and 0.018 rad in a fall, at most
1200 rad/s².
"""

CAUGHT_UP, CAUGHT_UP_PULL = 0.02, 1200.0
"""The same of a leg that is late [rad], [rad/s²]: it catches up by what it moves in that time.
"""

MANY, CALM_NS = 3, 2_000_000_000
"""Ticks with jumps from which an encoder tells anything, and for how long it must not have jumped
to be believed then [ns].
"""

ALIKE, USUAL_S = 0.075, 1.0
"""Distance of two mean angles within which they are the same [rad], and the time over which they
are taken [s].
"""

N = len(LEGS)


@dataclass(frozen=True)
class Doubt:
    """Legs that have jumped, and what they told since.

    Attributes
    ----------
    legs : tuple of 4 bool
        Which are not believed yet.
    all_at_once : bool
        Whether all jumped in the same tick.
    count, jumped_ns : ndarray (4,)
        Ticks in which they have jumped, and the stamps of the last one [ns].
    odd_ns : ndarray (4,)
        Stamps at which they told last what does not fit [ns].
    slipped, told : ndarray (12,)
        Sum of their jumps, and their mean angles since the last one [rad].
    late_ns : ndarray (4,)
        By how much they are late [ns].
    """

    legs: tuple[bool, ...]
    all_at_once: bool
    count: Array
    jumped_ns: Array
    odd_ns: Array
    slipped: Array
    told: Array
    late_ns: Array


NOBODY = Doubt((False,) * N, False, np.zeros(N), np.zeros(N, int), np.zeros(N, int),
               np.zeros(3 * N), np.zeros(3 * N), np.zeros(N, int))
"""No leg is in doubt."""


@made_often
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
    until_ns : tuple of int
        Stamps until which these are not believed; −1: they were never in doubt.
    heard_ns : tuple of 12 int
        Stamps at which each joint's angle was new [ns].
    usual : ndarray (12,)
        Mean angles while they were believed [rad].
    doubt : Doubt
        Which legs are not believed.
    past : tuple of SensorReadings
        Those of the ticks before, of ``PAST_NS``.
    """

    readings: SensorReadings
    since_ns: tuple[int, ...]
    joint_position: Array
    until_ns: tuple[int, ...]
    heard_ns: tuple[int, ...]
    usual: Array
    doubt: Doubt
    past: tuple[SensorReadings, ...] = ()


NEVER = (-1,) * (1 + 2 * N)
"""Stamps of sensors none of which repeats itself, or is in doubt."""


def first_watch(readings: SensorReadings) -> SensorWatch:
    """Memory after the first readings."""
    usable = np.where(np.isfinite(readings.joint_position), readings.joint_position, 0.0)
    now = readings.joints_ns
    return SensorWatch(readings, NEVER, usable, NEVER, (now,) * (3 * N), usable, NOBODY)


def without_frozen(watch: SensorWatch, readings: SensorReadings, weight: float
                   ) -> tuple[SensorWatch, SensorReadings]:
    """Readings in which those of sensors that freeze, jump or pull are missing (NaN), of a robot
    with a weight [N].
    """
    last, heard = watch.readings, watch.heard_ns
    jumps: dict[int, float] = {}
    if readings.joints_ns >= last.joints_ns:
        heard, jumps = _heard(watch, readings)
    else:  # newer ones have been used already
        readings = replace_unchecked(
            readings, joints_ns=last.joints_ns, joint_position=last.joint_position,
            joint_velocity=last.joint_velocity)
    doubt = watch.doubt
    if jumps or any(doubt.legs):
        doubt = _in_doubt(watch, readings, jumps)
    doubtful = any(doubt.legs)
    told, since, until, passed = _without_repeated(watch, readings, HELD * weight)
    if doubtful:
        passed = _without(passed, doubt.all_at_once, doubt.legs, doubt.all_at_once)
    known = _known(watch, passed)
    usual = watch.usual + _share(1e-9 * (readings.time_ns - watch.readings.time_ns)) * (
        known - watch.usual)
    if doubtful:
        usual = np.where(np.repeat(doubt.legs, 3), watch.usual, usual)
    oldest, past = readings.time_ns - PAST_NS, (*watch.past, last)
    past = past[1:] if past[0].time_ns < oldest else past
    return SensorWatch(told, since, known, until, heard, usual, doubt, past), passed


def _heard(watch: SensorWatch, readings: SensorReadings
           ) -> tuple[tuple[int, ...], dict[int, float]]:
    """Stamps at which each joint was heard last, and by how much joints jumped [rad]."""
    last, now, heard, jumps = watch.readings, readings.joints_ns, [*watch.heard_ns], {}
    late = watch.doubt.late_ns.tolist() if any(watch.doubt.legs) else None
    before, rate, rate_before = (last.joint_position.tolist(), readings.joint_velocity.tolist(),
                                 last.joint_velocity.tolist())
    for i, q in enumerate(readings.joint_position.tolist()):
        change = q - before[i]
        if not (change > 0.0 or change < 0.0):  # not a number included
            continue
        dt = 1e-9 * (now - heard[i])
        heard[i] = now
        least, pull = (CAUGHT_UP, CAUGHT_UP_PULL) if late and late[i // 3] else (APART, PULL)
        apart, most = change - 0.5 * dt * (rate[i] + rate_before[i]), least + pull * dt * dt
        if apart > most or apart < -most:
            jumps[i] = apart
    return tuple(heard), jumps


def _in_doubt(watch: SensorWatch, readings: SensorReadings, jumps: dict[int, float]) -> Doubt:
    """Doubt in legs that jump or have jumped, by the jumps of this tick's joints [rad]."""
    doubt, now, q = watch.doubt, readings.time_ns, readings.joint_position
    apart = np.zeros(3 * N)
    apart[list(jumps)] = list(jumps.values())
    told_late_ns = told_late(watch.past, watch.readings, readings)
    jump = (apart != 0.0).reshape(N, 3).any(axis=1) | (told_late_ns > 0)
    late_ns = np.where(jump, told_late_ns, doubt.late_ns)
    if doubt.all_at_once and jump.any() and not told_late_ns.any():
        late_ns = told_late_ns  # what one of them has caught up with, all have
    if late_ns.any():
        late_ns = np.where(unknown(watch.past, watch.heard_ns, readings), 0, late_ns)
    was_late = np.repeat((doubt.late_ns > 0) | (late_ns > 0), 3)
    at_once = doubt.all_at_once or bool(jump.all())
    jumped = np.where(jump, now, doubt.jumped_ns)
    since = 1e-9 * np.repeat(now - jumped, 3)
    slipped = np.where(was_late, 0.0, doubt.slipped + apart)
    dt = 1e-9 * (now - watch.readings.time_ns)
    mean = doubt.told + np.where(np.isfinite(q), np.maximum(
        dt / np.maximum(since, dt), _share(dt)) * (q - doubt.told), 0.0)
    alike = (np.abs(slipped) <= APART).reshape(N, 3).all(axis=1) | (
        np.abs(mean - watch.usual) <= ALIKE).reshape(N, 3).all(axis=1)
    count = doubt.count + jump
    odd = np.where(alike & ~jump, doubt.odd_ns, now)
    legs = (jump | doubt.legs) & ((late_ns > 0) | (now - odd < JOINTS_NS) & ~(
        (count >= MANY) & (now - jumped >= CALM_NS)))
    if at_once:
        legs = np.full(N, legs.any())
    if not legs.any():
        return NOBODY
    return Doubt(tuple(legs.tolist()), at_once, count * legs, jumped, odd,
                 np.where(np.repeat(legs, 3), slipped, 0.0), mean, late_ns * legs)


def _share(dt: float) -> float:
    """Share of the newest angle in a mean."""
    return min(dt / USUAL_S, 1.0)


def _without_repeated(watch: SensorWatch, readings: SensorReadings, most: float) -> tuple[
        SensorReadings, tuple[int, ...], tuple[int, ...], SensorReadings]:
    """Without those of sensors that repeat themselves, of a gyroscope that jumps, and of contacts
    that pull by more than they may [N]: what to compare the next ones with, since when what
    repeats, until when what is in doubt, and the readings.
    """
    last, now, until = watch.readings, readings.time_ns, watch.until_ns
    turning, before = triple(readings.rate_in_base.tolist()), triple(last.rate_in_base.tolist())
    change = minus(turning, before)
    if max(change) > JUMP or min(change) < -JUMP:
        until = (now + STEADY_NS, *until[1:])
    if any(pulls := [force < -most for force in readings.foot_force.tolist()]):
        until = (*until[:1 + N], *(now + STEADY_NS if of else end for of, end in zip(
            pulls, until[1 + N:], strict=True)))
    rates, q = readings.joint_velocity, readings.joint_position
    repeated, force = q == last.joint_position, _repeated_forces(readings, last)
    # A simulated body may ride level, without any noise.
    imu = turning[0] == before[0] and all(turning)
    if not (imu or np.count_nonzero(repeated) or any(force) or (
            until is not NEVER and max(until) > now)):  # as it always is
        return readings, NEVER, NEVER, readings
    imu = imu and np.array_equal(readings.rate_in_base, last.rate_in_base) and np.array_equal(
        readings.specific_force_in_base, last.specific_force_in_base)
    legs = (repeated & (rates == last.joint_velocity)).reshape(N, 3).all(axis=1)
    moves = np.abs(np.nan_to_num(rates)).max() > MOVING  # also those say so that are frozen
    since = tuple((begun if begun >= 0 else now) if same and moves else -1
                  for begun, same in zip(watch.since_ns, [imu, *legs, *force], strict=True))
    until = tuple(
        now + STEADY_NS if begun >= 0 and (end > now or now - begun >= FROZEN_NS) else end
        for begun, end in zip(since, until, strict=True))
    doubted = [end > now for end in until]
    passed = _without(readings, doubted[0], doubted[1:1 + N], doubted[1 + N:]) if any(
        doubted) else readings
    return _told(watch, readings, now), since, until, passed


def _repeated_forces(readings: SensorReadings, last: SensorReadings) -> list[bool]:
    """Which feet are loaded and tell the same force again, while that of another one changes."""
    changes = [now - before if now != 0.0 and before != 0.0 else nan for now, before in zip(
        readings.foot_force.tolist(), last.foot_force.tolist(), strict=True)]
    if 0.0 not in changes or not any(abs(change) > 0.0 for change in changes):
        return [False] * N
    return [change == 0.0 for change in changes]


def _without(readings: SensorReadings, imu: bool, legs: ArrayLike, contacts: ArrayLike
             ) -> SensorReadings:
    """Readings in which those of some sensors are missing."""
    nothing, part = np.full(3, np.nan), np.repeat(legs, 3)
    return SensorReadings(
        readings.time_ns, np.where(part, np.nan, readings.joint_position),
        np.where(part, np.nan, readings.joint_velocity), readings.joint_effort,
        nothing if imu else readings.rate_in_base,
        nothing if imu else readings.specific_force_in_base,
        np.where(contacts, np.nan, readings.foot_force), readings.joints_ns)


def without_imu(readings: SensorReadings) -> SensorReadings:
    """Readings in which those of the IMU are missing (NaN)."""
    return _without(readings, True, (False,) * N, (False,) * N)


def _told(watch: SensorWatch, readings: SensorReadings, now: int) -> SensorReadings:
    """Readings to compare the next ones with: a frozen sensor's are those that it still tells."""
    return replace_unchecked(readings, time_ns=now, **{
        name: np.where(np.isnan(new := getattr(readings, name)),
                       getattr(watch.readings, name), new)
        for name in ('joint_position', 'joint_velocity', 'rate_in_base',
                     'specific_force_in_base', 'foot_force')})


def _known(watch: SensorWatch, readings: SensorReadings) -> Array:
    """Angles, and the last usable ones of legs that have none."""
    if all(readings.usable_legs):
        return readings.joint_position
    usable = np.repeat(readings.usable_legs, 3)
    return np.where(usable, readings.joint_position, watch.joint_position)


def with_joints(watch: SensorWatch, readings: SensorReadings) -> SensorReadings:
    """Readings whose missing joints stand where they were known last."""
    usable = np.repeat(readings.usable_legs, 3)
    return replace_unchecked(
        readings, joint_position=watch.joint_position,
        joint_velocity=np.where(usable, readings.joint_velocity, 0.0),
        joint_effort=np.where(np.isfinite(readings.joint_effort), readings.joint_effort, 0.0))
