# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sideways pushes that change the speed by 1.2 m/s are survived at the phases that bear least."""

from __future__ import annotations

from math import pi

import pytest

from dmp_cpg_ros.studies.walking_trials import Walk, survives

SPEED_CHANGE = 1.2


@pytest.mark.parametrize(('gait', 'sixteenth', 'angle'), [
    ('amble', 7, -0.5 * pi), ('amble', 15, 0.5 * pi), ('trot', 3, 0.5 * pi)])
def test_a_push_from_the_side_is_survived(gait: str, sixteenth: int, angle: float) -> None:
    run = Walk(gait)
    assert run.reach((0.5, 0.0, 0.0)) and run.walk(3.0)
    omega = run.loop.network.omega(run.loop.r)
    assert run.walk(sixteenth / 16.0 * 2.0 * pi / omega)
    assert survives(run, angle, SPEED_CHANGE)
