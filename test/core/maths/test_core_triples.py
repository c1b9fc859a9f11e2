# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The algebra of tuples against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.maths import vec3
from dmp_cpg_ros.core.maths.rotations import turned


@pytest.mark.parametrize('_', range(5))
def test_products_and_inverse(_: int, rng: np.random.Generator) -> None:
    a, b, M = rng.normal(size=3), rng.normal(size=3), rng.normal(size=(3, 3))
    u, v = vec3.triple(a.tolist()), vec3.triple(b.tolist())
    rows = tuple(vec3.triple(row) for row in M.tolist())
    matrix = (rows[0], rows[1], rows[2])
    assert vec3.pair([1.0, 2.0]) == (1.0, 2.0)
    assert vec3.dot(u, v) == pytest.approx(a @ b)
    np.testing.assert_array_equal(vec3.plus(u, v), a + b)
    np.testing.assert_array_equal(vec3.minus(u, v), a - b)
    np.testing.assert_array_equal(vec3.moved(u, v, 0.3), a + b * 0.3)
    np.testing.assert_allclose(vec3.cross(u, v), np.cross(a, b), atol=1e-14)
    np.testing.assert_allclose(vec3.times(matrix, v), M @ b, atol=1e-14)
    np.testing.assert_allclose(vec3.transposed_times(matrix, v), M.T @ b, atol=1e-14)
    np.testing.assert_allclose(np.array(vec3.inverse(matrix)) @ M, np.eye(3), atol=1e-10)


def test_rotations(rng: np.random.Generator) -> None:
    vector = rng.normal(size=3)
    quaternion = turned((0.0, 0.0, 0.0, 1.0), vector.tolist())
    R, angle = np.array(vec3.rotation(quaternion)), float(np.linalg.norm(vector))
    (x, y, z), across = vector / angle, np.cross(vector, [1.0, 2.0, 3.0])
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    np.testing.assert_allclose(
        R, np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K, atol=1e-12)
    assert vector @ np.cross(across, R @ across) * np.sin(angle) > 0.0
    np.testing.assert_array_equal(vec3.upward(quaternion), R[2])


def test_a_singular_matrix_has_no_inverse() -> None:
    with pytest.raises(ZeroDivisionError):
        vec3.inverse(((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    with pytest.raises(ValueError, match='unpack'):
        vec3.triple([1.0, 2.0])
