# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The analysis reads the gait in force at every time, and recordings that do not name it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_examples import GAITS, TICK, TICK_NS, quadruped, standing_state

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.episodes import gait_rows, gaits_walked, planned_stance, steady_segments
from dmp_cpg_ros.analysis.metrics.summary import gait_metrics, phase_errors
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.core.gait.transition import BlendedGait
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.studies.loop_recording import recording_of

ROBOT = quadruped()


@pytest.fixture(scope='module')
def recording() -> Recording:
    loop = WalkingLoop(ROBOT, GAITS['amble'], SuiteParameters(
        ReferenceParameters(cmd_vel_timeout=0.0),
        inhibition=InhibitionParameters(start_inhibited=False, block_stop=False)), GAITS)
    loop.command(0.5)
    states, ticks = [], []
    for k in range(round(9.0 / TICK)):
        if k == round(4.5 / TICK):
            loop.change_gait('trot')
        states.append(standing_state(ROBOT, k * TICK_NS))
        ticks.append(loop.tick(states[-1]))
    return recording_of(states, ticks)


def context(**changes: object) -> RunContext:
    return RunContext(robot=ROBOT, gait=GAITS['amble'], gaits=GAITS,
                      **changes)  # type: ignore[arg-type]


def test_the_phase_error_is_that_from_the_gait_in_force(recording: Recording) -> None:
    _, errors = phase_errors(recording, context())
    assert np.abs(errors).max() < 1e-6
    metrics = gait_metrics(recording, context())
    assert metrics['phase_error_rad_max'] < 1e-6
    assert metrics['name'] == 'amble' and metrics['names'] == ['amble', 'trot']
    [change] = metrics['changes']
    assert change['start_s'] == pytest.approx(4.5, abs=2 * TICK) and change['end_s'] < 6.0


def test_gaits_are_found_in_order_with_their_blends(recording: Recording) -> None:
    rows = gait_rows(recording, context())
    assert rows is not None
    assert rows[0].gait is not None and rows[0].gait.name == 'amble'
    assert rows[-1].gait.name == 'trot'
    assert all(isinstance(entry.gait, BlendedGait) for entry in rows[1:-1])
    assert sum(entry.rows.stop - entry.rows.start for entry in rows) == len(
        recording.canonical.time)
    assert gaits_walked(recording) == ['amble', 'trot']


def test_planned_feet_and_steady_walking_know_of_the_change(recording: Recording) -> None:
    stance, _ = planned_stance(recording, context())
    late = slice(-200, None)
    trot = GAITS['trot']
    position = np.abs(trot.cycle_position(phase(recording.canonical.x[late])))
    duty = trot.duty(0.5, WalkingLoop(ROBOT, trot).network.scale)
    assert np.mean(stance[late] == (position >= 0.5 * (1.0 - duty))) > 0.99
    segments = steady_segments(recording)
    [change] = gait_metrics(recording, context())['changes']
    assert segments and all(end <= change['start_s'] or start >= change['end_s']
                            for start, end in segments)


def test_a_recording_without_names_was_walked_in_the_gait_of_its_parameters(
        recording: Recording) -> None:
    early = recording.canonical.time < 4.4
    canonical = recording.canonical
    old = replace(recording, canonical=replace(
        canonical, time=canonical.time[early], x=canonical.x[early], x_dot=canonical.x_dot[early],
        gaits=()))
    assert gait_metrics(old, context())['phase_error_rad_max'] < 1e-6
    assert gait_metrics(old, context())['names'] is None
    unknown = RunContext(robot=ROBOT)
    assert gait_metrics(old, unknown)['phase_error_rad_max'] < 1e-6    # from the walk itself


def test_a_name_that_is_not_known_falls_back_to_the_walk_itself(recording: Recording) -> None:
    canonical = recording.canonical
    strange = replace(recording, canonical=replace(
        canonical, gaits=(GaitShares('gallop'),) * len(canonical.time)))
    assert gait_rows(strange, context()) is None
    assert gait_metrics(strange, context())['phase_error_rad_max'] > 0.1
