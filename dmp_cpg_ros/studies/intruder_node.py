# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node in the robot's ROS domain that listens, and publishes what it should not."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from math import atan2, cos, nan, remainder, sin, tau
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_srvs.srv import SetBool

from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.values import set_stamp
from dmp_cpg_ros.suite_table import ROBOT

NAME = 'intruder'
"""Its node; what ``/diagnostics`` must name."""

FLOODED, REJECTED = 'flooded by', 'rejected.'
"""What reports say of floods, and the name of what they have refused of a topic."""

HEAR_S = 2.0
"""Time after which a topic has nothing to say [s]."""


class Pose(NamedTuple):
    """Place of the base in the world [m] and its heading [rad] at a time of the robot [s]."""

    time_s: float
    x: float
    y: float
    z: float
    yaw: float


class Intruder(Node):  # type: ignore[misc]
    """A node that listens to the suite and publishes what it should not.

    It hears where the robot is, and a topic of the suite while it attacks with what it says there:
    reading everything takes as much of a core as four legs, from which a suite in as many
    processes as it has nodes falls behind on two cores without any attack.

    Attributes
    ----------
    begin, named : float
        When the attack began, and when a report of the suite first named it since [s]; NaN before.
    fell : bool
        Whether the robot has told a fall.
    sent : int
        Messages and requests so far.
    refused : dict of (str, str) to int
        Messages that nodes say they have refused, by node and topic.
    shutters : set of str
        Nodes that say they do not receive it any more.
    stop : Future or None
        Answer to the stop that was asked for in an attack.
    """

    def __init__(self, seed: int) -> None:
        """Listen to where the robot is, and to reports."""
        super().__init__(NAME)
        self.executor_ = SingleThreadedExecutor()
        self.executor_.add_node(self)
        self.draw = random.Random(seed)
        self.last: dict[str, bytes] = {}
        self.poses: list[Pose] = []
        self.begin, self.named, self.fell, self.sent = nan, nan, False, 0
        self.refused: dict[tuple[str, str], int] = {}
        self.shutters: set[str] = set()
        self.stop: Any = None
        self._inhibit = self.create_client(SetBool, 'inhibit')
        self._writers: dict[str, Any] = {}
        self._readers: dict[str, Any] = {}
        place = interface('ground_truth')
        self.create_subscription(place.type, place.name, self._on_place, 10, raw=True)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_report, 100)

    def hear(self, name: str) -> bool:
        """Listen to a topic until :meth:`leave`; whether it has said something."""
        if name not in self._readers:
            self.last.pop(name, None)
            self._readers[name] = self.create_subscription(
                interface(name).type, name, partial(self.last.__setitem__, name), 10, raw=True)
            end = time.monotonic() + HEAR_S
            while name not in self.last and time.monotonic() < end:
                self.spin(0.02)
        return name in self.last

    def _on_place(self, data: bytes) -> None:
        with suppress(rclpy_implementation.RMWError):  # its own garbage comes back
            odom = deserialize_message(data, Odometry)
            place, stamp, q = (odom.pose.pose.position, odom.header.stamp,
                               odom.pose.pose.orientation)
            if place.x == 0.0 == place.z:
                return
            yaw = 2.0 * atan2(q.z, q.w)  # of a body that is hardly tilted
            self.poses.append(Pose(stamp.sec + 1e-9 * stamp.nanosec, place.x, place.y, place.z,
                                   yaw))
            if len(self.poses) > 1000:
                del self.poses[:500]

    def _on_report(self, report: DiagnosticArray) -> None:
        for status in report.status:
            if NAME in status.message and self.named != self.named:
                self.named = time.monotonic()
            if FLOODED in status.message and NAME in status.message:
                self.shutters.add(status.name)
            self.refused.update(
                {(status.name, entry.key): int(entry.value) for entry in status.values
                 if entry.key.startswith(REJECTED)})
            self.fell |= status.name == ROBOT and any(entry.key == 'fell' and entry.value == 'true'
                             for entry in status.values)

    def spin(self, seconds: float) -> None:
        """Listen for some time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor_.spin_once(timeout_sec=max(0.0, end - time.monotonic()))

    def speed(self, seconds: float = 1.5) -> float:
        """Mean speed ahead over the last seconds of the robot's clock [m/s]."""
        if not self.poses:
            return nan
        end = self.poses[-1]
        begin = next(pose for pose in self.poses if pose.time_s >= end.time_s - seconds)
        passed_s = end.time_s - begin.time_s
        heading = begin.yaw + 0.5 * remainder(end.yaw - begin.yaw, tau)
        ahead = cos(heading) * (end.x - begin.x) + sin(heading) * (end.y - begin.y)
        return ahead / passed_s if passed_s > 0.0 else nan

    def publish(self, name: str, message: Any) -> None:
        """Publish a message, or its bytes, with the suite's own quality of service."""
        if name not in self._writers:
            topic = interface(name)
            self._writers[name] = self.create_publisher(
                topic.type, topic.name, topic.publisher_qos)
            self.spin(0.3)
        with suppress(rclpy_implementation.RCLError):  # bytes that this middleware does not send
            self._writers[name].publish(message)
            self.sent += 1

    def leave(self) -> None:
        """Destroy all publishers, and the readers of what was attacked."""
        for publisher in self._writers.values():
            self.destroy_publisher(publisher)
        for reader in self._readers.values():
            self.destroy_subscription(reader)
        self._writers, self._readers = {}, {}

    def repeat(self, seconds: float, rate: float, act: Callable[[], object]) -> None:
        """Do something at a rate [Hz], and listen in between."""
        begin, count = time.monotonic(), 0
        while time.monotonic() < begin + seconds:
            act()
            count += 1
            ahead = begin + count / rate - time.monotonic()
            if ahead > 0.0:
                self.spin(ahead)
            elif count % 20 == 0:
                self.executor_.spin_once(timeout_sec=0.0)

    def message(self, name: str) -> Any:
        """The last message of a topic."""
        return deserialize_message(self.last[name], interface(name).type)

    def changed(self, name: str, change: Callable[[Any], None]) -> None:
        """Publish the last message of a topic, changed."""
        if self.hear(name):
            with suppress(rclpy_implementation.RMWError):  # what it has heard last is its own
                message = self.message(name)
                change(message)
                self.publish(name, message)

    def stamp_ns(self) -> int:
        """Stamp of the last pose [ns]."""
        return round(self.poses[-1].time_s * 1e9) if self.poses else 0

    def stamped(self, name: str, stamp_ns: int) -> None:
        """Publish the last message of a topic with another stamp."""
        self.changed(name, lambda message: set_stamp(message.header.stamp, stamp_ns))

    def ask(self, inhibited: bool) -> Any:
        """Ask for a stop, or for its end, as a user may; returns the answer that is to come."""
        self._inhibit.wait_for_service(timeout_sec=2.0)
        return self._inhibit.call_async(SetBool.Request(data=inhibited))

    def call(self, kind: Any, name: str, requests: Sequence[Any], rate: float) -> None:
        """Send requests to a service at a rate and do not wait for the answers."""
        client = self.create_client(kind, name)
        client.wait_for_service(timeout_sec=2.0)
        left = list(requests)
        self.sent += len(left)
        self.repeat(len(left) / rate, rate, lambda: left and client.call_async(left.pop()))
        self.spin(0.2)
        self.destroy_client(client)
