# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the robot measured of its own timing."""

from __future__ import annotations

from typing import Any

from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.suite_table import ROBOT

KEYS = ('rate_hz', 'real_time_factor', 'latency_ms_p50', 'latency_ms_p99', 'deadline_misses')


def timing_metrics(recording: Recording, node: str = ROBOT) -> dict[str, Any]:
    """Group ``timing`` of ``metrics.json``, as the robot stated each key last.

    Parameters
    ----------
    recording : Recording
        The recording.
    node : str
        Part of the status's name.
    """
    statuses = sorted(
        (status for name, status in recording.diagnostics.items() if node in name),
        key=lambda status: status.time,
    )
    metrics: dict[str, Any] = dict.fromkeys(KEYS)
    for status in statuses:
        stated = {key: status.number(key) for key in KEYS}
        metrics.update({key: value for key, value in stated.items() if value is not None})
    if metrics['deadline_misses'] is not None:
        metrics['deadline_misses'] = round(metrics['deadline_misses'])
    return metrics
