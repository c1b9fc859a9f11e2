# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The oscillators watched and judged while they run: alarms, and ticks that go on."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest

pytest.importorskip('rclpy')

import ros_processes
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.task import Future
from ros_processes import Ros

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges
from dmp_cpg_ros.nodes.canonical_oscillators import CanonicalOscillators
from dmp_cpg_ros.nodes.framework.judging import judge
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain

TICK_NS = 4_000_000


def test_a_disturbed_oscillator_raises_an_alarm_and_its_return_ends_it(ros: Ros) -> None:
    node = CanonicalOscillators(context=ros.context, parameter_overrides=[
        Parameter('start_inhibited', value=False)])
    ros.executor.add_node(node)
    node.start()
    diagnostics: list[DiagnosticArray] = ros.collect(DiagnosticArray, '/diagnostics')
    topic, writer = interface('reference'), ReferenceWriter()
    publisher = ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos)
    states = ros.collect(interface('canonical_state').type, 'canonical_state')
    ros.spin_until(lambda: publisher.get_subscription_count() == 1
                   and node.count_subscribers('canonical_state') == 1)
    reference, ahead = np.array([0.3, 0.0, 0.0]), np.array(((-0.5, 0.9), (-0.9, -0.5)))

    def run(count: int) -> None:
        for tick in range(node.health.ticks + 1, node.health.ticks + count + 1):
            publisher.publish(writer.fill(tick * TICK_NS, reference).serialized)
            ros.spin_until(partial(has_run, tick))

    def has_run(tick: int) -> bool:
        return bool(node.health.ticks == tick)

    def said(level: bytes, text: str) -> bool:
        return any(status.name == node.get_name() and status.level == level
                   and text in status.message
                   for message in diagnostics for status in message.status)

    run(20)
    assert not said(DiagnosticStatus.WARN, 'alarm')
    node._state.x[2] = ahead @ node._state.x[2]                  # leg rl is suddenly 2 rad ahead
    run(1)
    ros.spin_until(lambda: said(DiagnosticStatus.WARN, 'alarm: phase-lock error'))
    diagnostics.clear()
    for _ in range(30):                              # and something keeps it there
        node._state.x[2] = ahead @ node._state.x[2]
        run(1)
    ros.spin_until(lambda: said(DiagnosticStatus.ERROR, 'does not come back'))
    diagnostics.clear()
    run(150)
    ros.spin_until(lambda: said(DiagnosticStatus.OK, 'active'))
    status = diagnostics[-1].status[0]
    values = {entry.key: entry.value for entry in status.values}
    assert float(values['phase_error_rad']) <= float(values['phase_error_bound_rad'])
    ros.spin_until(lambda: bool(states))
    ros.executor.remove_node(node)
    node.close()
    node.destroy_node()


class Walking:
    """Oscillators that walk, one tick after the other, and the service that changes them."""

    def __init__(self, ros: Ros, **parameters: object) -> None:
        self._ros, self._sent = ros, 0
        self.node = CanonicalOscillators(context=ros.context, parameter_overrides=[
            Parameter(name, value=value) for name, value in
            {'start_inhibited': False, **parameters}.items()])
        ros.executor.add_node(self.node)
        self.node.start()
        topic, self._writer = interface('reference'), ReferenceWriter()
        self._publisher = ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self._client = ros.node.create_client(
            SetParametersAtomically, 'canonical_oscillators/set_parameters_atomically')
        ros.spin_until(lambda: self._publisher.get_subscription_count() == 1
                       and self.node.count_publishers('reference') == 1
                       and self._client.service_is_ready())
        # an answer to a later client proves that the earlier one is heard
        ros.call(GetParameters, 'canonical_oscillators/get_parameters', GetParameters.Request())

    def tick(self, count: int) -> None:
        for _ in range(count):
            self._sent += 1
            self._publisher.publish(
                self._writer.fill(self._sent * TICK_NS, np.array([0.3, 0.0, 0.0])).serialized)
            self._ros.spin_until(lambda: self.node.health.ticks == self._sent)

    def ask(self, **values: object) -> Future:
        return self._client.call_async(SetParametersAtomically.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]))

    def answer(self, asked: Future) -> tuple[bool, str]:
        self._ros.spin_until(asked.done)
        result = asked.result().result
        return result.successful, result.reason

    def change(self, **values: object) -> tuple[bool, str]:
        return self.answer(self.ask(**values))


