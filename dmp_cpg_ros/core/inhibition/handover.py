# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The stop over the end of the one who watches it: taken up by the next, carried out without."""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.state import LEGS


def adopted(acting: Inhibition, time_ns: int, parameters: InhibitionParameters
            ) -> SupervisorState:
    """State of a supervisor that comes to a gait on which an inhibition acts.

    A stop that was requested stays requested, and what ends it stays the same; a gait that runs
    goes on. Inhibition that is armed stays so, because legs that are held are no longer in the
    places in which they may be caught, and gains above the service's are those of votes, of which
    the service's leg need not be within its region. Where else in a stop or a start the gait is
    shows itself within a few ticks.

    Parameters
    ----------
    acting : Inhibition
        What acts on the oscillators.
    time_ns : int
        Stamp of the tick before the first [ns].
    parameters : InhibitionParameters
        Gains that the service's stop has.
    """
    stop, gains, leg = acting.requested, acting.gains, int(np.argmax(acting.gains))
    armed = stop and bool(gains.any())
    word = 'at_rest' if acting.at_rest else 'captured' if armed else 'waiting'
    voted = stop and bool(np.any(gains > parameters.gains_on(leg)))
    return SupervisorState(
        time_ns, word if stop else 'releasing', stop, acting.automatic, time_ns, armed,
        (0.0 if acting.at_rest else 1.0,) * len(LEGS),
        measured_s=0.0 if acting.at_rest else float('nan'), asked=stop, voted=voted,
        vote_gains=gains if voted else np.zeros(len(LEGS)), leg=leg,
        rest_phase=acting.rest_phase, quickness=acting.quickness)


class SilentStop:
    """The stop that the oscillators carry out by themselves when nobody watches it any more.

    Parameters
    ----------
    supervisor : GaitSupervisor
        Like the one that has fallen silent.
    acting : Inhibition
        What acted last.
    time_ns : int
        Stamp of the last tick [ns].
    """

    def __init__(self, supervisor: GaitSupervisor, acting: Inhibition, time_ns: int) -> None:
        """Request the stop; a service's stop stays one."""
        self._supervisor = supervisor
        self._state = supervisor.request(
            adopted(acting, time_ns, supervisor.parameters), True,
            acting.automatic or not acting.requested)

    @property
    def inhibition(self) -> Inhibition:
        """What acts at the next tick."""
        return self._supervisor.inhibition(self._state)

    def step(self, time_ns: int, network: GaitNetwork, x: Array, x_dot: Array, r: Array) -> None:
        """Advance to the oscillators' tick at a stamp [ns], see
        :meth:`~dmp_cpg_ros.core.inhibition.supervisor.GaitSupervisor.step`.
        """
        self._state = self._supervisor.step(
            self._state, time_ns, network, x, x_dot, r, (0.0, 0.0, 0.0))
