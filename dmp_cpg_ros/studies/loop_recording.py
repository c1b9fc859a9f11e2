# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the plain loop did, as a recording: studies and figures need no bag."""

from __future__ import annotations

from collections.abc import Sequence
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
    robot = Recording(
        joints=JointSeries(*_columns(
            states, 'time_ns', 'joint_position', 'joint_velocity', 'joint_effort')),
        odometry=OdometrySeries(*_columns(
            states, 'time_ns', 'base_position_in_world', 'base_quaternion',
            'base_velocity_in_base', 'base_rate_in_base')),
        feet=FootForceSeries(*_columns(states, 'time_ns', 'foot_force')),
        work=WorkSeries() if any(state.joint_work is None for state in states) else WorkSeries(
            *_columns(states, 'time_ns', 'joint_work', 'joint_peak_effort')))
    if not ticks:
        return robot
    time, r, x, x_dot = _columns(ticks, 'time_ns', 'r', 'x', 'x_dot')
    targets = _columns([tick.targets for tick in ticks], 'position', 'velocity', 'effort')
    return replace(
        robot, targets=JointSeries(time, *targets),
        canonical=CanonicalSeries(time, x, x_dot, tuple(shares_of(tick.gait) for tick in ticks)),
        reference=VelocitySeries(time, r),
        inhibition=_changes(time, [(tick.supervisor.state, {}) for tick in ticks]),
        modes=_changes(time, [(tick.mode.mode, {'reason': tick.mode.reason}) for tick in ticks]))


def _columns(rows: Sequence[object], *names: str) -> list[NDArray[np.float64]]:
    """Arrays of some attributes; times in seconds."""
    return [np.array([getattr(row, name) for row in rows]) * (1e-9 if name == 'time_ns' else 1)
            for name in names]


def _changes(time: NDArray[np.float64], states: Sequence[tuple[str, dict[str, str]]]
             ) -> tuple[StatusEvent, ...]:
    """Words and values where the word changed."""
    return tuple(StatusEvent(float(at), 0, word, values)
                 for k, (at, (word, values)) in enumerate(zip(time, states, strict=True))
                 if k == 0 or word != states[k - 1][0])
