# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The joint drive: its law, its limits, and targets that arrive late."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.robot.joint_drive import JointDrive
from dmp_cpg_ros.robot.model_reader import load_description

STEPS, STEP_S = 4, 0.001
DESCRIPTION = load_description()
LIMIT = np.concatenate([leg.torque_limit for leg in DESCRIPTION.legs])
SPEED = np.concatenate([leg.velocity_limit for leg in DESCRIPTION.legs])
ZERO = np.zeros(12)

torques = arrays(float, 12, elements=st.floats(-200, 200))
speeds = arrays(float, 12, elements=st.floats(-100, 100))


def drive():
    return JointDrive(DESCRIPTION, STEPS, STEP_S)


def targets(position=0.0, velocity=0.0, effort=0.0):
    return JointTargets(*(np.full(12, value) for value in (position, velocity, effort)))


@given(position=arrays(float, 12, elements=st.floats(-0.05, 0.05)),
       velocity=arrays(float, 12, elements=st.floats(-1, 1)))
def test_small_errors_give_the_pd_law(position, velocity):
    under_test = drive()
    under_test.accept(JointTargets(position + 0.02, velocity - 0.5, np.full(12, 0.7)))
    kp, kd = np.tile(DESCRIPTION.kp, 4), np.tile(DESCRIPTION.kd, 4)
    np.testing.assert_allclose(under_test.torque(0, position, velocity),
                               0.02 * kp - 0.5 * kd + 0.7, atol=1e-9)


@given(velocity=arrays(float, 12, elements=st.floats(-1, 1)))
def test_friction_is_made_up_for_at_the_target_velocity_and_never_at_the_measured_one(velocity):
    damping = np.linspace(0.1, 1.0, 12)
    with_it, without = JointDrive(DESCRIPTION, STEPS, STEP_S, damping), drive()
    told = JointTargets(ZERO, velocity, ZERO)
    with_it.accept(told)
    without.accept(told)
    more = with_it.torque(0, ZERO, velocity) - without.torque(0, ZERO, velocity)
    np.testing.assert_allclose(more, damping * velocity, atol=1e-9)
    with_it.accept(JointTargets(ZERO, ZERO, ZERO))
    without.accept(JointTargets(ZERO, ZERO, ZERO))
    np.testing.assert_array_equal(with_it.torque(0, ZERO, velocity),
                                  without.torque(0, ZERO, velocity))


def test_a_drive_without_gains_passes_torques_on_as_they_come():
    torques_only = JointDrive(replace(DESCRIPTION, kp=np.zeros(3), kd=np.zeros(3)), STEPS, STEP_S,
                              np.ones(12))
    torques_only.accept(targets(0.3, 2.0, 1.5))
    np.testing.assert_array_equal(torques_only.torque(0, ZERO, ZERO), np.full(12, 1.5))


@given(torque=torques, velocity=speeds)
def test_torque_never_exceeds_its_limit_and_never_drives_beyond_the_speed_limit(torque, velocity):
    limited = drive().limited(torque, velocity)
    assert (np.abs(limited) <= LIMIT).all()
    driving = limited * velocity > 0
    assert (np.abs(velocity[driving]) <= SPEED[driving]).all()


@given(torque=torques, velocity=speeds)
def test_braking_torque_is_limited_by_torque_only(torque, velocity):
    braking = torque * velocity <= 0
    expected = np.clip(torque, -LIMIT, LIMIT)
    np.testing.assert_array_equal(drive().limited(torque, velocity)[braking], expected[braking])


@given(torque=torques, velocity=speeds)
def test_limiting_is_symmetric_and_keeps_the_sign(torque, velocity):
    limited = drive().limited(torque, velocity)
    np.testing.assert_allclose(drive().limited(-torque, -velocity), -limited, atol=1e-12)
    assert (limited * torque >= 0).all()


def test_driving_torque_falls_monotonically_with_speed_to_zero():
    speeds = np.linspace(0.0, 1.0, 50)
    driving = np.array([drive().limited(10 * LIMIT, share * SPEED) for share in speeds])
    np.testing.assert_array_equal(driving[0], LIMIT)
    assert (np.diff(driving, axis=0) <= 1e-12).all()
    np.testing.assert_allclose(driving[-1], 0.0, atol=1e-9)


def reference(under_test, step):
    """The angle at which the drive is at rest, i.e. its q_d, for a standing joint without q̇_d."""
    return under_test.torque(step, ZERO, ZERO) / np.tile(DESCRIPTION.kp, 4)


def test_targets_move_on_with_their_velocity_within_a_tick():
    gentle = JointDrive(replace(DESCRIPTION, kd=np.zeros(3)), STEPS, STEP_S)
    gentle.accept(targets(0.1, 2.0))
    for step in range(STEPS):
        np.testing.assert_allclose(reference(gentle, step), 0.1 + 2.0 * step * STEP_S)


def test_targets_that_are_not_renewed_stand_still_after_one_tick():
    under_test = drive()
    under_test.accept(targets(0.05, 1.0))
    for _ in range(3):
        under_test.accept(targets(0.05, 1.0))
        for step in range(STEPS):
            np.testing.assert_allclose(reference(under_test, step), 0.05 + 1.0 * STEPS * STEP_S)


def test_each_joint_has_its_own_arrival():
    under_test = drive()
    under_test.accept(targets(0.05, 1.0))
    renewed = targets(0.05, 1.0)
    renewed.position[:3] = 0.054
    under_test.accept(renewed)
    kp, kd = DESCRIPTION.kp[0], DESCRIPTION.kd[0]
    torque = under_test.torque(0, ZERO, ZERO)
    np.testing.assert_allclose(torque[:3], kp * 0.054 + kd * 1.0)
    np.testing.assert_allclose(torque[3:], kp * (0.05 + STEPS * STEP_S))


def test_reset_forgets_what_arrived():
    under_test = drive()
    under_test.accept(targets(0.05, 1.0))
    first = under_test.torque(0, ZERO, ZERO)
    under_test.reset()
    under_test.accept(targets(0.05, 1.0))
    np.testing.assert_array_equal(under_test.torque(0, ZERO, ZERO), first)


@pytest.mark.parametrize('bad', [np.nan, np.inf])
@pytest.mark.parametrize('field', ['position', 'velocity', 'effort'])
def test_targets_that_are_not_finite_are_refused_by_joint(field, bad):
    broken = targets()
    getattr(broken, field)[7] = bad
    with pytest.raises(DataError, match='rl_hip'):
        drive().accept(broken)


def test_targets_of_another_shape_are_refused():
    with pytest.raises(DataError, match=r'velocity has shape \(3,\)'):
        drive().accept(JointTargets(ZERO, np.zeros(3), ZERO))


def test_unequal_arrivals_do_what_equal_ones_do():
    """All joints new at once are handled apart; a joint with an old number among them is not."""
    one, other = drive(), drive()
    rng = np.random.default_rng(5)
    held = np.full(12, 0.3)
    other.accept(JointTargets(held, np.zeros(12), np.zeros(12)))
    position, velocity, effort = rng.uniform(-0.5, 0.5, (3, 12))
    position[4] = 0.3  # the same number as before, but with another velocity
    one.accept(JointTargets(position, velocity, effort))
    other.accept(JointTargets(position, velocity, effort))
    for step in range(STEPS):
        np.testing.assert_array_equal(
            one.torque(step, ZERO, ZERO), other.torque(step, ZERO, ZERO))
