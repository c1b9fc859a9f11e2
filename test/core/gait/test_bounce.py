# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The body's planned rise and fall obeys mechanics, legs and posture agree on it, and gaits that
need it reach their speed.
"""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.gait.com_height import LEVEL, planned_bounce
from dmp_cpg_ros.core.gait.lags import stance_groups
from dmp_cpg_ros.core.gait.transition import GaitTransition
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.studies.walking_trials import relative_error, steady
from dmp_cpg_ros.suite import load_gaits

OMEGA = 17.0
CYCLE = 2.0 * np.pi / OMEGA
PLACES = np.linspace(-0.5, 0.5, 20001)


def bounces(groups: int, duty: float) -> np.ndarray:
    return np.array([planned_bounce(c, groups, duty, OMEGA) for c in PLACES.tolist()])


@pytest.mark.parametrize(('groups', 'duty'), [(1, 0.65), (1, 0.3), (2, 0.45), (4, 0.2)])
def test_velocity_and_acceleration_are_derivatives(groups: int, duty: float) -> None:
    height, velocity, acceleration = bounces(groups, duty).T
    step = CYCLE * (PLACES[1] - PLACES[0])
    assert np.abs(np.gradient(height, step) - velocity).max() < 0.01
    steady_force = np.abs(np.diff(acceleration)) < 1e-9
    slope = np.diff(velocity) / step
    assert np.allclose(slope[steady_force], acceleration[:-1][steady_force], atol=1e-6)


@pytest.mark.parametrize(('groups', 'duty'), [(1, 0.65), (2, 0.45)])
def test_it_closes_and_forces_carry_the_weight_in_the_mean(groups: int, duty: float) -> None:
    height, velocity, acceleration = bounces(groups, duty).T
    assert height[0] == pytest.approx(height[-1]) and velocity[0] == pytest.approx(velocity[-1])
    assert acceleration.mean() == pytest.approx(0.0, abs=0.02)
    assert np.all(acceleration + GRAVITY >= 0.0)  # the ground does not pull


@pytest.mark.parametrize('name', ['pronk', 'trot'])
def test_the_body_falls_freely_exactly_while_no_foot_stands(name: str) -> None:
    gait, duty = load_gaits()[name], 0.4
    for c in np.linspace(-0.5, 0.5, 997).tolist():
        legs = (c - gait.lag + 0.5) % 1.0 - 0.5
        flies = bool(np.all(np.abs(legs) < 0.5 * (1.0 - duty)))
        seen = [gait.bounce(leg, duty, OMEGA) for leg in legs.tolist()]
        assert all((bounce.acceleration == -GRAVITY) == flies for bounce in seen)
        assert np.allclose(seen, seen[0], atol=1e-12)  # all legs tell the same


def test_no_flight_no_bounce() -> None:
    gaits = load_gaits()
    for name, gait in gaits.items():
        assert gait.bounce(0.1, 0.74, OMEGA) == LEVEL or name == 'pronk'
    assert gaits['trot'].bounce(0.0, 0.5, OMEGA) == LEVEL


def test_uneven_gaits_have_no_groups() -> None:
    assert stance_groups(np.array([0.0, 0.1, 0.5, 0.6])) == 0
    assert [stance_groups(load_gaits()[name].lag) for name in ('pronk', 'bound', 'amble')] == [
        1, 2, 4]


def test_a_change_of_gait_leads_from_one_bounce_to_the_other() -> None:
    gaits = load_gaits()
    change = GaitTransition(gaits['trot'], gaits['pronk'])
    for c in (-0.4, 0.0, 0.3):
        assert change.at(0.0, 1.0).bounce(c, 0.6, OMEGA) == LEVEL
        assert change.at(1.0, 1.0).bounce(c, 0.6, OMEGA) == pytest.approx(
            gaits['pronk'].bounce(c, 0.6, OMEGA))


@pytest.mark.parametrize('gait', ['bound', 'pronk'])
def test_gaits_with_flight_or_rocking_reach_their_speed(gait: str) -> None:
    velocity = (0.5, 0.0, 0.0)
    outcome = steady(gait, velocity)
    assert not outcome.fell
    assert relative_error(outcome, velocity) <= 0.05
