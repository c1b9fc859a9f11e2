# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors that freeze or jump are missing, and others are as they were told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dmp_cpg_ros.core.estimation.frozen import (
    CALM_NS,
    FROZEN_NS,
    JOINTS_NS,
    STEADY_NS,
    first_watch,
    with_joints,
    without_frozen,
)
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings

TICK_NS, WEIGHT, RNG = 4_000_000, 50.0, np.random.default_rng(0)


def readings(k: int, *, moving: bool = True) -> SensorReadings:
    noise = np.random.default_rng(k)
    speed = 2.0 if moving else 0.0
    return SensorReadings(
        k * TICK_NS, 1e-9 * k * TICK_NS * speed + 1e-3 * noise.normal(size=12),
        speed * (1.0 + 0.1 * noise.random(12)),
        noise.normal(size=12), noise.normal(size=3), noise.normal(size=3),
        10.0 + noise.random(4))


def watched(change: object = None, *, moving: bool = True, ticks: int = 40) -> SensorReadings:
    """Last readings of a run in which a change is made to each, as they were passed on."""
    first = readings(0, moving=moving)
    watch = first_watch(first)
    for k in range(1, ticks):
        told = readings(k, moving=moving)
        for name, part in (change or {}).items():  # type: ignore[attr-defined]
            getattr(told, name)[part] = getattr(first, name)[part]
        watch, passed = without_frozen(watch, told, WEIGHT)
    return with_joints(watch, passed) if change is None else passed


def test_what_changes_is_passed_on_as_it_is() -> None:
    last = readings(39)
    for name, value in vars(watched()).items():
        np.testing.assert_array_equal(value, getattr(last, name))


@pytest.mark.parametrize('change, usable', [
    ({'rate_in_base': slice(None), 'specific_force_in_base': slice(None)}, 'imu_is_usable'),
    ({'joint_position': slice(3, 6), 'joint_velocity': slice(3, 6)}, 'usable_legs'),
    ({'foot_force': slice(2, 3)}, 'usable_contacts')])
