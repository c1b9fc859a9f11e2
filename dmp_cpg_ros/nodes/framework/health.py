# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says about itself: counts and problems, timing, connections.

Discovery is not symmetric in time: a reader may know a writer before the writer knows the reader,
and a reliable volatile writer sends nothing to readers that it does not know yet. So each node
answers for its own ends only: its expected partners are in the graph, and as many ends as the
graph shows are matched here.
"""

from __future__ import annotations

import math
import time
import zlib
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSCompatibility, qos_check_compatible
from rclpy.subscription import Subscription
from rclpy.task import Future
from std_srvs.srv import Trigger

from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.messages.interfaces import Interface, partners
from dmp_cpg_ros.nodes.messages.values import status_message
from dmp_cpg_ros.suite_table import KINDS

PERIOD_NS = 1_000_000_000
"""Time between reports on the robot's clock [ns]."""

LOG_EVERY_S = 5.0
"""Time after which a topic's next dropped message is logged again [s]."""


class NodeHealth:
    """Ticks, rejected messages and problems of one node.

    Parameters
    ----------
    name : str
        Name of the node.
    clock : callable () → float
        Steady time [s]: what is dropped may come while the robot's clock stands still.
    robot : str
        Namespace of the node, by which several robots are told apart.

    Attributes
    ----------
    ticks : int
        Ticks since the node was made.
    stamp_ns : int
        Stamp of the last tick [ns].
    rejected : dict of str to int
        Messages that were dropped, per topic; requests, per service.
    """

    def __init__(self, name: str, clock: Callable[[], float] = time.monotonic,
                 robot: str = '') -> None:
        """Start healthy; nodes report at different moments, so that no tick bears all reports."""
        self.name, self._clock, self._robot = name, clock, robot.strip('/')
        self.ticks = self.stamp_ns = 0
        self.rejected: dict[str, int] = {}
        self._recent: dict[str, tuple[bytes, str]] = {}
        self._logged: dict[str, float] = {}
        self._problems: dict[str, tuple[bytes, str]] = {}
        self._offset_ns = zlib.crc32(name.encode()) % PERIOD_NS
        self._period = -1

    def due(self) -> bool:
        """Whether a second of the robot's clock has begun since the last time this was true."""
        period = (self.stamp_ns + self._offset_ns) // PERIOD_NS
        if period == self._period:
            return False
        self._period = period
        return True

    def reject(self, topic: str, problem: str, *, error: bool = False) -> bool:
        """Count a dropped message; returns whether to log it: not again within ``LOG_EVERY_S``."""
        self.rejected[topic] = self.rejected.get(topic, 0) + 1
        self._recent[topic] = (_level(error), f'{topic}: {problem}')
        now, logged = self._clock(), self._logged.get(topic)
        if logged is not None and now < logged + LOG_EVERY_S:
            return False
        self._logged[topic] = now
        return True

    def set_problem(self, key: str, message: str, *, error: bool = False) -> bool:
        """Raise a warning (or error) that stays until it is cleared; returns whether it is new."""
        problem = (_level(error), message)
        new = self._problems.get(key) != problem
        self._problems[key] = problem
        return new

    def has_problem(self, key: str) -> bool:
        """Whether a warning is raised."""
        return key in self._problems

    def clear_problem(self, key: str) -> bool:
        """Withdraw a warning; returns whether there was one."""
        return self._problems.pop(key, None) is not None

    def forget_problems(self) -> None:
        """Withdraw all warnings: what would clear them has gone."""
        self._problems = {}

    def status(self, state: str, values: Mapping[str, Any], *, periodic: bool) -> DiagnosticArray:
        """Build the report.

        Parameters
        ----------
        state : str
            Lifecycle state.
        values : mapping of str to value
            What the node adds.
        periodic : bool
            Whether this report closes the second in which messages were rejected; later reports
            are healthy again.
        """
        # The lasting ones first.
        told = {**self._problems, **self._recent, **self._problems}.values()
        if periodic:
            self._recent = {}
        return status_message(
            self.name, self.stamp_ns, '; '.join(message for _, message in told) or state,
            {'state': state, 'ticks': self.ticks, 'last_stamp_ns': self.stamp_ns,
             **{f'rejected.{topic}': count for topic, count in self.rejected.items()}, **values},
            level=max((level for level, _ in told), default=DiagnosticStatus.OK),
            robot=self._robot)


