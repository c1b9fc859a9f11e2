# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stopping and starting the gait: requests in, the next tick's inhibition and its state out.

- ``free``, ``walking``: uninhibited, or slowed by votes that do not stop it; walking once the legs
  are in their places and the reference moves.
- ``waiting``: a stop is requested; the reference slows and the legs come to their places, then
  inhibition is armed until x enters C. Capture is certified for legs that enter C in their places.
- ``captured``: inhibition holds an oscillator and the others follow.
- ``at_rest``: oscillators, reference and swings have come to rest.
- ``releasing``: a start is requested; the oscillators run up until they are phase-locked.
- ``stepping``: a push has released the gait from a stop, which stays in force; it is on the spot
  (:mod:`~dmp_cpg_ros.core.inhibition.push_recovery`).

A robot that is disturbed follows less of its command
(:mod:`~dmp_cpg_ros.core.inhibition.caution`); one that makes no way although it walks requests a
stop itself (:mod:`~dmp_cpg_ros.core.inhibition.blocked`).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, isfinite

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import (
    Inhibition,
    InhibitionParameters,
    joined_gains,
)
from dmp_cpg_ros.core.canonical.phase import scalar_phase_rates
from dmp_cpg_ros.core.clock import time_step
from dmp_cpg_ros.core.gait.choice import Changing
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.blocked import NO_BLOCK, Progress, block_step
from dmp_cpg_ros.core.inhibition.caution import (
    DISTURBED,
    changing_share,
    falls,
    followed_share,
    least_share,
    room,
)
from dmp_cpg_ros.core.inhibition.entry import in_places, next_leg, way_in
from dmp_cpg_ros.core.inhibition.push_recovery import NO_PUSH, push_step
from dmp_cpg_ros.core.inhibition.step_timing import fastest_lately, quickened, quickest
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.reference.operating_range import REST_SPEED, armed_speed
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import activities_step
from dmp_cpg_ros.core.voting.parameters import SUM, VotingParameters
from dmp_cpg_ros.core.voting.votes import Tally
from dmp_cpg_ros.core.voting.voting import holds_at_rest

STATES = ('free', 'walking', 'waiting', 'captured', 'at_rest', 'releasing', 'stepping')
"""What ``inhibition_state`` can say."""

FALLEN_MODES = ('damped', 'recovering')
"""Modes of the body after which only the service starts the gait again."""

REST_ACTIVITY = 0.02
"""Swing activity below which a leg is at rest: its foot is below 2 % of its clearance."""

REST_PHASE_RATE = 0.05
"""Phase rate below which an oscillator is at rest [rad/s]."""

LOCKED_PHASE_ERROR = 0.05
"""Phase error below which the legs count as being in their places [rad]."""

LOCKED_ACTIVITY = 0.95
"""Swing activity above which a leg swings at its height."""


