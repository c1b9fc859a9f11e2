# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sideways pushes that change the speed by 1.2 m/s are survived at the phases that bear least, and
at rest.
"""

from __future__ import annotations

from copy import deepcopy
from functools import lru_cache
from math import cos, pi, sin

import numpy as np
import pytest

from dmp_cpg_ros.studies.push_trials import survives
from dmp_cpg_ros.studies.walking_trials import Walk

SPEED_CHANGE = 1.2


@pytest.mark.parametrize(('gait', 'sixteenth', 'angle'), [
    ('amble', 7, -0.5 * pi), ('amble', 15, 0.5 * pi), ('trot', 3, 0.5 * pi)])
def test_a_push_from_the_side_is_survived(gait: str, sixteenth: int, angle: float) -> None:
    run = Walk(gait)
    assert run.reach((0.5, 0.0, 0.0)) and run.walk(3.0)
    omega = run.loop.network.omega(run.loop.r)
    assert run.walk(sixteenth / 16.0 * 2.0 * pi / omega)
    assert survives(run, angle, SPEED_CHANGE)


@lru_cache
def resting(recovery: bool) -> Walk:
    run = Walk('amble', values=(('push_recovery', recovery),), start=False)
    assert run.walk(0.5) and run.loop.stop.state == 'at_rest'
    return run


@pytest.mark.parametrize('angle', [0.5 * pi, 1.25 * pi, 1.5 * pi])
def test_a_robot_at_rest_steps_out_of_a_push_and_rests_again(angle: float) -> None:
    assert not survives(resting(False), angle, SPEED_CHANGE)
    run = deepcopy(resting(True))
    impulse = run.robot.description.mass * SPEED_CHANGE
    for _ in range(2):
        begin = run.state.base_position_in_world
        run.push(impulse * np.array((cos(angle), sin(angle), 0.0)))
        words = []
        for _ in range(round(3.0 / run.tick_s)):
            assert run.walk(run.tick_s)
            words.append(run.loop.stop.state)
            assert run.loop.stop.in_force and not run.loop.r.any()
        assert {'stepping', 'captured'} <= set(words) and words[-1] == 'at_rest'
        moved = run.state.base_position_in_world - begin
        assert np.hypot(*moved[:2]) < 1.0
