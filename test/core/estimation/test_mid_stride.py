# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An estimator that begins in the middle of a stride."""

from __future__ import annotations

import numpy as np
import pytest

from dmp_cpg_ros.core.estimation.mid_stride import steadied
from dmp_cpg_ros.core.maths import vec3
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
