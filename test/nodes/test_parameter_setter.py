# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A change of parameters: followers are asked now and then, and not for ever."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip('rclpy')

import ros_processes
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from rclpy.task import Future
from ros_processes import Ros

from dmp_cpg_ros.core.suite_parameters import CANONICAL, INHIBITION, REFERENCE
from dmp_cpg_ros.nodes.framework import requests
from dmp_cpg_ros.nodes.framework.requests import ParameterSetter

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain


class Owner:
    """Accepts every change."""

    def call_async(self, request: SetParametersAtomically.Request) -> Future:
        return answered(SetParametersAtomically.Response(
            result=SetParametersResult(successful=True)))


class Follower:
    """Knows a coupling gain of 50 from a question on; or does not answer."""

    def __init__(self, knows_at: float, answers: bool = True) -> None:
        self.knows_at, self.answers, self.asked = knows_at, answers, 0

    def call_async(self, request: GetParameters.Request) -> Future:
        self.asked += 1
        gain = Parameter('coupling_gain', value=50.0 if self.asked >= self.knows_at else 100.0)
        return answered(GetParameters.Response(values=[
            gain.get_parameter_value()])) if self.answers else Future()


def answered(response: Any) -> Future:
    future = Future()
    future.set_result(response)
    return future


def change(ros: Ros, reference: Follower, inhibition: Follower) -> list[str]:
    """What is told of a change of the coupling gain until it has ended."""
    setter, told = ParameterSetter(ros.node), list[str]()
    setter._setters = {CANONICAL: Owner()}
    setter._getters = {REFERENCE: reference, INHIBITION: inhibition}
    setter.set({'coupling_gain': 50.0}, told.append)
    ros.spin_until(lambda: bool(told))
    for _ in range(5):
        ros.executor.spin_once(timeout_sec=0.0)
    return told


def test_followers_are_asked_until_they_know(ros: Ros) -> None:
    quick, slow = Follower(1), Follower(3)
    assert change(ros, slow, quick) == ['']
    assert (slow.asked, quick.asked) == (3, 1)


@pytest.mark.parametrize('answers', [True, False])
def test_who_does_not_follow_is_named(ros: Ros, monkeypatch: pytest.MonkeyPatch, answers: bool
                                      ) -> None:
    monkeypatch.setattr(requests, 'PATIENCE_S', 0.2)
    assert change(ros, Follower(1), Follower(float('inf'), answers)) == [
        f'{INHIBITION} does not follow']


class Clockwork:
    """A node whose timer runs out when the test says so, also after it was destroyed."""

    def create_timer(self, period_s: float, run_out: Any, clock: Any) -> Any:
        self.run_out = run_out
        return object()

    def destroy_timer(self, timer: Any) -> None:
        pass


class Postman:
    """Has every answer at once, and hands it over when the test says so."""

    def __init__(self) -> None:
        self.letters: list[Any] = []

    def call_async(self, request: GetParameters.Request) -> Postman:
        return self

    def done(self) -> bool:
        return True

    def result(self) -> GetParameters.Response:
        return Follower(1).call_async(GetParameters.Request()).result()

    def add_done_callback(self, hand_over: Any) -> None:
        self.letters.append(hand_over)


def test_an_answer_that_is_there_is_not_asked_for_again_nor_counted_for_another() -> None:
    node, reference, inhibition, told = Clockwork(), Postman(), Postman(), list[str]()
    setter = ParameterSetter.__new__(ParameterSetter)
    setter._node, setter._timer = node, None
    setter._getters = {REFERENCE: reference, INHIBITION: inhibition}
    setter._await([REFERENCE, INHIBITION], {'coupling_gain': 50.0}, told.append)
    node.run_out()
    assert len(reference.letters) == 1 and not inhibition.letters
    reference.letters[0](reference)
    node.run_out()
    assert len(inhibition.letters) == 1 and not told
    inhibition.letters[0](inhibition)
    node.run_out()
    assert told == [''] and len(inhibition.letters) == 1
