# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The estimator on motions that are known exactly: it converges, bad sensors do not harm it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from body_motions import SWAY, Sway, point_footed, readings
from core_examples import GRAVITY, TICK

from dmp_cpg_ros.core.estimation.body_estimate import BodyEstimate
from dmp_cpg_ros.core.estimation.estimator import BodyEstimator, EstimatorState
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.core.maths.rotations import roll_pitch_yaw, turned
from dmp_cpg_ros.core.maths.vec3 import plus, rotation
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import LEGS

ROBOT = point_footed()
SECONDS = 3.0
Change = Callable[[int, SensorReadings], SensorReadings]
Memory = Callable[[EstimatorState], EstimatorState]


@pytest.fixture(scope='module')
def exact() -> list[SensorReadings]:
    return list(readings(ROBOT, SWAY, SECONDS))


def run(sensors: list[SensorReadings], change: Change = lambda k, r: r,
        kick: tuple[int, Memory] | None = None) -> list[BodyEstimate]:
    """Estimates of all ticks; the estimator's state may be kicked after one of them."""
    estimator, memory = BodyEstimator(ROBOT, EstimationParameters()), None
    estimates = []
    for k, reading in enumerate(sensors):
        memory, estimate = estimator.step(memory, change(k, reading))
        if kick is not None and k == kick[0]:
            memory = kick[1](memory)
        estimates.append(estimate)
    return estimates


def errors(estimates: list[BodyEstimate], sway: Sway = SWAY) -> np.ndarray:
    """Errors of velocity [m/s] and of roll, pitch, yaw [rad], (n, 6)."""
    rows = []
    for k, estimate in enumerate(estimates):
        _, R = sway.pose(k * TICK)
        velocity, _ = sway.velocity(k * TICK)
        E = R.T @ np.array(rotation(estimate.quaternion.tolist()))
        turn = 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
        rows.append(np.concatenate((estimate.velocity_in_base - R.T @ velocity, turn)))
    return np.array(rows)


def test_it_follows_an_exact_motion(exact: list[SensorReadings]) -> None:
    estimates = run(exact)
    found = np.abs(errors(estimates)).max(axis=0)
    speed = max(np.linalg.norm(SWAY.velocity(k * TICK)[0]) for k in range(len(exact)))
    assert speed > 0.15
    # What is left is the error of integration, of second order in tick times rate (0.004 · 9)²,
    # and that the slow begin of the motion is taken for the bias of the gyroscope.
    assert found[:3].max() < 2.0 * 0.036**2 * speed
    assert found[3:].max() < 0.0005
    assert max(abs(e.position_in_world - SWAY.pose(k * TICK)[0]).max()
               for k, e in enumerate(estimates)) < 0.001
    assert not any(estimate.problems for estimate in estimates)


def test_wrong_velocity_and_tilt_converge(exact: list[SensorReadings]) -> None:
    def kick(memory: EstimatorState) -> EstimatorState:
        state = memory.filter
        wrong = dataclasses.replace(
            state, velocity_in_base=plus(state.velocity_in_base, (0.3, -0.2, 0.1)),
            quaternion=turned(state.quaternion, (0.03, -0.02, 0.0)),
            covariance=np.diag(np.repeat((0.05, 0.3, 0.001, 0.01), 3) ** 2))
        return dataclasses.replace(memory, filter=wrong)

    found = np.abs(errors(run(exact, kick=(200, kick))))
    assert found[201, 3:5].max() > 0.02  # the feet correct the velocity at once, the tilt slowly
    assert found[201, :3].max() > 10.0 * found[-1, :3].max()
    assert found[-1, :3].max() < 0.001
    assert found[-1, 3:5].max() < 0.05 * 0.03


@pytest.mark.parametrize('axis', range(3))
def test_standing_still_tells_the_bias_of_the_gyroscope(axis: int) -> None:
    bias = 0.005 * np.eye(3)[axis]
    still = Sway(np.zeros(6), np.ones(6))

    def biased(_: int, reading: SensorReadings) -> SensorReadings:
        return dataclasses.replace(reading, rate_in_base=reading.rate_in_base + bias)

    estimates = run(list(readings(ROBOT, still, 2.0)), biased)
    # Without any bias in the filter this would stay 0.005.
    assert abs(estimates[-1].rate_in_base).max() < 0.05 * 0.005
    assert abs(roll_pitch_yaw(estimates[-1].quaternion)[2]) < 0.005 * 2.0


