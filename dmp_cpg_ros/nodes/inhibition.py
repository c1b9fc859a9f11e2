# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inhibition``: the service that stops and starts the gait, and the state of the stop."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from math import inf, isfinite
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.gait.contact_feedback import initial_contact_state
from dmp_cpg_ros.core.gait.network import SLOWEST, CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.running import CanonicalState
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.blocked import InTime
from dmp_cpg_ros.core.inhibition.handover import adopted
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import (
    INHIBITION,
    VOTE_SOURCES,
    RequestParameters,
    TickParameters,
)
from dmp_cpg_ros.core.voting.parameters import VoteSourceParameters, VotingParameters
from dmp_cpg_ros.core.voting.voters import VoteSensors
from dmp_cpg_ros.core.voting.votes import VoteInbox
from dmp_cpg_ros.core.voting.voting import Voting
from dmp_cpg_ros.nodes.framework.certified import JUDGED, Acting, Certified, certificate_words
from dmp_cpg_ros.nodes.framework.gaits import description_of, gait_name
from dmp_cpg_ros.nodes.framework.judging import Later
from dmp_cpg_ros.nodes.framework.known_stop import OthersKnow
from dmp_cpg_ros.nodes.framework.promise import Present, Promises
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.framework.told_stop import ToldStop
from dmp_cpg_ros.nodes.framework.waiting_requests import OVERTAKEN, WaitingRequests
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateReader
from dmp_cpg_ros.nodes.messages.commands import read_votes
from dmp_cpg_ros.nodes.messages.interfaces import BLIND_NS, interface
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES, read_drive_mode
from dmp_cpg_ros.nodes.messages.posture_feedback import BodyReader
from dmp_cpg_ros.nodes.messages.reference import read_reference
from dmp_cpg_ros.nodes.messages.robot_state import FootContactsReader, read_imu
from dmp_cpg_ros.nodes.messages.values import stamp_ns, stamped

FOLLOWING = DRIVE_MODES[0]

JOIN_EVERY_S = 0.1
"""In lock-step, how often a restarted node looks whether it has been told what acts [s]."""

UNKNOWN = 'done; it could not be predicted'
"""Begin of the answer to a request of which no time can be said."""


