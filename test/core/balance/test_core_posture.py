# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Balance: forces inside their limits, wrenches met where the limits allow, torques bounded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from core_examples import GAITS, GRAVITY, TICK, network, quadruped, standing_state
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.controller import PostureController, PostureParameters
from dmp_cpg_ros.core.balance.corrections import MassOffset, VelocityCorrection
from dmp_cpg_ros.core.balance.motion_plan import MotionPlan
from dmp_cpg_ros.core.balance.unfelt import borne_by_others
from dmp_cpg_ros.core.balance.virtual_model import REGULARISATION, distribute
from dmp_cpg_ros.core.estimation.leg_odometry import normal_in_world
from dmp_cpg_ros.core.maths.rotations import turned
from dmp_cpg_ros.core.maths.vec3 import Triple, heading_frame, rotation, triple, upward
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.transformation.leg import nominal_foothold

ROBOT = quadruped()
FEET = np.array([nominal_foothold(ROBOT, leg.name) for leg in ROBOT.legs])
WEIGHT = ROBOT.mass * GRAVITY
LARGEST = 2.0 * WEIGHT

wrenches = st.tuples(*[st.floats(-300.0, 300.0)] * 3, *[st.floats(-80.0, 80.0)] * 3).map(np.array)
def shared(wrench: np.ndarray, feet: np.ndarray, load: np.ndarray, friction: float,
           **importance: Triple) -> np.ndarray:
    """Forces (4, 3) of ``distribute``."""
    places = [triple(foot) for foot in feet.tolist()]
    return np.array(distribute(triple(wrench[:3].tolist()), triple(wrench[3:].tolist()), places,
                               load.tolist(), friction, LARGEST, **importance))


loads = st.lists(st.sampled_from([0.0, 0.3, 1.0]), min_size=4, max_size=4).map(np.array)


def wrench_of(forces: np.ndarray, feet: np.ndarray) -> np.ndarray:
    return np.concatenate([forces.sum(axis=0), np.cross(feet, forces).sum(axis=0)])


@given(wrench=wrenches, load=loads, friction=st.floats(0.05, 1.5), seed=st.integers(0, 100))
def test_forces_stay_in_their_cones(
        wrench: np.ndarray, load: np.ndarray, friction: float, seed: int) -> None:
    feet = FEET + np.random.default_rng(seed).normal(scale=0.05, size=(4, 3))
    forces = shared(wrench, feet, load, friction)
    assert np.all(np.isfinite(forces))
    assert np.all(forces[:, 2] >= 0.0) and np.all(forces[:, 2] <= LARGEST * load + 1e-9)
    assert np.all(np.hypot(*forces[:, :2].T) <= friction * forces[:, 2] + 1e-9)


@given(push=st.tuples(*[st.floats(-5.0, 5.0)] * 2), moment=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
       lift=st.floats(0.8, 1.3), swinging=st.sampled_from([None, 0, 1, 2, 3]))
def test_a_wrench_within_the_limits_is_met(
        push: tuple[float, ...], moment: tuple[float, ...], lift: float,
        swinging: int | None) -> None:
    load, wrench = np.ones(4), np.array([*push, lift * WEIGHT, *moment])
    if swinging is not None:
        load[swinging] = 0.0
        # three feet carry what is above their triangle
        support = FEET[load > 0.0].mean(axis=0)
        wrench[3:5] += lift * WEIGHT * np.array([support[1], -support[0]])
    forces = shared(wrench, FEET, load, 2.0)
    scale = np.array([WEIGHT] * 3 + [0.2 * WEIGHT] * 3)
    assert np.all(np.abs(wrench_of(forces, FEET) - wrench) < 0.01 * scale)
    assert swinging is None or not forces[swinging].any()


