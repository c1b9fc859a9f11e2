# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot climbs stairs of 10 cm and strides over gaps blind, and forgets them after a way."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.balance.terrain import NOTHING_FELT, Terrain
from dmp_cpg_ros.core.robot_model.grounds import Steps
from dmp_cpg_ros.core.robot_model.rough_grounds import Gaps
from dmp_cpg_ros.studies.walking_trials import Walk, attitude

HIGHEST_STEP = 0.1
ON_TOP, DOWN, BEYOND = 1.6, 3.2, 3.0


def test_trot_climbs_two_stairs_and_forgets_them() -> None:
    run = Walk('trot', world=Steps(height=HIGHEST_STEP, depth=0.3, count=2, platform=4.0), seed=3)
    run.loop.command(0.5)
    roughest = 0.0
    while run.state.base_position_in_world[0] < ON_TOP and run.state.time_ns < 12e9:
        assert run.walk(0.1)
        rough = run.loop.posture.balance.terrain.rough
        roughest = max(roughest, rough)
    assert run.state.base_position_in_world[0] >= ON_TOP
    assert run.state.base_position_in_world[2] > 2.0 * HIGHEST_STEP + 0.2
    assert roughest > HIGHEST_STEP
    assert rough < roughest


def test_trot_comes_down_stairs_without_diving() -> None:
    """At the foot of the way down a plane through the footholds leans by 27 degrees."""
    run = Walk('trot', world=Steps(height=HIGHEST_STEP, depth=0.3, count=3, platform=0.6), seed=8)
    run.loop.command(0.5)
    steepest = 0.0
    while run.state.base_position_in_world[0] < DOWN and run.state.time_ns < 16e9:
        assert run.walk(0.1)
        steepest = max(steepest, float(np.abs(attitude(run.states[-1:])[:, 1]).max()))
    assert run.state.base_position_in_world[0] >= DOWN
    assert steepest < np.deg2rad(20.0)


def test_amble_strides_over_gaps() -> None:
    """A body that braked because of the leg in the gap fell over it."""
    run = Walk('amble', world=Gaps(width=0.1, count=3, depth=0.5), seed=201)
    run.loop.command(0.5 * float(np.random.default_rng(200).uniform(0.9, 1.1)))
    shares, gaps = [], []
    while run.state.base_position_in_world[0] < BEYOND and run.state.time_ns < 10e9:
        assert run.walk(0.1)
        gaps.append(run.loop.posture.balance.terrain.gaps)
        shares.append(run.loop.stop.share)
    assert run.state.base_position_in_world[0] >= BEYOND
    assert max(gaps) > 0.0
    assert all(share > 0.5 for share, gap in zip(shares[5:], gaps, strict=False) if gap)


def test_without_climbing_nothing_is_remembered() -> None:
    run = Walk('trot', world=Steps(height=HIGHEST_STEP, depth=0.3, count=2, platform=4.0), seed=3,
               values=(('climbing', False),))
    run.loop.command(0.5)
    assert run.walk(2.5)
    assert run.loop.posture.balance.terrain == NOTHING_FELT
    feedback = run.loop.tick(run.state).feedback
    assert feedback.level == (0.0,) * 4 and feedback.progress.rough == 0.0


@pytest.mark.parametrize(('gait', 'speed', 'tells'), [
    ('trot', 0.5, True), ('trot', 2.5, False), ('pronk', 0.3, False), ('pace', 0.3, False)])
def test_first_step_is_told_slowly_and_on_both_sides_and_ends_alone(
        gait: str, speed: float, tells: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    calm, felt = [], Terrain.felt

    def noted(self: Terrain, *args: object) -> object:
        calm.append(args[6])
        return felt(self, *args)

    run = Walk(gait)
    run.loop.command(speed)
    assert run.walk(2.5)
    monkeypatch.setattr(Terrain, 'felt', noted)
    assert run.walk(0.5)
    assert len(calm) > 100 and set(calm) == {tells}
