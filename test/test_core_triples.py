# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The algebra of tuples against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core import triples
from dmp_cpg_ros.core.rotations import rotation_matrix, turned

RANDOM = np.random.default_rng(11)


@pytest.mark.parametrize('_', range(5))
def test_products_and_inverse(_: int) -> None:
    a, b, M = RANDOM.normal(size=3), RANDOM.normal(size=3), RANDOM.normal(size=(3, 3))
    u, v = triples.triple(a.tolist()), triples.triple(b.tolist())
    rows = tuple(triples.triple(row) for row in M.tolist())
    matrix = (rows[0], rows[1], rows[2])
    assert triples.pair([1.0, 2.0]) == (1.0, 2.0)
    assert triples.dot(u, v) == pytest.approx(a @ b)
    np.testing.assert_array_equal(triples.plus(u, v), a + b)
    np.testing.assert_array_equal(triples.minus(u, v), a - b)
    np.testing.assert_array_equal(triples.moved(u, v, 0.3), a + b * 0.3)
    np.testing.assert_allclose(triples.cross(u, v), np.cross(a, b), atol=1e-14)
    np.testing.assert_allclose(triples.times(matrix, v), M @ b, atol=1e-14)
    np.testing.assert_allclose(triples.transposed_times(matrix, v), M.T @ b, atol=1e-14)
    np.testing.assert_allclose(np.array(triples.inverse(matrix)) @ M, np.eye(3), atol=1e-10)


def test_rotations() -> None:
    quaternion = turned(np.array([0.0, 0.0, 0.0, 1.0]), RANDOM.normal(size=3))
    R = rotation_matrix(quaternion)
    np.testing.assert_array_equal(triples.rotation(quaternion.tolist()), R)
    np.testing.assert_array_equal(triples.upward(quaternion.tolist()), R[2])


def test_a_singular_matrix_has_no_inverse() -> None:
    with pytest.raises(ZeroDivisionError):
        triples.inverse(((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    with pytest.raises(ValueError, match='unpack'):
        triples.triple([1.0, 2.0])
