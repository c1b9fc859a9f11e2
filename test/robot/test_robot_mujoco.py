# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The MuJoCo robot: it stands, obeys Newton, repeats itself, and says when it cannot go on."""

from __future__ import annotations

import re
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.sensors import SensorParameters
from dmp_cpg_ros.core.robot_model.state import JointTargets, RobotState
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.port import RobotError
from dmp_cpg_ros.robot.robot_file import own_robot_file

ZERO = np.zeros(12)


def hold(position):
    return JointTargets(position, ZERO, ZERO)


def run(robot, ticks, targets):
    state = None
    for _ in range(ticks):
        state = robot.step(targets)
    return state


def wriggle(robot, ticks=120):
    """All states of a lively motion."""
    states = [robot.reset()]
    home = states[0].joint_position
    rng = np.random.default_rng(3)
    for _ in range(ticks):
        states.append(robot.step(JointTargets(home + rng.normal(0, 0.1, 12), rng.normal(0, 1, 12),
                                              rng.normal(0, 1, 12))))
    return states


@pytest.fixture(scope='module')
def robot():
    return MujocoRobot()


def test_it_starts_standing_with_its_weight_on_its_feet(robot):
    state = robot.reset()
    assert state.time_ns == 0
    height = robot.description.stance_height
    assert state.base_position_in_world[2] == pytest.approx(height, abs=1e-3)
    assert not robot.fallen
    weight = robot.description.mass * 9.81
    assert (state.foot_force > 0.1 * weight).all()
    assert state.foot_force.sum() == pytest.approx(weight, rel=0.3)


def test_it_stands_for_two_seconds_under_the_joint_drive(robot):
    start = robot.reset()
    state = run(robot, 500, hold(start.joint_position))
    assert state.time_ns == 2_000_000_000
    assert not robot.fallen
    assert state.base_position_in_world[2] > 0.9 * robot.description.stance_height
    assert np.abs(state.base_velocity_in_base).max() < 1e-3
    assert state.foot_force.sum() == pytest.approx(robot.description.mass * 9.81, rel=1e-3)
    np.testing.assert_allclose(state.foot_force[::2], state.foot_force[1::2], rtol=1e-3)
    assert np.linalg.norm(state.acceleration_in_base) == pytest.approx(9.81, abs=0.05)


def test_two_runs_from_reset_are_identical_bit_for_bit(robot):
    first, second, other = wriggle(robot), wriggle(robot), wriggle(MujocoRobot())
    for one, again, elsewhere in zip(first, second, other, strict=True):
        for field in fields(RobotState):
            value = np.asarray(getattr(one, field.name))
            assert value.tobytes() == np.asarray(getattr(again, field.name)).tobytes()
            assert value.tobytes() == np.asarray(getattr(elsewhere, field.name)).tobytes()


def test_a_robot_that_lies_repeats_itself_with_the_noise_of_its_sensors():
    robot = MujocoRobot(sensors=SensorParameters(), start_pose='lying')
    first, again = (robot.reset() for _ in range(2))
    for field in fields(RobotState):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(again, field.name))


def test_states_do_not_change_behind_ones_back(robot):
    state = robot.reset()
    before = {f.name: np.array(getattr(state, f.name)) for f in fields(RobotState)}
    run(robot, 5, hold(state.joint_position + 0.2))
    for name, value in before.items():
        np.testing.assert_array_equal(getattr(state, name), value)


def test_time_is_a_whole_number_of_ticks(robot):
    assert [state.time_ns for state in wriggle(robot, 5)] == [k * 4_000_000 for k in range(6)]


def test_velocities_are_the_rates_of_positions(robot):
    states = wriggle(robot)
    tick = robot.tick_ns * 1e-9
    before, now, after = states[-3], states[-2], states[-1]
    x, y, z, w = now.base_quaternion
    R_world_base = np.zeros(9)
    mujoco.mju_quat2Mat(R_world_base, np.array((w, x, y, z)))
    R_world_base = R_world_base.reshape(3, 3)
    difference = (after.base_position_in_world - before.base_position_in_world) / (2 * tick)
    scale = np.abs(difference).max()
    assert scale > 0.05
    np.testing.assert_allclose(R_world_base @ now.base_velocity_in_base, difference,
                               atol=0.3 * scale)


def test_the_accelerometer_agrees_with_the_models_own_sensor():
    robot = MujocoRobot(tick_ns=1_000_000)
    state = wriggle(robot, 160)[-1]
    sensor = robot.data.sensor('imu_acceleration').data  # of the last physics step
    np.testing.assert_allclose(state.acceleration_in_base, sensor,
                               atol=0.02 * np.linalg.norm(sensor) + 0.2)
    np.testing.assert_allclose(state.base_rate_in_base, robot.data.qvel[3:6])


