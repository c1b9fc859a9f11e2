# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bare relays: what the messages of the suite cost when nobody computes anything.

``rclpy`` nodes in the suite's places pass on recorded messages: the same types, sizes, qualities
of service, executor and scheduling, in the same numbers of processes; each waits for what its
place waits for. The robot's place steps MuJoCo, always from the same state, for no robot is
simulated without. Run as a program, its arguments are names of nodes; it says ``connected``, the
robot begins at the first line of the input, and everything ends where the input does.
"""

from __future__ import annotations

import argparse
import json
import struct
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from dmp_cpg_ros.core.estimation.parameters import StateSourceParameters
from dmp_cpg_ros.nodes.framework import execution, middleware
from dmp_cpg_ros.nodes.framework.health import RobotTiming
from dmp_cpg_ros.nodes.framework.parameters import BATCH
from dmp_cpg_ros.nodes.messages import interfaces
from dmp_cpg_ros.suite_table import KIND_OF, KINDS, POSTURE, RECORDED_WALK, RECORDER, ROBOT

STAMP = struct.Struct('<iI')
STAMP_AT = 4
"""A message with a stamp begins with it, behind the four bytes that say how it is encoded."""

DELAYED = ('inhibition_gains',)
"""What acts one tick later; in lock-step it comes at every tick."""

SOURCE = 'source'
"""Name of the relay that writes everything itself, for a recorder."""

SECOND, LOOK_S = 1_000_000_000, 0.02
"""One second [ns]; how often relays look whether they are connected [s]."""

STEADY = Clock(clock_type=ClockType.STEADY_TIME)


class Sample(NamedTuple):
    """A message of a topic, and how many each of its writers sends in a tick."""

    data: bytes
    per_tick: float


Samples = Mapping[str, Sample]


def samples(run: Path) -> dict[str, Sample]:
    """Messages of a recorded run that come at least once in a hundred ticks, by topic."""
    from dmp_cpg_ros.analysis.bag import find_bag, opened, recorded  # not in every relay

    with opened(find_bag(run)) as reader:
        counts = {of.topic.strip('/'): of.msgcount for of in reader.connections}
        last = {of.topic.strip('/'): bytes(raw)
                for of, _, raw in recorded(reader, reader.connections)}
    found = {topic.name: (topic.name.strip('/'), writers(topic)) for topic in interfaces.RECORDED}
    shares = {name: counts[short] / many / counts['joint_states']
              for name, (short, many) in found.items() if short in last and many}
    return {name: Sample(last[found[name][0]], share)
            for name, share in shares.items() if share >= 0.01}


def writers(topic: interfaces.Interface) -> int:
    """Number of nodes that write a topic."""
    return interfaces.expected_count(topic.publishers)


def reads(kind: str, topic: interfaces.Interface) -> bool:
    """Whether a kind of node reads a topic as the parameters are by default."""
    body = interfaces.BODY_TOPICS[StateSourceParameters().state_source]
    return kind in RECORDED_WALK and topic in interfaces.read_by(kind) and (
        kind not in topic.sometimes or (kind == POSTURE and topic.name in body))


def messages_per_tick(known: Samples, kind: str) -> tuple[float, float]:
    """Messages that a node of a kind sends and takes in one tick."""
    topics = {interfaces.interface(name): sample.per_tick for name, sample in known.items()}
    return (sum(share for topic, share in topics.items() if kind in topic.publishers),
            sum(share * writers(topic) for topic, share in topics.items() if reads(kind, topic)))


class Relay(Node):
    """Publishes what its place does when all is there that its place waits for.

    Parameters
    ----------
    name : str
        Of the node in the suite, or ``SOURCE``.
    known : mapping of str to Sample
        What is sent.
    tick_ns : int
        Control tick [ns].
    lock_step : bool
        Whether the robot waits for its targets.
    """

    def __init__(self, name: str, known: Samples, tick_ns: int, lock_step: bool) -> None:
        super().__init__(name, namespace='relays', enable_rosout=False,
                         start_parameter_services=False)
        self.tick_ns, self.lock_step, self.taken = tick_ns, lock_step, 0
        self._wanted, self._waiting = 0, Counter[int]()
        self._ends: list[Callable[[], bool]] = []
        self._outputs: list[tuple[Callable[[bytes], None], bytearray, int]] = []
        kind = KIND_OF.get(name, name)
        for topic in map(interfaces.interface, known):
            data, per_tick = known[topic.name]
            if kind in (*topic.publishers, SOURCE):
                publisher = self.create_publisher(
                    topic.type, topic.name.strip('/'), topic.publisher_qos)
                readers = [of for of in KINDS if reads(of, topic)]
                self._expect(publisher.get_subscription_count, 1 if kind == SOURCE else
                             interfaces.expected_count(readers))
                self._outputs += [(publisher.publish, bytearray(data), round(1.0 / per_tick))] * (
                    writers(topic) if kind == SOURCE else 1)
            if kind != SOURCE and reads(kind, topic):
                waits = per_tick > 0.9 and kind != RECORDER
                subscription = self.create_subscription(
                    topic.type, topic.name.strip('/'),
                    partial(self._match, topic.name) if waits else self._take,
                    topic.recorder_qos if kind == RECORDER else topic.reader_qos, raw=True)
                self._expect(subscription.get_publisher_count,
                             writers(topic) if waits else 1)
                self._wanted += writers(topic) * waits
                # nothing comes before the first tick
                self._waiting[0] += waits and topic.name in DELAYED

    def _expect(self, count: Callable[[], int], least: int) -> None:
        self._ends.append(lambda: count() >= least)

    def connected(self) -> bool:
        """Whether every end has its partners."""
        return all(end() for end in self._ends)

    def begin(self) -> None:
        """Go on without a first message; only the robot does."""

    def _take(self, data: bytes) -> None:
        self.taken += 1

    def _match(self, topic: str, data: bytes) -> None:
        self.taken += 1
        seconds, rest = STAMP.unpack_from(data, STAMP_AT)
        stamp_ns = seconds * SECOND + rest + (self.tick_ns if topic in DELAYED else 0)
        self._waiting[stamp_ns] += 1
        self.arrived(stamp_ns)
        if self._waiting[stamp_ns] == self._wanted:
            del self._waiting[stamp_ns]
            self.fire(stamp_ns)

    def arrived(self, stamp_ns: int) -> None:
        """Note one message of a tick; only the robot does."""

    def fire(self, stamp_ns: int) -> None:
        """Publish the messages of a tick."""
        for publish, data, every in self._outputs:
            if stamp_ns // self.tick_ns % every == 0:
                STAMP.pack_into(data, STAMP_AT, *divmod(stamp_ns, SECOND))
                publish(bytes(data))


class RobotRelay(Relay):
    """The robot's place: it begins, keeps the pace and measures."""

    def begin(self) -> None:
        """Start with time 0."""
        self._timing, self._now = RobotTiming(), 0
        self._physics = physics(self.tick_ns)
        self._publish()
        if not self.lock_step:
            self._begun = time.monotonic_ns()
            self.create_timer(self.tick_ns * 1e-9, self._on_timer, clock=STEADY)

    def arrived(self, stamp_ns: int) -> None:
        """Note the targets of a leg."""
        self._timing.arrived(stamp_ns)

    def fire(self, stamp_ns: int) -> None:
        """All targets of a tick are there."""
        if self.lock_step:
            self._step()

    def _on_timer(self) -> None:
        for _ in range(2):  # as the robot itself
            if time.monotonic_ns() - self._begun - self._now >= self.tick_ns // 2:
                self._timing.deadline(self._now)
                self._step()

    def _step(self) -> None:
        self._physics()
        self._now += self.tick_ns
        self._publish()

    def _publish(self) -> None:
        self._timing.published(self._now)
        super().fire(self._now)
        if self._now % SECOND == 0:
            print(json.dumps([self._now * 1e-9, self._timing.values()]), flush=True)


