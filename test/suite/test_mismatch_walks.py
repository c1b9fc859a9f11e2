# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Robots that are not as their controllers know them walk at the speed that is asked for."""

from __future__ import annotations

import pytest

pytest.importorskip('mujoco')

from dmp_cpg_ros.studies.benchmark_cases import MISMATCHED
from dmp_cpg_ros.studies.walking_trials import relative_error, steady

PAYLOAD, FRICTION, OFFSET = (next(name for name in MISMATCHED if word in name)
                             for word in ('payload', 'friction', 'mass 3 cm'))


@pytest.mark.parametrize(('what', 'gait', 'speed'), [
    (PAYLOAD, 'amble', 0.5), (FRICTION, 'amble', 0.5), (OFFSET, 'trot', 1.0)])
def test_the_speed_is_kept_whatever_the_model_does_not_know(
        what: str, gait: str, speed: float) -> None:
    """Without the wider limit and the offset that is found these are 20, 34 and 27 % too slow."""
    velocity = speed, 0.0, 0.0
    outcome = steady(gait, velocity, seed=60, values=MISMATCHED[what](1))
    assert relative_error(outcome, velocity) < 0.06      # NaN after a fall
