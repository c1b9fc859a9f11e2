# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Prediction of the times to rest and to walking, by simulating the model ahead.

The canonical system and the reference form a closed hierarchy: nothing of the body enters them.
From their present state the same code that drives the legs can therefore be run ahead, and its
prediction is exact to the tick.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.gait.running import CanonicalState, RunningGait
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor, SupervisorState
from dmp_cpg_ros.core.reference.filter import ReferenceSystem

Array = NDArray[np.float64]


def predict(supervisor: GaitSupervisor, reference: ReferenceSystem, canonical: RunningGait,
            state: SupervisorState, published: Inhibition, canon: CanonicalState, r: Array,
            command: tuple[float, float, float], dt: float, horizon: float = 10.0,
            body_mode: str = 'standing') -> float:
    """Time from now to rest (of a requested stop) or to phase lock (of a start).

    Parameters
    ----------
    supervisor, reference, canonical : GaitSupervisor, ReferenceSystem, RunningGait
        The blocks as they run.
    state : SupervisorState
        Present state, the request included.
    published : Inhibition
        The inhibition that was published before the request; it still acts at the next tick.
    canon : CanonicalState
        Present state of the oscillators, gait and cadence perhaps on their way to others.
    r : ndarray (3,)
        Present reference.
    command : tuple of float
        External command that is assumed to stay (v_x, v_y, γ).
    dt : float
        Tick [s].
    horizon : float
        Longest time that is looked ahead [s].
    body_mode : str
        What the body does, assumed to stay; in every mode but ``standing`` no command starts it.

    Returns
    -------
    float
        [s]; infinite when it does not happen within the horizon.
    """
    tick_ns = round(dt * 1e9)
    start_ns, inhibition = state.time_ns, published
    for k in range(1, math.ceil(horizon / dt) + 1):
        r_ext = np.zeros(3) if inhibition.requested else np.array(command)
        r = reference.step(r, r_ext, dt)
        canon = canonical.step(canon, r, inhibition, dt)
        state = supervisor.step(
            state, start_ns + k * tick_ns, canonical.network(canon.gait), canon.x, canon.x_dot,
            r, command, body_mode=body_mode)
        inhibition = supervisor.inhibition(state)
        if state.word in ('at_rest', 'walking', 'free'):
            return k * dt
    return math.inf