class GaitSupervisor:
    """The state machine; state in, state out.

    Parameters
    ----------
    parameters : InhibitionParameters
        Gains, region, legs, automatic stop.
    voting : VotingParameters
        How a stop by votes holds and ends.
    activity_rate : float
        Rate at which the legs' swing activity follows the rates of their oscillators [1/s].
    reference : ReferenceParameters
        Limits of the commands, within which inhibition is armed.
    lead_ns : int
        Time after which a request and inhibition that is armed act [ns]; 0: at the next tick.
    """

    def __init__(self, parameters: InhibitionParameters, voting: VotingParameters,
                 activity_rate: float, reference: ReferenceParameters, lead_ns: int = 0) -> None:
        """Keep the parts."""
        self.parameters, self.voting, self.activity_rate = parameters, voting, activity_rate
        self.reference, self.lead_ns = reference, lead_ns

    def initial_state(self, time_ns: int = 0, leg: int = 0) -> SupervisorState:
        """At rest, a leg inhibited, or free when ``start_inhibited`` is false."""
        stopped = self.parameters.start_inhibited
        return SupervisorState(time_ns, 'at_rest' if stopped else 'free', stopped, True, time_ns,
                               stopped, (0.0 if stopped else 1.0,) * len(LEGS),
                               measured_s=0.0, asked=stopped, leg=leg)

    def inhibition(self, state: SupervisorState) -> Inhibition:
        """Inhibition that the canonical system applies at the tick after ``state``.

        Votes that do not stop the gait act weakly while it walks. In a stop the larger acts on
        each leg of what was asked for and what was voted, once the reference is slow.
        """
        return Inhibition(state.in_force, self._gains(state, state.armed),
                          self.parameters.region_radius, state.state == 'at_rest',
                          state.automatic and not state.block.acts,
                          state.push.opposite, state.rest_phase, state.share, state.quickness)

    def _gains(self, state: SupervisorState, armed: bool) -> Array:
        if not state.requested:
            return np.zeros(len(LEGS)) if state.push.acts else state.tally.gains
        gains = self.parameters.gains_on(state.leg) * float(armed and state.asked)
        return joined_gains(gains, state.vote_gains, state.holds) if (
            armed and state.voted) else gains

    def request(self, state: SupervisorState, stop: bool, automatic: bool = False
                ) -> SupervisorState:
        """Ask for a stop or a start; what is already asked changes nothing but its origin.

        A service call that asks for a start ends a stop by votes too, once nobody votes any more.
        What an obstacle asked for is asked for by whoever asks next.
        """
        voted, gains = state.voted and (stop or automatic or state.tally.alive), state.vote_gains
        if state.asked and not stop and voted and state.armed:  # what holds the legs stays
            gains = self._gains(state, True)
        state = replace_unchecked(state, asked=stop, automatic=automatic, voted=voted,
                                  vote_gains=gains, block=NO_BLOCK)
        if state.push.acts and not (stop or voted):
            state = replace_unchecked(state, push=NO_PUSH, requested=True)
        return self._turned(state)

    def step(self, state: SupervisorState, time_ns: int, network: GaitNetwork, x: Array,
             x_dot: Array, r: Array, command: tuple[float, float, float],
             tally: Tally | None = None, body_mode: str = 'standing',
             margins: Sequence[float] | None = None, progress: Progress | None = None,
             changing: Changing | None = None, acts: bool = True) -> SupervisorState:
        """Advance by one tick.

        Parameters
        ----------
        state : SupervisorState
            State after the last tick, requests included.
        time_ns : int
            Stamp of this tick [ns].
        network : GaitNetwork
            The oscillators that act, with their gait.
        x, x_dot, r : ndarray (4, 2), (4, 2), (3,)
            Canonical states, their rates and reference of this tick.
        command : tuple of float
            External command (v_x, v_y, γ) that acts at this tick.
        tally : Tally, optional
            Votes of this tick; those of the tick before without.
        body_mode : str
            What the body does; in every mode but ``standing`` the gait is stopped.
        margins : sequence of four floats, optional
            Of the capture point in the support polygon, where they are known [m].
        progress : Progress, optional
            Of the body, where it is known.
        changing : Changing, optional
            Of the gait, at a lower speed.
        acts : bool
            Whether a stop that is requested acts; inhibition is not armed before it does.
        """
        dt = time_step(state.time_ns, time_ns)
        if time_ns < state.time_ns:
            state = state.carried(time_ns)
        gait, rates = network.gait, scalar_phase_rates(x, x_dot)
        speed = network.scale.foot_speed(*r.tolist())
        state = replace_unchecked(state, time_ns=time_ns, activity=activities_step(
            state.activity, [rate + gait.rest_rate for rate in rates],
            gait.own_omegas(network.omega(r)), self.activity_rate, dt))
        if body_mode != 'standing':
            state = self._barred(state, body_mode)
        elif self.parameters.auto_inhibit:
            state = self._automatic(state, any(command))
        state = self._blocked(state, r, command, progress, network, body_mode, dt)
        state = self._voted(state, tally or state.tally, network)
        state = self._pushed(state, network, x, margins, body_mode)
        most = changing_share(network, changing, command, speed) if changing else 1.0
        quick = state.quickness > 1.0
        state = self._balancing(state, margins, network, progress or Progress(), r, most, dt)
        if state.requested:  # until it acts the reference may speed up
            return (replace_unchecked(state, armed=False, state='waiting') if quick or not acts
                    else self._stopping(state, network, x, rates, speed))
        return self._running(state, max(map(abs, network.phase_errors(x))), speed)

    def _balancing(self, state: SupervisorState, margins: Sequence[float] | None,
                   network: GaitNetwork, progress: Progress, r: Array, most: float, dt: float
                   ) -> SupervisorState:
        """Follow less and step faster while the body is disturbed; less while the gait changes.
        Feet need time on rough ground, but after a push or when the body falls.
        """
        p, leg = self.parameters, network.scale.leg_length
        left, falling = room(margins, leg, network.gait.wide), falls(margins, r.tolist())
        predicted = state.requested or state.state == 'releasing'
        share, most = 1.0, min(most, state.block.most)
        if not (predicted or state.push.acts):
            share = followed_share(state.share, left if p.caution else None, dt, most,
                                   least_share(progress.rough, progress.gaps, falling))
        waits = not state.push.acts and (predicted or (progress.rough and not falling))
        fastest = fastest_lately(state.fastest, r, dt)
        hurries = p.step_timing and not waits and left is not None and left < DISTURBED
        quickness = quickened(state.quickness, left if hurries else None, dt, quickest(
            network, state.quickness, r, progress.velocity, fastest) if hurries else 1.0)
        return replace_unchecked(state, share=share, quickness=quickness, fastest=fastest)

    def _automatic(self, state: SupervisorState, commanded: bool) -> SupervisorState:
        """Stop after a time of zero command, and start at a command."""
        if commanded:
            if state.idle_ns >= 0:
                state = replace_unchecked(state, idle_ns=-1)
            held = not state.automatic or state.block.acts
            return self.request(state, False, True) if state.asked and not held else state
        if state.idle_ns < 0:
            state = replace_unchecked(state, idle_ns=state.time_ns)
        waited = (state.time_ns - state.idle_ns) * 1e-9
        late = not state.asked and waited >= self.parameters.auto_delay
        return self.request(state, True, True) if late else state

    def _blocked(self, state: SupervisorState, r: Array, command: tuple[float, float, float],
                 progress: Progress | None, network: GaitNetwork, body_mode: str, dt: float
                 ) -> SupervisorState:
        """Stop a walk that makes no way, and start again at a command that leads elsewhere."""
        block = state.block
        if block.acts:
            if not any(command):
                return replace_unchecked(state, block=block._replace(ahead=(0.0, 0.0)))
            stays = block.leads_there(command) or not state.automatic or body_mode != 'standing'
            return state if stays else self.request(state, False, True)
        if not self.parameters.block_stop or state.requested or state.push.acts or (
                state.state not in ('walking', 'free')):
            return state if block is NO_BLOCK else replace_unchecked(state, block=NO_BLOCK)
        v_x, v_y, _ = r.tolist()
        wanted = min(hypot(v_x, v_y) / state.share, hypot(command[0], command[1]))
        block = block_step(block, r, wanted, progress, network.scale.leg_length, dt)
        if block.acts:
            state = self.request(state, True, True)
        return replace_unchecked(state, block=block)

    def _voted(self, state: SupervisorState, tally: Tally, network: GaitNetwork
               ) -> SupervisorState:
        """Stop when votes overcome the threshold; keep what holds until it is released, also while
        the service asks for the stop: its leg need not be where it could hold the others.
        """
        if tally is not state.tally:
            state = replace_unchecked(state, tally=tally)
        if not state.voted:
            return self._turned(replace_unchecked(
                state, voted=True, vote_gains=tally.gains)) if tally.stops else state
        if not (tally.alive or state.asked) and self.voting.vote_resume:
            return self._turned(replace_unchecked(state, voted=False))
        gains = state.vote_gains
        if self.voting.vote_rule == SUM and np.any(tally.gains > gains):
            gains = joined_gains(gains, tally.gains, state.holds)
        if not (state.asked or holds_at_rest(network, gains, self.parameters.region_radius)):
            # parameters or cadence have changed: what the votes asked for, the service's gain does
            gains = np.maximum(gains, self.parameters.gains_on(state.leg))
        return state if gains is state.vote_gains else replace_unchecked(state, vote_gains=gains)

    def _pushed(self, state: SupervisorState, network: GaitNetwork, x: Array,
                margins: Sequence[float] | None, body_mode: str) -> SupervisorState:
        """Release the gait for a push against a stop, and stop it again."""
        push = NO_PUSH
        if (self.parameters.push_recovery and (state.asked or state.voted)
                and body_mode in ('standing', 'stopping')):
            push = push_step(state.push, state.time_ns, state.state, network, x, margins)
        return state if push is state.push else self._turned(replace_unchecked(state, push=push))

    @staticmethod
    def _turned(state: SupervisorState) -> SupervisorState:
        """Begin a stop or a start when what is wanted has changed."""
        stop = (state.asked or state.voted) and not state.push.acts
        if stop == state.requested:
            return state
        return replace_unchecked(state, state='waiting' if stop else 'releasing', requested=stop,
                       request_ns=state.time_ns, armed=False, measured_s=float('nan'), idle_ns=-1,
                       rest_phase=0.0)

    def _barred(self, state: SupervisorState, body_mode: str) -> SupervisorState:
        """Stop because the robot does not stand; after a fall no command starts it again."""
        automatic = body_mode not in FALLEN_MODES
        if not state.asked:
            return self.request(state, True, automatic)
        return replace_unchecked(state, automatic=state.automatic and automatic, idle_ns=-1)

    def _stopping(self, state: SupervisorState, network: GaitNetwork, x: Array,
                  rates: list[float], speed: float) -> SupervisorState:
        if not self.parameters.auto and self.parameters.armed_gains[state.leg] == 0.0:
            # auto keeps what holds when it takes over in this stop
            state = replace_unchecked(state, leg=int(self.parameters.armed_gains.argmax()))
        armed = inside = state.armed and self._inside(state, network, x)
        if not inside:
            most = armed_speed(network.scale, self.parameters, self.reference)
            armed = speed <= most and self.in_places(network, x)
            state = self._aimed(state, network, x, rates, speed, armed)
            inside = self._inside(state, network, x)
        if not (armed and inside):
            return replace_unchecked(state, armed=armed, state='waiting')
        if (max(map(abs, rates)) > REST_PHASE_RATE or speed > REST_SPEED
                or max(state.activity) > REST_ACTIVITY):
            return replace_unchecked(state, armed=armed, state='captured')
        return replace_unchecked(state, armed=armed, state='at_rest',
                                 measured_s=self._measured(state))

    def _inside(self, state: SupervisorState, network: GaitNetwork, x: Array) -> bool:
        """Whether inhibition acts here once it is armed."""
        once_armed = Inhibition(True, self._gains(state, True), self.parameters.region_radius,
                                rest_phase=state.rest_phase)
        return bool(network.acting_gains(once_armed, x).any())

    def _aimed(self, state: SupervisorState, network: GaitNetwork, x: Array, rates: list[float],
               speed: float, armed: bool) -> SupervisorState:
        """State with the leg that is to be caught; once it is, it is kept."""
        leg, rest_phase = state.leg, 0.0
        if armed and state.asked and self.parameters.auto:
            leg, rest_phase = next_leg(network, self.parameters, x, way_in(
                network, speed, rates, 1e-9 * self.lead_ns), leg if state.armed else None)
        same = (leg, rest_phase) == (state.leg, state.rest_phase)
        return state if same else replace_unchecked(state, leg=leg, rest_phase=rest_phase)

    def in_places(self, network: GaitNetwork, x: Array) -> bool:
        """Whether legs and radii are as close to their places as capture requires."""
        return in_places(network, x, self.parameters.region_radius)

    def _running(self, state: SupervisorState, error: float, speed: float) -> SupervisorState:
        in_step = error <= LOCKED_PHASE_ERROR
        swinging = min(state.activity)
        if state.state == 'releasing' and not (in_step and swinging >= LOCKED_ACTIVITY):
            return state
        now, measured_s = 'walking' if in_step and speed > REST_SPEED else 'free', state.measured_s
        now = 'stepping' if state.push.acts else now
        if now == state.state and isfinite(measured_s):
            return state
        return replace_unchecked(state, state=now, measured_s=self._measured(state))

    @staticmethod
    def _measured(state: SupervisorState) -> float:
        """Time from the request to now, kept once it has been set [s]."""
        return state.measured_s if isfinite(state.measured_s) else (
            state.time_ns - state.request_ns) * 1e-9
