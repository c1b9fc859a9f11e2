# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lays the robot down at the end of a real-time run, so that it does not drop."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String
from std_srvs.srv import Trigger

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.nodes.messages.conversions import read_body_mode
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.values import stamp_ns

PATIENCE_NS = 12_000_000_000
"""Time on the robot's clock within which it must lie [ns]: coming to rest, and the movement."""


class LyingDown:
    """Asks for ``lie_down`` and watches until the robot lies.

    Parameters
    ----------
    node : Node
        Whose topics and service it uses.
    say : callable (time_s, text)
        Told what happens.
    """

    def __init__(self, node: Node, say: Callable[[float, str], None]) -> None:
        """Create client and subscriptions; nothing is asked before :meth:`begin`."""
        self._say, self._time_ns, self._deadline_ns = say, 0, 0
        self._mode, self._done = '', Future()
        self._client = node.create_client(Trigger, interface('lie_down').name)
        for name, callback in (('body_mode', self._on_mode), ('/clock', self._on_clock)):
            topic = interface(name)
            node.create_subscription(topic.type, topic.name, callback, topic.reader_qos)

    def begin(self) -> Future:
        """Ask; the future holds how it ended, in words, once it has."""
        self._deadline_ns = self._time_ns + PATIENCE_NS
        if self._mode in ('lying', 'damped'):
            self._end(f'it is {self._mode}')
        else:
            self._client.call_async(Trigger.Request()).add_done_callback(self._answered)
        return self._done

    def _answered(self, future: Future) -> None:
        answer = future.result()
        if answer is None or not answer.success:
            self._end(f'refused: {"no answer" if answer is None else answer.message}')
        else:
            self._say(self._time_ns * 1e-9, f'  lie_down: {answer.message}')

    def _on_mode(self, message: String) -> None:
        try:
            self._mode = read_body_mode(message)
        except DataError:
            return
        if self._deadline_ns and self._mode in ('lying', 'damped'):
            self._end(f'it is {self._mode}')

    def _on_clock(self, message: Clock) -> None:
        self._time_ns = stamp_ns(message.clock)
        if self._deadline_ns and self._time_ns > self._deadline_ns:
            self._end(f'it is still {self._mode} after {PATIENCE_NS * 1e-9:g} s')

    def _end(self, how: str) -> None:
        if not self._done.done():
            self._done.set_result(how)
            self._say(self._time_ns * 1e-9, how)
