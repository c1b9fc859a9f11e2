# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plays a scenario to the running suite: velocity commands and service calls at their ticks; lays
the robot down at the end.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.scenario.fault import Fault
from dmp_cpg_ros.core.scenario.push import Push
from dmp_cpg_ros.core.scenario.scenario import Action, Command, Scenario
from dmp_cpg_ros.core.suite_parameters import CHANGEABLE
from dmp_cpg_ros.nodes.framework.acknowledged_topic import AcknowledgedTopic
from dmp_cpg_ros.nodes.framework.own_messages import OwnMessages
from dmp_cpg_ros.nodes.framework.requests import ParameterSetter, ask
from dmp_cpg_ros.nodes.framework.strangers import ANYBODYS, Strangers
from dmp_cpg_ros.nodes.messages.commands import push_force, twist
from dmp_cpg_ros.nodes.messages.inhibition import read_state_word
from dmp_cpg_ros.nodes.messages.interfaces import GATE_OWNER, STAMPED_CMD_VEL, interface
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES, read_drive_mode
from dmp_cpg_ros.nodes.messages.posture_feedback import read_body_mode
from dmp_cpg_ros.nodes.messages.values import header_ns, set_stamp, stamp_ns

FAR_NS = 2**31 * 10**9 - 1
"""A stamp later than every run [ns]."""

LEAD_NS = 40_000_000
"""In real time a push is stamped so much later than the clock that its message is in time [ns]."""

REPEAT_NS, REPEATED_NS = 200_000_000, 3_000_000_000
"""In real time a service that refuses is asked again after a time, and for how long [ns]: on a
loaded machine the robot may have to look after itself for a moment.
"""

PATIENCE_NS = 12_000_000_000
"""Time on the robot's clock within which it must lie [ns]: coming to rest, and the movement."""


class PlayerError(DmpCpgError):
    """The suite did not take a command or a request."""