@given(load=loads, seed=st.integers(0, 100))
def test_forces_are_those_of_the_damped_least_squares(load: np.ndarray, seed: int) -> None:
    """The minimum of |D (G f − wrench)|² / damping + Σ |f_i|² / w_i over the loaded feet."""
    rng, importance = np.random.default_rng(seed), (9.0, 12.0, 7.0)
    feet = FEET + rng.normal(scale=0.05, size=(4, 3))
    # pressed so hard onto the ground that no cone is left
    forces = rng.normal(size=(4, 3)) + (0.0, 0.0, 0.2 * WEIGHT)
    wrench = wrench_of(forces * load[:, None], feet)
    weights = np.repeat(load, 3)
    grasp = np.concatenate([np.tile(np.eye(3), 4), np.concatenate(
        [np.cross(foot, np.eye(3)).T for foot in feet], axis=1)])
    D = np.diag([1.0, 1.0, 1.0, *importance])
    damping = REGULARISATION * max(load.mean(), 1e-9)
    multipliers = np.linalg.solve(
        D @ grasp @ np.diag(weights) @ grasp.T @ D + damping * np.eye(6), D @ wrench)
    expected = (weights * (grasp.T @ D @ multipliers)).reshape(4, 3)
    found = shared(wrench, feet, load, 100.0, importance=importance)
    inside = np.all((expected[:, 2] > 0.0) & (expected[:, 2] < LARGEST * load)
                    & (np.hypot(*expected[:, :2].T) < 100.0 * expected[:, 2]) | (load == 0.0))
    if inside:
        np.testing.assert_allclose(found, expected, atol=1e-7 * WEIGHT)


@given(push=st.tuples(*[st.floats(-5.0, 5.0)] * 2), lift=st.floats(0.8, 1.3),
       gap=st.sampled_from([0, 1, 2, 3]))
def test_what_a_foot_in_a_gap_does_not_bear_the_others_do(
        push: tuple[float, ...], lift: float, gap: int) -> None:
    wrench, load = np.array((*push, lift * WEIGHT, 0.0, 0.0, 0.0)), np.ones(4)
    empty = [leg == gap for leg in range(4)]
    arguments = (triple(wrench[:3].tolist()), (0.0, 0.0, 0.0),
                 [triple(foot) for foot in FEET.tolist()], load.tolist())
    forces = np.array(borne_by_others(*arguments, empty, 0.8, LARGEST))
    planned = shared(wrench, FEET, load, 0.8)
    assert forces[gap] == pytest.approx(planned[gap])   # it presses on, and finds ground
    others = np.delete(forces, gap, axis=0)
    assert others[:, 2].sum() == pytest.approx(wrench[2], rel=0.1)
    on_all = borne_by_others(*arguments, [False] * 4, 0.8, LARGEST)
    assert np.array_equal(np.array(on_all), planned)


def test_without_load_there_are_no_forces() -> None:
    wrench = np.array([0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0])
    forces = shared(wrench, FEET, np.zeros(4), 0.6)
    assert not forces.any()

AMBLE = GAITS['amble']


def controller(**changes: object) -> PostureController:
    return PostureController(ROBOT, PostureParameters(**changes))  # type: ignore[arg-type]


def forces_of(torque: Sequence[float]) -> np.ndarray:
    """Forces of the ground on the feet that torques balance."""
    q = standing_state(ROBOT).joint_position.reshape(4, 3)
    return np.array([-np.linalg.solve(LegKinematics(leg).jacobian_in_base(a).T, t)
                     for leg, a, t in zip(ROBOT.legs, q, np.reshape(torque, (4, 3)), strict=True)])


@pytest.mark.parametrize('gait', GAITS)
def test_standing_still_the_feet_carry_the_weight_and_nothing_else(gait: str) -> None:
    of, x = controller(), network(gait).locked_state()
    _, feedback = of.step(
        of.initial_state(), standing_state(ROBOT), GAITS[gait], x, 0.0 * x, np.zeros(3), TICK)
    wrench = wrench_of(forces_of(feedback.torque), FEET)
    assert np.allclose(wrench, [0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0], atol=0.01 * WEIGHT)
    assert not np.any(feedback.shift_in_base) and not any(feedback.correction)


@pytest.mark.parametrize('gait', GAITS)
def test_who_feels_nothing_carries_its_weight_as_planned(gait: str) -> None:
    """Whatever it was told last of joints, attitude and velocity."""
    of, x, state = controller(), network(gait).locked_state(), standing_state(ROBOT)
    felt = replace(
        state, joint_position=state.joint_position + 0.3, felt_legs=(False,) * 4,
        base_velocity_in_base=np.array((1.0, 0.3, 0.0)), gyro_in_base=np.full(3, np.nan),
        base_rate_in_base=np.ones(3), base_quaternion=np.array(
            turned(state.base_quaternion, (0.2, -0.1, 0.0))))
    told = [of.step(of.initial_state(), of_state, GAITS[gait], x, 0.0 * x, np.zeros(3), TICK)[1]
            for of_state in (state, felt)]
    assert np.allclose(told[1].torque, told[0].torque, atol=1e-6)
    assert np.allclose(told[1].measured, state.joint_position, atol=1e-6)
    assert told[0].felt == (True,) * 4 and told[1].felt == (False,) * 4