def test_yaw_of_a_moving_robot_drifts_with_the_bias(exact: list[SensorReadings]) -> None:
    moving = [reading for reading in exact if reading.time_ns * 1e-9 > SWAY.begin + 0.2]
    drifts = []
    for bias in (0.0, 0.01, 0.02):
        estimates = run(moving, lambda _, r, b=bias: dataclasses.replace(  # type: ignore[misc]
            r, rate_in_base=r.rate_in_base + (0.0, 0.0, b)))
        drifts.append(roll_pitch_yaw(estimates[-1].quaternion)[2])
    time = len(moving) * TICK
    one, two = drifts[1] - drifts[0], drifts[2] - drifts[0]
    assert one == pytest.approx(0.01 * time, rel=0.1)  # nobody else knows yaw
    assert two == pytest.approx(2.0 * one, rel=0.02)


@pytest.mark.parametrize('bias', [(0.1, 0, 0), (0, -0.1, 0), (0, 0, 0.1)])
def test_a_biased_accelerometer_tilts_by_its_share_of_gravity(
        exact: list[SensorReadings], bias: tuple[float, float, float]) -> None:
    estimates = run(exact, lambda _, r: dataclasses.replace(
        r, specific_force_in_base=r.specific_force_in_base + bias))
    found = np.abs(errors(estimates))
    assert found[:, 3:5].max() < 1.5 * 0.1 / GRAVITY
    assert found[:, :3].max() < 0.02


# Sensors that fail -----------------------------------------------------------------------------

NAN = float('nan')


def spoiled(reading: SensorReadings, **parts: slice) -> SensorReadings:
    """Reading with NaN in parts of its arrays."""
    values = {}
    for name, part in parts.items():
        values[name] = getattr(reading, name).copy()
        values[name][part] = NAN
    return dataclasses.replace(reading, **values)


FAILURES = {
    'imu': ({'rate_in_base': slice(0, 1), 'specific_force_in_base': slice(0, 3)}, 0.01),
    'gyro': ({'rate_in_base': slice(0, 3)}, 0.01),
    'joints of fl': ({'joint_position': slice(0, 1)}, 0.01),
    'joints of rr': ({'joint_velocity': slice(9, 12)}, 0.01),
    'contact of fl': ({'foot_force': slice(0, 1)}, 0.01),
    'all contacts': ({'foot_force': slice(0, 4)}, 0.01),
    'all joints': ({'joint_position': slice(0, 12)}, 0.05),
    'contacts and torques': ({'foot_force': slice(0, 4), 'joint_effort': slice(0, 12)}, 0.05),
    'everything': ({name: slice(0, 12) for name in (
        'joint_position', 'joint_velocity', 'joint_effort', 'rate_in_base',
        'specific_force_in_base', 'foot_force')}, 0.4),
}
"""What is NaN from 1.5 s to 1.7 s, and the error of the velocity that is accepted meanwhile."""


@pytest.mark.parametrize('failure', list(FAILURES))
def test_a_failing_sensor_is_named_and_overcome(exact: list[SensorReadings], failure: str) -> None:
    parts, accepted = FAILURES[failure]
    first, past = round(1.5 / TICK), round(1.7 / TICK)
    estimates = run(exact, lambda k, r: spoiled(r, **parts) if first <= k < past else r)
    found = np.abs(errors(estimates))
    assert np.isfinite(found).all()
    assert found[:, :3].max() < accepted
    assert found[-1, :3].max() < 0.005
    assert found[-1, 3:5].max() < 0.01
    for k, estimate in enumerate(estimates):
        assert bool(estimate.problems) == (first <= k < past)
    named = {name for estimate in estimates for name in estimate.problems}
    expected = {'gyro': {'imu'}, 'all contacts': {f'contact of {leg}' for leg in LEGS},
                'all joints': {f'joints of {leg}' for leg in LEGS},
                'contacts and torques': {f'contact of {leg}' for leg in LEGS}}
    if failure != 'everything':
        assert named == expected.get(failure, {failure})