def _level(error: bool) -> bytes:
    return bytes(DiagnosticStatus.ERROR if error else DiagnosticStatus.WARN)


BINS = 100.0
"""Bins of durations per factor of ten: each is 2.3 % wide."""


class Durations(Counter[int]):
    """How many durations fell into which bin; a difference of two is what came in between.

    Neither its memory nor the time that it takes to report grows with the length of a run.
    """

    def note(self, seconds: float) -> None:
        """Count a duration [s]; none is shorter than 1 µs."""
        self[round(BINS * math.log10(max(seconds, 1e-6)))] += 1

    def percentile(self, percent: float) -> float:
        """Duration that so many are not above [s]; NaN without any."""
        wanted, seen = 1e-2 * percent * self.total(), 0
        for bin_ in sorted(self):
            seen += self[bin_]
            if seen >= wanted:
                return math.pow(10.0, bin_ / BINS)
        return math.nan

    def __str__(self) -> str:
        return ' '.join(f'{bin_}:{count}' for bin_, count in sorted(self.items()))

    @classmethod
    def parse(cls, text: str) -> Durations:
        """Read what ``str`` has written."""
        pairs = (word.split(':') for word in text.split())
        return cls({int(bin_): int(count) for bin_, count in pairs})


class RobotTiming:
    """Measures on the machine's monotonic clock; nothing of it enters the gait.

    Attributes
    ----------
    ticks, misses, waits : int
        Ticks; those at which targets were missing; periods that the simulation let pass.
    latency, period : Durations
        From a state to the last of its targets; between states.
    """

    def __init__(self) -> None:
        """Start without any tick."""
        self._published: dict[int, list[float]] = {}
        self.latency, self.period = Durations(), Durations()
        self._first = self._last = (math.nan, 0)
        self.ticks = self.misses = self.waits = 0

    def published(self, stamp_ns: int) -> None:
        """Note that the state of a tick has been published."""
        now = time.monotonic()
        if self.ticks:
            self.period.note(now - self._last[0])
        self._last = (now, stamp_ns)
        self._first = self._first if self.ticks else self._last
        self.ticks += 1
        self._published[stamp_ns] = [now, 0.0]
        if len(self._published) > 64:
            del self._published[min(self._published)]

    def arrived(self, stamp_ns: int) -> None:
        """Note that a leg's targets of a tick have arrived."""
        entry = self._published.get(stamp_ns)
        if entry is None:
            return
        entry[1] += 1.0
        if entry[1] == len(LEGS):
            self.latency.note(time.monotonic() - entry[0])

    def deadline(self, stamp_ns: int) -> None:
        """Note that the tick after ``stamp_ns`` begins: its targets should have arrived."""
        entry = self._published.get(stamp_ns)
        if entry is not None and entry[1] < len(LEGS):
            self.misses += 1

    def values(self) -> dict[str, float | int | str]:
        """Rate [Hz], real-time factor, latency [ms] and misses since the start; NaN without
        ticks. ``latencies`` and ``periods`` are what :class:`Durations` writes.
        """
        wall = self._last[0] - self._first[0] or math.nan
        robot = (self._last[1] - self._first[1]) * 1e-9
        return {'deadline_misses': self.misses, 'waits': self.waits, 'timed_ticks': self.ticks,
                'rate_hz': (self.ticks - 1) / wall, 'real_time_factor': robot / wall,
                'latency_ms_p50': 1e3 * self.latency.percentile(50.0),
                'latency_ms_p99': 1e3 * self.latency.percentile(99.0),
                'latencies': str(self.latency), 'periods': str(self.period)}


ASK_AGAIN_S = 0.25, 2.0
"""Time after which a request without an answer is repeated, at first and at most [s]."""


NO_ANSWER = 'it does not answer'
"""What is said of nodes that say nothing."""

FAILED, LACKS = 'it failed in its tick at', 'it waits in its tick at'
"""What a node adds to its answer whose tick has not ended, before the time."""


