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
from dmp_cpg_ros.core.gait.choice import changing_to
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.handover import adopted
from dmp_cpg_ros.core.inhibition.prediction import look_ahead, next_gait
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.voting.voters import VoteSensors
from dmp_cpg_ros.studies.draws import Case
from dmp_cpg_ros.suite import load_gaits

CONDITIONS = ('places', 'arming', 'acting', 'holding', 'leads', 'way')
"""Conditions that can be left out, to see whether the search notices: without ``places``
inhibition is armed at once and switches each leg by its own region, and without ``leads`` and
``way`` the bounds of a stop that acts later are those of one which acts at the next tick.
"""

GAITS = load_gaits()


def gaits_of(case: Case) -> dict[str, Gait]:
    """Gaits that may be walked in a case: its own, ``gaits`` as entries of a file of them, and
    those of the package.
    """
    return GAITS | {name: Gait.from_mapping(name, entry)
                    for name, entry in case.get('gaits', {}).items()}


class Oscillators(WalkingLoop):
    """The loop's reference, oscillators, votes and state of the stop, without robot and legs."""

    def __init__(self, description: RobotDescription, case: Case, weaken: str = '') -> None:
        """Build the loop of a case."""
        self.tick_ns, gaits = round(case['tick_s'] * 1e9), gaits_of(case)
        start = Running(SuiteParameters(reference=ReferenceParameters(cmd_vel_timeout=0.0)),
                        gaits[case['gait']], None, case['tick_s'])  # type: ignore[arg-type]
        super().__init__(description, gaits[case['gait']],
                         start.changed(case['parameters']).parameters, gaits)
        self._dt, self._weaken, self.now_ns = case['tick_s'], weaken, 0
        self._margins, self._pushed_until_ns = (np.inf,) * 4, 0
        self._voted_ns, self._lead_ns = -1, round(1e9 * case.get('lead_s', 0.0))
        self._announced, self.gone = Announced(self.inhibition), False
        self._early: tuple[int, Inhibition] = (0, self.inhibition)
        nothing = np.full(3, np.nan)
        self._sensors = VoteSensors(0, 0, np.full(4, 0.25), nothing, nothing)
        self._adapt()

    def _described(self, parameters: SuiteParameters, gait: Any) -> Running:
        running = super()._described(parameters, gait)
        if self._weaken == 'acting':
            running = replace(running, acting_cadence=None)
        return _Unheld(**vars(running)) if self._weaken == 'holding' else running

    def change(self, values: Mapping[str, Any]) -> str:
        """Change parameters; the condition that is left out stays left out."""
        told = super().change(values)
        self._adapt()
        return told

    def _adapt(self) -> None:
        """Tell the supervisor its lead, and leave out the places where that is wanted."""
        of = self.supervisor
        self.supervisor = (_Hasty if self._weaken == 'places' else GaitSupervisor)(
            of.parameters, of.voting, of.activity_rate, of.reference, self._lead_ns)

    def certified(self) -> bool:
        """Whether the present parameters have a certificate."""
        return self.in_force().certificate().holds

    @property
    def lead_s(self) -> float:
        """Time after which a request acts, and what is armed [s]; 0: at the next tick."""
        return 1e-9 * self._lead_ns

    @property
    def on_its_way(self) -> bool:
        """Whether the last request does not act yet at the next tick."""
        return self.now_ns - self.stop.request_ns < max(
            self.tick_ns, self._lead_ns - self.tick_ns)

    @property
    def acting(self) -> Inhibition:
        """Inhibition that acts on the oscillators at the next tick."""
        until_ns, early = self._early
        next_ns = self.now_ns + self.tick_ns
        return early if next_ns < until_ns else self._announced.at(next_ns).acting

    def time_to_rest(self) -> float:
        """Bound that is stated for a stop that was requested now [s]."""
        running = self.in_force()
        leads = 0.0 if self._weaken == 'leads' else running.time_ahead(self.lead_s)
        if self._weaken == 'arming':
            return running.certificate().time_to_rest + leads
        return super().time_to_rest() + leads

    def stop_distance(self) -> float:
        """Bound that is stated on the way of the reference in such a stop [m]."""
        return self.in_force().stop_distance(
            self.r, self._foreseen, 0.0 if self._weaken == 'way' else self.lead_s)

    def request(self, stop: bool) -> float:
        """Request a stop or a start; what is told ahead is told before it is predicted."""
        if not self._lead_ns:
            return super().request(stop)
        self.stop = self.supervisor.request(self.stop, stop)
        self.inhibition = self.supervisor.inhibition(self.stop)
        self._announced = self._announced.after(self.stop, self.inhibition, self._lead_ns)
        return look_ahead(
            self.supervisor, self.reference, self.canonical, self.stop, self._announced,
            self.canon, self.r, self._foreseen, self._dt).time_s

    def in_force(self) -> Running:
        """What runs, in the gait in force or in the change between two when a request acts."""
        gait = next_gait(self.reference, self.canonical, self._announced, self.canon, self.r,
                         self._foreseen, self._dt, self.now_ns)
        return self._described_in(gait)

    def leave(self) -> None:
        """Let nobody watch the stop: what was told still acts when it was to."""
        self.gone = True

    def take_over(self) -> float:
        """Let another one watch the stop from now on, who knows what acts and no votes; returns
        the time to rest that it predicts [s]. Who is away with a request on its way is back after
        it acts: no process starts within a lead.
        """
        while self.gone and self._announced.coming:
            self.advance()
        self.gone = False
        if self._lead_ns:
            self.inhibition = self._announced.acting
        self.stop = adopted(self.inhibition, self.now_ns, self.supervisor.parameters)
        if self._lead_ns:
            self.inhibition = self.supervisor.inhibition(self.stop)
        self._announced = Announced(self.inhibition)
        self.votes = self.voting.initial_state(self.network)
        return look_ahead(
            self.supervisor, self.reference, self.canonical, self.stop,
            Announced(self.inhibition), self.canon, self.r,
            self.gate.foreseen(self.now_ns + self.tick_ns), self._dt).time_s

    def forget(self) -> None:
        """Let the oscillators begin anew, who know where they are: what they hear last acts on
        them at once, and not when it was to.
        """
        self._early = self._announced.latest_ns, self._announced.latest

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

    @property
    def ahead(self) -> bool:
        """Whether the oscillators do already what was told to act later: no prediction knows."""
        return self.now_ns < self._early[0]

    def advance(self) -> None:
        """Run one tick of what the certificate speaks of."""
        self.now_ns += self.tick_ns
        self._announced = self._announced.at(self.now_ns)
        dt, inhibition = self._dt, self._announced.acting
        command = self.gate.at(self.now_ns)
        self.r = self.reference.towards(self.r, command, inhibition, dt)
        if self.ahead:
            inhibition = self._early[1]
        if self._weaken == 'places':
            inhibition = _Separate(**vars(inhibition))
        self.canon = canon = self.canonical.step(self.canon, self.r, inhibition, dt)
        if self.gone:
            return
        self.votes = self.voting.step(
            self.votes, self.now_ns, self.network, self._sensors, canon.x, self.r,
            self.stop.state in ('walking', 'free'), self.inbox.take(self.votes.memory.asks))
        self.stop = self.supervisor.step(
            self.stop, self.now_ns, self.network, canon.x, canon.x_dot, self.r, command,
            self.votes.tally,
            margins=self._margins if self.now_ns <= self._pushed_until_ns else None,
            changing=changing_to(self.parameters.gait_choice, canon.gait, canon.wanted),
            acts=self._lead_ns == 0 or self._announced.stops)
        self.inhibition = self.supervisor.inhibition(self.stop)
        self._announced = self._announced.after(self.stop, self.inhibition, self._lead_ns)

    @property
    def held(self) -> bool:
        """Whether a stop is in force and inhibition acts."""
        now = self.acting
        return bool(now.requested and self.network.acting_gains(now, self.x).any())


class _Unheld(Running):
    """Parameters of which any may change in a stop."""

    def refused_now(self, *_: object, **__: object) -> str:
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
