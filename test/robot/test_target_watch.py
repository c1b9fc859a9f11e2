# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Targets that no leg sends are not believed, and those that a leg sends are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.target_watch import TargetWatch
from dmp_cpg_ros.studies.failures import Case, drawn, trial

TICK_NS, GAP_NS = 4_000_000, 200_000_000
PERIOD_S = 0.5
LEG = load_description().legs[0]
MIDDLE = 0.5 * (LEG.position_lower + LEG.position_upper)


def stride(k: int) -> JointTargets:
    """Targets of a leg that strides at the k-th tick."""
    phase = 2.0 * np.pi * 1e-9 * TICK_NS * k / PERIOD_S + np.arange(3)
    return JointTargets(MIDDLE + 0.4 * np.sin(phase), 0.8 * np.pi / PERIOD_S * np.cos(phase),
                        np.zeros(3))


def believed(sent: Callable[[int], JointTargets | None], ticks: int) -> list[bool | None]:
    """Tell of each tick whether its targets were believed; None where none came."""
    watch, seen = TargetWatch(LEG, GAP_NS), []
    for k in range(ticks):
        targets = sent(k)
        seen.append(None if targets is None else watch.believes(k * TICK_NS, targets))
    return seen


def off(k: int, way: float | np.ndarray) -> JointTargets:
    right = stride(k)
    return JointTargets(right.position + way, right.velocity, right.effort)


@pytest.mark.parametrize('seed', range(20))
def test_a_stride_is_believed_also_where_some_of_it_is_lost(seed: int) -> None:
    random = np.random.default_rng(seed)
    seen = believed(lambda k: stride(k) if random.random() < 0.5 else None, 500)
    assert False not in seen


def test_an_offset_is_not_believed_until_it_goes() -> None:
    seen = believed(lambda k: off(k, 0.15 * (100 <= k < 300)), 400)
    assert all(seen[:100])
    assert not any(seen[100:300])
    assert all(seen[300:])


def test_an_offset_that_stays_is_believed_once_the_leg_rests() -> None:
    def sent(k: int) -> JointTargets:
        moves = off(k, 0.15 * (k >= 100))
        return moves if k < 300 else JointTargets(off(300, 0.15).position, *np.zeros((2, 3)))

    seen = believed(sent, 400)
    assert not any(seen[100:300])
    assert not any(seen[300:320])  # it stops within a tick, which is a jump of its speed
    assert all(seen[330:])


def test_what_tells_anything_is_not_believed() -> None:
    random = np.random.default_rng(3)
    wild = [JointTargets(MIDDLE + 2.0 * random.standard_normal(3), *np.zeros((2, 3)))
            for _ in range(200)]
    seen = believed(lambda k: wild[k - 100] if 100 <= k < 300 else stride(k), 300)
    assert not any(seen[100:])


def test_what_repeats_while_it_moves_is_not_believed_and_what_rests_is() -> None:
    seen = believed(lambda k: stride(min(k, 100)), 300)
    assert all(seen[:101])
    assert not any(seen[101:])
    rest = JointTargets(stride(0).position, *np.zeros((2, 3)))
    assert all(believed(lambda _: rest, 300))


def test_a_step_of_a_leg_that_rests_is_believed_after_a_moment() -> None:
    seen = believed(
        lambda k: JointTargets(MIDDLE + 0.3 * (k >= 100), *np.zeros((2, 3))), 300)
    assert all(seen[:100])
    assert not any(seen[100:124])
    assert all(seen[126:])


@pytest.mark.parametrize(('cell', 'seed'), [
    (('amble', 'link', 'wrong'), 103), (('amble', 'node', 'stuck'), 103),
    (('amble', 'node', 'garbage'), 104),
    (('trot', 'node', 'delayed'), 103), (('amble', 'imu', 'garbage'), 101),
    (('trot', 'imu', 'slow'), 104), (('trot', 'imu', 'wrong'), 103),
    (('trot', 'imu', 'wrong'), 104), (('amble', 'imu', 'wrong'), 104),
    (('amble', 'joint', 'garbage'), 200), (('trot', 'joint', 'garbage'), 205),
    (('amble', 'joint', 'stuck'), 203), (('trot', 'joint', 'stuck'), 200)])
def test_failures_that_made_a_walk_fall_do_not(cell: tuple[str, str, str], seed: int) -> None:
    outcome = trial(drawn(cell, seed, [Case._field_defaults['robot']]))
    assert outcome.end != 'falls'
    assert outcome.named


def test_a_joint_whose_targets_were_cut_at_a_limit_is_not_judged_until_it_has_caught_up() -> None:
    fast, step = 1.5 * LEG.velocity_limit[2], 2.0 * LEG.velocity_limit[2] * 1e-9 * TICK_NS
    wanted = MIDDLE[2] + fast * 1e-9 * TICK_NS * np.clip(np.arange(40) - 5, 0, 6)
    told = [MIDDLE[2]]
    for goal in wanted[1:]:
        told.append(told[-1] + min(goal - told[-1], step if len(told) > 8 else 0.5 * step))

    def sent(k: int) -> JointTargets:
        rate = LEG.velocity_limit[2] * (5 < k < 9) + 0.1 * (k >= 9)
        return JointTargets(np.array((*MIDDLE[:2], told[k])), np.array((0.0, 0.0, rate)),
                            np.zeros(3))

    assert all(believed(sent, 40))