@pytest.mark.parametrize('value', [np.inf, -np.inf, 1e30, 1e5])
def test_impossible_numbers_count_as_missing(exact: list[SensorReadings], value: float) -> None:
    estimates = run(exact[:200], lambda k, r: dataclasses.replace(
        r, rate_in_base=np.array([0.0, value, 0.0])) if k == 150 else r)
    assert estimates[150].problems == ('imu',)
    assert np.abs(errors(estimates)).max() < 0.01


def test_a_body_that_feels_nothing_keeps_its_vertical(exact: list[SensorReadings]) -> None:
    """Without IMU it follows the feet; footholds that nobody feels any more do not turn with it,
    and turned it on and on.
    """
    def steps(memory: EstimatorState) -> EstimatorState:
        feet = tuple((x, y, z + 0.03 * (i < 2))
                     for i, (x, y, z) in enumerate(memory.terrain.foothold_in_world))
        return dataclasses.replace(memory, terrain=dataclasses.replace(
            memory.terrain, foothold_in_world=feet))

    begins = 200
    estimates = run(exact, lambda k, reading: reading if k <= begins else spoiled(
        reading, joint_position=slice(None), joint_velocity=slice(None),
        rate_in_base=slice(None), specific_force_in_base=slice(None), foot_force=slice(None)),
        kick=(begins, steps))
    up = [rotation(of.quaternion.tolist())[2] for of in (estimates[begins + 10], estimates[-1])]
    assert estimates[-1].problems and np.allclose(*up, atol=1e-3)


def test_it_can_begin_with_bad_sensors(exact: list[SensorReadings]) -> None:
    everything = FAILURES['everything'][0]
    estimates = run(exact, lambda k, r: spoiled(r, **everything) if k < 3 else r)
    assert all(np.isfinite(estimate.quaternion).all() for estimate in estimates)
    assert np.abs(errors(estimates))[-1, :5].max() < 0.01


def test_a_robot_that_begins_anew_is_estimated_anew(exact: list[SensorReadings]) -> None:
    once = run(exact[:300])
    again = run(exact[:300] + exact[:300])[300:]
    for first, second in zip(once, again, strict=True):
        assert np.array_equal(first.quaternion, second.quaternion)
        assert np.array_equal(first.velocity_in_base, second.velocity_in_base)


def test_a_slipping_foot_is_not_believed(exact: list[SensorReadings]) -> None:
    """One foot of four slides at 0.5 m/s for 0.2 s; their mean would be off by 0.125 m/s."""
    first, past, slide = round(1.5 / TICK), round(1.7 / TICK), np.array([0.5, 0.0, 0.0])

    def slipping(k: int, reading: SensorReadings) -> SensorReadings:
        if not first <= k < past:
            return reading
        J = estimator.odometry.legs.kinematics[0].jacobian_in_base(reading.joint_position[:3])
        velocity = reading.joint_velocity.copy()
        velocity[:3] += np.linalg.solve(J, slide)
        return dataclasses.replace(reading, joint_velocity=velocity)

    estimator = BodyEstimator(ROBOT, EstimationParameters())
    robust = np.abs(errors(run(exact, slipping)))[:, :3].max()
    assert robust < 0.4 * 0.125


# Symmetry, Jacobians, ground -------------------------------------------------------------------


def mirrored(reading: SensorReadings) -> SensorReadings:
    """Left and right exchanged."""
    swap = np.array([3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8])
    sign = np.tile([-1.0, 1.0, 1.0], 4)
    joints = {name: getattr(reading, name)[swap] * sign
              for name in ('joint_position', 'joint_velocity', 'joint_effort')}
    return dataclasses.replace(
        reading, **joints, rate_in_base=reading.rate_in_base * (-1.0, 1.0, -1.0),
        specific_force_in_base=reading.specific_force_in_base * (1.0, -1.0, 1.0),
        foot_force=reading.foot_force[[1, 0, 3, 2]])


