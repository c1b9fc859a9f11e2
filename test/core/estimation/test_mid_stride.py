# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An estimator that begins in the middle of a stride."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_examples import quadruped, standing_state

from dmp_cpg_ros.core.estimation.body_estimate import estimated_state
from dmp_cpg_ros.core.estimation.mid_stride import on_feet, steadied
from dmp_cpg_ros.core.maths import vec3
from dmp_cpg_ros.core.robot_model.sensor_readings import readings_of
from dmp_cpg_ros.studies import change_trials
from dmp_cpg_ros.studies.walking_trials import Walk


@pytest.mark.parametrize(('gait', 'speed'), [('amble', 0.5), ('trot', 2.0), ('pace', 0.5)])
def test_it_finds_the_body_nearly_level_and_as_fast_as_it_is(gait: str, speed: float) -> None:
    """One reading of the accelerometer is off by 5 to 15 degrees in the median, and rest by all of
    the speed.
    """
    run, tilts, velocities = Walk(gait, seed=3), [], []
    assert run.settle((speed, 0.0, 0.0))
    for _ in range(60):
        assert run.walk(0.02)
        kept, run.loop.estimator_state = run.loop.estimator_state, None
        found = run.loop._estimated(run.state)
        run.loop.estimator_state = kept
        up, seen = (np.array(vec3.upward(each.base_quaternion.tolist()))
                    for each in (run.state, found))
        tilts.append(np.arccos(min(1.0, up @ seen)))
        velocities.append(np.linalg.norm(found.base_velocity_in_base
                                         - run.state.base_velocity_in_base))
    assert np.median(tilts) < np.deg2rad(3.5)
    assert np.median(velocities) < 0.05


@pytest.mark.parametrize(('gait', 'speed'), [('trot', 2.0), ('bound', 0.5)])
def test_whenever_it_begins_the_body_is_found_standing(gait: str, speed: float) -> None:
    """One reading in fifteen of a bound, and of a trot one in some hundreds, is as long as in rest
    and far off the vertical: a robot that walked was taken for fallen, and its joints were damped.
    """
    run = Walk(gait, seed=3)
    run.loop.command(speed)
    body, estimator, found = run.loop.body, run.loop.estimator, set()
    assert estimator is not None and run.walk(0.3)
    for _ in range(500):
        assert run.walk(0.012)
        _, estimate = estimator.step(None, readings_of(run.state))
        state = estimated_state(readings_of(run.state), estimate)
        found.add(body.picked_up(body.initial_state(), state).mode.mode)
    assert found == {'standing'}


def test_a_pace_whose_posture_control_begins_anew_walks_on(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Taken for a robot at rest it fell at most phases."""
    monkeypatch.setattr(change_trials, 'WATCHED', 3.0)
    outcomes = change_trials.run_restarts('pace', 0.5, 4)
    assert len(outcomes) == 4 and not any(one.fell for one in outcomes)
    assert max(one.tilt for one in outcomes) < 10.0


@pytest.mark.parametrize(('force', 'up'), [
    ((1.0, -2.0, 9.6), (0.2, -0.4, 9.6)),   # a step shakes a level body
    ((9.0, 0.0, 4.0), (9.0, 0.0, 4.0)),     # on its side
    ((0.0, 3.0, -9.0), (0.0, 3.0, -9.0)),   # on its back
    ((30.0, 0.0, 5.0), (0.0, 0.0, 1.0)),    # a blow
    ((0.5, 0.5, -0.5), (0.0, 0.0, 1.0)),    # a jump
])
def test_one_reading_tells_a_moving_body_little(
        force: tuple[float, float, float], up: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(steadied(np.array(force)), up, atol=1e-12)


def test_what_carries_a_body_tells_whether_it_is_on_its_feet() -> None:
    """A reading far off the vertical is believed of a body that its feet do not carry."""
    weight, state = 120.0, standing_state(quadruped(), 0)
    aside = replace(readings_of(state), specific_force_in_base=np.array((9.0, 0.0, 4.0)))
    for feet, walks in ((0.0, False), (0.2, False), (0.5, True), (np.nan, False)):
        force = np.array((0.25 * feet * weight,) * 4)
        assert on_feet(replace(aside, foot_force=force), weight) is walks
    np.testing.assert_allclose(
        steadied(aside.specific_force_in_base, walks=True), (0.0, 0.0, 1.0), atol=1e-12)
