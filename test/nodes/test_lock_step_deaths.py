# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A model of the suite in lock-step: nodes that die at any moment, and are restarted in any order,
never wait for each other for ever, and the gait shows nothing of it.

Each node is what it waits for (:class:`TickInputs`) and counts its ticks. Messages of one writer
to one reader keep their order; all else is drawn, also which of the last ones of a node that dies
are lost. Where nothing is under way any more the robot tells its last two ticks again.
"""

from __future__ import annotations

import random
from collections import deque
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.framework.ticks import TickInputs

ROBOT, REFERENCE, CANONICAL, INHIBITION = 'robot', 'reference', 'canonical', 'inhibition'

BY_CANONICAL = ('canonical_state', 'reference', 'feedback')

WIRING: dict[str, tuple[tuple[str, ...], tuple[str, ...], str]] = {
    REFERENCE: (('sensed',), ('gains',), 'reference'),
    CANONICAL: (('reference',), ('gains',), 'canonical_state'),
    'posture': (('canonical_state', 'reference', 'sensed'), (), 'feedback'),
    INHIBITION: (BY_CANONICAL, (), 'gains'),
    **{leg: (BY_CANONICAL, (), f'targets_{leg}') for leg in LEGS},
}
"""Inputs of each node, the trigger first, those that act a tick later, and what it says."""

READERS = {topic: [name for name, (inputs, delayed, _) in WIRING.items()
                   if topic in (*inputs, *delayed)] or [ROBOT]
           for topic in ('sensed', *(output for *_, output in WIRING.values()))}
READERS['memory'] = [REFERENCE, CANONICAL]

KEPT = {'gains': 100, 'memory': 1}
"""What a latched topic keeps for who comes late."""

ASKS = 15
"""How often the robot tells its ticks again until the walk counts as hung."""


class Node:
    """What a node waits for, and the ticks that it has counted; stamps are ticks here."""

    def __init__(self, suite: Suite, name: str) -> None:
        inputs, delayed, self.output = WIRING[name]
        self.suite, self.name, self.count = suite, name, 0
        self.begun, self.remembers = False, bool(delayed)
        self.memory: tuple[int, int] | None = None
        self.held: tuple[int, dict[str, Any]] | None = None
        self.said: dict[int, list[tuple[str, int, Any]]] = {}
        self.inputs = TickInputs(self.run, inputs, inputs[0], delayed=delayed, lock_step=True,
                                 on_repeat=self.repeat)

    def take(self, topic: str, stamp: int, value: Any) -> None:
        if topic == 'memory':
            self.memory = stamp, value
        else:
            self.inputs.add(topic, stamp, value)
        self.try_again()

    def try_again(self, patient: bool = True) -> None:
        held, self.held = self.held, None
        if held is not None:
            self.on_tick(*held, patient=patient)

    def run(self, stamp: int, values: dict[str, Any]) -> None:
        self.said = dict(sorted(self.said.items())[-1:])
        self.on_tick(stamp, values)

    def on_tick(self, stamp: int, values: dict[str, Any], patient: bool = True) -> None:
        first, self.begun = not self.begun, True
        if first and self.remembers and stamp > 0:
            if self.memory is not None and self.memory[0] > stamp:
                self.begun = False  # it has ended that tick before it died
                return
            values['gains'] = gains = self.inputs.before('gains', stamp)
            if patient and (self.memory is None or gains is None
                            or gains < min(self.memory[0], stamp - 1)):
                self.begun, self.held = False, (stamp, values)
                return
        if first and self.memory is not None:
            self.count = self.memory[1] + stamp - self.memory[0]
        else:
            self.count += stamp > 0
        if self.remembers and stamp > 0:
            self.suite.check(self, stamp, values['gains'])
        self.say(self.output, stamp, stamp if self.name == INHIBITION else self.count)
        if self.name == INHIBITION:
            self.suite.publish(self.name, 'memory', stamp, values['canonical_state'])

    def say(self, topic: str, stamp: int, value: int) -> None:
        self.said.setdefault(stamp, []).append((topic, stamp, value))
        self.suite.publish(self.name, topic, stamp, value)

    def repeat(self, stamp: int) -> None:
        last = self.inputs.last_ns
        for message in self.said.get(stamp if last is None else min(stamp, last), ()):
            self.suite.publish(self.name, *message)


class Suite:
    """All nodes, and what is under way between them."""

    def __init__(self, seed: int) -> None:
        self.draw, self.now = random.Random(seed), 0
        self.arrived: dict[str, int] = {}
        self.under_way: dict[tuple[str, str, str], deque[tuple[int, Any]]] = {}
        self.kept: dict[tuple[str, str], deque[tuple[int, Any]]] = {}
        self.forgotten = False  # where the gait was
        self.nodes = {name: Node(self, name) for name in WIRING}
        self.publish(ROBOT, 'sensed', 0, None)

    def check(self, node: Node, stamp: int, gains: int | None) -> None:
        """A node is where it would be if nobody had died, with the gains of the tick before."""
        again = node.memory is not None and node.memory[0] == stamp
        assert self.forgotten or (node.count == stamp and (again or gains == stamp - 1)), (
            f'{node.name} at {stamp}: {node.count}, gains of {gains}')

    def publish(self, writer: str, topic: str, stamp: int, value: Any) -> None:
        if topic in KEPT:
            self.kept.setdefault((writer, topic), deque(maxlen=KEPT[topic])).append(
                (stamp, value))
        for reader in READERS[topic]:
            if reader == ROBOT or reader in self.nodes:
                self.under_way.setdefault((writer, topic, reader), deque()).append((stamp, value))

    def deliver(self) -> bool:
        """Deliver a message; whether there was one."""
        waiting = [way for way, queue in self.under_way.items() if queue]
        if waiting:
            way = self.draw.choice(waiting)
            stamp, value = self.under_way[way].popleft()
            if way[2] == ROBOT:
                self.follow(way[1], stamp)
            else:
                self.nodes[way[2]].take(way[1], stamp, value)
        return bool(waiting)

    def follow(self, topic: str, stamp: int) -> None:
        self.arrived[topic] = stamp
        if all(self.arrived.get(f'targets_{leg}') == self.now for leg in LEGS):
            self.now += 1
            self.publish(ROBOT, 'sensed', self.now, None)

    def tell_again(self) -> None:
        """What the robot does when nothing happens any more; who waits for others has lost its
        patience by then.
        """
        for node in self.nodes.values():
            node.try_again(patient=False)
        for stamp in (self.now - 1, self.now)[self.now == 0:]:
            self.publish(ROBOT, 'sensed', stamp, None)

    def kill(self, names: list[str]) -> None:
        for name in names:
            del self.nodes[name]
            for way, queue in list(self.under_way.items()):
                if way[2] == name:
                    del self.under_way[way]
                elif way[0] == name:
                    for _ in range(self.draw.randint(0, len(queue))):
                        queue.pop()
            self.kept = {by: of for by, of in self.kept.items() if by[0] != name}
        self.forgotten |= INHIBITION in names and not {REFERENCE, CANONICAL}.isdisjoint(names)

    def restart(self, name: str) -> None:
        self.nodes[name] = Node(self, name)
        for (writer, topic), messages in self.kept.items():
            if name in READERS[topic]:
                self.under_way.setdefault((writer, topic, name), deque()).extend(messages)

    def deaths(self, most: int) -> None:
        """Let some die and come back while the others go on."""
        for _ in range(self.draw.randint(20, 200)):
            self.deliver()
        dead = self.draw.sample(sorted(WIRING), self.draw.randint(1, most))
        self.kill(dead)
        for name in dead:
            for _ in range(self.draw.randint(0, 60)):
                if not self.deliver() and self.draw.random() < 0.1:
                    self.tell_again()
            self.restart(name)

    def goes_on(self) -> bool:
        """Whether it walks on for some ticks."""
        until, asked = self.now + 4, 0
        while self.now < until and asked < ASKS:
            if not self.deliver():
                self.tell_again()
                asked += 1
        return self.now >= until


@pytest.mark.parametrize('most', [1, 2, 3, len(WIRING)])
@settings(max_examples=60)
@given(st.integers(0, 2 ** 32))
def test_in_lock_step_nodes_that_die_at_once_never_wait_for_each_other(
        most: int, seed: int) -> None:
    suite = Suite(seed)
    for _ in range(5):
        suite.deaths(most)
        assert suite.goes_on(), {
            name: node.inputs.awaited() for name, node in suite.nodes.items()}
