# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The estimate of a node that now and then is kept from working for some ticks."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

from test_transforms import CollectingNode

from dmp_cpg_ros.core.maths import vec3
from dmp_cpg_ros.nodes.posture_control import BodyState
from dmp_cpg_ros.studies.walking_trials import Walk


@pytest.mark.parametrize(('gait', 'speed', 'tilt'), [
    ('amble', 0.5, 0.1), ('trot', 1.0, 0.1), ('bound', 0.5, 0.2)])
def test_who_misses_ticks_keeps_its_vertical(gait: str, speed: float, tilt: float) -> None:
    """The turn rate of one moment was taken for that of a fifth of a second: a bound was off by up
    to 2.4 rad, a trot by 0.9 rad in a run, which was taken for a fall.
    """
    run = Walk(gait, seed=3)
    assert run.settle((speed, 0.0, 0.0))
    run.states.clear()
    assert run.walk(6.0)
    for seed in range(3):
        draw, body, off, k, until = np.random.default_rng(seed), BodyState(
            CollectingNode(), run.robot.description), list[float](), 0, 100
        while k < len(run.states):
            state, stamp = run.states[k], run.states[k].time_ns
            found = body.state(stamp, {
                'joint_states': (stamp, (
                    state.joint_position, state.joint_velocity, state.joint_effort)),
                'imu': (stamp, (state.measured_rate_in_base, state.acceleration_in_base)),
                'foot_contacts': (stamp, state.foot_force)})
            up, seen = (np.array(vec3.upward(one.base_quaternion.tolist()))
                        for one in (state, found))
            off.append(float(np.arccos(min(1.0, up @ seen))))
            k += 1
            if k > until:
                k += int(draw.integers(12, 70))
                until = k + int(draw.integers(1, 60))
        assert len(off) > 500 and max(off) < tilt
