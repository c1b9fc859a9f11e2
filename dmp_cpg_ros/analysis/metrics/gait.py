# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the legs kept their places, and how long each foot stood."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis import episodes
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.motion import held, mean_between
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.core.canonical.phase import phase, wrapped
from dmp_cpg_ros.core.robot_model.state import LEGS


def gait_metrics(recording: Recording, context: RunContext) -> dict[str, Any]:
    """Group ``gait`` of ``metrics.json``.

    Returns
    -------
    dict
        ``name`` of the gait at the start, ``names`` of all in order and their ``changes``;
        ``phase_error_rad_max``, the largest deviation of a leg from its place in the gait while
        walking freely and settled; ``duty_factor``, the measured share of the cycle on the ground,
        mean of the legs, with ``duty_factor_of_leg`` and the planned ``duty_factor_planned``;
        ``period_s``, the median gait cycle.
    """
    time, errors = phase_errors(recording, context)
    settled = np.abs(errors[settled_rows(recording, time)])
    duty = duty_factors(recording, context)
    changes = [{'start_s': start, 'end_s': end}
               for start, end in episodes.changing_intervals(recording)]
    return {
        'name': None if context.gait is None else context.gait.name,
        'names': episodes.gaits_walked(recording) or None, 'changes': changes or None,
        'phase_error_rad_max': float(settled.max()) if settled.size else None,
        'duty_factor': None if duty is None else float(duty.mean()),
        'duty_factor_of_leg':
            None if duty is None else dict(zip(LEGS, duty.tolist(), strict=True)),
        'duty_factor_planned': planned_duty_factor(recording, context),
        'period_s': episodes.gait_period(recording)}


def phase_errors(recording: Recording, context: RunContext) -> tuple[Array, Array]:
    """Deviation of each leg's phase from its place, relative to the circular mean of the four.

    Returns
    -------
    time : ndarray (n,)
        [s]
    error : ndarray (n, 4)
        [rad]; from the places in the gait in force, which move while gaits change. Where the gait
        is not known its offsets are the circular means of the settled walk.
    """
    time, phi = recording.canonical.time, phase(recording.canonical.x)
    offsets = episodes.phase_offsets(recording, context)
    if offsets is None:
        relative = (phi - phi[:, :1])[settled_rows(recording, time)]
        offsets = np.arctan2(np.sin(relative).sum(axis=0), np.cos(relative).sum(axis=0))
    places = phi - offsets
    common = np.arctan2(np.sin(places).sum(axis=1), np.cos(places).sum(axis=1))
    return time, wrapped(places - common[:, None])


def settled_rows(recording: Recording, time: Array) -> NDArray[np.bool_]:
    """Which times lie in settled, moving walking, boolean ndarray (n,)."""
    inside = episodes.within(time, [(start + episodes.SETTLING, end) for start, end
                                    in episodes.running_intervals(recording)])
    if recording.reference.time.size and time.size:
        value = held(recording.reference.time, recording.reference.value, time)
        inside &= (np.abs(value) > episodes.MOVING).any(axis=1)
    return inside


def duty_factors(recording: Recording, context: RunContext) -> Array | None:
    """Measured share of time on the ground over whole cycles of steady walking, ndarray (4,)."""
    segments, feet = episodes.steady_segments(recording), recording.feet
    if not segments or not feet.time.size:
        return None
    contact = (feet.force > context.contact_force).astype(float)
    shares = [mean_between(feet.time, contact, start, end) for start, end in segments]
    return np.average(shares, axis=0, weights=np.diff(segments)[:, 0])


def planned_duty_factor(recording: Recording, context: RunContext) -> float | None:
    """Duty factor that the gait plans, averaged over the same stretches."""
    segments, time = episodes.steady_segments(recording), recording.canonical.time
    _, duty = episodes.planned_stance(recording, context)
    if not duty.size or not segments:
        return None
    planned = [duty[(time >= start) & (time <= end)].mean() for start, end in segments]
    return float(np.average(planned, weights=np.diff(segments)[:, 0]))