class SourceRelay(Relay):
    """Writes what all nodes do, at the pace of the clock, for a while."""

    seconds = 1.0

    def begin(self) -> None:
        """Start with time 0."""
        self._next, self._begun = 0, time.monotonic_ns()
        self.create_timer(1e-3, self._on_timer, clock=STEADY)

    def _on_timer(self) -> None:
        now = time.monotonic_ns()
        due = min(now - self._begun, round(self.seconds * SECOND))
        while self._next <= due and time.monotonic_ns() < now + SECOND // 10:
            self.fire(self._next)
            self.taken += sum(self._next // self.tick_ns % every == 0
                              for _, _, every in self._outputs)
            self._next += self.tick_ns


def physics(tick_ns: int) -> Callable[[], None]:
    """What steps MuJoCo alone by one tick, always from the state of a robot that stands."""
    import mujoco

    from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

    robot = MujocoRobot(tick_ns=tick_ns)
    model, data = robot.model, robot.data
    position, velocity = data.qpos.copy(), data.qvel.copy()
    steps = tick_ns // round(model.opt.timestep * 1e9)

    def step() -> None:
        data.qpos[:], data.qvel[:] = position, velocity
        for _ in range(steps):
            mujoco.mj_step(model, data)

    return step


def main(arguments: Sequence[str] | None = None) -> int:
    """Run some relays; returns the exit status."""
    parser = argparse.ArgumentParser(prog='relays', description=__doc__)
    parser.add_argument('names', nargs='+')
    parser.add_argument('--samples', type=Path, required=True, help='JSON of what is sent')
    parser.add_argument('--rate', type=float, default=250.0)
    parser.add_argument('--lock-step', action='store_true')
    parser.add_argument('--seconds', type=float, default=1.0, help='how long the source writes')
    options = parser.parse_args(arguments)
    middleware.prepare_middleware()
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    SourceRelay.seconds = options.seconds
    kinds = {ROBOT: RobotRelay, SOURCE: SourceRelay}
    known = {name: Sample(bytes.fromhex(data), per_tick) for name, (data, per_tick)
             in json.loads(options.samples.read_text(encoding='utf-8')).items()}
    nodes = [kinds.get(name, Relay)(name, known, round(SECOND / options.rate), options.lock_step)
             for name in options.names]
    asked, until, said = threading.Event(), Future(), set[str]()

    def listen() -> None:
        if sys.stdin.readline():
            asked.set()
            sys.stdin.readline()
        until.set_result(None)

    def look() -> None:
        if 'connected' not in said and all(node.connected() for node in nodes):
            said.add('connected')
            print('connected', flush=True)
        if asked.is_set():
            nodes[0].destroy_timer(timer)
            for node in nodes:
                node.begin()

    timer: Any = nodes[0].create_timer(LOOK_S, look, clock=STEADY)
    threading.Thread(target=listen, daemon=True).start()
    execution.schedule(BATCH)
    execution.spin(nodes, 'events', until)
    print(json.dumps([None, {'taken': sum(node.taken for node in nodes)}]), flush=True)
    rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
