# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Plays a scenario to the running suite: velocity commands and service calls at their ticks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, WrenchStamped
from rclpy.node import Node
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.scenario.push import Push
from dmp_cpg_ros.core.scenario.scenario import Command, Scenario
from dmp_cpg_ros.nodes.framework.parameter_services import ParameterSetter
from dmp_cpg_ros.nodes.messages.conversions import read_body_mode
from dmp_cpg_ros.nodes.messages.inhibition_state import read_state_word
from dmp_cpg_ros.nodes.messages.interfaces import GATE_OWNER, interface
from dmp_cpg_ros.nodes.messages.values import header_ns, set_stamp, stamp_ns
from dmp_cpg_ros.nodes.scenario.acknowledged_topic import AcknowledgedTopic

FAR_NS = 2**31 * 10**9 - 1
"""A stamp later than every run [ns]."""


LEAD_NS = 40_000_000
"""In real time a push is stamped so much later than the clock that its message is in time [ns]."""


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

    Attributes
    ----------
    finished : Future
        Done at the end of the scenario, with an exception when it could not be played.
    time_ns : int
        Stamp of the robot's last tick [ns].
    mode : str
        What the body does, as last told; empty before.
    """

    def __init__(
        self, scenario: Scenario, tick_ns: int, lock_step: bool, say: Callable[[float, str], None]
    ) -> None:
        """Create the topics; nothing is sent before :meth:`begin`."""
        super().__init__('scenario_player')
        self._actions, self._tick_ns, self._lock_step, self._say = (
            scenario.timeline(tick_ns),
            tick_ns,
            lock_step,
            say,
        )
        self._end_ns = scenario.ticks(tick_ns) * tick_ns
        self._next, self._begun, self._busy, self._word = 0, False, False, ''
        self._holding_ns, self._inhibition_ns = -1, -1
        self.time_ns = 0
        self.finished = Future()
        gate = interface(f'{GATE_OWNER}/advance_until')
        self._commands = AcknowledgedTopic(self, 'cmd_vel')
        self._pushes = AcknowledgedTopic(self, 'push')
        self._topics = [self._commands, self._pushes]
        if any(action.kind == 'votes' for action in self._actions):
            self._votes = AcknowledgedTopic(self, 'votes')
            self._topics.append(self._votes)
        self._gate = self.create_publisher(Clock, gate.name, gate.publisher_qos)
        self._inhibit = self.create_client(SetBool, interface('inhibit').name)
        self._setter = ParameterSetter(self)
        self._modes = {
            what: self.create_client(Trigger, interface(what).name) for what in REQUESTS
        }
        self.mode = ''
        self._deliver: dict[str, Callable[[Any], None]] = {
            'command': self._send,
            'inhibit': self._call_inhibit,
            'gait': lambda name: self._set({'gait': name}),
            'push': self._push,
            'set': self._set,
            'votes': self._vote,
            **{what: self._asking(what) for what in REQUESTS},
        }
        for name, callback in (
            (f'{GATE_OWNER}/holding_at', self._on_holding),
            ('inhibition_state', self._on_inhibition),
            ('inhibition_gains', self._on_gains),
            ('body_mode', self._on_body_mode),
            ('/clock', self._on_clock),
        ):
            topic = interface(name)
            if name != '/clock' or not lock_step:
                self.create_subscription(topic.type, topic.name, callback, topic.reader_qos)

    def connected(self) -> bool:
        """Whether the gate, the readers of commands and the service are there."""
        services = (self._inhibit, *self._modes.values())
        return (
            self._gate.get_subscription_count() > 0
            and all(client.service_is_ready() for client in services)
            and self._setter.connected()
            and all(topic.connected() for topic in self._topics)
        )

    def begin(self) -> None:
        """Begin with the first tick."""
        self._begun = True
        if self._lock_step:
            self._continue()
        else:
            self._open(FAR_NS)

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
            self._continue()

    def _continue(self) -> None:
        """Deliver what acts at the held tick once all nodes have finished the tick before, then
        open the gate.
        """
        if (
            not self._begun
            or not self._lock_step
            or self._holding_ns < 0
            or self._busy
            or self.finished.done()
        ):
            return
        if self._holding_ns > 0 and self._inhibition_ns < self._holding_ns - self._tick_ns:
            return
        self.time_ns = self._holding_ns
        if self.time_ns >= self._end_ns:
            self.finished.set_result(None)
            return
        if self._deliver_due():
            return
        following = (
            self._actions[self._next].time_ns if self._next < len(self._actions) else self._end_ns
        )
        self._holding_ns = -1
        self._open(min(following, self._end_ns) - self._tick_ns)

    def _deliver_due(self) -> bool:
        """Deliver due actions; returns whether one is under way and will call back."""
        while (
            self._next < len(self._actions) and self._actions[self._next].time_ns <= self.time_ns
        ):
            action = self._actions[self._next]
            self._next += 1
            if action.label:
                self._say(self.time_ns * 1e-9, f'> {action.label}')
            self._busy = True
            self._deliver[action.kind](action.value)
            return True
        return False

    def _send(self, command: Command) -> None:
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = command
        self._commands.send(message)
        self._finish(self._commands)

    def _push(self, push: Push) -> None:
        """Send the push's forces at once; the robot applies each at its stamp."""
        start_ns = self.time_ns if self._lock_step else self.time_ns + LEAD_NS
        for force in push.forces(start_ns, self._tick_ns):
            message = WrenchStamped()
            set_stamp(message.header.stamp, force.time_ns)
            message.header.frame_id = force.frame
            vector = message.wrench.force
            vector.x, vector.y, vector.z = force.force
            self._pushes.send(message)
        self._finish(self._pushes)

    def _vote(self, weights: dict[str, float]) -> None:
        message = JointState(
            name=[f'scenario/{leg}' for leg in weights], effort=list(weights.values()))
        self._votes.send(message)
        self._finish(self._votes)

    def _finish(self, topic: AcknowledgedTopic) -> None:
        """Go on: in lock-step when all readers have what was sent."""
        if self._lock_step:
            topic.when_taken(self._delivered)
        else:
            self._delivered()

    def _delivered(self) -> None:
        self._busy = False
        if self._lock_step:
            self._continue()
        else:
            self._deliver_due()

    def _call_inhibit(self, stop: bool) -> None:
        request = SetBool.Request(data=stop)
        self._inhibit.call_async(request).add_done_callback(self._answered)

    def _answered(self, future: Future) -> None:
        answer = future.result()
        if answer is None or not answer.success:
            self._fail(f'service inhibit: {"no answer" if answer is None else answer.message}')
            return
        self._say(self.time_ns * 1e-9, f'  inhibit: {answer.message}')
        self._delivered()

    def _asking(self, what: str) -> Callable[[Any], None]:
        """What delivers a request to stand up, lie down or recover."""

        def answered(future: Future) -> None:
            answer = future.result()
            if answer is None or not answer.success:
                self._fail(f'service {what}: {"no answer" if answer is None else answer.message}')
                return
            self._say(self.time_ns * 1e-9, f'  {what}: {answer.message}')
            self._delivered()

        def ask(_: Any) -> None:
            self._modes[what].call_async(Trigger.Request()).add_done_callback(answered)

        return ask

    def _on_body_mode(self, message: String) -> None:
        mode = read_body_mode(message)
        if mode != self.mode:
            known, self.mode = self.mode, mode
            if known or mode != 'standing':
                self._say(self.time_ns * 1e-9, mode)

    def _set(self, values: dict[str, Any]) -> None:
        """Ask the owner for a change; the robot walks on when it is refused."""

        def done(refusal: str) -> None:
            self._say(self.time_ns * 1e-9, f'  refused: {refusal}' if refusal else '  accepted')
            self._delivered()

        self._setter.set(values, done)

    # Real time -----------------------------------------------------------------------------------

    def _on_clock(self, message: Clock) -> None:
        self.time_ns = stamp_ns(message.clock)
        if not self._begun or self.finished.done():
            return
        if self.time_ns >= self._end_ns:
            self.finished.set_result(None)
        elif not self._busy:
            self._deliver_due()

    # Inside --------------------------------------------------------------------------------------

    def _open(self, until_ns: int) -> None:
        message: Any = Clock()
        set_stamp(message.clock, until_ns)
        self._gate.publish(message)

    def _fail(self, text: str) -> None:
        if not self.finished.done():
            self.finished.set_exception(PlayerError(text))