class InhibitionNode(SuiteNode):
    """Stops and starts the gait on request, says when it will be at rest, and watches that it
    is.
    """

    KIND = INHIBITION
    JUDGES = True
    CHANGEABLE = (*JUDGED, *VOTE_SOURCES)
    certified: Certified

    def configure(self) -> None:
        """Build the supervisor and its topics and service."""
        self.certified = Certified(self, self._acting_now)
        gaits = self.certified.gaits
        self._inbox, self._weight = VoteInbox(), description_of(self).mass * GRAVITY
        self._lead_ns = 0 if self.lock_step else round(
            1e9 * self.parameters_of(RequestParameters).request_lead)
        self._build()
        self._network = self._slow = self._running_gait.network(gaits.named(gait_name(self)))
        self._votes = self._voting.initial_state(self._network)
        self._state = self._supervisor.initial_state(
            leg=self.parameters_of(CanonicalParameters).first_leg)
        self._announced = Announced(self._supervisor.inhibition(self._state))
        self._x: Any = None
        self._x_dot: Any = None
        self._r, self._body_mode = np.zeros(3), 'standing'
        self._promises, self._anew = Promises(
            self, self.certified, self._network.gait, self._lead_ns), False
        self._waiting = WaitingRequests()
        self._blind = ''
        self._drive, self._joined, self._asked = FOLLOWING, False, False
        self._began_ns, self._clock_ns, self._in_time = -1, 0, InTime()
        self._held: tuple[int, dict[str, Any]] | None = None
        self._told = ToldStop(self, tuple(gaits.gaits), self._voting.voting.voting)
        self._others = OthersKnow(self, self._take_up)
        self.listen('drive_mode', self._on_drive)
        if self.lock_step:
            self.look_every(JOIN_EVERY_S, self._try_again)
        else:
            self.listen('/clock', lambda message: self._watch(stamp_ns(message.clock)))
        body, sensors = BodyReader(), {}
        if self._voting.voting.voting:
            sensors = {'foot_contacts': stamped(FootContactsReader().read),
                       'imu': stamped(read_imu)}
            self.listen('votes', lambda message: self._inbox.accept(*read_votes(message)),
                        command=True)
        mode = {'posture_feedback': body.read}
        self.match('canonical_state', {
            'canonical_state': CanonicalStateReader(gaits).read,
            'reference': read_reference,
            **sensors,
            **(mode if self.lock_step else {}),
        }, delayed={} if self.lock_step else mode, optional=sensors, last='posture_feedback')
        self._gate = self.certified.commands()
        self.serve('inhibit', self._take_request)

    def deactivate(self) -> None:
        """Answer the start that waits: nothing will be started."""
        self._waiting.refuse(f'{self.get_name()} was deactivated before the robot followed its '
                             'legs')

    def on_parameters(self) -> None:
        """Take over what may change while walking."""
        self._build()
        self._network = self._running_gait.network(self._network.gait)
        self._slow = self._unhurried(self._network.gait)
        self.certified.limit(self._gate)
        # until a request acts a change of gait may begin, of which no inequality depends
        self._promises.take_over_parameters()
        self._anew |= self._is_on_its_way(self._state) or not (
            self._promises.holds_with(self.certified.running_in(self._network.gait)))
        self._told.forget()  # the certificate may be another one

    def _build(self) -> None:
        of = self.parameters_of
        self._supervisor = self.certified.supervisor(self._lead_ns)
        self._voting = Voting(of(InhibitionParameters), of(VotingParameters),
                              of(VoteSourceParameters), of(ReferenceParameters), self._weight)
        self._reference = self.certified.reference()
        self._running_gait = self.certified.running_gait()

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Advance the state of the stop to the stamp of the canonical state."""
        self._x, self._x_dot, gait = values['canonical_state']
        self._r = values['reference']
        self._network = network = self._running_gait.network(gait)
        if not self._joined and not self._join(stamp_ns):
            self._held = (stamp_ns, values) if self.lock_step else None
            return
        self._announced = self._announced.at(stamp_ns)
        self._slow, before = self._unhurried(gait), self._state
        self._body_mode, margins, progress = values['posture_feedback'] or (
            self._body_mode, None, None)
        self._in_time = self._in_time.at(stamp_ns, before.time_ns, self._clock_ns)
        self._votes = self._voting.step(
            self._votes, stamp_ns, network, _vote_sensors(stamp_ns, values), self._x, self._r,
            before.state in ('walking', 'free'), self._inbox.take(self._votes.memory.asks))
        self._state = self._supervisor.step(
            before, stamp_ns, network, self._x, self._x_dot, self._r, self._gate.at(stamp_ns),
            self._votes.tally, self._barring, margins,
            self._in_time.of_obstacles(stamp_ns, progress), self.certified.changing(gait),
            self._lead_ns == 0 or self._announced.stops)
        self._announce()
        # it goes with a clock that is set back
        self._promises.due_ns += min(0, stamp_ns - before.time_ns)
        self._tell_block(before)
        balance = (self._state.share, self._state.quickness)
        if (self._told.is_news(self._state, self._promises.latest)
                or balance != (before.share, before.quickness)
                or self._told.are_gains_due(stamp_ns)):
            self._tell_gains()
            if not self.lock_step:
                self._tell_memory(stamp_ns)
        self._predict_what_is_new(before)  # takes several ticks, for which nobody is to wait
        self._tell_news()
        if self.lock_step:
            self._tell_memory(stamp_ns)
        if self._blind:
            self._blind = ''
            self.clear('blind')
        self._watch_bound(stamp_ns)

    def _predict_what_is_new(self, before: SupervisorState) -> None:
        """Predict a stop or a start that began in this tick, or one that is under way anew when
        parameters have changed, or another command has come before the request acted.
        """
        state, anew, self._anew = self._state, self._anew, False
        overtaken = state.requested and self._is_on_its_way(before) and (
            self._gate.foreseen(state.time_ns) != self._promises.command)
        if state.requested != before.requested or (
                (anew or overtaken) and not isfinite(state.measured_s)):
            self._predict()

    def _tell_block(self, before: SupervisorState) -> None:
        """Say that the robot has stopped by itself, and when it no longer has."""
        if self._state.block.acts == before.block.acts:
            return
        if self._state.block.acts:
            self.warn('blocked', f'stopped as before an obstacle: {self._state.block.why}; a '
                      'command that leads elsewhere, or inhibit with false, starts the gait')
        else:
            self.clear('blocked')

    def _is_on_its_way(self, state: SupervisorState) -> bool:
        """Whether the last request does not act yet at the tick after a state."""
        tick_ns = self.parameters_of(TickParameters).tick_ns
        return state.time_ns - state.request_ns < max(tick_ns, self._lead_ns - tick_ns)

    def _unhurried(self, gait: GaitInForce) -> GaitNetwork:
        """Oscillators at the cadence that a gait has but for the quickness that acts; at its own
        where they cannot have heard of that yet.
        """
        quickness = self._announced.acting.quickness
        slow = gait.cadence_scale / quickness
        if quickness == 1.0 or slow < SLOWEST:
            return self._network
        return self._network.of(self.certified.gaits.at_cadence(gait, slow))

    # Restarts, and what is missing -------------------------------------------------------------

    def _join(self, stamp_ns: int) -> bool:
        """Take up what acts on a gait that began before this node; the first tick of a run has
        the stamp 0. False while it is not known yet: what others know of a stop holds until then.
        """
        now_ns = time.monotonic_ns() if self.lock_step else stamp_ns  # no robot's time passes
        if stamp_ns > 0 and (not self._others.have_told(now_ns) or (
                self.lock_step and self.certified.others.awaited())):
            return False
        self._adopt(stamp_ns)
        return True

    def _try_again(self) -> None:
        """In lock-step, where the robot waits, take the tick that could not be taken before."""
        held, self._held = self._held, None
        if held is not None:
            self.take_parameters()
            self.on_tick(*held)

    def _adopt(self, stamp_ns: int) -> None:
        """Take over what is known at a tick; who does not know whether the gait was stopped leaves
        it to the service to start.
        """
        self._joined, self._began_ns = True, stamp_ns
        if stamp_ns > 0:
            unknown = replace(self._supervisor.inhibition(self._state), automatic=False)
            self._state = adopted(
                self._others.known or unknown, stamp_ns, self._supervisor.parameters)
            self._announced = Announced(self._supervisor.inhibition(self._state))
            if self._state.requested:
                self._predict()

    def _take_up(self, stamp_ns: int, acting: Inhibition) -> None:
        """Take up a stop of the service of before this node that is told only now."""
        if (self._joined and stamp_ns < self._began_ns and not self._asked
                and acting.requested and not acting.automatic):
            self._stop_now(automatic=False)

    @property
    def _barring(self) -> str:
        """What keeps the gait from running: the body's mode, or what the drive does by itself."""
        if self._body_mode != 'standing' or self._drive == FOLLOWING:
            return self._body_mode
        return 'damped' if self._drive == 'damp' else f'looking after itself ({self._drive})'

    def _on_drive(self, message: Any) -> None:
        """Stop the gait at once while the robot does not follow the legs."""
        self._drive = read_drive_mode(message)
        if self._drive != FOLLOWING and self._joined:
            self._stop_now()
        self._take_put_off()

    def _stop_now(self, automatic: bool = True) -> None:
        if not self._state.in_force or self._state.automatic and not automatic:
            self._state = self._supervisor.request(self._state, True, automatic)
            self._announce()
            self._tell_gains()
            self._predict()
            self._tell_state()

    def _watch(self, now_ns: int) -> None:
        """Notice on the robot's clock that nothing is known of the gait any more."""
        self._clock_ns = now_ns
        if self._waiting.is_overdue(now_ns):
            self._waiting.refuse(self._refusal)
        if not self._joined:
            return
        if now_ns - self._state.time_ns > BLIND_NS and not self._blind:
            topic = next((name for name in ('reference', 'canonical_state')
                          if now_ns - self.inputs.newest_ns(name) > BLIND_NS), 'canonical_state')
            self._blind = (f'no {topic} from {interface(topic).publishers[0]} since '
                           f'{self._state.time_ns * 1e-9:.3f} s')
            self.warn('blind', f'{self._blind}: nothing is known of the gait', error=True)
        if self._blind and now_ns - self._state.time_ns > BLIND_NS + self.return_ns:
            self._stop_now()
        self._watch_bound(now_ns)

    def _watch_bound(self, now_ns: int) -> None:
        """Report a stop that takes longer than was promised."""
        if not self._state.requested or isfinite(self._state.measured_s):
            self._promises.due_ns = inf
            self.clear('bound')
        elif now_ns > self._promises.due_ns:
            self.warn('bound', f'the gait was to rest by {self._promises.due_ns * 1e-9:.3f} s '
                      'and does not', error=True)

    def _acting_now(self) -> Acting:
        if self._x is None:
            return Acting()
        gait = self._slow.gait
        return Acting(gait.cadence_scale, (self._network, self._announced.latest, self._x),
                      gait.ends)

    def diagnostic_values(self) -> Mapping[str, Any]:
        """State of the stop, once it is known."""
        if not self._joined:
            return {}
        return {'inhibition': self._state.state, 'requested': self._state.in_force,
                'pushed': self._state.push.acts, 'blocked': self._state.block.acts,
                'command': self._gate.foreseen(self._state.time_ns)}

    # The service -------------------------------------------------------------------------------

    def _take_request(self, request: Any) -> tuple[bool, str] | Later:
        """Take a request; the answer says when it will be fulfilled. It acts from the next tick
        on: in lock-step from that of this node, else from the next one of the oscillators.
        """
        return self._take(request.data, Later())

    def _take(self, stop: bool, answer: Later) -> tuple[bool, str] | Later:
        self._asked = True
        self.take_parameters()  # with which the tick begins in which the request acts
        if self._x is None:
            return False, 'no canonical_state and reference yet; is canonical_oscillators running?'
        self._waiting.refuse('another request came before the robot followed its legs')
        if not stop and self._stands_by_itself and not self.lock_step:
            return self._waiting.put_off(answer, self.health.stamp_ns)
        if not stop and self._barring != 'standing':
            return False, self._refusal
        if self._blind:
            if stop:
                self._state = self._supervisor.request(self._state, True)
                self._announce()
                self._tell_gains()
            return False, (
                f'{self._blind}: no time to rest can be promised' + (
                    '; the stop is requested and will be carried out' if stop else ''))
        if not self._joined:  # what is asked for now acts, whatever was before
            self._adopt(self.health.stamp_ns)
        already, steps = stop == self._state.in_force, self._state.push.acts
        self._state = self._supervisor.request(self._state, stop)
        if stop != self._state.in_force:
            return False, f'held by votes: {self._state.tally.cause}; ask again without them'
        if already:
            return True, ('stopped already, and steps to catch a push' if steps and stop
                          else f'already {self._state.state}')
        if not self.lock_step:  # what it takes to predict must not delay it
            self._announce()
            self._tell_gains()
        self._waiting.acts(stop, answer)
        self._predict()
        return answer.delivered or answer

    @property
    def _stands_by_itself(self) -> bool:
        """Whether the robot has come to a stand by itself, as it does for a moment where targets
        are late.
        """
        return self._drive == 'stand' and self._body_mode == 'standing'

    @property
    def _refusal(self) -> str:
        """Why the gait cannot start."""
        way = ('ask again when it follows its legs' if self._stands_by_itself else
               f'call {"recover" if self._barring == "damped" else "stand_up"}, or wait until it '
               'stands')
        return f'the gait cannot start: the robot is {self._barring}, not standing; {way}'

    def _take_put_off(self) -> None:
        """Take the start that waits for the robot, or refuse it, once that does something else."""
        answer = None if self._stands_by_itself else self._waiting.resumed()
        if answer is not None:
            known = self._take(False, answer)
            if known is not answer:
                answer.deliver(known)

    def _told_of(self, stop: bool) -> tuple[bool, str]:
        """What a request is answered once it has been predicted."""
        if stop != self._state.in_force:
            return True, OVERTAKEN
        return True, self._promises.latest.words(
            stop, self._words(), self._supervisor.parameters.push_recovery)

    def _predict(self) -> None:
        """Promise the rest or the walk that was requested, just now or before parameters have
        changed, and answer the request once it has been predicted.
        """
        state, present = self._state, self._network.gait
        changing = self.certified.changing(present)
        wanted = self.certified.gaits.named((changing.wanted if changing else present).name)
        tick_ns = self.parameters_of(TickParameters).tick_ns

        def known(error: Exception | None) -> None:
            self._waiting.predicted(self._told_of if error is None else (
                lambda _: (True, f'{UNKNOWN}: {error}')))
            if self.active and not self.lock_step:
                self._tell_news()

        canonical = CanonicalState(present, wanted, self._slow.gait.cadence_scale, self._x,
                                   self._x_dot, initial_contact_state())
        self._promises.make(Present(
            state, self._announced, canonical, self._slow, self._r,
            self._gate.foreseen(state.time_ns + tick_ns), self._barring), known)

    # What is told ------------------------------------------------------------------------------

    def _words(self) -> str:
        return certificate_words(self.certified.certificate_in(self._network.gait))

    def _announce(self) -> None:
        """Let act what is to be told from now on."""
        self._announced = self._announced.after(
            self._state, self._supervisor.inhibition(self._state), self._lead_ns)

    def _tell_gains(self) -> None:
        self._told.tell_gains(self._state.time_ns, self._announced)

    def _tell_memory(self, stamp_ns: int) -> None:
        self._told.tell_memory(stamp_ns, self._x, self._x_dot, self._slow.gait, self._r)

    def _tell_news(self) -> None:
        if self._told.is_news(self._state, self._promises.latest):
            self._tell_state()

    def _tell_state(self) -> None:
        self._told.tell_state(self._state, self._announced, self._promises.latest, {
            'certified': self.certified.certificate_in(self._network.gait).holds,
            'grade': self._words()})


def _vote_sensors(stamp_ns: int, values: dict[str, Any]) -> VoteSensors:
    """What sensors told at a tick; NaN where they are not read or have told nothing."""
    nothing = np.full(3, np.nan)
    contact_ns, load = values.get('foot_contacts') or (stamp_ns, np.full(len(LEGS), np.nan))
    imu_ns, (rate, force) = values.get('imu') or (stamp_ns, (nothing, nothing))
    return VoteSensors(contact_ns, imu_ns, load, rate, force)
