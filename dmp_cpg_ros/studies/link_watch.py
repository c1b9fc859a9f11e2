# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who sees on the robot's host how it walks, and says where to.

The truth, the drive's mode and the diagnostics of the robot come to it without the link; commands,
and what the controllers say, cross it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, nan
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.executors import Executor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.modes.falls import FALLEN_TILT
from dmp_cpg_ros.nodes.framework.health import Durations, ReadinessOfOthers
from dmp_cpg_ros.nodes.messages.interfaces import GATE_OWNER, interface
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.suite_table import ROBOT, WALKING_NODES

READY_WITHIN_S = 120.0
"""How long nodes may take to find each other across the link [s]."""

COMMAND_EVERY_S = 0.1
"""How often the command is repeated [s]: one that has been lost is worth nothing later."""

LOW = 0.7
"""Share of its first height below which a robot lies."""

FAR_NS = 10**18
"""Up to when the gate opens [ns]."""


def posture(tilt: float, height: float, first_height: float) -> str:
    """How a robot is, by its tilt [rad] and its height beside that at first: fallen, lying or
    standing.
    """
    if tilt > FALLEN_TILT:
        return 'fallen'
    return 'lying' if height < LOW * first_height else 'standing'


class WatchError(DmpCpgError):
    """The suite did not come up, or stands still."""


@dataclass
class Timing:
    """What the robot's diagnostics have counted so far.

    Attributes
    ----------
    ticks, carried : int
        At which the robot moved its joints, and at which it carried targets on that were late.
    latencies : Durations
        From a state to the last of its targets.
    """

    ticks: int = 0
    carried: int = 0
    latencies: Durations = field(default_factory=Durations)

    def since(self, before: Timing) -> Timing:
        """What has been counted after another report."""
        return Timing(self.ticks - before.ticks, self.carried - before.carried,
                      Durations(self.latencies - before.latencies))


class LinkWatch:
    """The node of the study.

    Parameters
    ----------
    node : Node
        On the robot's host.
    executor : Executor
        Runs it.
    alive : callable ()
        Called now and then; raises when a process has ended.

    Attributes
    ----------
    time_ns : int
        Of the robot; −1 before its first state.
    tilt, highest_tilt : float
        Of the body, now and ever [rad].
    travelled : list of (float, float)
        Time [s] and forward velocity [m/s] of every state.
    drive, body, stop : str
        Its drive's mode, its body's, and the state of the stop.
    said : list of (float, str)
        When the suite said what [s].
    timing : Timing
        By the robot's last report.
    """

    def __init__(self, node: Node, executor: Executor, alive: Callable[[], None]) -> None:
        """Listen."""
        self._node, self._executor, self._alive = node, executor, alive
        executor.add_node(node)
        self.time_ns, self.tilt, self.highest_tilt = -1, 0.0, 0.0
        self._height, self._first_height = nan, nan
        self.travelled: list[tuple[float, float]] = []
        self.drive = self.body = self.stop = ''
        self.said: list[tuple[float, str]] = []
        self._told: dict[str, str] = {}
        self.timing, self._command = Timing(), Twist()
        take = {'ground_truth': self._on_truth, '/diagnostics': self._on_diagnostics,
                'inhibition_state': self._on_stop, 'drive_mode': self._on_drive,
                'body_mode': self._on_body}
        for name, callback in take.items():
            topic = interface(name)
            node.create_subscription(topic.type, topic.name, callback, topic.reader_qos)
        self._commands, self._gate = (
            node.create_publisher(Twist, 'cmd_vel', 10),
            node.create_publisher(Clock, f'{GATE_OWNER}/advance_until', 10))

    @property
    def seconds(self) -> float:
        """Time of the robot [s]."""
        return self.time_ns * 1e-9

    @property
    def posture(self) -> str:
        """How the robot is: fallen, lying or standing."""
        return posture(self.tilt, self._height, self._first_height)

    def begin(self) -> None:
        """Wait until all nodes are ready, and let the robot's time begin."""
        others = ReadinessOfOthers(self._node, WALKING_NODES)
        deadline = time.monotonic() + READY_WITHIN_S
        while missing := others.missing():
            if time.monotonic() > deadline:
                raise WatchError(f'not ready within {READY_WITHIN_S:g} s: {"; ".join(missing)}')
            self._turn()
        gate = Clock()
        gate.clock.sec = FAR_NS // 10**9
        self._gate.publish(gate)
        self._node.create_timer(COMMAND_EVERY_S, lambda: self._commands.publish(self._command))

    def command(self, speed: float) -> None:
        """Ask for a forward speed [m/s] from now on."""
        self._command.linear.x = speed

    def run(self, seconds: float) -> None:
        """Let so much of the robot's time pass [s]."""
        end = max(0, self.time_ns) + round(seconds * 1e9)
        last_ns, deadline = self.time_ns, inf
        while self.time_ns < end:
            if self.time_ns != last_ns or deadline == inf:
                last_ns, deadline = self.time_ns, time.monotonic() + READY_WITHIN_S
            if time.monotonic() > deadline:
                raise WatchError(f'the robot stands still at {self.seconds:.3f} s')
            self._turn()

    def _turn(self) -> None:
        self._executor.spin_once(timeout_sec=COMMAND_EVERY_S)
        self._alive()

    def _say(self, name: str, text: str) -> None:
        if self._told.get(name) != text:
            self._told[name] = text
            self.said.append((self.seconds, f'{name}: {text}'))

    def _on_truth(self, message: Odometry) -> None:
        self.time_ns, pose = header_ns(message), message.pose.pose
        turned = pose.orientation
        upright = 1.0 - 2.0 * (turned.x**2 + turned.y**2)
        self.tilt = math.acos(min(1.0, max(-1.0, upright)))
        self.highest_tilt = max(self.highest_tilt, self.tilt)
        self._height = pose.position.z
        if math.isnan(self._first_height):
            self._first_height = self._height
        self.travelled.append((self.seconds, message.twist.twist.linear.x))

    def _on_drive(self, message: String) -> None:
        self.drive = message.data
        self._say('drive_mode', message.data)

    def _on_body(self, message: String) -> None:
        self.body = message.data
        self._say('body_mode', message.data)

    def _on_stop(self, message: DiagnosticArray) -> None:
        values = {entry.key: entry.value for entry in message.status[0].values}
        self.stop = message.status[0].message + (
            f' ({values["cause"]})' if values.get('cause') else '')
        self._say('inhibition_state', self.stop)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.level != DiagnosticStatus.OK:
                self._say(status.name, status.message)
            else:
                self._told.pop(status.name, None)
            if status.name == ROBOT:
                self._count({entry.key: entry.value for entry in status.values})

    def _count(self, values: dict[str, Any]) -> None:
        if 'latencies' in values:
            self.timing = Timing(int(values['guarded_ticks']), int(values['carried_ticks']),
                                 Durations.parse(values['latencies']))
