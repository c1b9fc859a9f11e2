# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Drives that are off by a constant are found by their torques, and told so much less."""

from __future__ import annotations

from copy import deepcopy

import numpy as np
import pytest

pytest.importorskip('mujoco')
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.scenario.fault import KINDS, WRONG_TARGET, Fault
from dmp_cpg_ros.robot.drive_offsets import STEADY, DriveOffsets
from dmp_cpg_ros.studies.failures import FailingWalk, walking

ROBOT = 'robots/mini_quadruped.yaml'


def failing(gait: str, kind: str, leg: str, fails_s: float, later_s: float = 0.0) -> FailingWalk:
    """A walk in which the drives of a leg begin to fail now."""
    walk = deepcopy(walking(gait, ROBOT, 0.5))
    walk.follow(0.5, later_s)
    walk.injector.add(Fault('joint', kind, fails_s, leg), walk.state.time_ns)
    return walk


def offsets(walk: FailingWalk, seconds: float) -> np.ndarray:
    """Offsets (n, 4, 3) that are known at the ticks of a walk that goes on."""
    known = []
    for _ in range(round(seconds * 1e9 / walk.robot.tick_ns)):
        walk.tick()
        known.append(walk.watchdog.drives.offsets.offset.reshape(4, 3).copy())
    return np.array(known)


@pytest.mark.parametrize('leg', ['fl', 'rr'])
@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_a_leg_that_is_off_is_told_so_much_less_until_it_is_not(gait: str, leg: str) -> None:
    mine, walked = LEGS.index(leg), 0
    for later_s in (0.0, 0.15, 0.3):
        walk = failing(gait, 'wrong', leg, 0.6, later_s)
        known = offsets(walk, 0.6)
        if walk.watchdog.fallback:  # its blow was taken for that of a leg that gives anything
            continue
        walked += 1
        assert not np.delete(known, mine, axis=1).any()
        np.testing.assert_allclose(known[-1, mine], WRONG_TARGET, atol=STEADY)
        assert {name[:2] for name in walk.watchdog.drives.failing} == {leg}
        assert not offsets(walk, 0.5)[-1].any()
        assert not walk.follow(0.5, 1.0) and not walk.watchdog.fallback
        assert walk.loop.stop.state == 'walking'
    assert walked >= 2


@pytest.mark.parametrize('kind', sorted({*KINDS} - {'wrong'}))
def test_what_fails_in_another_way_is_not_off_by_a_constant(kind: str) -> None:
    for later_s in (0.0, 0.2):
        assert not offsets(failing('trot', kind, 'fr', 1.0, later_s), 2.0).any()


@pytest.mark.parametrize('share', [0.0, 0.4, 1.0])
def test_a_drive_that_gives_a_share_of_what_it_is_asked_for_is_not_off(share: float) -> None:
    """Not even where what is asked for stays the same, and the joints move."""
    walk = walking('trot', ROBOT, 0.5)
    known = DriveOffsets(walk.robot.description)
    for k in range(50):
        asked = np.full(12, 0.4)
        angle = np.full(12, 2.0 * 0.004 * k)
        known.see(4_000_000 * k, share * asked, np.array((asked, asked)),
                  angle if share else np.zeros(12), angle)
    assert not known.known


def test_an_offset_is_found_whatever_is_asked_for_meanwhile() -> None:
    description = walking('trot', ROBOT, 0.5).robot.description
    random, known = np.random.default_rng(0), DriveOffsets(description)
    limit = np.concatenate([leg.torque_limit for leg in description.legs])
    shares = np.tile(description.kp, 4) / limit * np.repeat((0.0, 0.1, 0.0, 0.0), 3)
    for k in range(15):
        asked = np.repeat(0.1 * random.normal(size=(1, 12)), 2, axis=0)
        known.see(4_000_000 * k, asked[0] + shares, asked, np.zeros(12), np.full(12, 0.01 * k))
    np.testing.assert_allclose(known.offset, np.repeat((0.0, 0.1, 0.0, 0.0), 3), atol=1e-9)
    known.forget(('fl',))
    assert known.known
    known.forget(('fr',))
    assert not known.known
