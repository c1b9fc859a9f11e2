# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Places of joints in MuJoCo's arrays."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.robot.model_parts import as_slice


@pytest.mark.parametrize('places', [[6, 7, 8], [5], [6, 8, 7], [3, 5, 7], [8, 7, 6]])
def test_a_slice_reads_what_the_places_say(places: list[int]) -> None:
    values, found = np.arange(10.0), as_slice(np.array(places))
    np.testing.assert_array_equal(values[found], values[places])
    assert isinstance(found, slice) == bool(np.all(np.diff(places) == 1))
