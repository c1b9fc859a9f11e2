# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who asks the running nodes for anything, whatever they answer, and keeps the answers."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.clock import Clock, ClockType
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.scenario.fault import Fault
from dmp_cpg_ros.core.suite_parameters import CHANGEABLE, OWNER
from dmp_cpg_ros.nodes.framework.health import ReadinessOfOthers
from dmp_cpg_ros.nodes.framework.requests import ask
from dmp_cpg_ros.nodes.messages.commands import twist
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.scenario_player import PlayerError, ScenarioPlayer
from dmp_cpg_ros.studies.process_usage import pid_of
from dmp_cpg_ros.suite_table import RECORDER, ROBOT, WALKING_NODES

ANSWERED_S, LOOK_S = 60.0, 0.02
"""How long an answer may take, and how often it is looked whether a node is ready again [s]."""

TRANSITIONS = {
    'configure': Transition.TRANSITION_CONFIGURE, 'cleanup': Transition.TRANSITION_CLEANUP,
    'activate': Transition.TRANSITION_ACTIVATE, 'deactivate': Transition.TRANSITION_DEACTIVATE}
"""Transitions that a node comes back from."""

ASKED = ('inhibit', *REQUESTS, 'set', 'gait', 'parameters', 'transition', 'fail', 'kill')
"""Kinds of events that are answered, and deaths."""


class Answer(NamedTuple):
    """What was answered to a request.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick before which it was asked [ns].
    kind : str
        One of ``ASKED``.
    value : object
        What was asked for.
    accepted : bool
        Whether it was granted.
    text : str
        In which words.
    """

    time_ns: int
    kind: str
    value: Any
    accepted: bool
    text: str


