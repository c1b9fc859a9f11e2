# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""In real time a stop and a start are carried out as predicted, however long messages take."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import ros_processes
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from ros_processes import Ros
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool

from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.nodes.canonical_oscillators import CanonicalOscillators
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.inhibition import InhibitionNode
from dmp_cpg_ros.nodes.messages.inhibition import AnnouncedReader
from dmp_cpg_ros.nodes.reference_filter import ReferenceFilter

pytest.importorskip('mujoco')

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain
TICK_NS = 4_000_000
LATEST = 5
"""Ticks that a message may take within ``request_lead``."""


class Link:
    """Brings what ``inhibition`` tells to one reader, in its order, some ticks later."""

    def __init__(self, random: np.random.Generator, latest: int) -> None:
        self._random, self._latest = random, latest
        self._under_way: list[tuple[int, JointState]] = []
        self._reader = AnnouncedReader()
        self.heard: tuple[int, Any] | None = None

    def send(self, tick: int, message: bytes) -> None:
        before = self._under_way[-1][0] if self._under_way else 0
        arrives = tick + 1 + int(self._random.integers(self._latest + 1))
        self._under_way.append(
            (max(before, arrives), deserialize_message(message, JointState)))

    def bring(self, tick: int) -> None:
        while self._under_way and self._under_way[0][0] <= tick:
            _, message = self._under_way.pop(0)
            self.heard = (max(0, tick) * TICK_NS, self._reader.read(message))


class Gait:
    """Reference, oscillators and inhibition of a suite in real time, over two links."""

    def __init__(self, ros: Ros, seed: int, latest: int, lead: float) -> None:
        random = np.random.default_rng(seed)
        self.reference = ReferenceFilter('reference_filter', context=ros.context)
        self.canonical = CanonicalOscillators('canonical_oscillators', context=ros.context)
        self.inhibition = InhibitionNode(
            'inhibition', context=ros.context,
            parameter_overrides=[Parameter('request_lead', value=lead)])
        self.nodes: list[SuiteNode] = [self.reference, self.canonical, self.inhibition]
        self._links = Link(random, latest), Link(random, latest)
        self.ticks = -1
        for node in self.nodes:
            node.start()
            node.elapsed = 1e-9 * TICK_NS
        for link in self._links:
            publish = self.inhibition._told._gains_publisher.publish
            self.inhibition._told._gains_publisher.publish = (  # type: ignore[method-assign]
                lambda message, link=link, publish=publish: (
                    link.send(self.ticks, message.serialized), publish(message)))
        self.tick()  # of stamp 0: the first of a run

    def tick(self) -> None:
        self.ticks += 1
        stamp, links = self.ticks * TICK_NS, self._links
        for link in links:
            link.bring(self.ticks)
        for node in (self.reference, self.inhibition):
            node._gate.accept(0.5, 0.0, 0.1)
        for node in self.nodes:
            node.health.stamp_ns = stamp
        self.reference.on_tick(
            stamp, {'joint_states': None, 'inhibition_gains': links[0].heard})
        r = self.reference._r
        self.canonical.on_tick(stamp, {'reference': r, 'inhibition_gains': links[1].heard})
        state = self.canonical._state
        self.inhibition.on_tick(stamp, {
            'canonical_state': (state.x, state.x_dot, state.gait), 'reference': r,
            'posture_feedback': ('standing', None, None)})

    def missed(self, stop: bool) -> float:
        """Carry a request out; return by how much the prediction was missed [s]."""
        taken, answer = self.inhibition._take_request(SetBool.Request(data=stop))
        promise = self.inhibition._promises.latest
        assert taken and f'in {promise.predicted_s:.3f} s' in answer
        for _ in range(1000):
            self.tick()
            state = self.inhibition._state
            if state.state in (('at_rest',) if stop else ('walking', 'free')):
                break
        assert state.measured_s <= promise.bound_s
        return state.measured_s - promise.predicted_s

    def end(self) -> None:
        for node in self.nodes:
            node.destroy_node()


@pytest.mark.parametrize(('lead', 'kept'), [(1e-9 * TICK_NS * (LATEST + 1), True), (0.0, False)])
def test_requests_are_carried_out_as_predicted_whenever_they_are_heard_within_the_lead(
        ros: Ros, lead: float, kept: bool) -> None:
    gait = Gait(ros, 5, LATEST, lead)
    missed, random = [], np.random.default_rng(6)
    for _ in range(6):
        for _ in range(int(random.integers(100, 300))):  # at first a command starts the gait
            gait.tick()
        missed += [gait.missed(True), gait.missed(False)]
    assert (max(map(abs, missed)) < 1e-9) == kept
    gait.end()


def test_no_parameter_of_what_captures_changes_once_it_is_told_that_legs_may_be_caught(
        ros: Ros) -> None:
    gait = Gait(ros, 7, 0, 1e-9 * TICK_NS * 20)
    for _ in range(200):
        gait.tick()
    gait.inhibition._take_request(SetBool.Request(data=True))

    def refused() -> str:
        result = gait.canonical.set_parameters([Parameter('coupling_gain', value=90.0)])[0]
        return '' if result.successful else str(result.reason)

    while not gait.inhibition._state.armed:
        gait.tick()
    for _ in range(2):  # of the one it is told, and it is heard
        gait.tick()
    assert gait.inhibition._announced.latest.gains.any()
    assert not gait.canonical._inhibition.gains.any()
    assert 'while the legs are being captured' in refused()
    gait.end()


def test_no_coupling_changes_from_when_a_stop_is_heard_of_until_its_arming_is(ros: Ros) -> None:
    gait = Gait(ros, 8, LATEST, 1e-9 * TICK_NS * 20)
    for _ in range(200):
        gait.tick()
    gait.inhibition._take_request(SetBool.Request(data=True))
    told = 0
    while not gait.canonical._latest.gains.any():
        gait.tick()
        if not gait.canonical._latest.requested:
            continue
        result = gait.canonical.set_parameters([Parameter('coupling_gain', value=90.0)])[0]
        assert not result.successful and 'while' in result.reason
        told += gait.inhibition._announced.latest.gains.any()
    assert told > 0  # it was armed, and not heard of
    gait.end()


def test_a_stop_is_predicted_of_oscillators_that_have_not_heard_how_quick_they_are_to_be(
        ros: Ros) -> None:
    """Such as those that were away when a body that sways asked for quicker steps."""
    gait = Gait(ros, 8, 0, 1e-9 * TICK_NS * 20)
    for _ in range(200):
        gait.tick()
    inhibition = gait.inhibition
    pushed = replace(inhibition._announced.latest, quickness=1.6)
    inhibition._announced = Announced(pushed)
    inhibition._state = replace(inhibition._state, quickness=1.6)
    taken, answer = inhibition._take_request(SetBool.Request(data=True))
    assert taken and 'at rest in' in answer
    gait.tick()
    assert inhibition._acting_now().cadence == gait.canonical._state.gait.cadence_scale == 1.0
    gait.end()
