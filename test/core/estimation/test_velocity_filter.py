# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parts of the estimator: Jacobians against differences, rotations, contact forces, planes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import pytest
from core_examples import GRAVITY, differences, quadruped

from dmp_cpg_ros.core.estimation.leg_odometry import (
    STEEPEST,
    LegOdometry,
    fitted_slope,
    force_from_torque,
    normal_in_world,
    turn_rate_of_feet,
)
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.core.estimation.velocity_filter import (
    FilterState,
    predict,
    settle,
    transition,
    update,
)
from dmp_cpg_ros.core.gait.contact_feedback import quarter_weight
from dmp_cpg_ros.core.maths.rotations import levelled, roll_pitch_yaw, turned
from dmp_cpg_ros.core.maths.vec3 import Triple, minus, plus, rotation, triple
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics

NOISE = EstimationParameters()


def rotation_matrix(quaternion: Sequence[float]) -> np.ndarray:
    return np.array(rotation(quaternion))


def skew(v: np.ndarray) -> np.ndarray:
    """Matrix of v × ·."""
    return np.cross(v, np.eye(3)).T


def some_state(rng: np.random.Generator) -> FilterState:
    quaternion = turned((0.0, 0.0, 0.0, 1.0), rng.normal(0.0, 0.5, 3).tolist())
    root = rng.normal(0.0, 0.1, (12, 12))
    velocity, gyro_bias, bias = (
        triple(rng.normal(0.0, size, 3).tolist()) for size in (1.0, 0.01, 0.1))
    return FilterState(quaternion, velocity, gyro_bias, bias, root @ root.T)


def moved(state: FilterState, error: np.ndarray) -> FilterState:
    """State plus an error state."""
    turn, velocity, gyro_bias, bias = (triple(part) for part in error.reshape(4, 3).tolist())
    return FilterState(turned(state.quaternion, turn), plus(state.velocity_in_base, velocity),
                       plus(state.gyro_bias, gyro_bias), plus(state.accelerometer_bias, bias),
                       state.covariance)


def error_between(state: FilterState, other: FilterState) -> np.ndarray:
    """Error state, to first order, that takes a state to another."""
    E = rotation_matrix(state.quaternion).T @ rotation_matrix(other.quaternion)
    turn = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
    return np.concatenate((turn, minus(other.velocity_in_base, state.velocity_in_base),
                           minus(other.gyro_bias, state.gyro_bias),
                           minus(other.accelerometer_bias, state.accelerometer_bias)))


@pytest.mark.parametrize('_', range(5))
def test_the_jacobian_of_the_prediction(_: int, rng: np.random.Generator) -> None:
    state, dt = some_state(rng), 1e-3
    rate, force = (triple(rng.normal(0.0, size, 3).tolist()) for size in (2.0, 10.0))
    after = predict(state, rate, force, dt, NOISE)
    by_differences = differences(
        lambda e: error_between(after, predict(moved(state, e), rate, force, dt, NOISE)),
        np.zeros(12), 1e-5)
    up = triple(rotation_matrix(state.quaternion)[2].tolist())
    F = transition(state.velocity_in_base, up, minus(rate, state.gyro_bias), dt)
    # F is of first order in dt; rates here are up to 20 per second.
    np.testing.assert_allclose(F, by_differences, atol=(20.0 * dt) ** 2)
    assert np.abs(by_differences - np.eye(12)).max() > 5.0 * dt


