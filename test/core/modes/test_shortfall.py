# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A body that stays slower than its reference is told; ramps, sway, stops and rest are not."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin

import numpy as np
import pytest

from dmp_cpg_ros.core.modes.shortfall import LASTS_S, MEAN_S, NO_SHORTFALL, SHARE

LEG, DT = 0.3, 0.004
Motion = Callable[[float], tuple[float, float]]


def told(motion: Motion, seconds: float = 20.0, direction: float = 0.0) -> list[float]:
    """Times at which it is told and is over, of a motion (reference, speed) over time."""
    state, changes = NO_SHORTFALL, []
    ahead = cos(direction), sin(direction)
    for k in range(round(seconds / DT)):
        asked, goes = motion(k * DT)
        after = state.step(np.array((*(asked * part for part in ahead), 0.3)),
                           (goes * ahead[0], goes * ahead[1]), LEG, DT)
        if after.lasts != state.lasts:
            changes.append(k * DT)
        state = after
    return changes


@pytest.mark.parametrize('direction', [0.0, 1.0, 3.0, -2.0])
def test_what_stays_short_is_told_once_wherever_it_goes(direction: float) -> None:
    (at,) = told(lambda t: (1.5, 0.85 * SHARE * 1.5), direction=direction)
    assert LASTS_S <= at <= LASTS_S + MEAN_S


WALKS: dict[str, Motion] = {
    'near enough': lambda t: (1.0, 0.93),
    'faster': lambda t: (1.0, 1.4),
    'swings with the gait': lambda t: (1.0, 0.97 + 0.9 * sin(12.0 * t)),
    'sets off late': lambda t: (min(1.5, t), min(1.5, max(0.0, t - 0.25))),
    'follows late': lambda t: (0.9 + 0.6 * sin(t), 0.9 + 0.6 * sin(t - 0.2)),
    'hardly asked': lambda t: (0.1, 0.0),
    'rests': lambda t: (0.0, 0.0),
    'stops between': lambda t: (0.0 if t % 3.0 > 2.0 else 1.0, 0.5),
}


@pytest.mark.parametrize('motion', WALKS.values(), ids=WALKS)
def test_what_a_walk_does_is_not_told(motion: Motion) -> None:
    assert not told(motion)


def test_it_is_over_when_the_body_follows_again_or_stops() -> None:
    at, over = told(lambda t: (1.0, 0.5 if t < 8.0 else 1.0))
    assert at < 8.0 < over < 8.0 + 2.0 * MEAN_S
    assert told(lambda t: (1.0 if t < 8.0 else 0.0, 0.5))[1] == pytest.approx(8.0, abs=2 * DT)


def test_a_body_that_does_not_balance_begins_anew() -> None:
    short = NO_SHORTFALL
    for _ in range(2000):
        short = short.step(np.array((1.0, 0.0, 0.0)), (0.2, 0.0), LEG, DT)
    assert short.lasts
    assert short.step(np.array((1.0, 0.0, 0.0)), None, LEG, DT) == NO_SHORTFALL
