# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An IMU that contradicts the feet is named and left out, and a sound one never is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from body_motions import SWAY, Sway, point_footed, readings
from core_examples import TICK

from dmp_cpg_ros.core.estimation.body_estimate import BodyEstimate
from dmp_cpg_ros.core.estimation.estimator import BodyEstimator
from dmp_cpg_ros.core.estimation.leg_odometry import TerrainState, levelled_by_feet
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.core.maths.rotations import turned
from dmp_cpg_ros.core.maths.vec3 import upward
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings

BEGIN_S, END_S, LONG_S = 1.0, 3.0, 6.0
ROBOT = point_footed()
NOTHING, ALONG, ROLLS = np.zeros(3), np.array((2.0, 0.0, 0.0)), np.array((0.3, 0.0, 0.0))


@pytest.fixture(scope='module')
def exact() -> list[SensorReadings]:
    return list(readings(ROBOT, SWAY, LONG_S))


def estimates(sensors: list[SensorReadings], turn: np.ndarray, force: np.ndarray
              ) -> list[BodyEstimate]:
    """Estimates with an IMU that is off for a while."""
    estimator, memory, found = BodyEstimator(ROBOT, EstimationParameters()), None, []
    for k, reading in enumerate(sensors):
        if BEGIN_S <= k * TICK < END_S:
            reading = dataclasses.replace(
                reading, rate_in_base=reading.rate_in_base + turn,
                specific_force_in_base=reading.specific_force_in_base + force)
        memory, estimate = estimator.step(memory, reading)
        found.append(estimate)
    return found


def tilt_errors(found: list[BodyEstimate]) -> np.ndarray:
    return np.array([np.linalg.norm(np.array(upward(of.quaternion.tolist()))
                                    - SWAY.pose(k * TICK)[1][2]) for k, of in enumerate(found)])


@pytest.mark.parametrize(('turn', 'force', 'within_s'), [
    (ROLLS, ALONG, 0.6), (NOTHING, ALONG, 0.6), (NOTHING, -ALONG[[1, 0, 2]], 0.6),
    (ROLLS, NOTHING, 1.5)])
def test_an_imu_that_is_off_is_named_and_left_out(
        exact: list[SensorReadings], turn: np.ndarray, force: np.ndarray, within_s: float) -> None:
    found = estimates(exact, turn, force)
    named = np.array(['imu' in of.problems for of in found])
    begin, end = round(BEGIN_S / TICK), round(END_S / TICK)
    assert not named[:begin].any()
    first = int(named.argmax())
    assert begin < first < begin + within_s / TICK
    assert named[first:end].all()
    errors = tilt_errors(found)
    swung = 2.0 * np.linalg.norm([SWAY.pose(k * TICK)[1][2] - (0.0, 0.0, 1.0)
                                  for k in range(end)], axis=1).max()
    assert errors[first:end].max() < swung  # it begins anew from where the body was a while ago
    assert errors[end - round(0.3 / TICK):end].max() < 0.05


def test_it_is_believed_again_once_it_has_agreed(exact: list[SensorReadings]) -> None:
    found = estimates(exact, ROLLS, ALONG)
    assert 'imu' not in found[-1].problems
    assert tilt_errors(found)[-1] < 0.02


def test_a_velocity_that_was_a_guess_puts_no_imu_in_doubt() -> None:
    """A body feels nothing for two seconds, in which it turns back: that its velocity was not what
    it was is nothing that the IMU told.
    """
    sway = Sway(np.array([0.08, 0.0, 0.01, 0.0, 0.03, 0.0]), np.array([8.0, 0, 9, 0, 6, 0]))
    there = 0.5 + (2.0 * np.pi + 0.5 * np.pi) / 8.0
    back = there + 2.0 + ((np.pi - 16.0) % (2.0 * np.pi)) / 8.0
    estimator, memory = BodyEstimator(ROBOT, EstimationParameters()), None
    for k, reading in enumerate(readings(ROBOT, sway, back + 1.5)):
        felt = not there <= k * TICK < back
        if not felt:
            reading = dataclasses.replace(reading, **{
                name: np.full_like(getattr(reading, name), np.nan) for name in (
                    'joint_position', 'joint_velocity', 'rate_in_base',
                    'specific_force_in_base', 'foot_force')})
        memory, estimate = estimator.step(memory, reading)
        assert ('imu' in estimate.problems) == (not felt)
    velocity, (_, R) = sway.velocity(k * TICK)[0], sway.pose(k * TICK)
    np.testing.assert_allclose(estimate.velocity_in_base, R.T @ velocity, atol=0.02)
    np.testing.assert_allclose(upward(estimate.quaternion.tolist()), R[2], atol=0.02)


def test_the_plane_of_the_feet_brings_a_vertical_back() -> None:
    feet = tuple((x, y, 0.1 * x - 0.05 * y) for x in (0.2, -0.2) for y in (0.1, -0.1))
    quaternion = turned((0.0, 0.0, 0.0, 1.0), (0.03, -0.02, 0.01))
    spoilt = turned(quaternion, (0.0, 0.0, 0.4))
    R = np.eye(3) + np.array(((0.0, 0.0, -0.02), (0.0, 0.0, -0.03), (0.02, 0.03, 0.0)))
    seen = tuple(tuple((R @ np.array(foot)).tolist()) for foot in feet)
    back = levelled_by_feet(spoilt, TerrainState(seen, (0.1, -0.05)), 1.0)
    up = np.array(upward(back))
    assert np.hypot(*up[:2]) < 0.2 * np.hypot(*upward(spoilt)[:2])
