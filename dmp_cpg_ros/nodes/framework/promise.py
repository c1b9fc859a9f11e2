# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is promised of a stop or a start that was requested, and how a node comes by it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, isfinite, nan
from typing import TYPE_CHECKING, NamedTuple

from dmp_cpg_ros.core.certificates import gate
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.votes import vote_bound
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.running import CanonicalState
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.prediction import Outlook, looking_ahead, next_gait
from dmp_cpg_ros.core.inhibition.step_timing import time_to_slow
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.rounding import exactly, no_less
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.suite_parameters import SuiteParameters, TickParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.nodes.framework.judging import Raised, Slices

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.certified import Certified
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

PREDICTED_AT_ONCE = 10
"""Ticks ahead that are computed between two callbacks: about 1 ms."""


class Promise(NamedTuple):
    """When a request will be fulfilled.

    Attributes
    ----------
    predicted_s, bound_s : float
        Time from the request to rest or to walking as predicted, and its certified bound [s]; not
        finite where there is none.
    bound_m : float
        Way of the reference until rest, at most [m]; NaN for a start.
    outlook : Outlook or None
        What is predicted of the body.
    """

    predicted_s: float = nan
    bound_s: float = nan
    bound_m: float = nan
    outlook: Outlook | None = None

    @property
    def stands_s(self) -> float:
        """Time until the body stands [s]."""
        return self.outlook.stands_s if self.outlook else nan

    def told_later(self, since_s: float, before_m: float) -> Promise:
        """The same bounds when the request is some time ago [s], since when the reference has
        gone no farther than was promised then [m].
        """
        return Promise(self.predicted_s + since_s, self.bound_s + since_s, self.bound_m + before_m)

    def foreseen(self, outlook: Outlook, since_s: float) -> Promise:
        """The same with what is predicted, of a request that is some time ago [s]; what it has
        taken stays where that is known.
        """
        known = isfinite(self.predicted_s)
        return self._replace(
            predicted_s=self.predicted_s if known else outlook.time_s + since_s,
            outlook=outlook._replace(down_s=outlook.down_s + since_s))

    def words(self, stop: bool, certificate: str, push_recovery: bool) -> str:
        """Say it, with the certificate in a few words; and whether pushes begin the gait anew."""
        when = f'in {exactly(self.predicted_s)} s' if isfinite(self.predicted_s) else (
            'not within 10 s')
        most = f'at most {no_less(self.bound_s)} s' if isfinite(self.bound_s) else (
            'without a bound from this state')
        way = (f'; the reference goes on for at most {no_less(self.bound_m)} m{self._standing()}'
               + ('; a push may begin it anew' if push_recovery else '')) if stop else ''
        return f'{"at rest" if stop else "walking"} {when}, {most}; {certificate}{way}'

    def _standing(self) -> str:
        """When and where the body will stand, of which there is no certificate but trials."""
        of = self.outlook
        if of is None or not isfinite(of.time_s):
            return ''
        return (f'; the body stands in about {of.stands_s:.2f} s, by trials within '
                f'{no_less(of.stands_within_s, 2)} s and {no_less(of.stands_within_m, 2)} m')


class Present(NamedTuple):
    """What a request is predicted from.

    Attributes
    ----------
    state : SupervisorState
        The request included.
    announced : Announced
        What has been published; in lock-step before the request.
    canonical : CanonicalState
        Of the oscillators.
    slow : GaitNetwork
        Their network at the cadence without the quickness that acts.
    r : ndarray (3,)
        The reference v_x, v_y [m/s], γ [rad/s].
    command : tuple of float
        External command of the same, assumed to stay.
    barring : str
        What the body does, assumed to stay.
    """

    state: SupervisorState
    announced: Announced
    canonical: CanonicalState
    slow: GaitNetwork
    r: Array
    command: tuple[float, float, float]
    barring: str