def textbook_update(state: FilterState, rate: np.ndarray, contact: np.ndarray,
                    measured: np.ndarray, trust: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Error state and covariance from the filter's equations as they are in books: the feet's
    measurements one below the other.
    """
    n, P = len(trust), state.covariance
    H = np.tile(np.eye(12)[3:6], (n, 1))
    y = measured - state.velocity_in_base - np.cross(rate - state.gyro_bias, contact)
    variance = (NOISE.foot_noise / trust) ** 2
    spread = np.diag(H @ P @ H.T).reshape(n, 3) + variance[:, None]
    distance = (y * y / spread).sum(axis=1)
    nu = NOISE.foot_freedom
    variance = variance * np.maximum((nu + distance) / (nu + 3.0), 1.0)
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + np.diag(np.repeat(variance, 3)))
    return K @ y.ravel(), P - K @ H @ P


@pytest.mark.parametrize('n', [1, 2, 4])
def test_one_measurement_stands_for_all_feet(n: int, rng: np.random.Generator) -> None:
    state, rate = some_state(rng), rng.normal(0.0, 2.0, 3)
    contact, trust = rng.normal(0.0, 0.3, (n, 3)), rng.uniform(0.1, 1.0, n)
    measured = state.velocity_in_base + rng.normal(0.0, 0.3, (n, 3))
    error, covariance = textbook_update(state, rate, contact, measured, trust)
    # and a foot that is not trusted measures nothing
    after, distance = update(state, rate, [*contact, np.ones(3)], [*measured, np.ones(3)],
                             [*trust, 0.0], NOISE)
    np.testing.assert_allclose(error_between(moved(state, error), after), 0.0, atol=1e-12)
    np.testing.assert_allclose(after.covariance, covariance, atol=1e-12)
    assert distance[-1] == 0.0
    same, _ = update(state, rate, contact, measured, np.zeros(n), NOISE)
    assert same is state


def test_a_foot_measures_the_velocity_over_it(rng: np.random.Generator) -> None:
    state, rate = some_state(rng), rng.normal(0.0, 2.0, 3)
    contact = rng.normal(0.0, 0.3, (4, 3))

    def predicted(error: np.ndarray) -> np.ndarray:
        other = moved(state, error)
        return (other.velocity_in_base + np.cross(rate - other.gyro_bias, contact)).ravel()

    exact = differences(predicted, np.zeros(12))
    np.testing.assert_allclose(exact[:, 3:6], np.tile(np.eye(3), (4, 1)), atol=1e-8)
    assert not exact[:, [0, 1, 2, 9, 10, 11]].any()
    # It depends on the gyroscope's bias, which walking feet shall not tell.
    assert exact[:, 6:9].any()
    measured = predicted(np.full(12, 0.01)).reshape(4, 3)
    blank = dataclasses.replace(state, covariance=np.eye(12))
    after, _ = update(blank, rate, contact, measured, np.ones(4), NOISE)
    assert np.array_equal(after.gyro_bias, state.gyro_bias)


def test_an_update_reduces_the_covariance_and_keeps_it_one(rng: np.random.Generator) -> None:
    state = some_state(rng)
    contact = rng.normal(0.0, 0.3, (3, 3))
    measured = np.tile(state.velocity_in_base, (3, 1))
    after, _ = update(state, state.gyro_bias, contact, measured, np.full(3, 0.7), NOISE)
    assert np.array_equal(after.covariance, after.covariance.T)
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-12
    assert np.linalg.eigvalsh(state.covariance - after.covariance).min() > -1e-9
    np.testing.assert_allclose(after.velocity_in_base, state.velocity_in_base, atol=1e-12)


def test_standing_still_makes_the_reading_the_bias(rng: np.random.Generator) -> None:
    state = dataclasses.replace(some_state(rng), covariance=np.diag(np.full(12, 0.01)))
    rate = plus(state.gyro_bias, (0.003, -0.002, 0.001))
    after = settle(state, rate, 0.1)  # as uncertain as the bias was: half the way
    np.testing.assert_allclose(after.gyro_bias, 0.5 * np.add(state.gyro_bias, rate))
    assert np.array_equal(after.velocity_in_base, state.velocity_in_base)
    assert after.covariance.diagonal()[6:9] == pytest.approx(np.full(3, 0.005))
    state = some_state(rng)
    after = settle(state, rate, 0.1)
    assert np.array_equal(after.quaternion, state.quaternion)
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-12
    # The bias is corrected as the full filter would correct it.
    bias = np.arange(6, 9)
    P = state.covariance[np.ix_(bias, bias)]
    K = P @ np.linalg.inv(P + 0.01 * np.eye(3))
    np.testing.assert_allclose(after.gyro_bias, state.gyro_bias + K @ minus(rate, state.gyro_bias))
    np.testing.assert_allclose(after.covariance[np.ix_(bias, bias)], (np.eye(3) - K) @ P,
                               atol=1e-12)


def test_a_foot_that_disagrees_weighs_less(rng: np.random.Generator) -> None:
    state = dataclasses.replace(some_state(rng), covariance=np.diag(np.full(12, 0.01)))
    contact, zero = np.zeros((2, 3)), np.zeros(3)
    gains = []
    for size in (0.01, 1.0, 100.0):
        measured = state.velocity_in_base + np.array([[size, 0.0, 0.0], [0.0, 0.0, 0.0]])
        after, distance = update(state, zero, contact, measured, np.ones(2), NOISE)
        gains.append(minus(after.velocity_in_base, state.velocity_in_base)[0] / size)
        assert distance[0] > distance[1]
    assert gains[0] > 1.5 * gains[1] > 10.0 * gains[2] > 0.0


def test_a_body_that_accelerates_unseen_does_not_tilt() -> None:
    """What a guess misses is no error of the vertical, as what an IMU does not tell may be."""
    zero, level = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    tilts = []
    for guessed in (False, True):
        state = FilterState(level, zero, zero, zero, 1e-3 * np.eye(12))
        for _ in range(100):
            state = predict(state, zero, (0.0, 0.0, GRAVITY), 4e-3, NOISE, guessed)
        after, _ = update(state, zero, [(0.2, 0.1, -0.3)], [(0.3, 0.0, 0.0)], [1.0], NOISE)
        tilts.append(np.abs(roll_pitch_yaw(np.array(after.quaternion))).max())
    assert tilts[0] > 0.01 and not tilts[1]


def test_feet_tell_the_turn_rate(rng: np.random.Generator) -> None:
    v, rate = rng.normal(0.0, 1.0, 3), rng.normal(0.0, 1.0, 3)
    contact = np.array([[x, y, -0.3] for x in (0.2, -0.2) for y in (0.1, -0.1)])
    measured = v + np.cross(rate, contact)
    trust, nothing, other = np.array([1.0, 0.3, 0.8, 1.0]), np.zeros(3), rng.normal(size=3)
    alone = turn_rate_of_feet(contact, measured, trust, nothing)
    assert np.linalg.norm(alone - rate) < 0.2 * np.linalg.norm(rate)
    np.testing.assert_allclose(turn_rate_of_feet(contact, measured, trust, rate), rate)
    two = turn_rate_of_feet(contact[:2], measured[:2], np.ones(2), other)  # on a line along y
    assert two[1] == pytest.approx(other[1])
    assert two[0] == pytest.approx(0.8 * rate[0] + 0.2 * other[0])
    assert two[2] == pytest.approx(rate[2], rel=0.05)
    one = turn_rate_of_feet(contact[:1], measured[:1], trust[:1], other)
    np.testing.assert_allclose(one, other)


def test_a_foot_that_has_just_come_down_turns_no_body() -> None:
    """It still moves, and is far from the line between the two that stand."""
    contact = np.array([[0.2, 0.1, -0.3], [-0.2, -0.1, -0.3], [0.2, -0.1, -0.3]])
    measured = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.5]])
    turns = [np.linalg.norm(turn_rate_of_feet(contact, measured, np.array([1.0, 1.0, trust]),
                                              np.zeros(3))) for trust in (0.1, 0.3, 1.0)]
    assert turns[0] < 0.1 * turns[2] < 0.5 * turns[1] < turns[2]


def test_rotations_agree_with_each_other(rng: np.random.Generator) -> None:
    for _ in range(10):
        v, u = rng.normal(0.0, 1.0, 3), rng.normal(0.0, 1.0, 3)
        q = turned((0.0, 0.0, 0.0, 1.0), v)
        R = rotation_matrix(q)
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        angle = np.linalg.norm(v)
        np.testing.assert_allclose(
            R, np.eye(3) + np.sin(angle) / angle * skew(v)
            + (1.0 - np.cos(angle)) / angle**2 * skew(v) @ skew(v), atol=1e-12)  # Rodrigues
        np.testing.assert_allclose(rotation_matrix(turned(q, u)), R @ rotation_matrix(
            turned((0.0, 0.0, 0.0, 1.0), u)), atol=1e-12)
    for small in (0.0, 1e-12, 1e-7):
        np.testing.assert_allclose(
            turned(q, np.full(3, small)), q, atol=2.0 * small + 1e-15)


def test_a_body_at_rest_is_levelled_by_its_accelerometer(rng: np.random.Generator) -> None:
    for _ in range(10):
        R = rotation_matrix(turned((0.0, 0.0, 0.0, 1.0), rng.normal(0.0, 0.6, 3)))
        q = levelled(GRAVITY * R[2])
        np.testing.assert_allclose(rotation_matrix(q)[2], R[2], atol=1e-12)
        assert roll_pitch_yaw(np.array(q))[2] == pytest.approx(0.0, abs=1e-12)


def test_torques_tell_the_force_on_a_foot() -> None:
    for leg in quadruped().legs:
        kinematics = LegKinematics(leg)
        q = np.array([0.1, 0.7, leg.knee_sign * 1.4])
        J, force = kinematics.jacobian_in_base(q), np.array([3.0, -2.0, 25.0])
        normal = np.array([0.0, 0.1, 0.995])
        assert force_from_torque(J, -J.T @ force, normal) == pytest.approx(normal @ force)
    assert force_from_torque(np.zeros((3, 3)), np.ones(3), normal) == 0.0


def test_a_rolling_foot_measures_the_whole_speed() -> None:
    """The centre of a foot of radius rho under a shank that turns at s moves at rho s."""
    robot = quadruped()
    odometry, leg = LegOdometry(robot), LegKinematics(robot.legs[0])
    q, radius = np.array([0.0, 0.8, -1.5]), robot.legs[0].foot_radius
    v = np.array([0.7, 0.0, 0.0])  # of the base; the ground is level and so is the base
    pitching = np.array([0.0, *robot.legs[0].axis_sign[1:]])
    # J q' = -v + s x rho n with s = pitching . q' about y, so that s x rho n = (rho s, 0, 0).
    rolling = np.outer((radius, 0.0, 0.0), pitching)
    q_dot = np.linalg.solve(leg.jacobian_in_base(q) - rolling, -v)
    motion = odometry.motion(np.tile(q, 4).tolist(), np.tile(q_dot, 4).tolist(), (0.0, 0.0, 1.0))
    np.testing.assert_allclose(motion.velocity_in_base[0], v, atol=1e-12)
    np.testing.assert_allclose(
        motion.contact_in_base[0], leg.foot_in_base(q) - (0.0, 0.0, radius), atol=1e-12)
    assert abs((leg.jacobian_in_base(q) @ q_dot)[0]) < 0.97 * 0.7  # what rolling leaves out


def test_a_soft_foot_rolls_on_the_radius_of_its_load() -> None:
    robot = quadruped()
    soft = dataclasses.replace(robot, legs=tuple(
        dataclasses.replace(leg, rolling_radius=(0.02, 0.014)) for leg in robot.legs))
    q, q_dot, level = np.tile((0.0, 0.8, -1.5), 4), np.tile((0.0, 2.0, 1.0), 4), (0.0, 0.0, 1.0)
    quarter = quarter_weight(robot)

    def measured(radius: float) -> tuple[Triple, ...]:
        hard = dataclasses.replace(robot, legs=tuple(
            dataclasses.replace(leg, foot_radius=radius) for leg in robot.legs))
        return LegOdometry(hard).motion(q.tolist(), q_dot.tolist(), level).velocity_in_base

    odometry = LegOdometry(soft)
    for force, radius in ((quarter, 0.02), (1.5 * quarter, 0.017), (2.0 * quarter, 0.014),
                          (float('nan'), 0.02), (-1e9, 0.026), (1e9, 0.002)):
        of_force = odometry.motion(q.tolist(), q_dot.tolist(), level, [force] * 4)
        np.testing.assert_allclose(of_force.velocity_in_base, measured(radius), atol=1e-12)
    known = LegOdometry(robot).motion(q.tolist(), q_dot.tolist(), level, [2.0 * quarter] * 4)
    assert known == LegOdometry(robot).motion(q.tolist(), q_dot.tolist(), level)


def test_a_plane_is_fitted_through_footholds() -> None:
    points = np.array([[0.2, 0.1, 0.0], [0.2, -0.1, 0.0], [-0.2, 0.1, 0.0], [-0.2, -0.1, 0.0]])
    for slope in ((0.1, 0.0), (0.0, -0.2), (-0.15, 0.15)):
        tilted = points + np.array([3.0, -5.0, 2.0])
        tilted[:, 2] += points[:, :2] @ slope
        # Ridge regression falls short by the ratio of NARROWEST to the points' spread.
        np.testing.assert_allclose(fitted_slope(tilted), slope, rtol=0.03, atol=1e-12)
        normal = np.array(normal_in_world(slope))
        assert normal @ normal == pytest.approx(1.0)
        np.testing.assert_allclose(np.diff(tilted, axis=0) @ normal, 0.0, atol=1e-12)


def test_impossible_planes_stay_bounded() -> None:
    cliff = np.array([[0.2, 0.1, 5.0], [0.2, -0.1, 5.0], [-0.2, 0.1, 0.0], [-0.2, -0.1, 0.0]])
    assert np.linalg.norm(fitted_slope(cliff)) == pytest.approx(STEEPEST)
    assert fitted_slope(np.ones((4, 3))) == (0.0, 0.0)
    line = np.array([[i * 0.1, 0.0, 0.0] for i in range(4)])
    assert np.isfinite(fitted_slope(line)).all()


