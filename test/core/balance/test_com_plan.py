# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The body's planned sway is the fundamental of a pendulum over the feet that must carry it, and a
gait that needs it holds its speed.
"""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.balance.virtual_model import STRAIGHT, lateral_plan
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.studies.walking_trials import relative_error, steady
from dmp_cpg_ros.suite import load_gaits

OMEGA, HEIGHT, ACROSS = 16.0, 0.27, (0.11, -0.11, 0.11, -0.11)
PLACES = np.arange(4096) / 4096.0
LAGS = np.random.default_rng(7).uniform(0.0, 1.0, (12, 4))


def positions(lag: np.ndarray) -> np.ndarray:
    return (PLACES[:, None] - lag + 0.5) % 1.0 - 0.5


def sways(lag: np.ndarray, duty: float) -> np.ndarray:
    return np.array([
        lateral_plan(legs, duty, OMEGA, ACROSS, HEIGHT) for legs in positions(lag).tolist()])


@pytest.mark.parametrize('lag', LAGS)
@pytest.mark.parametrize('duty', [0.45, 0.6, 0.7])
def test_it_is_the_fundamental_of_the_pendulum(lag: np.ndarray, duty: float) -> None:
    swing_fl, swing_fr, swing_rl, swing_rr = (np.abs(positions(lag)) < 0.5 * (1.0 - duty)).T
    p = ACROSS[0] * (swing_fr & swing_rr) + ACROSS[1] * (swing_fl & swing_rl)
    turning = np.exp(-2j * np.pi * PLACES)
    fundamental = np.real(2.0 * np.mean(p * turning) / turning)
    y, _, acceleration = sways(lag, duty).T
    assert np.allclose(acceleration, GRAVITY / HEIGHT * (y - fundamental), atol=0.05)


@pytest.mark.parametrize('name', ['pace', 'amble'])
def test_velocity_and_acceleration_are_derivatives(name: str) -> None:
    y, velocity, acceleration = sways(load_gaits()[name].lag, 0.6).T
    step = 2.0 * np.pi / OMEGA * PLACES[1]
    assert np.abs(velocity).max() > 0.01
    assert np.allclose(np.gradient(y, step)[1:-1], velocity[1:-1], atol=1e-5)
    assert np.allclose(np.gradient(velocity, step)[1:-1], acceleration[1:-1], atol=1e-4)


def test_the_body_is_over_the_side_that_stands() -> None:
    left_stands = lateral_plan((0.5, 0.0, 0.5, 0.0), 0.6, OMEGA, ACROSS, HEIGHT)
    right_stands = lateral_plan((0.0, 0.5, 0.0, 0.5), 0.6, OMEGA, ACROSS, HEIGHT)
    assert left_stands.place > 0.0 > left_stands.acceleration
    assert np.allclose(left_stands, -np.array(right_stands), atol=1e-12)


@pytest.mark.parametrize(
    ('name', 'duty'), [('trot', 0.45), ('trot', 0.65), ('bound', 0.6), ('pronk', 0.65)])
def test_gaits_that_are_the_same_on_both_sides_go_straight(name: str, duty: float) -> None:
    assert np.allclose(sways(load_gaits()[name].lag, duty), 0.0, atol=1e-12)


def test_three_feet_on_the_ground_need_none() -> None:
    lag = load_gaits()['walk'].lag
    assert all(
        lateral_plan(legs, 0.76, OMEGA, ACROSS, HEIGHT) is STRAIGHT
        for legs in positions(lag).tolist())


def test_it_follows_phases_and_stance_without_a_jump() -> None:
    """Legs that drift apart past half a cycle change the sway by no more than they move."""
    for apart in (0.0, 0.25, 0.5, 0.75):
        for duty in (0.45, 0.5, 0.75):
            here, there = (
                lateral_plan((0.1, 0.3, 0.2, (0.3 - apart - small) % 1.0 - 0.5), duty,
                             OMEGA, ACROSS, HEIGHT)
                for small in (-1e-6, 1e-6))
            assert np.allclose(here, there, atol=1e-3)


@pytest.mark.parametrize('velocity', [(0.2, 0.0, 0.0), (0.0, 0.6, 0.0)])
def test_a_pace_holds_its_speed(velocity: tuple[float, float, float]) -> None:
    """Slowly ahead, which needs the plan, and sideways, which it must not disturb."""
    assert relative_error(steady('pace', velocity), velocity) < 0.05
