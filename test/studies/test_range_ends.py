# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study asks for the ends of every range, and ends with what the suite had."""

from __future__ import annotations

from itertools import groupby

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.studies.range_ends import questions


def test_each_number_is_set_to_the_ends_of_its_range_and_back() -> None:
    asked = {key: [of.value for of in group] for key, group in groupby(
        questions(['posture_control']), key=lambda of: (of.node, of.name))}
    assert len(asked) > 20
    rate = asked['posture_control', 'estimate_rate']
    assert rate[-1] == EstimationParameters().estimate_rate
    assert {0.0, 5e-324, 1e-300, 2000.0} <= set(rate)
    assert all(0.0 <= value <= 2000.0 for value in rate)