def test_a_leg_that_is_not_felt_is_where_the_plan_has_it() -> None:
    of, x, state = controller(), network('trot').locked_state(), standing_state(ROBOT)
    angles = state.joint_position.copy()
    angles[3:6] += 0.3
    _, feedback = of.step(of.initial_state(), replace(
        state, joint_position=angles, felt_legs=(True, False, True, True)), GAITS['trot'], x,
        0.0 * x, np.zeros(3), TICK)
    assert np.allclose(feedback.measured, state.joint_position, atol=1e-6)
    assert feedback.felt == (True, False, True, True)


@pytest.mark.parametrize(('change', 'component', 'sign'), [
    ({'base_velocity_in_base': np.array([0.2, 0.0, 0.0])}, 0, -1.0),
    ({'base_velocity_in_base': np.array([0.0, -0.2, 0.0])}, 1, 1.0),
    ({'base_velocity_in_base': np.array([0.0, 0.0, 0.2])}, 2, -1.0),
    ({'base_rate_in_base': np.array([0.5, 0.0, 0.0])}, 3, -1.0),
    ({'base_rate_in_base': np.array([0.0, 0.5, 0.0])}, 4, -1.0),
    ({'base_rate_in_base': np.array([0.0, 0.0, 0.5])}, 5, -1.0),
    ({'base_quaternion': np.array([0.05, 0.0, 0.0, 1.0]) / np.hypot(0.05, 1.0)}, 3, -1.0),
    ({'base_quaternion': np.array([0.0, 0.05, 0.0, 1.0]) / np.hypot(0.05, 1.0)}, 4, -1.0),
])
def test_errors_are_answered_by_the_opposite_wrench(
        change: dict[str, np.ndarray], component: int, sign: float) -> None:
    of, x = controller(), network().locked_state()
    at_rest = wrench_of(forces_of(of.step(
        of.initial_state(), standing_state(ROBOT), AMBLE, x, 0.0 * x, np.zeros(3),
        TICK)[1].torque), FEET)
    state = standing_state(ROBOT, **change)
    feedback = of.step(of.initial_state(), state, AMBLE, x, 0.0 * x, np.zeros(3), TICK)[1]
    R = np.array(heading_frame(upward(state.base_quaternion.tolist())))
    wrench = wrench_of(forces_of(feedback.torque) @ R.T, FEET @ R.T)
    assert sign * (wrench - at_rest)[component] > 0.1


@pytest.mark.parametrize('slope', [(0.25, 0.0), (-0.2, 0.0), (0.0, 0.2)])
def test_on_a_slope_parallel_to_it_the_feet_carry_the_weight(slope: tuple[float, float]) -> None:
    """The forces are vertical (their sum along the slope too), and nothing turns the body."""
    of, x = controller(), network().locked_state()
    normal = np.array(normal_in_world(slope))
    axis = np.cross((0.0, 0.0, 1.0), normal)
    turn = axis / np.linalg.norm(axis) * np.arccos(normal[2])
    state = standing_state(ROBOT, base_quaternion=np.array(turned((0.0, 0.0, 0.0, 1.0), turn)),
                           ground_normal_in_world=normal)
    feedback = of.step(of.initial_state(), state, AMBLE, x, 0.0 * x, np.zeros(3), TICK)[1]
    R_world_base = np.array(rotation(state.base_quaternion.tolist()))
    forces = forces_of(feedback.torque)
    weight = ROBOT.mass * GRAVITY
    np.testing.assert_allclose(
        forces.sum(axis=0) @ R_world_base.T, (0.0, 0.0, weight), atol=0.02 * weight)
    np.testing.assert_allclose(wrench_of(forces, FEET)[3:], 0.0, atol=0.02 * weight)
    tangential = np.hypot(forces[:, 0], forces[:, 1])  # the base is parallel to the ground
    assert (tangential <= of.parameters.friction * forces[:, 2] + 1e-9).all()
    # Swinging feet are placed downhill: slope times height of the centre of mass.
    downhill = -np.array(slope) / np.hypot(*slope)
    assert ((np.array(feedback.shift_in_base)[:, :2] @ downhill) > 0.15 * 0.2).all()