class ScenarioPlayer(Node):  # type: ignore[misc]
    """Holds the robot's gate and lets a tick pass when everything that is to act in it has been
    delivered.

    Parameters
    ----------
    scenario : Scenario
        What to play.
    tick_ns : int
        Control tick [ns].
    lock_step : bool
        Whether the gate is held before every tick with an action; in real time it opens once.
    say : callable (time_s, text)
        Told what happens.
    stamped : bool
        Whether the suite runs with ``stamped_cmd_vel:=true``: ``TwistStamped``, not ``Twist``.

    Attributes
    ----------
    heard : OwnMessages
        What it reads of the suite.
    finished : Future
        Done at the end of the scenario, with an exception when it could not be played.
    time_ns : int
        Stamp of the robot's last tick [ns].
    mode : str
        What the body does, as last told; empty before.
    begun : bool
        Whether the scenario plays.
    busy : bool
        Whether an action is being delivered.
    refused : int
        How many changes of parameters and gaits were refused; the robot walks on without them.
    """

    def __init__(self, scenario: Scenario, tick_ns: int, lock_step: bool,
                 say: Callable[[float, str], None], *, stamped: bool = False) -> None:
        """Create the topics; nothing is sent before :meth:`begin`."""
        super().__init__('scenario_player')
        self._tick_ns, self._lock_step, self._say = tick_ns, lock_step, say
        self._actions, self._next = scenario.timeline(tick_ns), 0
        self._end_ns = scenario.ticks(tick_ns) * tick_ns
        self.begun, self.busy, self._word = False, False, ''
        self._holding_ns, self._inhibition_ns = -1, -1
        self.time_ns, self.mode, self.drive, self.finished = 0, '', DRIVE_MODES[0], Future()
        self._until_ns, self._again_ns, self.refused = -1, 0, 0
        self._lain: Future | None = None
        self._strangers = Strangers(self)
        self.heard = OwnMessages(self, self._warn, lock_step=lock_step)
        voting = any(action.kind == 'votes' and action.value for action in self._actions)
        self._velocity = STAMPED_CMD_VEL if stamped else interface('cmd_vel')
        self._topics = {topic.name: AcknowledgedTopic(self, self.heard, topic) for topic in (
            self._velocity, *map(interface, ['push', *(['votes'] if voting else [])]))}
        gate = interface(f'{GATE_OWNER}/advance_until')
        self._gate = self.create_publisher(Clock, gate.name, gate.publisher_qos)
        self._callees = {name: self.create_client(interface(name).type, name)
                         for name in ('inhibit', *REQUESTS)}
        self._setter = ParameterSetter(self)
        self._robot = self.create_client(
            SetParametersAtomically, f'{GATE_OWNER}/set_parameters_atomically')
        self._turn = 0
        self._unanswered: Action | None = None
        self._deliver: dict[str, Callable[[Any], None]] = {
            'command': self._send, 'push': self._push, 'votes': self._vote, 'set': self._set,
            'fail': self._fail, 'gait': lambda name: self._set({'gait': name}),
            **{name: partial(self._ask, name) for name in self._callees}}
        heard: dict[str, Callable[[Any], None]] = {
            f'{GATE_OWNER}/holding_at': self._on_holding, 'inhibition_state': self._on_inhibition,
            'inhibition_gains': self._on_gains, 'body_mode': self._on_body_mode,
            'drive_mode': self._on_drive_mode,
            **({} if lock_step else {'/clock': self._on_clock})}
        for name, callback in heard.items():
            self.heard.listen(interface(name), callback)

    def connected(self) -> bool:
        """Whether the gate, the readers of commands and the services are there."""
        return (self._gate.get_subscription_count() > 0
                and all(client.service_is_ready() for client in self._callees.values())
                and self._setter.connected() and self._robot.service_is_ready()
                and all(topic.connected() for topic in self._topics.values()))

    def begin(self) -> None:
        """Begin with the first tick."""
        self.begun = True
        if self._lock_step:
            self._continue()
        else:
            self._open(FAR_NS)

    @property
    def progress_ns(self) -> int:
        """Stamp of the last tick that is known to have ended [ns]."""
        return max(self.time_ns, self._inhibition_ns)

    def renew(self, nodes: Collection[str]) -> None:
        """Tell nodes that were restarted what they missed: the commands and, in lock-step, the
        last tick.
        """
        self.heard.forget(nodes)
        for topic in self._topics.values():
            topic.renew(nodes)
        if self.busy:
            self._ask_again(nodes)
        self.remind()

    def remind(self) -> None:
        """Let the robot tell its last tick again, in lock-step: what a node that was restarted
        has told too early is not believed, for the node before it was heard until then.
        """
        if self._lock_step and self._until_ns >= 0:
            self._open(self._until_ns)

    def _warn(self, text: str) -> None:
        self._say(self.progress_ns * 1e-9, text)

    # Lock-step: the robot holds, everything is delivered, the robot goes on ----------------------

    def _on_holding(self, message: Clock) -> None:
        self._holding_ns = stamp_ns(message.clock)
        self._continue()

    def _on_inhibition(self, message: DiagnosticArray) -> None:
        word = read_state_word(message)
        if word != self._word:
            self._word = word
            self._say(header_ns(message) * 1e-9, word.replace('_', ' '))

    def _on_gains(self, message: JointState) -> None:
        """Note that the inhibition node, which is the last of a tick, has finished it."""
        self._inhibition_ns = header_ns(message)
        if self._lock_step:
            if self._unanswered is not None:
                self._hand_over(self._unanswered)
            self._continue()

    def _continue(self) -> None:
        """Deliver what acts at the held tick once all nodes have finished the tick before, then
        open the gate.
        """
        if (not self.begun or not self._lock_step or self._holding_ns < 0 or self.busy
                or self.finished.done()):
            return
        if self._holding_ns > 0 and self._inhibition_ns < self._holding_ns - self._tick_ns:
            return
        self.time_ns = self._holding_ns
        if self.time_ns >= self._end_ns:
            self.finished.set_result(None)
        elif not self._deliver_due():
            following = (self._actions[self._next].time_ns if self._next < len(self._actions)
                         else self._end_ns)
            self._holding_ns = -1
            self._open(min(following, self._end_ns) - self._tick_ns)

    def _deliver_due(self) -> bool:
        """Deliver the next action if it is due; returns whether one is under way and will call
        back.
        """
        if (self._next == len(self._actions)
                or max(self._actions[self._next].time_ns, self._again_ns) > self.time_ns):
            return False
        action = self._actions[self._next]
        self._next += 1
        if action.label and not self._again_ns:
            self._say(self.time_ns * 1e-9, f'> {action.label}')
        if action.value is None:
            return self._deliver_due()
        self.busy = True
        self._hand_over(action)
        return True

    def _hand_over(self, action: Action) -> None:
        """Deliver an action; when it was delivered before, no answer of then counts."""
        self._turn, self._unanswered = self._turn + 1, None
        self._deliver[action.kind](action.value)

    def _this_time(self, done: Callable[..., None]) -> Callable[..., None]:
        """Return what hears of the action that is being delivered, unless it is asked again."""
        turn = self._turn
        return lambda *answer: done(*answer) if turn == self._turn else None

    def _ask_again(self, nodes: Collection[str]) -> None:
        """Ask a node that was restarted before it has answered; in lock-step once ticks end, for
        before its first one it refuses.
        """
        action = self._actions[self._next - 1]
        asked = CHANGEABLE if action.kind in ('set', 'gait') else (
            interface(action.kind).publishers if action.kind in self._callees else ())
        if not set(nodes).intersection(asked):
            return
        if self._lock_step:
            self._unanswered = action
        else:
            self._hand_over(action)

    def _send(self, command: Command) -> None:
        self._publish('cmd_vel', twist(self._velocity.type, command))

    def _push(self, push: Push) -> None:
        """Send the push's forces at once; the robot applies each at its stamp."""
        start_ns = self.time_ns if self._lock_step else self.time_ns + LEAD_NS
        self._publish('push', *(push_force(force.force, force.frame, force.time_ns)
                                for force in push.forces(start_ns, self._tick_ns)))

    def _vote(self, weights: dict[str, float]) -> None:
        self._publish('votes', JointState(
            name=[f'scenario/{leg}' for leg in weights], effort=list(weights.values())))

    def _publish(self, name: str, *messages: Any) -> None:
        """Send, and go on: in lock-step when all readers have what was sent."""
        if self._lock_step:
            self._topics[name].send(messages, self._delivered)
        else:
            self._topics[name].send(messages, lambda: None)
            self._delivered()

    def _delivered(self) -> None:
        self.busy = False
        if self._lock_step:
            self._continue()
        else:
            self._deliver_due()

    def _ask(self, service: str, stop: bool) -> None:
        request = SetBool.Request(data=stop) if service == 'inhibit' else Trigger.Request()
        due_ns = self._actions[self._next - 1].time_ns

        def answered(agreed: bool, message: str) -> None:
            self._warn_of_servers(service)
            if agreed:
                self._say(self.time_ns * 1e-9, f'  {service}: {message}')
            elif not self._lock_step and self.time_ns < due_ns + REPEATED_NS:
                self.busy, self._next = False, self._next - 1
                self._again_ns = self.time_ns + REPEAT_NS
                return
            self._again_ns = 0
            self._go_on(agreed, f'service {service}: {message}')

        ask(self._callees[service], request, self._this_time(answered))

    def _warn_of_servers(self, service: str) -> None:
        """Tell who else serves a service that has answered."""
        if self.count_services(service) > 1 and (who := self._strangers.serving(service)):
            self._warn(ANYBODYS.format(service, who))

    def _go_on(self, agreed: bool, why_not: str) -> None:
        """Go on when a service has agreed, or end the run."""
        if agreed:
            self._delivered()
        elif not self.finished.done():
            self.finished.set_exception(PlayerError(why_not))

    def _on_body_mode(self, message: String) -> None:
        mode = read_body_mode(message)
        if mode != self.mode:
            known, self.mode = self.mode, mode
            if known or mode != 'standing':
                self._say(self.time_ns * 1e-9, mode)
        self._watch_lying()

    def _on_drive_mode(self, message: String) -> None:
        drive = read_drive_mode(message)
        if drive != self.drive:
            self.drive = drive
            self._say(self.progress_ns * 1e-9, 'the robot follows its legs again'
                      if drive == DRIVE_MODES[0] else f'the robot looks after itself: {drive}')

    def _set(self, values: dict[str, Any]) -> None:
        """Ask the owner for a change; the robot walks on when it is refused."""

        def done(refusal: str) -> None:
            self.refused += bool(refusal)
            self._say(self.time_ns * 1e-9, f'  refused: {refusal}' if refusal else '  accepted')
            self._delivered()

        self._setter.set(values, self._this_time(done))

    def _fail(self, fault: Fault) -> None:
        """Set the robot's parameter; the scenario goes on when it has taken it."""
        request = SetParametersAtomically.Request(parameters=[Parameter(
            'fail', value=json.dumps(fault.as_mapping())).to_parameter_msg()])

        ask(self._robot, request, lambda agreed, reason: self._go_on(agreed, f'fail: {reason}'))

    # Real time -----------------------------------------------------------------------------------

    def _on_clock(self, message: Clock) -> None:
        self.time_ns = stamp_ns(message.clock)
        self._watch_lying()
        if not self.begun or self.finished.done():
            return
        if self.time_ns >= self._end_ns:
            self.finished.set_result(None)
        elif not self.busy:
            self._deliver_due()

    def stop(self) -> None:
        """Ask for a stop of the gait, if somebody is there to be asked."""
        if self._callees['inhibit'].service_is_ready():
            self._callees['inhibit'].call_async(SetBool.Request(data=True))

    def lie_down(self) -> Future:
        """Lay the robot down at the end of a real-time run, so that it does not drop; the future
        holds how it ended, in words, once it has.
        """
        if not self.finished.done():
            self.finished.set_result(None)
        lain = self._lain = Future()
        self._deadline_ns = self.time_ns + PATIENCE_NS

        def answered(agreed: bool, message: str) -> None:
            self._warn_of_servers('lie_down')
            if agreed:
                self._say(self.time_ns * 1e-9, f'  lie_down: {message}')
            else:
                self._end_lying(f'refused: {message}')

        self._watch_lying()
        if not lain.done():
            ask(self._callees['lie_down'], Trigger.Request(), answered)
        return lain

    def _watch_lying(self) -> None:
        if self.mode in ('lying', 'damped'):
            self._end_lying(f'it is {self.mode}')
        elif self._lain is not None and self.time_ns > self._deadline_ns:
            self._end_lying(f'it is still {self.mode} after {PATIENCE_NS * 1e-9:g} s')

    def _end_lying(self, how: str) -> None:
        if self._lain is not None and not self._lain.done():
            self._lain.set_result(how)
            self._say(self.time_ns * 1e-9, how)

    def _open(self, until_ns: int) -> None:
        message: Any = Clock()
        self._until_ns = until_ns
        set_stamp(message.clock, until_ns)
        self._gate.publish(message)
