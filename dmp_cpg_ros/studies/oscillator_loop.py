# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite's loop without robot and legs: reference, oscillators, votes and state of the stop.

A condition of the certificates can be left out, to see whether a search for failures notices.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.handover import adopted
from dmp_cpg_ros.core.inhibition.prediction import look_ahead
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.voting.voters import VoteSensors
from dmp_cpg_ros.studies.draws import Case
from dmp_cpg_ros.suite import load_gaits

CONDITIONS = ('places', 'arming', 'acting', 'holding')
"""Conditions that can be left out, to see whether the search notices: without ``places``
inhibition is armed at once and switches each leg by its own region.
"""

GAITS = load_gaits()


class Oscillators(WalkingLoop):
    """The loop's reference, oscillators, votes and state of the stop, without robot and legs."""

    def __init__(self, description: RobotDescription, case: Case, weaken: str = '') -> None:
        """Build the loop of a case."""
        self.tick_ns = round(case['tick_s'] * 1e9)
        start = Running(SuiteParameters(reference=ReferenceParameters(cmd_vel_timeout=0.0)),
                        GAITS[case['gait']], None, case['tick_s'])  # type: ignore[arg-type]
        super().__init__(description, GAITS[case['gait']],
                         start.changed(case['parameters']).parameters, GAITS)
        self._dt, self._weaken, self.now_ns = case['tick_s'], weaken, 0
        self._margins, self._pushed_until_ns = (np.inf,) * 4, 0
        self._voted_ns = -1
        nothing = np.full(3, np.nan)
        self._sensors = VoteSensors(0, 0, np.full(4, 0.25), nothing, nothing)
        self._leave_out_places()

    def _described(self, parameters: SuiteParameters, gait: Any) -> Running:
        running = super()._described(parameters, gait)
        if self._weaken == 'acting':
            running = replace(running, acting_cadence=None)
        return _Unheld(**vars(running)) if self._weaken == 'holding' else running

    def change(self, values: Mapping[str, Any]) -> str:
        """Change parameters; the condition that is left out stays left out."""
        told = super().change(values)
        self._leave_out_places()
        return told

    def _leave_out_places(self) -> None:
        if self._weaken == 'places':
            of = self.supervisor
            self.supervisor = _Hasty(
                of.parameters, of.voting, of.activity_rate, of.reference)

    def certified(self) -> bool:
        """Whether the present parameters have a certificate."""
        return self.in_force().certificate().holds

    def time_to_rest(self) -> float:
        """Bound that is stated for a stop now [s]."""
        if self._weaken == 'arming':
            return self.in_force().certificate().time_to_rest
        return super().time_to_rest()

    def take_over(self) -> float:
        """Let another one watch the stop from now on, who knows what acts and no votes; returns
        the time to rest that it predicts [s].
        """
        self.stop = adopted(self.inhibition, self.now_ns, self.supervisor.parameters)
        self.votes = self.voting.initial_state(self.network)
        return look_ahead(
            self.supervisor, self.reference, self.canonical, self.stop,
            Announced(self.inhibition), self.canon, self.r,
            self.gate.foreseen(self.now_ns + self.tick_ns), self._dt).time_s

    def vote(self, weights: Mapping[str, float], voter: str = '') -> None:
        """Vote for a stop; no prediction of before the next tick knows of it."""
        super().vote(weights, voter)
        self._voted_ns = self.now_ns

    @property
    def voted_now(self) -> bool:
        """Whether somebody has voted since the last tick."""
        return self._voted_ns == self.now_ns

    def push(self, margin: float, duration: float) -> None:
        """Let the body be disturbed: the least margin of its capture point [m], for a time [s]."""
        self._margins = (margin, *self._margins[1:])
        self._pushed_until_ns = self.now_ns + round(duration * 1e9)

    def advance(self) -> None:
        """Run one tick of what the certificate speaks of."""
        self.now_ns += self.tick_ns
        dt, inhibition = self._dt, self.inhibition
        command = self.gate.at(self.now_ns)
        self.r = self.reference.towards(self.r, command, inhibition, dt)
        if self._weaken == 'places':
            inhibition = _Separate(**vars(inhibition))
        self.canon = canon = self.canonical.step(self.canon, self.r, inhibition, dt)
        self.votes = self.voting.step(
            self.votes, self.now_ns, self.network, self._sensors, canon.x, self.r,
            self.stop.state in ('walking', 'free'), self.inbox.take(self.votes.memory.asks))
        self.stop = self.supervisor.step(
            self.stop, self.now_ns, self.network, canon.x, canon.x_dot, self.r, command,
            self.votes.tally,
            margins=self._margins if self.now_ns <= self._pushed_until_ns else None,
            wanted=canon.wanted)
        self.inhibition = self.supervisor.inhibition(self.stop)

    @property
    def held(self) -> bool:
        """Whether a stop is in force and inhibition acts."""
        now = self.inhibition
        return bool(now.requested and self.network.acting_gains(now, self.x).any())


class _Unheld(Running):
    """Parameters of which any may change in a stop."""

    def refused_now(self, *_: object) -> str:
        """Nothing has to wait."""
        return ''


class _Hasty(GaitSupervisor):
    """A state machine that does not wait until the legs are in their places."""

    def in_places(self, network: GaitNetwork, x: Array) -> bool:
        """Taken for granted."""
        return True


@dataclass(frozen=True)
class _Separate(Inhibition):
    """Inhibition that each node switches by its own region, as in the paper."""

    def acting_gains(self, x: Array, target: Array) -> Array:
        """Gains of the nodes that are inside."""
        return replace(self, requested=False).gains * (
            np.linalg.norm(x - target, axis=1) <= self.region_radius)
