# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A posture block that is restarted finds the body in the mode in which it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dmp_cpg_ros.core.modes.body_control import BodyControl
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.suite import load_suite

pytest.importorskip('mujoco')
from dmp_cpg_ros.robot.model_reader import load_description

SUITE = load_suite(None, {})


@pytest.mark.parametrize(('pose', 'tilt', 'mode'), [
    ('standing', 0.0, 'standing'), ('standing', 0.3, 'standing'), ('lying', 0.0, 'lying'),
    ('standing', 1.2, 'damped'), ('lying', 3.0, 'damped')])
def test_the_mode_is_that_of_the_body(pose: str, tilt: float, mode: str) -> None:
    description, p = load_description(SUITE.robot_file), SUITE.parameters
    state = PerfectTrackingRobot(description, SUITE.tick_ns, pose).reset()
    turned = np.array((np.sin(tilt / 2.0), 0.0, 0.0, np.cos(tilt / 2.0)))
    control = BodyControl(description, p.posture, p.mode)
    found = control.picked_up(control.initial_state(), replace(state, base_quaternion=turned))
    assert found.mode.mode == mode


@pytest.mark.parametrize(('pose', 'start', 'mode'), [
    ('standing', 'lying', 'standing'), ('lying', 'lying', 'lying'),
    ('standing', 'damped', 'damped')])
def test_how_it_was_to_start_says_nothing_unless_it_was_to_be_damped(
        pose: str, start: str, mode: str) -> None:
    suite = load_suite(None, {'start_mode': start})
    description, p = load_description(suite.robot_file), suite.parameters
    state = PerfectTrackingRobot(description, suite.tick_ns, pose).reset()
    control = BodyControl(description, p.posture, p.mode)
    assert control.picked_up(control.initial_state(), state).mode.mode == mode
