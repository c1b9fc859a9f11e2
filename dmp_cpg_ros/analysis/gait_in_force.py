# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The gait in force at every recorded canonical state: gaits may change while walking."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.motion import held
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits, shares_of
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.transformation.leg import body_scale


class GaitRow(NamedTuple):
    """Rows of the canonical states in one gait, or one row of a blend.

    Attributes
    ----------
    rows : slice
        Rows.
    gait : Gait or BlendedGait
        In force.
    """

    rows: slice
    gait: GaitInForce


def gait_rows(recording: Recording, context: RunContext) -> list[GaitRow] | None:
    """Gaits in force, in order; None where the recording and its context do not tell.

    A recording without names of gaits (from before gaits could change) was walked in the gait of
    the context.
    """
    count = len(recording.canonical.time)
    if context.gait is None or not count:
        return None
    shares = recording.canonical.gaits or (shares_of(context.gait),) * count
    known = KnownGaits({**context.gaits, context.gait.name: context.gait})
    borders = [0, *(k for k in range(1, count) if shares[k] != shares[k - 1]), count]
    try:
        return [GaitRow(slice(first, past), known.in_force(shares[first]))
                for first, past in zip(borders, borders[1:], strict=False)]
    except DataError:
        return None


def phase_offsets(recording: Recording, context: RunContext) -> Array | None:
    """Phases of the legs relative to fl that the gait in force plans, ndarray (n, 4) [rad]."""
    found = gait_rows(recording, context)
    if found is None:
        return None
    offsets = np.empty((len(recording.canonical.time), 4))
    for rows, gait in found:
        offsets[rows] = gait.phases
    return offsets


def planned_stance(recording: Recording, context: RunContext) -> tuple[NDArray[np.bool_], Array]:
    """Feet that the gait in force plans on the ground, and its duty factor.

    Returns
    -------
    stance : ndarray of bool (n, 4)
        No rows where gait, robot or reference are not known.
    duty : ndarray (n,)
    """
    found, reference = gait_rows(recording, context), recording.reference
    if found is None or context.robot is None or not reference.time.size:
        return np.zeros((0, 4), dtype=bool), np.zeros(0)
    scale, phi = body_scale(context.robot), phase(recording.canonical.x)
    r = held(reference.time, reference.value, recording.canonical.time)
    duty, position = np.empty(len(phi)), np.empty(phi.shape)
    for rows, gait in found:
        duty[rows] = [gait.duty(scale.foot_speed(*value), scale) for value in r[rows]]
        position[rows] = gait.cycle_position(phi[rows])
    return np.abs(position) >= 0.5 * (1.0 - duty[:, None]), duty


def gaits_walked(recording: Recording) -> list[str]:
    """Names of the gaits in force, each time one takes over; empty in old recordings."""
    names = [gait.before for gait in recording.canonical.gaits if not gait.after]
    return [name for k, name in enumerate(names) if k == 0 or name != names[k - 1]]