class RequestPlayer(ScenarioPlayer):
    """Plays events in lock-step that may be refused, and more kinds of them than scenarios have.

    ``twist``
        A command (v_x, v_y, γ), numbers or none, at a stamp [s, ns] where it has one.
    ``parameters``
        Node, values by name, whether all at once: any node's, of any type.
    ``transition``
        Node, number of the transition.
    ``cycle``
        Node, and a list of what is done to it within one tick: names of ``TRANSITIONS``, or
        requests as lists of kind and value; it ends active.
    ``at_once``
        Requests as lists of kind and value that are sent before the first is answered.
    ``shut_down``
        Nodes, which are asked in turn to shut down; the scenario ends with that.
    ``interrupt``
        The run is interrupted, as by Ctrl-C.
    ``kill``
        Nodes, each a process of its own, that are killed. What a node had been asked and had not
        answered it is asked again once it is back.

    Parameters
    ----------
    answers : list of Answer
        Where the answers go.
    """

    def __init__(self, answers: list[Answer], *arguments: Any, **options: Any) -> None:
        """Create the topics and clients."""
        super().__init__(*arguments, **options)
        self._answers, self._asked_s = answers, time.monotonic()
        self._changers = {name: self.create_client(ChangeState, f'{name}/change_state')
                          for name in (*WALKING_NODES, RECORDER)}
        self._parameters: dict[tuple[str, bool], Any] = {
            (name, whole): self.create_client(kind, f'{name}/{service}')
            for name in WALKING_NODES for whole, kind, service in (
                (True, SetParametersAtomically, 'set_parameters_atomically'),
                (False, SetParameters, 'set_parameters'))}
        self._waiting: list[tuple[Mapping[str, Any], Callable[[str], None]]] = []
        self._returning: ReadinessOfOthers | None = None
        self._lost = set[str]()
        self._pending: dict[object, tuple[Collection[str], Callable[[], None]]] = {}
        self._asking: dict[str, Callable[[Any, Callable[[], None]], None]] = {
            **{name: partial(self._request, name) for name in self._callees},
            'set': self._change, 'gait': lambda name, then: self._change({'gait': name}, then),
            'parameters': self._raw, 'transition': self._transition, 'fail': self._let_fail}
        self._deliver |= {
            **{kind: partial(self._asked, kind) for kind in self._asking},
            'twist': self._twist, 'cycle': self._cycle, 'at_once': self._at_once,
            'shut_down': self._shut_down, 'kill': self._kill,
            'interrupt': lambda _: signal.raise_signal(signal.SIGINT)}
        self.create_timer(1.0, self._watch, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._back_timer = self.create_timer(
            LOOK_S, self._look_after_return, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _hand_over(self, action: Any) -> None:
        self._asked_s, self._action = time.monotonic(), action
        super()._hand_over(action)

    def _watch(self) -> None:
        """End where a request is left without an answer."""
        if self.busy and not self.finished.done() and (
                time.monotonic() > self._asked_s + ANSWERED_S):
            self.finished.set_exception(PlayerError(
                f'no answer to {self._action.kind} {self._action.value}'))

    def _note(self, kind: str, value: Any, accepted: bool, text: str) -> None:
        self._answers.append(Answer(self.time_ns, kind, value, accepted, text))

    def _until_answered(self, nodes: Collection[str], call: Callable[[Callable[..., None]], None],
                        done: Callable[..., None]) -> None:
        """Ask some nodes, and again when one of them was started again before the answer came; of
        the answers the first one counts.
        """
        key = object()

        def answered(*answer: Any) -> None:
            if self._pending.pop(key, None) is not None:
                done(*answer)

        self._pending[key] = nodes, partial(call, answered)
        call(answered)

    def _ask_again(self, nodes: Collection[str]) -> None:
        self._lost |= set(nodes)

    def _on_gains(self, message: Any) -> None:
        self._ask_lost()
        super()._on_gains(message)

    def _ask_lost(self) -> None:
        """Ask who has been started again before it answered; before its first tick it refuses."""
        nodes, self._lost = self._lost, set[str]()
        for asked, again in list(self._pending.values()):
            if not nodes.isdisjoint(asked):
                again()

    # Requests ------------------------------------------------------------------------------------

    def _asked(self, kind: str, value: Any) -> None:
        self._asking[kind](value, self._delivered)

    def _request(self, name: str, value: bool, then: Callable[[], None]) -> None:
        request = SetBool.Request(data=value) if name == 'inhibit' else Trigger.Request()
        self._call(self._callees[name], request, name, value, then)

    def _call(self, client: Any, request: Any, kind: str, value: Any, then: Callable[[], None]
              ) -> None:
        """Call a service, and note its answer; one that is not served now is not asked."""
        def answered(accepted: bool, text: str) -> None:
            self._note(kind, value, accepted, text)
            then()

        if client.service_is_ready():
            node = ROBOT if kind == 'fail' else interface(kind).publishers[0]
            self._until_answered([node], partial(ask, client, request), answered)
        else:
            then()

    def _change(self, values: Mapping[str, Any], then: Callable[[], None]) -> None:
        def done(refusal: str) -> None:
            self._note('set', dict(values), not refusal, refusal)
            then()

        self._set_in_turn(values, done)

    def _set_in_turn(self, values: Mapping[str, Any], done: Callable[[str], None]) -> None:
        """Set an owner's parameters once those before are known to all."""
        def go_on(refusal: str) -> None:
            self._waiting.pop(0)
            if self._waiting:
                self._set_next()
            done(refusal)

        self._waiting.append((values, go_on))
        if len(self._waiting) == 1:
            self._set_next()

    def _set_next(self) -> None:
        values, done = self._waiting[0]
        self._until_answered(CHANGEABLE, partial(self._setter.set, values), done)

    def _raw(self, value: Sequence[Any], then: Callable[[], None]) -> None:
        """Set parameters of a node, and wait until those who follow it know."""
        node, values, whole = value
        kind = SetParametersAtomically if whole else SetParameters
        request = kind.Request(parameters=[
            Parameter(name, value=of).to_parameter_msg() for name, of in values.items()])

        def answered(future: Future) -> None:
            answer = future.result()
            results = [answer.result] if whole else list(answer.results)
            taken = [all(result.successful for result in results)] * len(values) if whole else [
                result.successful for result in results]
            self._note('parameters', value, all(taken),
                       '; '.join(result.reason for result in results if not result.successful))
            known = {name: of for (name, of), so in zip(values.items(), taken, strict=True)
                     if so and OWNER.get(name) == node}
            if known:
                self._set_in_turn(known, lambda refusal: self._followed(known, refusal, then))
            else:
                then()

        self._await(node, self._parameters[node, whole], request, answered)

    def _followed(self, known: Mapping[str, Any], refusal: str, then: Callable[[], None]) -> None:
        if refusal:
            self._note('followed', dict(known), False, refusal)
        then()

    def _let_fail(self, fault: Fault, then: Callable[[], None]) -> None:
        request = SetParametersAtomically.Request(parameters=[Parameter(
            'fail', value=json.dumps(fault.as_mapping())).to_parameter_msg()])
        self._call(self._parameters[ROBOT, True], request, 'fail', fault.as_mapping(), then)

    def _transition(self, value: Sequence[Any], then: Callable[[], None]) -> None:
        node, number = value

        def answered(future: Future) -> None:
            self._note('transition', value, future.result().success, '')
            then()

        request = ChangeState.Request(transition=Transition(id=number))
        self._await(node, self._changers[node], request, answered)

    def _await(self, node: str, client: Any, request: Any, answered: Callable[[Future], None]
               ) -> None:
        """Call a service of a node, also of one that is not there yet."""
        self._until_answered(
            [node], lambda told: client.call_async(request).add_done_callback(told), answered)

    # More than one, and what has no answer -------------------------------------------------------

    def _twist(self, value: Sequence[Any]) -> None:
        velocity, stamp = value
        message = twist(self._velocity.type, velocity)
        if hasattr(message, 'header') and stamp is not None:
            message.header.stamp.sec, message.header.stamp.nanosec = stamp
        self._publish('cmd_vel', message)

    def _at_once(self, requests: Sequence[Sequence[Any]]) -> None:
        left = len(requests)

        def then() -> None:
            nonlocal left
            left -= 1
            if left == 0:
                self._delivered()

        for kind, value in requests:
            self._asking[kind](value, then)

    def _cycle(self, value: Sequence[Any]) -> None:
        """Take a node through its states, with requests in between, and wait until it is back."""
        (node, steps), serves = value, True

        def go_on(left: Sequence[Any]) -> None:
            if not left:
                self._returning = ReadinessOfOthers(self, WALKING_NODES)
                self._returned = node
                return
            nonlocal serves
            step, then = left[0], partial(go_on, left[1:])
            if isinstance(step, str):
                serves = step != 'cleanup'
                self._transition([node, TRANSITIONS[step]], then)
            elif serves or step[0] not in self._callees or (
                    node not in interface(step[0]).publishers):
                self._asking[step[0]](step[1], then)
            else:  # nobody is there to answer, which takes a moment to be known
                then()

        go_on(steps)

    def _shut_down(self, nodes: Sequence[str]) -> None:
        """Shut nodes down in turn, whatever those that are left make of it."""
        if not nodes:
            self.finished.set_result(None)
            return

        def answered(future: Future) -> None:
            if not future.result().success:
                self._note('shut_down', nodes[0], False, 'the transition failed')
            self._shut_down(nodes[1:])

        request = ChangeState.Request(transition=Transition(
            id=Transition.TRANSITION_ACTIVE_SHUTDOWN))
        self._changers[nodes[0]].call_async(request).add_done_callback(answered)

    def _kill(self, nodes: Sequence[str]) -> None:
        """Kill those that are there."""
        for node in nodes:
            if pid := pid_of(os.getpid(), [node]):
                os.kill(pid, signal.SIGKILL)
                self._note('kill', node, True, '')
        self._delivered()

    def _look_after_return(self) -> None:
        """Go on once a node that was taken through its states is connected again."""
        if self._returning is None or self._returning.missing() or not self.connected():
            return
        self._returning.end()
        self._returning = None
        self.renew([self._returned])
        self._delivered()