class Intervals:
    """Growing intervals of wall time at which someone who waits says what for.

    Parameters
    ----------
    first_s : float
        The first of them [s]; each is twice as long as the one before.
    """

    def __init__(self, first_s: float = 1.0) -> None:
        """Begin the first."""
        self._length_s, self._end = first_s, time.monotonic() + first_s

    def due(self) -> bool:
        """Whether an interval has ended since the last time this was true."""
        now = time.monotonic()
        if now < self._end:
            return False
        self._length_s *= 2.0
        self._end = now + self._length_s
        return True


class ReadinessOfOthers:
    """Asks nodes whether they are ready, again and again until each has said so.

    Parameters
    ----------
    node : Node
        Who asks.
    names : iterable of str
        Names of nodes in its namespace.

    Attributes
    ----------
    said : dict of str to str
        What they answered last.
    """

    def __init__(self, node: Node, names: Iterable[str]) -> None:
        """Create the clients."""
        self._node = node
        self._clients = {name: node.create_client(Trigger, f'{name}/ready') for name in names}
        self._asked: dict[str, tuple[float, float, Future]] = {}
        self.said: dict[str, str] = {}

    def missing(self) -> list[str]:
        """Take answers and ask again, without waiting; returns who has not said yes, and why."""
        for name, client in list(self._clients.items()):
            asked_s, patience_s, future = self._asked.get(name, (-math.inf, 0.0, Future()))
            answer = future.result() if future.done() else None
            if answer is not None:
                self.said[name] = answer.message
            if answer is not None and answer.success:
                self._node.destroy_client(self._clients.pop(name))
                continue
            # A response is lost where the server does not know the client yet; it is late where
            # the machine is busy, and then the next one is waited for longer.
            now, (first_s, most_s) = time.monotonic(), ASK_AGAIN_S
            if (answer is not None or now > asked_s + patience_s) and client.service_is_ready():
                patience_s = min(2.0 * patience_s, most_s) if answer is None else 0.0
                client.remove_pending_request(future)
                self._asked[name] = (now, max(first_s, patience_s),
                                     client.call_async(Trigger.Request()))
        return [f'{name}: {self.said.get(name, NO_ANSWER)}' for name in self._clients]

    def end(self) -> None:
        """Ask no more."""
        for client in self._clients.values():
            self._node.destroy_client(client)
        self._clients = {}


def missing_connections(node: Node, kind: str,
                        outputs: Sequence[tuple[Interface, Sequence[str], Publisher]],
                        inputs: Sequence[tuple[Interface, Subscription]],
                        expected: Collection[str]) -> list[str]:
    """List what is missing.

    Parameters
    ----------
    node : Node
        The node.
    kind : str
        Its kind.
    outputs : sequence of (Interface, sequence of str, Publisher)
        Its publishers and the kinds of nodes that read them.
    inputs : sequence of (Interface, Subscription)
        Its subscriptions.
    expected : collection of str
        Kinds of nodes that take part; others are not waited for.

    Returns
    -------
    list of str
        One text per missing connection.
    """
    ends = [(topic, kinds, publisher, 'read', 'readers', publisher.get_subscription_count,
             node.get_subscriptions_info_by_topic) for topic, kinds, publisher in outputs]
    ends += [(topic, partners(topic, readers=False), subscription, 'published', 'publishers',
              subscription.get_publisher_count, node.get_publishers_info_by_topic)
             for topic, subscription in inputs]
    missing: list[str] = []
    for topic, kinds, own, done, words, matched, look in ends:
        others = look(own.topic_name)
        found = {other.node_name for other in others
                 if other.node_namespace == node.get_namespace()}
        absent = [name for other in kinds if other in expected and other != kind
                  for name in KINDS[other].instances if name not in found]
        missing += [f'{topic.name} is not {done} by {name}' for name in absent]
        pairs = [(own, other) if done == 'read' else (other, own) for other in others]
        known = sum(qos_check_compatible(offer.qos_profile, request.qos_profile)[0]
                    != QoSCompatibility.ERROR for offer, request in pairs)
        if not absent and matched() < known:
            missing.append(f'{topic.name} is not matched with all of its {known} {words}')
    return missing
