# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pushed robot steps faster; phases, stops and starts do not notice."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from core_examples import network
from standing_run import TICK, Run, walking
from test_push_recovery import TO_THE_LEFT, resting, told

from dmp_cpg_ros.core.balance.capture_point import WIDE
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.gait.speed_limit import swing_acceleration
from dmp_cpg_ros.core.inhibition.caution import DISTURBED, room
from dmp_cpg_ros.core.inhibition.step_timing import (
    QUICKEST,
    RISING,
    SLOWING,
    quickened,
    quickest,
)
from dmp_cpg_ros.studies.walking_trials import Walk, is_there

FALLING = (1.0, 1.0, -1.0, 1.0)


def pushed(**changes: object) -> Run:
    """A run that walks as fast as a push makes it."""
    run = walking(**changes)
    told(run).margins = FALLING
    return run.go(0.1)


def test_the_factor_grows_as_the_least_margin_falls_and_is_never_beyond_its_bounds() -> None:
    factors = [quickened(1.0, room((1.0, m, 1.0, 1.0), 0.5, 1.0), 1.0)
               for m in np.linspace(-0.5, 0.5)]
    assert np.all(np.diff(factors) <= 0.0) and {min(factors), max(factors)} == {1.0, QUICKEST}
    half = quickened(1.0, room((0.25 * DISTURBED,) * 4, 0.5, 1.0), 1.0)
    assert half == pytest.approx(0.5 * (1.0 + QUICKEST))
    assert quickened(1.0, room((0.5 * DISTURBED,) * 4, 0.5, 1.0), 1.0) == 1.0


def test_it_rises_and_falls_at_its_rates() -> None:
    falling = room(FALLING, 0.3, 1.0)
    assert quickened(1.0, falling, 0.5 * RISING) == pytest.approx(0.5 * (1.0 + QUICKEST))
    for left in (None, room(WIDE, 0.3, 1.0)):
        assert quickened(QUICKEST, left, 0.1) == pytest.approx(QUICKEST - 0.1 * SLOWING)
        assert quickened(QUICKEST, left, 10.0) == 1.0


@pytest.mark.parametrize('gait', ['amble', 'trot', 'pronk'])
@pytest.mark.parametrize('quickness', [1.0, 2.0])
@pytest.mark.parametrize(('v_x', 'body'), [
    (0.5, 0.2), (-0.5, -0.5), (1.0, 2.5), (-0.4, -3.0), (0.02, 3.0)])
@pytest.mark.parametrize('lately', [0.3, 2.8])
def test_legs_go_no_faster_than_hips_can_swing_them_at_the_speed_that_the_body_has_from_walking(
        gait: str, quickness: float, v_x: float, body: float, lately: float) -> None:
    slow = network(gait)
    slow.scale = scale = replace(slow.scale, swing=200.0)
    acts = slow.of(slow.gait.scaled(quickness))
    most = quickest(acts, quickness, np.array([v_x, 0.0, 0.3]), (body, 1.5), lately)
    pace = slow.gait.pace(np.array([v_x, 0.0, 0.3]), scale)
    needed = swing_acceleration(
        max(abs(v_x), min(lately, abs(body))), most * pace.omega / (2.0 * pi), pace.duty)
    assert needed == pytest.approx(200.0)
    fallen = quickened(1.0, room(FALLING, 0.3, 1.0), 1.0, most)
    assert fallen == pytest.approx(max(1.0, min(QUICKEST, most)))


def test_a_push_at_rest_or_sideways_is_answered_as_fast_as_ever() -> None:
    of = network('trot')
    of.scale = replace(of.scale, swing=200.0)
    for v_x in (0.0, 0.3):
        assert quickest(of, 1.0, np.array([v_x, 0.0, 0.0]), (v_x, 3.0), v_x) > QUICKEST
    of.scale = replace(of.scale, swing=inf)
    assert quickest(of, 1.0, np.array([3.0, 0.0, 0.0]), (3.0, 0.0), 3.0) == inf