def test_the_accelerometers_means_add_up_to_the_change_of_velocity(robot):
    states = wriggle(robot, 60)
    change, felt = np.zeros(3), np.zeros(3)
    for before, after in pairwise(states):
        velocities = []
        for state in (before, after):
            x, y, z, w = state.base_quaternion
            R = np.zeros(9)
            mujoco.mju_quat2Mat(R, np.array((w, x, y, z)))
            velocities.append(R.reshape(3, 3) @ state.base_velocity_in_base)
        change += np.abs(velocities[1] - velocities[0])
        reading = R.reshape(3, 3) @ after.acceleration_in_base - (0.0, 0.0, 9.81)
        felt += np.abs(reading * robot.tick_ns * 1e-9 - (velocities[1] - velocities[0]))
    assert change.min() > 0.1
    assert (felt < 0.05 * change).all()  # the base turns by little within a tick


def test_in_free_fall_the_accelerometer_reads_nothing_and_the_body_falls_with_g():
    robot = MujocoRobot(initial_height=2.0)
    robot.reset()
    limp = JointTargets(robot.reset().joint_position, ZERO, ZERO)
    state = run(robot, 25, limp)
    assert state.base_velocity_in_base[2] == pytest.approx(-9.81 * 0.1, rel=0.1)
    assert np.linalg.norm(state.acceleration_in_base) < 1.0
    np.testing.assert_array_equal(state.foot_force, 0.0)


def test_a_push_in_the_air_gives_its_impulse_and_ends():
    force = np.array((20.0, -10.0, 0.0))
    momenta = []
    for push in (0.0 * force, force):
        robot = MujocoRobot(initial_height=3.0)
        home = robot.reset().joint_position
        robot.apply_push(push, 20_000_000)
        run(robot, 10, hold(home))
        momenta.append(total_momentum(robot))
    np.testing.assert_allclose(momenta[1] - momenta[0], force * 0.02, atol=2e-3)


def total_momentum(robot):
    mujoco.mj_subtreeVel(robot.model, robot.data)
    base = robot.model.body('base_link').id
    return robot.data.subtree_linvel[base] * robot.model.body_subtreemass[base]


def test_reset_ends_a_push(robot):
    calm = wriggle(robot, 10)[-1]
    robot.apply_push(np.array((50.0, 0.0, 0.0)), 100_000_000)
    np.testing.assert_array_equal(wriggle(robot, 10)[-1].joint_position, calm.joint_position)


def test_it_notices_a_fall():
    robot = MujocoRobot()
    start = robot.reset()
    robot.apply_push(np.array((0.0, 400.0, 0.0)), 200_000_000)
    run(robot, 300, hold(start.joint_position))
    assert robot.fallen
    robot.reset()
    assert not robot.fallen
    limp = start.joint_position + np.tile((0.0, 0.6, -0.9), 4)
    run(robot, 200, hold(limp))
    assert robot.fallen


def test_effort_stays_within_the_limits(robot):
    limit = np.concatenate([leg.torque_limit for leg in robot.description.legs])
    home = robot.reset().joint_position
    for sign in (1, -1) * 10:
        state = robot.step(JointTargets(home + 3.0 * sign, ZERO, ZERO))
        assert (np.abs(state.joint_effort) <= limit + 1e-12).all()


def test_work_and_peaks_are_those_of_every_physics_step(robot, monkeypatch):
    steps, advance = [], mujoco.mj_step

    def watched(model, data):
        before = data.qvel[6:].copy()
        advance(model, data)
        way = 0.5 * (before + data.qvel[6:]) * model.opt.timestep
        steps.append((data.qfrc_actuator[6:].copy(), way))

    monkeypatch.setattr(mujoco, 'mj_step', watched)
    states = wriggle(robot, 30)
    work, per_tick = np.zeros(12), len(steps) // 30
    np.testing.assert_array_equal(states[0].joint_work, 0.0)
    for k, state in enumerate(states[1:]):
        inside = steps[k * per_tick:(k + 1) * per_tick]
        work += sum(np.maximum(torque * way, 0.0) for torque, way in inside)
        np.testing.assert_allclose(state.joint_work, work, rtol=1e-9)
        peak = np.max([np.abs(torque) for torque, _ in inside], axis=0)
        np.testing.assert_allclose(state.joint_peak_effort, peak, rtol=1e-9)
    assert per_tick > 1


def test_what_joints_lose_is_what_their_damping_and_friction_take(monkeypatch):
    robot, steps, advance = MujocoRobot(), [], mujoco.mj_step
    b, f = robot.model.dof_damping[6:], robot.model.dof_frictionloss[6:]
    assert b.any() and f.any()

    def watched(model, data):
        before = data.qvel[6:].copy()
        advance(model, data)
        steps.append(0.5 * (before + data.qvel[6:]))

    monkeypatch.setattr(mujoco, 'mj_step', watched)
    states = wriggle(robot, 30)
    rates, step = np.array(steps), robot.model.opt.timestep
    lost = step * (b * rates ** 2 + f * np.abs(rates)).sum(axis=0)
    np.testing.assert_allclose(states[-1].joint_loss, lost, rtol=1e-9)
    for before, after in pairwise(states):
        assert (after.joint_loss >= before.joint_loss).all()


