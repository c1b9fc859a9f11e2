# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot walks on its own estimate, and the estimate is near the simulator's truth."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pytest
from core_examples import GAITS, TICK, suite_parameters

from dmp_cpg_ros.core.estimation.body_estimate import BodyEstimate
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.maths.rotations import roll_pitch_yaw
from dmp_cpg_ros.core.robot_model.grounds import Slope
from dmp_cpg_ros.core.robot_model.sensors import SensorParameters
from dmp_cpg_ros.core.robot_model.state import RobotState

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot, SensorNoise

STAND = 1.0  # [s]


@dataclass(frozen=True)
class Walk:
    """States and estimates of a walk, tick by tick."""

    states: list[RobotState]
    estimates: list[BodyEstimate]

    def errors(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the velocity (n, 3) [m/s], of roll, pitch, yaw (n, 3) [rad], of height (n,) [m]."""
        velocity = [estimate.velocity_in_base - state.base_velocity_in_base
                    for state, estimate in zip(self.states, self.estimates, strict=True)]
        angles = [np.subtract(roll_pitch_yaw(estimate.quaternion),
                              roll_pitch_yaw(state.base_quaternion))
                  for state, estimate in zip(self.states, self.estimates, strict=True)]
        height = [estimate.height - state.base_position_in_world[2]
                  for state, estimate in zip(self.states, self.estimates, strict=True)]
        wrapped = (np.array(angles) + np.pi) % (2.0 * np.pi) - np.pi
        return np.array(velocity), wrapped, np.array(height)


def walk(robot: MujocoRobot, gait: str, command: tuple[float, ...], seconds: float) -> Walk:
    loop, state = WalkingLoop(robot.description, GAITS[gait], suite_parameters()), robot.reset()
    states, estimates = [], []
    for k in range(round(seconds / TICK)):
        if k == round(STAND / TICK):
            loop.request(False)
            loop.command(*command)
        targets = loop.tick(state).targets
        assert loop.estimator_state is not None
        states.append(state)
        estimates.append(loop.estimator_state.estimate)
        state = robot.step(targets)
    assert not robot.fallen
    return Walk(states, estimates)


@lru_cache
def walked(gait: str, command: tuple[float, ...]) -> Walk:
    return walk(MujocoRobot(sensors=SensorParameters(), seed=2), gait, command, 5.0)


CASES = [('amble', (0.1,)), ('amble', (0.5,)), ('trot', (0.5,)), ('trot', (1.0,)),
         ('trot', (0.3, 0.0, 0.8))]


@pytest.mark.parametrize(('gait', 'command'), CASES)
def test_the_estimate_is_near_the_truth(gait: str, command: tuple[float, ...]) -> None:
    velocity, angles, height = walked(gait, command).errors()
    rms = np.sqrt((velocity[round(STAND / TICK):] ** 2).mean(axis=0))
    # A hundredth of the speed and what an encoder's noise makes of a foot's velocity: 0.02 rad/s
    # times a leg of 0.3 m. Vertically feet sink into the soft ground by millimetres at each step.
    assert rms[:2].max() < 0.01 * np.linalg.norm(command) + 0.006
    assert rms[2] < 0.02
    # A bias of the accelerometer of 0.02 m/s^2 (times 3) tilts by 0.02 · 3 / g while it is hidden.
    assert np.abs(angles[:, :2]).max() < 3.0 * 0.02 / 9.81 + 0.002
    # The bias of the gyroscope, 0.001 rad/s (times 3), less what standing taught of it.
    assert np.abs(angles[-1, 2]) < 0.003 * 5.0
    assert np.sqrt((height**2).mean()) < 0.005


@pytest.mark.parametrize(('gait', 'command'), CASES[:4])
def test_it_walks_as_it_is_told(gait: str, command: tuple[float, ...]) -> None:
    states = walked(gait, command).states[round(2.5 / TICK):]
    speed = np.mean([state.base_velocity_in_base[0] for state in states])
    assert speed == pytest.approx(command[0], rel=0.1, abs=0.01)
    yaw = [roll_pitch_yaw(state.base_quaternion)[2] for state in states]
    assert abs(yaw[-1] - yaw[0]) < 0.03


@pytest.mark.parametrize('degrees', [12.0, -12.0])
def test_it_walks_on_a_slope_parallel_to_the_ground_that_it_found(degrees: float) -> None:
    robot = MujocoRobot(sensors=SensorParameters(), seed=2, world=Slope(degrees=degrees))
    on_slope = walk(robot, 'trot', (0.4,), 8.0)
    last = on_slope.states[-1]
    assert last.base_position_in_world[0] > 0.4 * 6.0 * 0.8
    normal = np.mean([e.normal_in_world for e in on_slope.estimates[-250:]], axis=0)
    assert np.rad2deg(np.arctan2(-normal[0], normal[2])) == pytest.approx(degrees, abs=1.5)
    pitch = np.mean([roll_pitch_yaw(s.base_quaternion)[1] for s in on_slope.states[-250:]])
    assert np.rad2deg(pitch) == pytest.approx(-degrees, abs=2.5)


def test_the_filter_is_not_surer_than_it_may_be() -> None:
    """Its covariance is no smaller than the errors are.

    It is larger: errors of a standing foot last for a part of the stance, and the filter takes
    them for independent ones of 0.1 m/s in every tick.
    """
    velocity, _, _ = walked('trot', (0.5,)).errors()
    begin = round(STAND / TICK)
    variance = np.array([e.velocity_variance for e in walked('trot', (0.5,)).estimates])
    assert (velocity[begin:] ** 2).mean() < variance[begin:].mean()


@pytest.mark.parametrize(('gait', 'command'), CASES)
def test_what_odometry_tells_of_its_errors_is_no_less_than_they_are(
        gait: str, command: tuple[float, ...]) -> None:
    states, estimates = walked(gait, command).states, walked(gait, command).estimates
    _, angles, _ = walked(gait, command).errors()
    last, first = states[-1].base_position_in_world, states[0].base_position_in_world
    begun = estimates[0].position_in_world
    way = estimates[-1].position_in_world - begun - (last - first)
    assert (way**2 < estimates[-1].position_variance).all()
    assert estimates[-1].way > 0.9 * np.linalg.norm(last - first)
    variance = np.array([estimate.attitude_variance for estimate in estimates])
    assert ((angles**2).mean(axis=0) < variance.mean(axis=0)).all()
    turning = np.array([estimate.rate_in_base - state.base_rate_in_base
                        for state, estimate in zip(states, estimates, strict=True)])
    variance = np.array([estimate.rate_variance for estimate in estimates])
    assert ((turning**2).mean(axis=0) < variance.mean(axis=0)).all()


def test_noise_follows_its_parameters() -> None:
    robot = MujocoRobot()
    state, parameters = robot.reset(), SensorParameters(sensor_noise=2.0)
    noise = SensorNoise(parameters, 5, 4_000_000)
    seen = [noise.measured(state) for _ in range(4000)]
    for name, truth, deviation in (
            ('joint_position', state.joint_position, 1e-4),
            ('joint_velocity', state.joint_velocity, 0.02),
            ('acceleration_in_base', state.acceleration_in_base, 1.4e-3 * 250**0.5),
            ('gyro_in_base', state.base_rate_in_base, 6.1e-5 * 250**0.5)):
        error = np.array([getattr(one, name) for one in seen]) - truth
        assert error.std(axis=0) == pytest.approx(2.0 * deviation, rel=0.1)
    biases = np.array([SensorNoise(parameters, seed, 4_000_000).measured(state).gyro_in_base
                       for seed in range(300)])
    assert biases.std() == pytest.approx(2.0 * (1e-3**2 + (6.1e-5**2 * 250)) ** 0.5, rel=0.1)
    for name in ('base_position_in_world', 'base_quaternion', 'base_velocity_in_base',
                 'base_rate_in_base', 'foot_force', 'joint_effort'):
        assert np.array_equal(getattr(seen[0], name), getattr(state, name))  # the truth stays


def test_equal_seeds_give_equal_runs_and_no_noise_gives_the_truth() -> None:
    def run(robot: MujocoRobot) -> list[RobotState]:
        loop, states = WalkingLoop(robot.description, GAITS['trot']), [robot.reset()]
        for _ in range(50):
            states.append(robot.step(loop.tick(states[-1]).targets))
        return states

    noisy = MujocoRobot(sensors=SensorParameters(), seed=3)
    first, again = run(noisy), run(noisy)
    other = run(MujocoRobot(sensors=SensorParameters(), seed=4))
    plain = run(MujocoRobot())
    silent = run(MujocoRobot(sensors=SensorParameters(sensor_noise=0.0)))
    for one, two in ((first, again), (plain, silent)):
        for a, b in zip(one, two, strict=True):
            assert np.array_equal(a.joint_position, b.joint_position)
            assert np.array_equal(a.measured_rate_in_base, b.measured_rate_in_base)
    assert not np.array_equal(first[-1].joint_position, other[-1].joint_position)


def test_only_sensors_enter_the_estimate() -> None:
    """The truth may be anything: the estimate is the same, bit for bit."""
    walk_ = walked('amble', (0.5,))
    loop = WalkingLoop(MujocoRobot().description, GAITS['amble'], suite_parameters())
    random = np.random.default_rng(0)
    for state, estimate in zip(walk_.states[:100], walk_.estimates, strict=False):
        loop.tick(dataclasses.replace(
            state, base_position_in_world=random.normal(size=3),
            base_quaternion=random.normal(size=4), base_velocity_in_base=random.normal(size=3),
            base_rate_in_base=random.normal(size=3)))
        assert loop.estimator_state is not None
        found = loop.estimator_state.estimate
        assert np.array_equal(found.quaternion, estimate.quaternion)
        assert np.array_equal(found.velocity_in_base, estimate.velocity_in_base)