def test_what_repeats_while_the_robot_moves_is_missing(change: dict[str, slice], usable: str
                                                       ) -> None:
    expected = {'imu_is_usable': True, 'usable_legs': (True,) * 4, 'usable_contacts': (True,) * 4}
    failing = {'imu_is_usable': False, 'usable_legs': (True, False, True, True),
               'usable_contacts': (True, True, False, True)}
    passed = watched(change)
    for name, sound in expected.items():
        assert getattr(passed, name) == (failing[name] if name == usable else sound)
    early = watched(change, ticks=FROZEN_NS // TICK_NS)
    assert getattr(early, usable) == expected[usable]
    assert getattr(watched(change, moving=False), usable) == expected[usable]


def test_a_robot_without_noise_is_not_frozen() -> None:
    """The stand-in with perfect tracking is level and shares its weight evenly."""
    ideal = {'rate_in_base': np.array((0.0, 0.0, 0.3)), 'foot_force': np.full(4, 20.0),
             'specific_force_in_base': np.array((0.1, 0.0, 9.81))}
    watch = first_watch(replace(readings(0), **ideal))
    for k in range(1, 40):
        told = replace(readings(k), **ideal)
        watch, passed = without_frozen(watch, told, WEIGHT)
        assert passed is told


def test_joints_that_are_missing_stand_where_they_were_known_last() -> None:
    first, told = readings(0), readings(1)
    told.joint_position[6:9] = told.joint_velocity[6:9] = np.nan
    judged = SensorReadings(*(getattr(told, name) for name in (
        'time_ns', 'joint_position', 'joint_velocity', 'joint_effort', 'rate_in_base',
        'specific_force_in_base', 'foot_force')))
    watch, passed = without_frozen(first_watch(first), judged, WEIGHT)
    filled = with_joints(watch, passed)
    np.testing.assert_array_equal(filled.joint_position[6:9], first.joint_position[6:9])
    assert not filled.joint_velocity[6:9].any()
    np.testing.assert_array_equal(filled.joint_position[:6], told.joint_position[:6])


def test_a_turn_rate_that_jumps_is_not_believed_for_a_while() -> None:
    watch, seen = first_watch(readings(0)), []
    for k in range(1, 60):
        told = readings(k)
        told.rate_in_base[:] += 50.0
        watch, passed = without_frozen(watch, told, WEIGHT)
        seen.append(passed.imu_is_usable)
    assert not any(seen[:20]) and all(seen[30:])


def usable_imu(change: Callable[[int, SensorReadings], None], ticks: int) -> list[bool]:
    """Tell at each tick whether the IMU is believed whose readings are changed."""
    watch, seen = first_watch(readings(0)), []
    for k in range(1, ticks):
        told = readings(k)
        change(k, told)
        watch, passed = without_frozen(watch, told, WEIGHT)
        seen.append(passed.imu_is_usable)
    return seen


def test_of_a_gyroscope_that_tells_anything_nothing_is_believed() -> None:
    random = np.random.default_rng(1)

    def garbage(k: int, told: SensorReadings) -> None:
        if 20 <= k < 500:
            told.rate_in_base[:] = 20.0 * random.standard_normal(3)

    seen = usable_imu(garbage, 600)
    assert all(seen[:18])
    assert not any(seen[19:499])
    assert all(seen[530:])


def test_an_imu_that_is_new_now_and_then_only_is_not_believed() -> None:
    kept: list[SensorReadings] = []

    def slow(k: int, told: SensorReadings) -> None:
        if 20 <= k < 500:
            if k % 25 == 20:
                kept[:] = [readings(k)]
            told.rate_in_base[:] = kept[0].rate_in_base
            told.specific_force_in_base[:] = kept[0].specific_force_in_base

    seen = usable_imu(slow, 600)
    assert not any(seen[33:499])  # what repeats is frozen after 50 ms, and for as long as it does
    assert all(seen[530:])


def test_a_contact_that_pulls_is_not_believed_for_a_while() -> None:
    """What tells anything does so every other time; one that is off by a little does not."""
    def spoil(k: int, told: SensorReadings) -> None:
        told.foot_force[2] -= 10.0 + 0.05 * WEIGHT  # about what it tells without load
        if 100 <= k < 200:
            told.foot_force[1] = 500.0 * np.random.default_rng(k).normal()

    passed = judged(spoil, 300)
    first = next(k for k in range(100, 200) if 500.0 * np.random.default_rng(k).normal() < -WEIGHT)
    contacts = np.array([sound.usable_contacts for sound in passed])
    assert first < 105 and contacts[:, (0, 2, 3)].all() and contacts[:99, 1].all()
    assert not contacts[first - 1:199, 1].any() and contacts[199 + STEADY_NS // TICK_NS:, 1].all()
    assert all(sound.imu_is_usable and all(sound.usable_legs) for sound in passed)


def swing(k: int, told: SensorReadings) -> None:
    """Let all joints swing as those of a walking robot do."""
    phase = 2.0 * np.pi * 1e-9 * TICK_NS * k / 0.5 + np.arange(12)
    told.joint_position[:] = 0.3 * np.sin(phase) + 1e-3 * np.random.default_rng(k).normal(size=12)
    told.joint_velocity[:] = 0.3 * 2.0 * np.pi / 0.5 * np.cos(phase)


def swinging(spoil: Callable[[int, SensorReadings], None]
             ) -> Callable[[int, SensorReadings], None]:
    """Spoil readings of joints that swing."""
    def both(k: int, told: SensorReadings) -> None:
        swing(k, told)
        spoil(k, told)
    return both


def judged(spoil: Callable[[int, SensorReadings], None], ticks: int = 500) -> list[SensorReadings]:
    """Readings of a run as they were passed on, each spoiled before by its tick."""
    first, passed = readings(0), []
    spoil(0, first)
    watch = first_watch(first)
    for k in range(1, ticks):
        told = readings(k)
        spoil(k, told)
        told = replace(told)  # judges anew
        watch, sound = without_frozen(watch, told, WEIGHT)
        passed.append(sound)
    return passed


@pytest.mark.parametrize('joint', [4, slice(3, 6)])
def test_a_leg_whose_encoders_tell_anything_is_missing_until_a_while_after(joint: int | slice
                                                                           ) -> None:
    def spoil(k: int, told: SensorReadings) -> None:
        if 1000 <= k < 1100:
            told.joint_position[joint] += 2.0 * np.random.default_rng(k).normal()

    for passed, again_ns in ((judged(spoil, 2000), CALM_NS),
                             (judged(swinging(spoil), 2000), 3 * JOINTS_NS)):
        again = 1100 + again_ns // TICK_NS
        legs = np.array([sound.usable_legs for sound in passed])
        assert legs[:, (0, 2, 3)].all() and legs[:999, 1].all() and legs[again:, 1].all()
        assert not legs[999:1099 + JOINTS_NS // TICK_NS - 1, 1].any()
        assert all(sound.imu_is_usable and all(sound.usable_contacts) for sound in passed)


@pytest.mark.parametrize('offset', [0.15, -0.4])
@pytest.mark.parametrize('legs', [(2,), (0, 1, 2, 3)])
def test_an_offset_that_comes_in_one_tick_is_believed_only_once_it_is_gone(
        legs: tuple[int, ...], offset: float) -> None:
    """However long it lasts; with all legs nothing else is believed either."""
    joints = [3 * leg + 1 for leg in legs]

    def spoil(k: int, told: SensorReadings) -> None:
        told.joint_position[joints] += offset * (200 <= k < 1500)

    for passed in (judged(spoil, 2000), judged(swinging(spoil), 2000)):
        sound = np.array([of.usable_legs for of in passed])[:, legs].all(axis=1)
        again = 1499 + JOINTS_NS // TICK_NS
        assert sound[:199].all() and not sound[199:again].any() and sound[again:].all()
        imu = np.array([of.imu_is_usable for of in passed])
        np.testing.assert_array_equal(imu, sound if len(legs) == 4 else True)


def test_joints_that_come_back_elsewhere_in_their_stride_are_believed_again() -> None:
    """What is told a tenth of a second late jumps by one amount and back by another."""
    def spoil(k: int, told: SensorReadings) -> None:
        if 1300 <= k < 1420:
            late = readings(k)
            swing(k - 25, late)
            told.joint_position[:], told.joint_velocity[:] = (
                late.joint_position, late.joint_velocity)

    sound = [all(of.usable_legs) for of in judged(swinging(spoil), 2000)]
    assert all(sound[:1299]) and not any(sound[1299:1419 + JOINTS_NS // TICK_NS])
    assert all(sound[1419 + 3 * JOINTS_NS // TICK_NS:])


def test_nothing_is_believed_of_what_makes_all_legs_jump_at_once() -> None:
    def spoil(k: int, told: SensorReadings) -> None:
        told.joint_position[:] += 0.15 * (k >= 100)

    for sound in judged(spoil, 150)[99:]:
        assert not (sound.imu_is_usable or any(sound.usable_legs) or any(sound.usable_contacts))


@pytest.mark.parametrize('late, ticks', [
    ((0, 1, 2, 3), 120), ((1,), 120), ((2, 3), 120), ((0, 1, 2, 3), 1000), ((2,), 1000)])
def test_legs_that_do_not_swing_are_late_too_as_one_that_does(late: tuple[int, ...], ticks: int
                                                              ) -> None:
    """Leg 2 swings fast, the others move slowly: by what is a tenth of a second late they do not
    jump. Nothing is believed where all legs are late, however long, and all is again some time
    after that; what is late and does not swing cannot be told alone.
    """
    def at(k: int) -> SensorReadings:
        told = readings(k)
        swing(k, told)
        for part in (told.joint_position, told.joint_velocity):
            part[:6] *= 0.1
            part[9:] *= 0.1
        return told

    def spoil(k: int, told: SensorReadings) -> None:
        joints = np.repeat([1300 <= k < 1300 + ticks and leg in late for leg in range(4)], 3)
        for name in ('joint_position', 'joint_velocity'):
            getattr(told, name)[:] = np.where(
                joints, getattr(at(max(k - 25, 0)), name), getattr(at(k), name))

    passed = judged(spoil, 2080 + ticks)
    doubted = late if 2 in late else ()
    for k, sound in enumerate(passed, 1):
        if 1300 <= k < 1300 + ticks:
            assert sound.usable_legs == tuple(leg not in doubted for leg in range(4))
            assert sound.imu_is_usable == all(sound.usable_contacts) == (len(doubted) < 4)
        elif k < 1300 or k >= 1300 + ticks + CALM_NS // TICK_NS:
            assert all(sound.usable_legs) and sound.imu_is_usable


@pytest.mark.parametrize('every', [1, 2, 5])
def test_joints_that_accelerate_as_hard_as_joints_can_are_believed(every: int) -> None:
    """Also with readings that come seldom, twice, or not at all for a while."""
    def spoil(k: int, told: SensorReadings) -> None:
        k -= k % every
        t, omega = 1e-9 * TICK_NS * k, 30.0  # 30 rad/s, 900 rad/s^2
        told.joint_position[:] = np.sin(omega * t) + 1e-3 * np.random.default_rng(k).normal(
            size=12)
        told.joint_velocity[:] = omega * np.cos(omega * t)
        if 100 <= k < 150:
            told.joint_position[3:6] = np.nan

    for k, sound in enumerate(judged(spoil), 1):
        assert sound.usable_legs == (True, not 100 <= k - k % every < 150, True, True)
