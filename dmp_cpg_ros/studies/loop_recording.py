# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the plain loop did, as a recording: studies and figures need no bag."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.recording import (
    CanonicalSeries,
    FootForceSeries,
    JointSeries,
    OdometrySeries,
    Recording,
    StatusEvent,
    VelocitySeries,
    WorkSeries,
)
from dmp_cpg_ros.core.gait.known_gaits import shares_of
from dmp_cpg_ros.core.loop import Tick
from dmp_cpg_ros.core.robot_model.state import RobotState


def recording_of(states: Sequence[RobotState], ticks: Sequence[Tick] = ()) -> Recording:
    """Make a recording of the robot's states and, when they are given, of the loop's ticks.

    Parameters
    ----------
    states : sequence of RobotState
        In order of time.
    ticks : sequence of Tick
        In order of time; none for a recording of the robot alone.

    Returns
    -------
    Recording
    """
    time = _column(states, 'time_ns') * 1e-9
    robot = Recording(
        joints=JointSeries(time, _column(states, 'joint_position'),
                           _column(states, 'joint_velocity'), _column(states, 'joint_effort')),
        odometry=OdometrySeries(
            time, _column(states, 'base_position_in_world'), _column(states, 'base_quaternion'),
            _column(states, 'base_velocity_in_base'), _column(states, 'base_rate_in_base')),
        feet=FootForceSeries(time, _column(states, 'foot_force')),
        work=_work(time, states))
    if not ticks:
        return robot
    time = _column(ticks, 'time_ns') * 1e-9
    targets = [tick.targets for tick in ticks]
    return replace(
        robot,
        targets=JointSeries(time, _column(targets, 'position'), _column(targets, 'velocity'),
                            _column(targets, 'effort')),
        canonical=CanonicalSeries(time, _column(ticks, 'x'), _column(ticks, 'x_dot'),
                                  tuple(shares_of(tick.gait) for tick in ticks)),
        reference=VelocitySeries(time, _column(ticks, 'r')), inhibition=tuple(_events(ticks)),
        modes=tuple(_modes(ticks)))


def _work(time: NDArray[np.float64], states: Sequence[RobotState]) -> WorkSeries:
    if any(state.joint_work is None for state in states):
        return WorkSeries()
    return WorkSeries(time, _column(states, 'joint_work'), _column(states, 'joint_peak_effort'))


def _column(rows: Sequence[object], name: str) -> NDArray[np.float64]:
    return np.array([getattr(row, name) for row in rows])


def _events(ticks: Sequence[Tick]) -> Iterable[StatusEvent]:
    word = ''
    for tick in ticks:
        if tick.supervisor.word != word:
            word = tick.supervisor.word
            yield StatusEvent(tick.time_ns * 1e-9, 0, word, {})


def _modes(ticks: Sequence[Tick]) -> Iterable[StatusEvent]:
    mode = ''
    for tick in ticks:
        if tick.mode.mode != mode:
            mode = tick.mode.mode
            yield StatusEvent(tick.time_ns * 1e-9, 0, mode, {'reason': tick.mode.reason})
