# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The foot's path: smooth, true to the ground in stance, clear of it in swing; rolling feet."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import geometry
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.transformation.foot_path import FootPath, rolling_share

speeds = st.floats(-1.5, 1.5)
turn_rates = st.one_of(st.floats(-2.0, 2.0), st.sampled_from([0.0, 1e-9, 1e-7]))


@st.composite
def paths(draw: st.DrawFn, rolls: bool = True) -> FootPath:
    share = st.floats(0.8, 1.2) if rolls else st.just(1.0)
    foothold = np.array([draw(st.floats(-0.3, 0.3)), draw(st.floats(-0.2, 0.2)), -0.25])
    omega, duty, clearance = st.floats(3.0, 30.0), st.floats(0.3, 0.9), st.floats(0.0, 0.1)
    return FootPath(foothold, draw(speeds), draw(speeds), draw(turn_rates), draw(omega),
                    draw(duty), draw(clearance), (draw(share), draw(share)))


@given(path=paths(), side=st.sampled_from([-1.0, 1.0]))
def test_position_and_slope_are_continuous_where_stance_meets_swing(
        path: FootPath, side: float) -> None:
    joint, h = side * 0.5 * (1.0 - path.duty), 1e-9
    before, after = path.at(joint - h), path.at(joint + h)
    for name, a, b in zip(('position', 'slope'), before, after, strict=True):
        assert np.allclose(a, b, atol=1e-5), name


@given(path=paths())
def test_the_cycle_closes(path: FootPath) -> None:
    for a, b in zip(path.at(-0.5), path.at(0.5), strict=True):
        assert np.allclose(a, b, atol=1e-9)
    assert np.allclose(path.at(0.5)[0], path.foothold_in_base)


@given(path=paths(), c=st.floats(-0.49, 0.49))
def test_slope_against_differences(path: FootPath, c: float) -> None:
    h = 1e-7
    if abs(abs(c) - 0.5 * (1.0 - path.duty)) < 2.0 * h:
        return
    expected = np.subtract(path.at(c + h)[0], path.at(c - h)[0]) / (2.0 * h)
    assert np.allclose(path.at(c)[1], expected, atol=1e-4)


@given(path=paths(rolls=False), share=st.floats(-0.99, 0.99), other=st.floats(-0.99, 0.99))
def test_in_stance_the_foot_stays_where_it_is_in_the_world(
        path: FootPath, share: float, other: float) -> None:
    """The base moves with constant (v, gamma) in its own frame, turning included."""
    period = 2.0 * np.pi / path.omega

    def foot_in_world(part: float) -> np.ndarray:
        from_mid_stance = 0.5 * part * path.duty
        position = path.at((from_mid_stance + 1.0) % 1.0 - 0.5)[0]
        t = from_mid_stance * period
        yaw = path.gamma * t
        c, s = np.cos(yaw), np.sin(yaw)
        if abs(yaw) > 1e-5:
            V = np.array([[s, c - 1.0], [1.0 - c, s]]) / path.gamma
        else:
            V = t * np.array([[1.0, -0.5 * yaw], [0.5 * yaw, 1.0]])
        base = V @ [path.v_x, path.v_y]
        return base + np.array([[c, -s], [s, c]]) @ position[:2]

    assert np.allclose(foot_in_world(share), foot_in_world(other), atol=1e-7)


@given(path=paths(), c=st.floats(-0.5, 0.5))
def test_the_foot_is_on_the_ground_in_stance_and_above_it_in_swing(
        path: FootPath, c: float) -> None:
    height = path.at(c)[0][2] - path.foothold_in_base[2]
    if abs(c) >= 0.5 * (1.0 - path.duty):
        assert height == 0.0
    else:
        assert -1e-12 <= height <= path.clearance + 1e-12
    assert path.at(0.0)[0][2] - path.foothold_in_base[2] == pytest.approx(path.clearance)


@given(path=paths(rolls=False))
def test_stance_is_centred_on_the_foothold_when_going_straight(path: FootPath) -> None:
    straight = FootPath(path.foothold_in_base, path.v_x, path.v_y, 0.0, path.omega, path.duty, 0.0)
    half = 0.5 * (1.0 - path.duty)
    middle = 0.5 * np.add(straight.at(half)[0], straight.at(-half)[0])
    assert np.allclose(middle, path.foothold_in_base)


@given(knee_sign=st.sampled_from([-1, 1]), height=st.floats(0.2, 0.33), x=st.floats(-0.05, 0.05),
       radius=st.floats(0.0, 0.03), signs=st.tuples(*[st.sampled_from([-1.0, 1.0])] * 3))
def test_a_rolling_foot_does_not_slip_at_its_foothold(
        knee_sign: int, height: float, x: float, radius: float, signs: tuple[float, ...]) -> None:
    """The lowest point of the sphere does not move when the base moves on and the shank turns."""
    leg = geometry(knee_sign=knee_sign, foot_radius=radius, axis_sign=np.array(signs))
    kinematics = LegKinematics(leg)
    foothold = np.array([0.19 + x, 0.11, -height])
    share = rolling_share(kinematics, foothold)
    h = 1e-6
    for axis in (0, 1):
        moved = np.zeros(3)
        moved[axis] = -share[axis] * h  # of the centre in the base while the base moves by h
        turned = leg.axis_sign * (kinematics.inverse(foothold + moved)
                                  - kinematics.inverse(foothold - moved)) / 2.0
        pitch, roll = turned[1] + turned[2], turned[0]
        rolled = radius * (pitch if axis == 0 else -roll)
        assert h + moved[axis] == pytest.approx(rolled, abs=1e-5 * h)
