# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All of ``metrics.json``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.metrics import gait, robot, stops
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.suite_table import ROBOT

TIMING = ('rate_hz', 'real_time_factor', 'latency_ms_p50', 'latency_ms_p99', 'deadline_misses')


def compute_metrics(
        recording: Recording, context: RunContext | None = None,
        certificate: Sequence[Any] | None = None) -> dict[str, Any]:
    """Everything that a run's ``metrics.json`` holds.

    Parameters
    ----------
    recording : Recording
        The run.
    context : RunContext, optional
        What is known besides.
    certificate : sequence, optional
        The inequalities, passed through.

    Returns
    -------
    dict
        Nested, of plain Python values; None where the recording cannot tell.
    """
    context = context or RunContext()
    return {
        'robot': robot.robot_metrics(recording, context),
        'tracking': robot.tracking_metrics(recording),
        'estimation': robot.estimation_metrics(recording, context),
        'gait': gait.gait_metrics(recording, context),
        'stop': stops.stop_metrics(recording, context), 'start': stops.start_metrics(recording),
        'timing': timing_metrics(recording),
        'recording': {'undecodable_messages': sum(recording.undecodable.values())},
        'certificate': None if certificate is None else list(certificate)}


def timing_metrics(recording: Recording) -> dict[str, Any]:
    """Group ``timing`` of ``metrics.json``, as the robot stated each key last."""
    metrics: dict[str, Any] = dict.fromkeys(TIMING)
    last = [status for name, status in recording.diagnostics.items() if ROBOT in name]
    for status in sorted(last, key=lambda status: status.time):
        metrics.update({key: value for key in TIMING
                        if (value := status.number(key)) is not None})
    if metrics['deadline_misses'] is not None:
        metrics['deadline_misses'] = round(metrics['deadline_misses'])
    return metrics