def test_a_seed_makes_the_start_vary_reproducibly():
    starts = [MujocoRobot(seed=seed, initial_spread=0.02).reset().joint_position
              for seed in (0, 0, 1)]
    np.testing.assert_array_equal(starts[0], starts[1])
    assert 0.0 < np.abs(starts[0] - starts[2]).max() <= 0.04


@pytest.mark.parametrize('tick_ns', [0, -4_000_000, 4_500_000, 999_999])
def test_a_tick_that_is_no_multiple_of_the_physics_step_is_refused(tick_ns):
    with pytest.raises(ParameterError, match=f'{tick_ns} ns.*physics step of 1000000 ns'):
        MujocoRobot(tick_ns=tick_ns)


def test_numbers_that_are_not_finite_are_refused_and_change_nothing(robot):
    home = robot.reset().joint_position
    with pytest.raises(DataError, match='not finite'):
        robot.step(hold(np.full(12, np.nan)))
    assert robot.step(hold(home)).time_ns == robot.tick_ns
    with pytest.raises(ParameterError, match='three finite numbers'):
        robot.apply_push(np.array((np.nan, 0.0, 0.0)), 4_000_000)
    with pytest.raises(ParameterError, match='initial_spread'):
        MujocoRobot(initial_spread=-1.0)


def test_an_unstable_simulation_is_an_error_not_a_jump():
    robot = MujocoRobot()
    robot.reset()
    robot.data.qvel[:] = 1e12
    with pytest.raises(RobotError, match='unstable'):
        run(robot, 50, hold(ZERO))


def test_a_robot_with_position_servos_is_driven_by_torques_all_the_same(tmp_path):
    """Torques applied to the joints themselves move the robot as torques through motors do."""
    text = own_robot_file().model.read_text(encoding='utf-8')
    text = re.sub(r'<motor (name="[^>]*/>)', r'<position kp="80" \1', text)
    text = re.sub(r'<motor ctrlrange="(.+)"/>', r'<position forcerange="\1"/>', text)
    path = tmp_path / 'servos.xml'
    path.write_text(text, encoding='utf-8')
    servos, motors = MujocoRobot(replace(own_robot_file(), model=path)), MujocoRobot()
    for one, other in zip(servos.description.legs, motors.description.legs, strict=True):
        np.testing.assert_array_equal(one.torque_limit, other.torque_limit)
    for one, other in zip(wriggle(servos, 30), wriggle(motors, 30), strict=True):
        np.testing.assert_allclose(one.joint_position, other.joint_position, atol=1e-6)


def test_what_the_controllers_do_not_know_is_in_the_robot_only(robot):
    """A payload weighs, an offset leans, friction brakes, and the description says nothing of it.
    """
    differs = MismatchParameters(payload=0.5, mass_offset=(0.02, -0.03), joint_friction=3.0)
    other = MujocoRobot(mismatch=differs)
    assert str(other.description) == str(robot.description)
    model, known, base = other.model, robot.model, robot.base
    mass = known.body_mass[base] + 0.5 * robot.description.mass
    assert model.body_mass[base] == pytest.approx(mass)
    assert model.body_subtreemass[base] == pytest.approx(1.5 * robot.description.mass)
    np.testing.assert_allclose(
        model.body_inertia[base], known.body_inertia[base] * mass / known.body_mass[base])
    np.testing.assert_allclose(
        model.body_ipos[base] - known.body_ipos[base], (0.02, -0.03, 0.0), atol=1e-12)
    np.testing.assert_allclose(model.dof_frictionloss[6:], 3.0 * known.dof_frictionloss[6:])
    np.testing.assert_allclose(model.dof_damping[6:], 3.0 * known.dof_damping[6:])
    state = run(other, 500, hold(other.reset().joint_position))
    assert state.foot_force.sum() == pytest.approx(1.5 * robot.description.mass * 9.81, rel=0.02)


def test_a_weak_drive_gives_its_share(robot):
    strength = (1.0, 1.0, 0.4) + (1.0,) * 9
    weak = MujocoRobot(mismatch=MismatchParameters(joint_strength=strength))
    states = [one.step(hold(one.reset().joint_position + 0.01)) for one in (robot, weak)]
    first = [one.reset().joint_effort for one in (robot, weak)]
    np.testing.assert_allclose(first[1], first[0] * strength, rtol=1e-12)
    assert np.abs(states[1].joint_effort[2]) < 0.6 * np.abs(states[0].joint_effort[2])


@pytest.mark.parametrize(('name', 'value', 'text'), [
    ('joint_strength', (1.0, 1.0), 'joint_strength must hold 12 numbers'),
    ('mass_offset', (0.0, 0.0, 0.0), 'mass_offset must hold 2 numbers'),
    ('payload', -0.1, 'outside its range'), ('joint_friction', float('nan'), 'outside its range')])
def test_an_impossible_mismatch_is_refused(name, value, text):
    with pytest.raises(ParameterError, match=text):
        MismatchParameters(**{name: value})