@pytest.mark.parametrize('slope', [(0.25, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.3)])
def test_feet_that_walk_on_a_slope_hold_the_body_as_on_level_ground(slope: tuple[float, float]
                                                                    ) -> None:
    """They come down as far downhill as the vertical through it meets the ground; standing ones
    stay where they are.
    """
    of, x, level = controller(), network().locked_state(), standing_state(ROBOT)
    normal = np.array(normal_in_world(slope))
    axis = np.cross((0.0, 0.0, 1.0), normal)
    turn = axis / np.linalg.norm(axis) * np.arccos(normal[2])
    leaning = replace(level, base_quaternion=np.array(turned(level.base_quaternion, turn)),
                      ground_normal_in_world=normal)
    walking = of.initial_state()._replace(activity=(1.0,) * 4)
    (flat, steep), (_, stood) = ([
        np.array(of.step(memory, state, AMBLE, x, 0.0 * x, np.zeros(3), TICK)[1].margins)
        for state in (level, leaning)] for memory in (walking, of.initial_state()))
    np.testing.assert_allclose(steep, flat, atol=0.01)
    assert (flat - stood).max() > 0.03


@given(seed=st.integers(0, 10_000), size=st.floats(0.0, 20.0), gait=st.sampled_from(list(GAITS)))
def test_torques_and_shifts_are_finite_and_within_limits_in_any_state(
        seed: int, size: float, gait: str) -> None:
    rng, of = np.random.default_rng(seed), controller()
    quaternion = rng.normal(size=4)
    state = standing_state(
        ROBOT, joint_position=rng.uniform(-3.0, 3.0, 12),
        base_rate_in_base=size * rng.normal(size=3),
        base_velocity_in_base=size * rng.normal(size=3),
        base_quaternion=quaternion / np.linalg.norm(quaternion))
    x, x_dot = rng.normal(size=(4, 2)), 20.0 * rng.normal(size=(4, 2))
    memory = of.initial_state()
    for _ in range(3):
        memory, feedback = of.step(
            memory, state, GAITS[gait], x, x_dot, rng.normal(size=3), TICK)
    limit = np.concatenate([leg.torque_limit for leg in ROBOT.legs])
    p = of.parameters
    assert np.all(np.abs(feedback.torque) <= limit)
    assert np.all(np.isfinite(feedback.shift_in_base))
    assert np.all(np.isfinite(feedback.drift_in_base))
    assert np.all(np.isfinite(feedback.correction))
    most = p.heading_gain * (GRAVITY / of.scale.leg_length) ** 0.5 * p.heading_limit
    assert abs(feedback.correction[2]) <= most + 1e-9


@given(seed=st.integers(0, 1000))
def test_levelling_keeps_the_heading_and_removes_the_tilt(seed: int) -> None:
    q = np.random.default_rng(seed).normal(size=4)
    x, y, z, w = q / np.linalg.norm(q)
    R_world_base = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
    R_level_base = np.array(heading_frame(upward((x, y, z, w))))
    assert np.allclose(R_level_base @ R_level_base.T, np.eye(3), atol=1e-6)
    R_world_level = R_world_base @ R_level_base.T
    assert np.allclose(R_world_level[2], [0.0, 0.0, 1.0], atol=1e-6)
    forward = R_world_base[:, 0] - [0.0, 0.0, R_world_base[2, 0]]
    assert np.allclose(np.cross(R_world_level[:, 0], forward), 0.0, atol=1e-6)


def test_a_correction_grows_while_walking_and_is_forgotten_at_rest() -> None:
    of, at = controller(), network()
    x, r = at.locked_state(), np.array([0.5, 0.0, 0.0])
    x_dot = at.omega(r) * (x @ np.array([[0.0, -1.0], [1.0, 0.0]]))
    memory, slow = of.initial_state(), standing_state(ROBOT)
    for _ in range(500):
        memory, feedback = of.step(memory, slow, AMBLE, x, x_dot, r, TICK)
    assert 0.05 < feedback.correction[0] <= of.parameters.speed_mismatch_limit * 0.5 + 1e-9
    for _ in range(500):
        memory, feedback = of.step(memory, slow, AMBLE, x, 0.0 * x, np.zeros(3), TICK)
    assert np.abs(feedback.correction).max() < 1e-3