def test_left_and_right_are_alike(exact: list[SensorReadings]) -> None:
    some = [dataclasses.replace(reading, foot_force=reading.foot_force * (1.0, 0.3, 0.0, 1.2))
            for reading in exact]
    one, other = run(some)[-1], run([mirrored(reading) for reading in some])[-1]
    close = {'rtol': 0.0, 'atol': 1e-10}
    np.testing.assert_allclose(other.velocity_in_base, one.velocity_in_base * (1, -1, 1), **close)
    np.testing.assert_allclose(other.quaternion, one.quaternion * (-1, 1, -1, 1), **close)
    np.testing.assert_allclose(
        other.position_in_world, one.position_in_world * (1, -1, 1), **close)
    np.testing.assert_allclose(other.normal_in_world, one.normal_in_world * (1, -1, 1), **close)
    assert other.height == pytest.approx(one.height, abs=1e-10)


@pytest.mark.parametrize('slope', [(0.0, 0.0), (0.2, 0.0), (0.0, -0.15), (0.1, 0.1)])
def test_the_ground_is_found_under_the_feet(slope: tuple[float, float]) -> None:
    tilted = dataclasses.replace(SWAY, slope=np.array(slope))
    estimate = run(list(readings(ROBOT, tilted, 1.5)))[-1]
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1.0 + np.dot(slope, slope))
    assert np.arccos(min(estimate.normal_in_world @ normal, 1.0)) < 0.05 * np.linalg.norm(
        slope) + 0.003
    place = SWAY.pose((round(1.5 / TICK) - 1) * TICK)[0]
    assert estimate.height == pytest.approx(float(place @ normal), abs=0.004)


def test_after_a_while_without_readings_it_goes_on_with_the_attitude_that_it_had(
        exact: list[SensorReadings]) -> None:
    """One reading of an accelerometer in the middle of a stride may be far off, and is believed
    of a body whose feet tell nothing.
    """
    estimator, memory = BodyEstimator(ROBOT, EstimationParameters()), None
    for reading in exact[:300]:
        memory, before = estimator.step(memory, reading)
    assert memory is not None
    blow = dataclasses.replace(exact[450], specific_force_in_base=np.array((9.5, 0.0, 1.0)))
    unfelt = dataclasses.replace(blow, foot_force=np.full(len(LEGS), np.nan))
    assert abs(roll_pitch_yaw(estimator.step(None, unfelt)[1].quaternion)[1]) > 0.8
    memory, estimate = estimator.resumed(memory, blow)
    np.testing.assert_array_equal(estimate.quaternion, before.quaternion)
    assert np.linalg.norm(estimate.position_in_world - before.position_in_world) < 0.1
    assert estimate.way >= before.way
    for reading in exact[451:]:
        memory, estimate = estimator.step(memory, reading)
    k = len(exact) - 1
    off = np.abs(errors([*[estimate] * k, estimate])[k])
    assert off[:5].max() < 0.01 and off[5] < 0.1  # nothing tells how far it has turned meanwhile


@pytest.mark.parametrize('speed', [0.5, 1.0, 2.0])
def test_who_walked_and_stands_after_a_while_without_readings_believes_its_imu(
        speed: float) -> None:
    """The speed of before, of which the feet take all back at once, is no fault of the IMU."""
    still = list(readings(ROBOT, dataclasses.replace(SWAY, begin=9.0), 2.0))
    estimator, memory = BodyEstimator(ROBOT, EstimationParameters()), None
    for reading in still[:100]:
        memory, _ = estimator.step(memory, reading)
    memory = dataclasses.replace(memory, filter=dataclasses.replace(
        memory.filter, velocity_in_base=(speed, 0.0, 0.0)))
    memory, _ = estimator.resumed(memory, still[200])
    for reading in still[201:]:
        memory, estimate = estimator.step(memory, reading)
        assert not memory.imu.doubted_s and not estimate.problems
        assert np.abs(roll_pitch_yaw(estimate.quaternion)).max() < 1e-3
        assert np.linalg.norm(estimate.velocity_in_base) < 1e-2
