# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Leg kinematics for random geometries: rotations spelled out, differences, inverses, reach."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import differences, geometry
from hypothesis import assume, given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.phase import wrapped
from dmp_cpg_ros.core.robot_model.description import LegGeometry
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics

signs = st.sampled_from([-1.0, 1.0])
small = st.floats(-0.05, 0.05)
vectors = st.tuples(small, small, small).map(np.array)
links = st.tuples(small, small, st.floats(-0.35, -0.12)).map(np.array)


@st.composite
def geometries(draw: st.DrawFn) -> LegGeometry:
    return geometry(
        hip_in_base=draw(vectors) * 4.0, hip_offset=draw(vectors), thigh=draw(links),
        shank=draw(links), axis_sign=np.array([draw(signs) for _ in range(3)]),
        knee_sign=int(draw(signs)))


def rotation_x(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


angles = st.tuples(*[st.floats(-1.5, 1.5)] * 3).map(np.array)


@given(leg=geometries(), q=angles)
def test_forward_kinematics_is_the_chain_of_its_links(leg: LegGeometry, q: np.ndarray) -> None:
    a, b, c = leg.axis_sign * q
    foot = leg.hip_in_base + rotation_x(a) @ (
        leg.hip_offset + rotation_y(b) @ (leg.thigh + rotation_y(c) @ leg.shank))
    assert np.allclose(LegKinematics(leg).foot_in_base(q), foot, atol=1e-12)


@given(leg=geometries(), q=angles)
def test_jacobian_against_differences(leg: LegGeometry, q: np.ndarray) -> None:
    kinematics = LegKinematics(leg)
    expected = differences(kinematics.foot_in_base, q)
    assert np.allclose(kinematics.jacobian_in_base(q), expected, atol=1e-8)


@given(leg=geometries(), bend=st.floats(0.2, 2.4), pitch=st.floats(-0.6, 0.6),
       roll=st.floats(-0.7, 0.7))
def test_inverse_undoes_forward(leg: LegGeometry, bend: float, pitch: float, roll: float) -> None:
    kinematics = LegKinematics(leg)
    thigh = np.arctan2(-leg.thigh[0], -leg.thigh[2])
    shank = np.arctan2(-leg.shank[0], -leg.shank[2])
    knee = leg.knee_sign * bend - shank + thigh
    q = leg.axis_sign * np.array([roll, pitch - 0.5 * leg.knee_sign * bend, knee])
    foot = kinematics.foot_in_base(q)
    in_plane = rotation_x(-roll) @ (foot - leg.hip_in_base)
    assume(in_plane[2] < -0.02)  # the foot is below the hip
    reach = np.hypot(*(in_plane - leg.hip_offset)[[0, 2]])
    assume(abs(kinematics.thigh_length - kinematics.shank_length) + 2e-3 < reach)
    assert np.allclose(wrapped(kinematics.inverse(foot) - q), 0.0, atol=1e-6)


@given(leg=geometries(), x=st.floats(-0.1, 0.1), y=st.floats(-0.1, 0.1), z=st.floats(-0.2, -0.1))
def test_forward_undoes_inverse_and_the_knee_bends_its_way(
        leg: LegGeometry, x: float, y: float, z: float) -> None:
    kinematics = LegKinematics(leg)
    longer = kinematics.thigh_length + kinematics.shank_length
    foot = leg.hip_in_base + np.array([leg.hip_offset[0] + x, kinematics.lateral_offset + y,
                                       leg.hip_offset[2] + 1.5 * z])
    q = kinematics.inverse(foot)
    reached = kinematics.foot_in_base(q)
    in_plane = rotation_x(-leg.axis_sign[0] * q[0]) @ (foot - leg.hip_in_base) - leg.hip_offset
    reach = np.hypot(in_plane[0], in_plane[2])
    shortest = abs(kinematics.thigh_length - kinematics.shank_length)
    assume(shortest + 2e-3 < reach < longer - 2e-3)
    assert np.allclose(reached, foot, atol=1e-9)
    thigh = rotation_y(leg.axis_sign[1] * q[1]) @ leg.thigh
    shank = rotation_y(leg.axis_sign[1] * q[1] + leg.axis_sign[2] * q[2]) @ leg.shank
    turn = thigh[2] * shank[0] - thigh[0] * shank[2]  # about +y, from thigh to shank
    assert np.sign(turn) == leg.knee_sign


@given(leg=geometries(), away=st.floats(1.5, 10.0), pitch=st.floats(-0.5, 0.5))
def test_a_point_out_of_reach_is_approached_as_far_as_possible(
        leg: LegGeometry, away: float, pitch: float) -> None:
    kinematics = LegKinematics(leg)
    longest = kinematics.thigh_length + kinematics.shank_length
    direction = np.array([np.sin(pitch), 0.0, -np.cos(pitch)])
    hip = leg.hip_in_base + leg.hip_offset
    hip[1] = leg.hip_in_base[1] + kinematics.lateral_offset
    q = kinematics.inverse(hip + away * longest * direction)
    assert np.all(np.isfinite(q))
    assert np.allclose(kinematics.foot_in_base(q), hip + longest * direction, atol=5e-3)


@pytest.mark.parametrize('knee_sign', [-1, 1])
def test_knees_of_both_signs_at_the_same_foothold(knee_sign: int) -> None:
    leg = geometry(knee_sign=knee_sign)
    kinematics, foot = LegKinematics(leg), np.array([0.19, 0.11, -0.26])
    q = kinematics.inverse(foot)
    assert np.allclose(kinematics.foot_in_base(q), foot)
    assert np.sign(q[2]) == knee_sign and np.sign(q[1]) == -knee_sign
