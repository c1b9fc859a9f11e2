# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A push against a stop: the gait is released, the stop stays in force, and it ends.

The robot only stands, and is told margins of the capture point.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from limbless import NO_FEEDBACK
from standing_run import ROBOT, TICK, Run, walking

from dmp_cpg_ros.core.balance.capture_point import WIDE
from dmp_cpg_ros.core.balance.controller import (
    PostureController,
    PostureFeedback,
    PostureParameters,
    PostureState,
)
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.inhibition import push_recovery
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.inhibition.prediction import look_ahead
from dmp_cpg_ros.core.inhibition.push_recovery import MOST_RELEASES
from dmp_cpg_ros.core.loop import WalkingLoop

TO_THE_RIGHT, TO_THE_LEFT = (0.1, 0.0, 0.1, 0.2), (0.1, 0.2, 0.1, 0.0)


class Told(PostureController):
    """Knows nothing but the margins and the progress that it is told."""

    margins = WIDE
    progress: Progress | None = None

    def step(self, memory: PostureState, *_: object) -> tuple[PostureState, PostureFeedback]:
        return memory, replace(NO_FEEDBACK, margins=self.margins, progress=self.progress)


def told(run: Run) -> Told:
    run.loop.body.posture = posture = Told(ROBOT, PostureParameters())
    return posture


def resting(**changes: object) -> tuple[Run, Told]:
    run = Run(**changes)
    body = told(run)
    return run.go(0.5), body


def ahead(loop: WalkingLoop) -> float:
    """Predicted time from now, where what was published acts at the next tick [s]."""
    return look_ahead(loop.supervisor, loop.reference, loop.canonical, loop.stop,
                   Announced(loop.inhibition), loop.canon, loop.r, (0.0, 0.0, 0.0), TICK).time_s


def test_a_push_at_rest_releases_the_gait_and_it_rests_again_as_predicted() -> None:
    run, body = resting()
    bound = run.loop.in_force().certificate()
    body.margins = TO_THE_LEFT
    run.until('releasing')
    predicted = ahead(run.loop)
    assert run.until('stepping') == pytest.approx(predicted) and predicted <= bound.time_to_walking
    assert run.loop.stop.measured_s == pytest.approx(predicted)
    run.go(1.0)
    assert run.loop.stop.state == 'stepping'
    body.margins = WIDE
    run.until('waiting')
    predicted, most = ahead(run.loop), run.loop.time_to_rest()
    assert run.until('at_rest') == pytest.approx(predicted) and predicted <= most
    run.go(2.0)
    assert run.words() == [
        'at_rest', 'releasing', 'stepping', 'waiting', 'captured', 'at_rest']


def test_the_stop_stays_in_force_and_the_reference_at_zero() -> None:
    run, body = resting()
    run.loop.request(True)
    run.loop.command(0.5)
    body.margins = TO_THE_LEFT
    run.ticks.clear()
    run.go(1.5)
    assert run.ticks[-1].supervisor.state == 'stepping' and run.loop.stop.in_force
    assert run.loop.inhibition.requested and not run.loop.inhibition.gains.any()
    assert not any(tick.r.any() for tick in run.ticks)


def test_one_tick_releases_nothing() -> None:
    run, body = resting()
    for _ in range(20):
        body.margins = TO_THE_LEFT
        run.go(TICK)
        body.margins = WIDE
        run.go(TICK)
    assert run.words() == ['at_rest']


def test_a_push_during_a_stop_is_answered_too() -> None:
    run = walking()
    body = told(run)
    run.loop.request(True)
    run.until('captured')
    body.margins = TO_THE_RIGHT
    run.until('releasing', 'stepping')
    assert not run.loop.stop.push.opposite
    run.go(0.5)
    body.margins = WIDE
    run.until('at_rest')


def test_it_ends_whatever_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(push_recovery, 'LONGEST_CYCLES', 1)
    run, body = resting()
    body.margins = TO_THE_LEFT
    run.go(12.0)
    acts = [tick.supervisor.push.acts for tick in run.ticks]
    assert np.count_nonzero(np.diff(acts)) == 2 * MOST_RELEASES
    assert run.loop.stop.push.releases == MOST_RELEASES and run.loop.stop.state == 'at_rest'
    body.margins = WIDE
    run.go(0.1)
    body.margins = TO_THE_LEFT
    run.go(0.1)
    assert run.loop.stop.state == 'releasing'


def test_it_ends_on_a_clock_that_is_set_back() -> None:
    run, body = resting()
    run.time_ns += 1_000_000_000_000
    run.go(TICK)
    body.margins = TO_THE_LEFT
    run.until('stepping')
    body.margins = WIDE
    run.go(TICK).time_ns = 0
    run.until('waiting', 'captured')
    body.margins = TO_THE_LEFT
    run.go(TICK).time_ns = 0  # the margin has been low since then
    run.until('releasing', longest=0.1)


@pytest.mark.parametrize(('margins', 'turns'), [(TO_THE_LEFT, False), (TO_THE_RIGHT, True)])
def test_the_legs_on_the_side_of_the_fall_swing_first(
        margins: tuple[float, ...], turns: bool) -> None:
    run, body = resting()
    body.margins = margins
    x = run.loop.x
    run.until('releasing')
    run.go(TICK)
    turned = float(np.sum(x * run.loop.x)) < 0.0
    assert turned == turns == run.loop.stop.push.opposite
    network = run.loop.network
    assert np.abs(network.phase_errors(run.loop.x)).max() < 0.2
    fallen_to, swung = ([1, 3] if turns else [0, 2]), set[int]()
    for _ in range(round(0.75 * 2.0 * np.pi / network.omega(run.loop.r) / TICK)):
        run.go(TICK)
        swung |= {leg for leg in fallen_to if abs(network.gait.cycle_position(
            phase(run.loop.x))[leg]) < 0.05 and run.loop.stop.activity[leg] > 0.6}
    assert swung == set(fallen_to)


def test_a_start_ends_it() -> None:
    run, body = resting()
    run.loop.command(0.4)
    body.margins = TO_THE_LEFT
    run.loop.request(True)
    run.until('stepping')
    run.loop.request(False)
    assert not run.loop.stop.in_force
    body.margins = WIDE
    run.until('walking')
    run.go(1.0)
    assert run.loop.r[0] == pytest.approx(0.4, abs=0.05)
    assert not run.loop.stop.push.acts


def test_without_the_parameter_nothing_is_released() -> None:
    run, body = resting(inhibition=InhibitionParameters(push_recovery=False))
    body.margins = TO_THE_LEFT
    run.go(1.0)
    assert run.words() == ['at_rest']


def test_while_the_robot_lies_down_nothing_is_released() -> None:
    run, body = resting()
    run.loop.request_mode('lie_down')
    run.until('at_rest')
    while run.loop.mode.mode != 'lowering':
        run.go(TICK)
    body.margins = TO_THE_LEFT
    run.go(1.0)
    assert run.words() == ['at_rest']
