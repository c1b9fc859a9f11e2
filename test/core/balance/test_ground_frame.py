# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The frame of the ground is level without slope and stands on the slope with one."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.balance.footholds import SLIGHT, ground_from_base, lean
from dmp_cpg_ros.core.estimation.leg_odometry import normal_in_world
from dmp_cpg_ros.core.maths.rotations import turned
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, rotation

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


def ground_on(slope: tuple[float, float] | None, turn: tuple[float, float, float],
              following: float = 1.0) -> tuple[Matrix, Triple]:
    normal = None if slope is None else np.array(normal_in_world(slope))
    return ground_from_base(attitude(turn), normal, following)


def attitude(turn: tuple[float, float, float]) -> Matrix:
    return rotation(turned(LEVEL, np.array(turn)).tolist())


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