class Promises:
    """Promises what a node is asked for: the bound is known at once, the prediction, which takes
    several ticks, once it has been made between them.

    Parameters
    ----------
    node : SuiteNode
        Whose ticks do not wait.
    certified : Certified
        Its certificate, and the blocks that run.
    gait : GaitInForce
        That is walked now.
    lead_ns : int
        Time after which what is requested acts [ns]; 0: at the next tick.

    Attributes
    ----------
    latest : Promise
        The last one.
    due_ns : float
        Until when a stop is to rest, on the robot's clock [ns]; infinite where there is no bound.
    command : tuple of float
        With which it was predicted, v_x, v_y [m/s], γ [rad/s].
    """

    def __init__(self, node: SuiteNode, certified: Certified, gait: GaitInForce, lead_ns: int
                 ) -> None:
        """Promise nothing yet."""
        self.latest, self.due_ns, self.command = Promise(), inf, (0.0, 0.0, 0.0)
        self._node, self._certified, self._lead_ns = node, certified, lead_ns
        self._slices = Slices(node, PREDICTED_AT_ONCE)
        self._for = certified.running_in(gait)
        self.take_over_parameters()

    def take_over_parameters(self) -> None:
        """Predict with the blocks as they run now."""
        certified = self._certified
        self._supervisor = certified.supervisor(self._lead_ns)
        self._reference = certified.reference()
        self._running_gait = certified.running_gait()
        self._tick_ns = self._node.parameters_of(TickParameters).tick_ns

    def holds_with(self, running: gate.Running) -> bool:
        """Whether what runs now keeps what was promised."""
        return gate.UNCERTIFIED.issuperset(running.differences(self._for))

    def make(self, now: Present, known: Callable[[Exception | None], None]) -> None:
        """Promise what has been requested, just now or before parameters have changed.

        Parameters
        ----------
        now : Present
            Where everything is.
        known : callable (Exception or None)
            Called once it is predicted, or with what was raised instead.
        """
        state, tick_s = now.state, self._tick_ns * 1e-9
        self.command = now.command
        gait = next_gait(self._reference, self._running_gait, now.announced, now.canonical, now.r,
                         now.command, tick_s, state.time_ns)
        since_s, before_m = 1e-9 * (state.time_ns - state.request_ns), self.latest.bound_m
        if since_s <= 0.0 or isfinite(state.measured_s):  # pushed in full swing, it runs already
            since_s = before_m = 0.0
        bounded = self._bounded(gait, now).told_later(since_s, before_m)

        def predicted(outlook: Outlook | Raised) -> None:
            if isinstance(outlook, Raised):
                self._node.drop('prediction', outlook.error)
                known(outlook.error)
                return
            self.latest = bounded.foreseen(outlook, since_s)
            if not (state.requested or isfinite(outlook.time_s)):
                self.latest = self.latest._replace(bound_s=inf)
            known(None)

        self.latest = bounded
        self._slices.begin(looking_ahead(
            self._supervisor, self._reference, self._running_gait, state, now.announced,
            now.canonical, now.r, now.command, tick_s, body_mode=now.barring), predicted)

    def _bounded(self, gait: GaitInForce, now: Present) -> Promise:
        """What is certain of a request that acts in a gait, from now on."""
        state, lead_s = now.state, 1e-9 * self._supervisor.lead_ns
        self._for = running = self._certified.running_in(gait)
        self.due_ns, way = inf, nan
        if not state.requested:
            bound = self._certified.certificate_in(gait).time_to_walking + lead_s
        else:
            way = running.stop_distance(now.r, now.command, lead_s)
            bound = self._bound_by_votes(now) if state.voted else running.time_to_rest(
                now.slow, now.canonical.x, now.r, state.quickness)
            bound += running.time_ahead(lead_s)
            if isfinite(bound):
                self.due_ns = state.time_ns + 1e9 * bound
        return Promise(state.measured_s, bound, way)

    def _bound_by_votes(self, now: Present) -> float:
        """Bound on the time from now to rest under the votes [s]."""
        of = self._node.parameters_of
        suite = SuiteParameters(reference=of(ReferenceParameters), leg=of(LegParameters),
                                inhibition=self._supervisor.parameters)
        armed = self._supervisor.inhibition(replace(now.state, armed=True))
        return time_to_slow(armed.quickness) + vote_bound(
            Setting.of(now.slow, suite, self._tick_ns * 1e-9), armed.gains)