@pytest.fixture
def walking(ros: Ros) -> Iterator[Walking]:
    found = Walking(ros)
    found.tick(2)
    yield found
    ros.executor.remove_node(found.node)
    found.node.close()
    found.node.destroy_node()


@contextmanager
def stopped_judge() -> Iterator[None]:
    """The process that judges does nothing meanwhile: as slow as one can be."""
    pid = judge().pid
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


def test_ticks_go_on_while_a_change_is_judged(walking: Walking) -> None:
    assert walking.change(coupling_gain=90.0) == (True, '')
    with stopped_judge():
        refused, accepted = walking.ask(cadence_scale=4.0), walking.ask(coupling_gain=80.0)
        walking.tick(50)
        assert not (refused.done() or accepted.done())
    successful, reason = walking.answer(refused)
    assert not successful and 'nearest value' in reason
    assert walking.answer(accepted) == (True, '')
    walking.tick(1)
    assert walking.node.get_parameter('coupling_gain').value == 80.0


def test_a_change_is_judged_by_what_the_ones_before_it_have_made(walking: Walking) -> None:
    assert walking.change(coupling_gain=90.0) == (True, '')
    with stopped_judge():
        weaker, path = walking.ask(coupling_gain=30.0), walking.ask(coupling_graph='path')
        walking.tick(1)
    assert walking.answer(weaker) == (True, '')
    successful, reason = walking.answer(path)
    assert not successful and 'what works: coupling_graph = ' in reason
    assert walking.change(coupling_gain=100.0, coupling_graph='path') == (True, '')


def test_a_verdict_that_comes_late_is_not_applied_to_another_cadence(walking: Walking) -> None:
    """For the cadence at which it was asked the change would be accepted."""
    slower = {'cadence_scale': 0.7, 'coupling_gain': 30.0}
    assert walking.change(**slower) == (True, '')
    assert walking.change(cadence_scale=1.0, coupling_gain=100.0) == (True, '')
    walking.tick(400)
    assert walking.change(cadence_scale=2.0) == (True, '')
    with stopped_judge():
        asked = walking.ask(**slower)
        walking.tick(600)
    successful, reason = walking.answer(asked)
    assert not successful and 'capture' in reason
    assert walking.node.get_parameter('cadence_scale').value == 2.0


def test_a_judge_that_dies_costs_ticks_and_no_answer(walking: Walking) -> None:
    assert walking.change(coupling_gain=90.0) == (True, '')
    with stopped_judge():
        asked = walking.ask(coupling_gain=80.0)
        walking.tick(1)
        os.kill(judge().pid, signal.SIGKILL)
    assert walking.answer(asked) == (True, '')
    assert walking.change(coupling_gain=70.0) == (True, '')


@pytest.mark.parametrize(('compute', 'reason'), [
    (partial(graph_from_edges, 2, ((0, 1),), 0.0), 'must have a positive definite'),
    (partial(int, 'no number'), 'ValueError')])
def test_a_judgement_that_fails_refuses_its_request_and_holds_up_no_other(
        walking: Walking, monkeypatch: pytest.MonkeyPatch, compute: partial[object], reason: str
        ) -> None:
    certified, failing = walking.node.certified, iter([(compute, list)])
    judges = certified.to_judge
    monkeypatch.setattr(certified, 'to_judge', lambda sets: next(failing, None) or judges(sets))
    asked, following = walking.ask(coupling_gain=80.0), walking.ask(coupling_gain=70.0)
    successful, told = walking.answer(asked)
    assert not successful and reason in told
    assert walking.answer(following) == (True, '')
    walking.tick(1)
    assert walking.node.get_parameter('coupling_gain').value == 70.0
