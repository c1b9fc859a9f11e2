# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The oscillators watched and judged while they run: alarms, and ticks that go on."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

pytest.importorskip('rclpy')

import ros_processes
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.parameter import Parameter
from ros_processes import Ros

from dmp_cpg_ros.nodes.canonical_oscillators import CanonicalOscillators
from dmp_cpg_ros.nodes.messages.conversions import ReferenceWriter
from dmp_cpg_ros.nodes.messages.interfaces import interface

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


def test_ticks_go_on_while_a_change_is_judged(ros: Ros) -> None:
    node = CanonicalOscillators(context=ros.context)
    node.start()
    topic, writer = interface('reference'), ReferenceWriter()
    publisher = ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos)
    ros.spin_until(lambda: publisher.get_subscription_count() == 1
                   and node.count_publishers('reference') == 1)
    sent = 0

    def judged() -> bool:
        """Nobody spins the node: what runs its ticks is the look for the nearest value."""
        nonlocal sent
        sent += 1
        publisher.publish(writer.fill(sent * TICK_NS, np.zeros(3)).serialized)
        (result,) = node.set_parameters([Parameter('cadence_scale', value=4.0)])
        assert not result.successful
        assert 'nearest value' in result.reason
        return bool(node.health.ticks > 0)

    ros.spin_until(judged)
    node.close()
    node.destroy_node()