def test_more_is_corrected_while_the_reference_stands_still() -> None:
    """The limit is narrow while the velocity asked for moves, and comes back to that gradually."""
    p, length = PostureParameters(), 0.28
    narrow, wide = (limit * 0.5 for limit in (p.speed_correction_limit, p.speed_mismatch_limit))

    def walked(before: VelocityCorrection, seconds: float, change: float
               ) -> list[VelocityCorrection]:
        plan, loops = MotionPlan().followed((0.5, 0.0, 0.0), 1.0, 5.0, 4.0, TICK), [before]
        for k in range(round(seconds / TICK)):
            v_x = 0.5 + change * np.sin(10.0 * k * TICK)
            plan = plan.followed((v_x, 0.0, 0.0), 1.0, 5.0, 4.0, TICK)
            loops.append(loops[-1].integrated(
                p, length, 1.0, (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), plan, 0.0, TICK))
        return loops[1:]

    moving = walked(VelocityCorrection(), 4.0, 0.1)
    assert narrow * 0.9 < moving[-1].correction[0] < narrow * 1.2
    still = walked(moving[-1], 6.0, 0.0)
    assert still[-1].correction[0] == pytest.approx(wide, rel=0.02)
    plan = MotionPlan(expected=(0.5, 0.0))
    assert still[-1].lasting(p, length, plan) == pytest.approx((wide - narrow, 0.0), abs=0.01)
    assert moving[20].lasting(p, length, plan) == (0.0, 0.0)
    back = [loop.correction[0] for loop in walked(still[-1], 3.0, 0.1)]
    assert narrow * 0.9 < back[-1] < narrow * 1.2
    assert np.abs(np.diff(back)).max() < 0.03 * wide


@pytest.mark.parametrize('way', [1.0, -1.0])
def test_legs_go_no_faster_for_a_body_that_stays_behind_than_the_gait_may(way: float) -> None:
    p, length, room = PostureParameters(), 0.28, 0.05
    plan, loop = MotionPlan(expected=(way * 1.5, 0.0)), VelocityCorrection()
    for _ in range(2000):
        loop = loop.integrated(p, length, 1.0, (0.0, 0.0, 0.0, 1.0), (way, 0.1, 0.0), plan, 0.0,
                               TICK, room)
    assert loop.correction[0] == pytest.approx(way * room)
    assert loop.correction[1] < -0.1  # nothing is asked across: what drifts is held all the same
    for _ in range(500):
        loop = loop.integrated(p, length, 1.0, (0.0, 0.0, 0.0, 1.0), (2.0 * way, 0.1, 0.0), plan,
                               0.0, TICK, room)
    assert way * loop.correction[0] < -0.1  # and slower ones are


@pytest.mark.parametrize('moving', [0.98, 0.9])
def test_slow_loops_forget_with_time_and_not_with_ticks(moving: float) -> None:
    """What legs that hardly move forget does not depend on the rate of the controller."""
    p, length, plan = PostureParameters(), 0.28, MotionPlan(expected=(0.5, 0.0))
    ends = []
    for ticks in (100, 400):
        loop = VelocityCorrection(heading_error=0.2, yaw=0.0, wide=0.8)
        for _ in range(ticks):
            loop = loop.integrated(p, length, moving, (0.0, 0.0, 0.0, 1.0), (0.5, 0.0, 0.0), plan,
                                   0.0, 0.1 / ticks)
        ends.append((loop.heading_error, loop.wide))
    assert ends[0] == pytest.approx(ends[1], rel=0.02)
    assert ends[0][0] < 0.15


@pytest.mark.parametrize(('tilt', 'place'), [
    ((-0.1, 0.0), (0.0, 1.0)), ((0.1, 0.0), (0.0, -1.0)),
    ((0.0, 0.1), (1.0, 0.0)), ((0.0, -0.1), (-1.0, 0.0))])
def test_the_mass_is_found_on_the_side_that_sinks(
        tilt: tuple[float, float], place: tuple[float, float]) -> None:
    """Roll left up means that mass is to the right; pitch nose down that it is ahead."""
    p, length = PostureParameters(), 0.28
    roll, pitch = tilt
    R = rotation(turned((0.0, 0.0, 0.0, 1.0), (roll, pitch, 0.0)))
    found = MassOffset()
    for _ in range(1000):
        found = found.found(p, length, 1.0, R, TICK)
    assert np.allclose(found.tilt, tilt, atol=1e-3)
    assert np.dot(found.place, place) > 0.005
    assert np.allclose(np.cross((*found.place, 0.0), (*place, 0.0)), 0.0, atol=1e-9)
    rests = found.found(p, length, 0.0, R, TICK)
    assert rests.place == found.place
    for _ in range(20_000):
        found = found.found(p, length, 1.0, R, TICK)
    assert np.linalg.norm(found.place) == pytest.approx(p.offset_limit * length)


def test_of_a_slight_tilt_nothing_is_concluded() -> None:
    R = rotation(turned((0.0, 0.0, 0.0, 1.0), (0.02, -0.02, 0.0)))
    found = MassOffset()
    for _ in range(5000):
        found = found.found(PostureParameters(), 0.28, 1.0, R, TICK)
    assert found.place == (0.0, 0.0)
