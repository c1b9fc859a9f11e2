# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Placement of the feet: it catches a pendulum, within reach, on the feet's own sides, level."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GRAVITY, quadruped
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.footholds import FootPlacement
from dmp_cpg_ros.core.balance.parameters import PostureParameters
from dmp_cpg_ros.core.maths.vec3 import Triple, heading_frame, pair, upward
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.transformation.leg import nominal_foothold

ROBOT = quadruped()
FEET = np.array([nominal_foothold(ROBOT, leg.name) for leg in ROBOT.legs])
LEG_LENGTH = 0.28
KINEMATICS = [LegKinematics(leg) for leg in ROBOT.legs]
PLACEMENT, P = FootPlacement(KINEMATICS, FEET, LEG_LENGTH), PostureParameters()
AT_REST = (0.0, 0.0, 0.0)
velocities = st.tuples(st.floats(-4.0, 4.0), st.floats(-3.0, 3.0), st.floats(-4.0, 4.0))
half_stances = st.floats(0.03, 0.3)


@given(velocity=velocities, half_stance=half_stances)
def test_a_body_that_moves_as_planned_needs_no_shift_within_reach(
        velocity: Triple, half_stance: float) -> None:
    shift = np.array(PLACEMENT.shift(P, velocity, velocity, half_stance))
    way = half_stance * np.array(PLACEMENT.over_feet(velocity))
    reached = np.array(PLACEMENT.within_reach([pair(place) for place in way.tolist()], P.reach))
    inside = (reached == way).all(axis=1)
    own_side = (FEET[:, 1] + way[:, 1]) * FEET[:, 1] > 0.0
    assert np.allclose(shift[inside & own_side], 0.0, atol=1e-12)


@given(measured=velocities, reference=velocities, half_stance=half_stances)
def test_feet_are_placed_where_the_legs_reach_and_on_their_own_side(
        measured: Triple, reference: Triple, half_stance: float) -> None:
    shift = np.array(PLACEMENT.shift(P, measured, reference, half_stance))
    down = FEET[:, :2] + half_stance * np.array(PLACEMENT.over_feet(reference)) + shift
    assert np.all(down[:, 1] * np.sign(FEET[:, 1]) >= -1e-12)
    for kinematics, x, y in zip(KINEMATICS, *down.T, strict=True):
        foot = np.array([x, y, FEET[0, 2]])
        assert np.allclose(kinematics.foot_in_base(kinematics.inverse(foot)), foot, atol=1e-9)


@given(measured=velocities, friction=st.floats(0.05, 2.0), wide=st.floats(0.0, 1.0))
def test_feet_of_one_side_that_stand_alone_are_within_what_friction_bears_of_the_middle(
        measured: Triple, friction: float, wide: float) -> None:
    most, own = friction * LEG_LENGTH / 2.0 ** 0.5, FEET[:, 1]
    alone, across, apart = (np.array(PLACEMENT.across(friction, LEG_LENGTH, of))
                            for of in (0.0, wide, 1.0))
    assert np.allclose(np.abs(alone), np.minimum(np.abs(own), most)) and (apart == own).all()
    assert np.allclose(across, alone + wide * (own - alone))
    assert np.all(across * own > 0.0)
    down = own + np.array(PLACEMENT.shift(P, measured, AT_REST, 0.1, tuple(across.tolist())))[:, 1]
    assert np.all(down * own >= -1e-12)
    at_rest = np.array(PLACEMENT.shift(P, AT_REST, AT_REST, 0.1, tuple(across.tolist())))
    assert np.allclose(own + at_rest[:, 1], across)


@given(v_x=st.floats(-4.0, -0.01), shares=st.lists(st.floats(0.0, 2.0), min_size=2, max_size=2),
       along=st.floats(-np.pi, np.pi))
def test_feet_go_along_with_a_body_that_walks_backwards_the_less_the_harder_it_is_pushed(
        v_x: float, shares: list[float], along: float) -> None:
    most = P.friction * GRAVITY / 2.0 ** 0.5
    less, more = (PLACEMENT.yielding(P, v_x, 1.0, (
        share * most * np.cos(along), share * most * np.sin(along))) for share in sorted(shares))
    most_of_all = PLACEMENT.yielding(P, v_x, 1.0)
    assert P.yielding <= more <= less + 1e-12 and less <= most_of_all <= 1.0
    assert max(shares) < 1.0 or more == pytest.approx(P.yielding)
    assert PLACEMENT.yielding(P, -v_x, 1.0, (most, 0.0)) == P.yielding


@given(measured=velocities)
def test_left_and_right_are_mirrored(measured: Triple) -> None:
    v_x, v_y, gamma = measured
    here = np.array(PLACEMENT.shift(P, measured, AT_REST, 0.1))
    there = np.array(PLACEMENT.shift(P, (v_x, -v_y, -gamma), AT_REST, 0.1))
    assert np.allclose(there, here[[1, 0, 3, 2]] * [1.0, -1.0], atol=1e-12)


@pytest.mark.parametrize('gain', [1.0, 0.7])
def test_a_pendulum_comes_to_rest_on_its_footholds(gain: float) -> None:
    """The linear inverted pendulum x'' = g x / l that steps onto d every T_s seconds."""
    rate, stance, velocity = (GRAVITY / LEG_LENGTH) ** 0.5, 0.2, 0.5
    p = PostureParameters(placement_gain=gain)
    speeds = [velocity]
    for _ in range(12):
        d, _ = PLACEMENT.shift(p, (velocity, 0.0, 0.0), AT_REST, 0.5 * stance)[0]
        c, s = np.cosh(rate * stance), np.sinh(rate * stance)
        velocity = velocity * c - d * rate * s
        speeds.append(velocity)
    assert abs(speeds[-1]) < 1e-2 * speeds[0]
    assert np.all(np.diff(np.abs(speeds)) < 0.0)


@given(roll=st.floats(-0.3, 0.3), pitch=st.floats(-0.3, 0.3))
def test_raised_feet_of_a_tilted_body_are_level(roll: float, pitch: float) -> None:
    q = np.array([np.sin(roll / 2), np.sin(pitch / 2), 0.0, 1.0])
    R_level_base = heading_frame(upward((q / np.linalg.norm(q)).tolist()))
    raised = np.array(PLACEMENT.raised(P, [(0.0, 0.0)] * 4, R_level_base))
    feet = (FEET + raised[:, None] * np.array([0.0, 0.0, 1.0])) @ np.array(R_level_base).T
    inside = np.abs(raised) < 0.09
    assert np.allclose(feet[inside, 2], FEET[inside, 2], atol=1e-9)


@given(yielding=st.floats(0.0, 1.0), v=st.floats(0.0, 4.0), more=st.floats(0.0, 1.0))
def test_standing_feet_go_along_further_the_faster_the_body_goes_backwards(
        yielding: float, v: float, more: float) -> None:
    p = PostureParameters(yielding=yielding)
    assert PLACEMENT.yielding(p, v, 1.0) == PLACEMENT.yielding(p, -v, 0.0) == yielding
    slow, fast = (PLACEMENT.yielding(p, -speed, 1.0) for speed in (v, v + more))
    assert yielding <= slow <= fast <= 1.0
    drift = np.array(PLACEMENT.drift(1.0, (0.3, -0.2, 0.1), AT_REST, (1.0, 0.5, 0.0, 1.0)))
    assert np.allclose(drift, np.outer((1.0, 0.5, 0.0, 1.0), (-0.3, 0.2)))