@pytest.mark.skipif(not is_there('robots/go1'), reason='the model of Go1 is not installed')
@pytest.mark.parametrize('stop', [True, False])
def test_a_robot_that_is_stopped_at_its_highest_speed_is_not_thrown_up_by_its_own_steps(
        stop: bool) -> None:
    """It took the way that a body has behind its reference for a push, stepped 2.5 times as fast,
    hit the ground with five times its weight, and fell.
    """
    run = Walk('trot', 'robots/go1', seed=3)
    run.loop.command(3.5)
    assert run.walk(4.0)
    if stop:
        run.stop()
    else:
        run.loop.command(0.0)
    assert run.walk(2.0)


def test_who_is_not_pushed_does_not_notice() -> None:
    run, without = walking(), walking(inhibition=InhibitionParameters(step_timing=False))
    for of in (run, without):
        of.go(1.0)
    assert run.loop.stop.quickness == 1.0
    assert np.array_equal(run.loop.x, without.loop.x)


@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_all_legs_go_faster_by_the_factor_and_keep_their_places(gait: str) -> None:
    run = pushed(gait=gait)
    assert run.loop.stop.quickness == QUICKEST
    network = run.loop.network
    slow = network.of(run.loop.canonical.gaits.named(gait))
    assert network.omega(run.loop.r) == pytest.approx(QUICKEST * slow.omega(run.loop.r))
    run.ticks.clear()
    run.go(1.0)
    errors = [np.abs(network.phase_errors(tick.x)).max() for tick in run.ticks]
    radii = [np.hypot(*tick.x.T) for tick in run.ticks]
    assert max(errors) < 1e-9 and np.ptp(radii) < 1e-3


def test_without_the_parameter_the_cadence_stays() -> None:
    run = pushed(inhibition=InhibitionParameters(step_timing=False))
    assert run.loop.stop.quickness == 1.0 == run.loop.canon.gait.cadence_scale


@pytest.mark.parametrize('gait', ['amble', 'trot'])
@pytest.mark.parametrize('seconds', [2 * TICK, 0.1, 0.73])
def test_a_stop_of_a_robot_that_is_pushed_comes_when_it_was_said(
        gait: str, seconds: float) -> None:
    """Whatever its margins are from then on, inhibition is armed at the cadence of the gait."""
    run = walking(gait=gait, inhibition=InhibitionParameters(push_recovery=False))
    told(run).margins = FALLING
    run.go(seconds)
    assert run.loop.stop.quickness > 1.0
    bound, predicted = run.loop.time_to_rest(), run.loop.request(True)
    run.ticks.clear()
    run.until('at_rest')
    assert run.loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)
    assert predicted <= bound
    factors = [tick.supervisor.quickness for tick in run.ticks]
    assert np.all(np.diff(factors) <= 0.0) and factors[-1] == 1.0
    assert not any(tick.supervisor.armed and tick.gait.cadence_scale != 1.0 for tick in run.ticks)
    predicted = run.loop.request(False)
    run.until('walking', 'free')
    assert run.loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)


def test_a_cadence_that_moves_and_the_factor_multiply_and_part_again() -> None:
    run = pushed()
    run.loop.change({'cadence_scale': 1.1})
    run.go(0.3)
    assert run.loop.canon.cadence_scale == 1.1
    assert run.loop.canon.gait.cadence_scale == pytest.approx(1.1 * QUICKEST)
    told(run).margins = WIDE
    run.go(2.0)
    assert run.loop.canon.gait.cadence_scale == 1.1


def test_steps_out_of_a_rest_are_quick_too() -> None:
    run, body = resting()
    body.margins = TO_THE_LEFT
    run.until('stepping')
    assert run.loop.stop.quickness > 1.0
    body.margins = WIDE
    run.until('at_rest')
    assert run.loop.stop.quickness == 1.0
