# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a stop that was requested will rest, and a start will walk."""

from __future__ import annotations

from math import ceil, inf

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.gait.running import CanonicalState, RunningGait
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor, SupervisorState
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.filter import ReferenceSystem


def predict(supervisor: GaitSupervisor, reference: ReferenceSystem, canonical: RunningGait,
            state: SupervisorState, published: Inhibition, canon: CanonicalState, r: Array,
            command: tuple[float, float, float], dt: float, horizon: float = 10.0,
            body_mode: str = 'standing') -> float:
    """Time from now to rest (of a requested stop) or to phase lock (of a start) by running ahead
    [s]; infinite when it does not happen within the horizon.

    Oscillators and reference form a closed hierarchy, into which nothing of the body enters: the
    same code that drives the legs predicts to the tick.

    Parameters
    ----------
    supervisor, reference, canonical
        The blocks as they run.
    state : SupervisorState
        Present state, the request included.
    published : Inhibition
        What was published before the request; it still acts at the next tick.
    canon : CanonicalState
        Present state of the oscillators, gait and cadence perhaps on their way to others.
    r : ndarray (3,)
        Present reference.
    command : tuple of float
        External command that is assumed to stay (v_x, v_y, γ).
    dt, horizon : float
        Tick, and longest time that is looked ahead [s].
    body_mode : str
        What the body does, assumed to stay.
    """
    tick_ns = round(dt * 1e9)
    start_ns, inhibition = state.time_ns, published
    for k in range(1, ceil(horizon / dt) + 1):
        r = reference.towards(r, command, inhibition, dt)
        canon = canonical.step(canon, r, inhibition, dt)
        state = supervisor.step(
            state, start_ns + k * tick_ns, canonical.network(canon.gait), canon.x, canon.x_dot,
            r, command, body_mode=body_mode)
        inhibition = supervisor.inhibition(state)
        if state.state in ('at_rest', 'walking', 'free', 'stepping'):
            return k * dt
    return inf
