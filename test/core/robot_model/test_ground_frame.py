# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frame of the ground is level without slope and stands on the slope with one."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.estimation.leg_odometry import normal_in_world
from dmp_cpg_ros.core.maths.rotations import turned
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, rotation
from dmp_cpg_ros.core.robot_model.ground_frame import (
    SLIGHT,
    STEEP,
    STEPPED,
    ground_from_base,
    lean,
    turned_back,
)

LEVEL = (0.0, 0.0, 0.0, 1.0)


def ground_on(slope: tuple[float, float] | None, turn: tuple[float, float, float],
              following: float = 1.0) -> tuple[Matrix, Triple]:
    normal = None if slope is None else np.array(normal_in_world(slope))
    return ground_from_base(attitude(turn), normal, following)


def attitude(turn: tuple[float, float, float]) -> Matrix:
    return rotation(turned(LEVEL, turn))


@pytest.mark.parametrize('turn', [(0.0, 0.0, 0.0), (0.1, -0.2, 0.0), (0.1, 0.2, 2.0)])
def test_without_slope_it_is_level(turn: tuple[float, float, float]) -> None:
    known, upward = ground_on((0.0, 0.0), turn)
    unknown, _ = ground_on(None, turn)
    level, _ = ground_on((0.3, 0.1), turn, following=0.0)
    np.testing.assert_allclose(known, unknown, atol=1e-12)
    np.testing.assert_allclose(known, level, atol=1e-12)
    np.testing.assert_allclose(upward, (0.0, 0.0, 1.0), atol=1e-12)
    np.testing.assert_allclose(known[2], attitude(turn)[2], atol=1e-12)  # the vertical


@pytest.mark.parametrize('turn', [(0.0, 0.0, 0.0), (0.1, -0.2, 0.0), (0.1, 0.2, 2.0)])
@pytest.mark.parametrize('slope', [(0.25, 0.0), (-0.1, 0.2)])
def test_on_a_slope_its_z_axis_is_the_normal(slope: tuple[float, float],
                                             turn: tuple[float, float, float]) -> None:
    R, upward = (np.array(found) for found in ground_on(slope, turn))
    R_world_base = np.array(attitude(turn))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    # The frame falls short of the slope by (SLIGHT / slope)² of it.
    np.testing.assert_allclose(R_world_base @ R[2], normal_in_world(slope),
                               atol=1.1 * SLIGHT**2 / np.hypot(*slope))
    np.testing.assert_allclose(R_world_base @ R.T @ upward, (0.0, 0.0, 1.0), atol=1e-12)
    assert R[0, 0] > 0.9 and abs(R[0, 1]) < 0.1  # the heading is the base's


def test_half_of_a_slope_is_half_as_steep() -> None:
    (_, _, z), _ = ground_on((0.2, -0.1), (0.0, 0.0, 0.0), following=0.5)
    short = 1.0 - SLIGHT**2 / (0.05 + SLIGHT**2)
    np.testing.assert_allclose(np.array(z) / z[2], (-0.1 * short, 0.05 * short, 1.0), atol=1e-12)


def test_a_slight_slope_is_hardly_followed() -> None:
    (_, _, z), _ = ground_on((0.003, 0.0), (0.0, 0.0, 0.0))
    assert 0.0 < -z[0] < 0.02 * 0.003


def test_the_vertical_through_the_body_meets_the_ground_downhill() -> None:
    angle = 0.2
    _, upward = ground_on((np.tan(angle), 0.0), (0.0, -angle, 0.0))
    shift = lean(upward, 0.3)
    assert shift[0] == pytest.approx(-0.3 * np.tan(angle), rel=0.03)  # uphill is ahead
    assert shift[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('turn', [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (-0.1, 0.4, 0.5)])
@pytest.mark.parametrize('slope', [(0.25, 0.0), (-0.1, 0.3), (0.0, -0.2)])
def test_on_a_slope_feet_stand_around_the_body_however_it_is_tilted(
        slope: tuple[float, float], turn: tuple[float, float, float]) -> None:
    R, upward = ground_on(slope, turn)
    under, normal, height = lean(upward, 0.3), np.array(R[2]), 0.3
    x, y = turned_back(under, under, R[2], height)
    down = -(height + normal[:2] @ (x, y)) / normal[2]  # in the plane of the ground
    along_x, along_y, below = np.array(attitude(turn)) @ (x, y, down)
    assert np.hypot(along_x, along_y) < 0.06 * height
    assert below < -0.9 * height


@pytest.mark.parametrize('slope', [(0.0, 0.0), (0.04, 0.0), (0.02, -0.03)])
def test_on_gentle_ground_footholds_know_nothing_of_a_tilt(slope: tuple[float, float]) -> None:
    R, upward = ground_on(slope, (0.3, -0.2, 0.0))
    beside = (0.01, -0.02)
    assert turned_back(beside, lean(upward, 0.3), R[2], 0.3) == beside


def test_a_tilt_counts_less_the_rougher_the_ground_and_not_where_its_slope_is_of_steps() -> None:
    R, upward = ground_on((0.3, 0.1), (0.3, -0.2, 0.0))
    beside, under = (0.01, -0.02), lean(upward, 0.3)
    turned = [np.subtract(turned_back(beside, under, R[2], 0.3, rough), beside)
              for rough in (0.0, 0.15 * STEPPED, STEPPED * 0.3, 0.2)]
    assert np.abs(turned[0]).max() > 0.05
    np.testing.assert_allclose(turned[1], 0.5 * turned[0])
    np.testing.assert_allclose(turned[2:], 0.0, atol=1e-12)


def test_a_tilt_counts_by_and_by_where_it_begins_to_be_steep() -> None:
    tilted, shifts = ground_on((0.0, 0.0), (0.2, 0.0, 0.0))[0][2], []
    for slope in np.linspace(0.0, 2.0 * STEEP[1], 200):
        shifts.append(turned_back((0.0, 0.0), (-0.3 * slope, 0.0), tilted, 0.3)[1])
    assert shifts[0] == 0.0
    assert shifts[-1] == pytest.approx(-0.3 * np.sin(0.2))
    assert np.max(np.abs(np.diff(shifts))) < 0.03 * 0.3
