# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All of ``metrics.json``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.metrics.estimation import estimation_metrics
from dmp_cpg_ros.analysis.metrics.gait import gait_metrics
from dmp_cpg_ros.analysis.metrics.robot import robot_metrics
from dmp_cpg_ros.analysis.metrics.stops import start_metrics, stop_metrics
from dmp_cpg_ros.analysis.metrics.timing import timing_metrics
from dmp_cpg_ros.analysis.metrics.tracking import tracking_metrics
from dmp_cpg_ros.analysis.recording import Recording


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
        'robot': robot_metrics(recording, context),
        'tracking': tracking_metrics(recording),
        'estimation': estimation_metrics(recording, context),
        'gait': gait_metrics(recording, context),
        'stop': stop_metrics(recording, context),
        'start': start_metrics(recording),
        'timing': timing_metrics(recording),
        'recording': {'undecodable_messages': sum(recording.undecodable.values())},
        'certificate': None if certificate is None else list(certificate),
    }
