# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Delivery within a process: everything once, in the order of publication, never nested."""

from __future__ import annotations

import pytest

pytest.importorskip('rclpy')

from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery, SuitePublisher


class Outside:
    """Stands for a publisher of the middleware."""

    def __init__(self) -> None:
        self.messages: list[str] = []

    def publish(self, message: str) -> None:
        self.messages.append(message)


def test_messages_that_callbacks_publish_wait_for_their_turn() -> None:
    local, seen, depth = LocalDelivery(('a',)), [], [0]

    def relay(message: str) -> None:
        depth[0] += 1
        assert depth[0] == 1
        seen.append(('relay', message))
        local.publish('second', message + message)
        depth[0] -= 1

    local.attach('first', relay)
    local.attach('first', lambda message: seen.append(('witness', message)))
    local.attach('second', lambda message: seen.append(('end', message)))
    outside = Outside()
    SuitePublisher(outside, 'first', local).publish('x')  # type: ignore[arg-type]
    assert seen == [('relay', 'x'), ('witness', 'x'), ('end', 'xx')]
    assert outside.messages == ['x']


def test_who_comes_late_gets_what_is_latched_as_long_as_its_writer_is_there() -> None:
    local, seen = LocalDelivery(('a',)), []
    local.latch('latched')
    local.catch_up('latched', seen.append)
    for message in ('first', 'last'):
        for topic in ('latched', 'other'):
            local.publish(topic, message)
    for topic in ('latched', 'other'):
        local.catch_up(topic, seen.append)
    assert seen == ['last']
    local.unlatch('latched')
    local.catch_up('latched', seen.append)
    assert seen == ['last']


def test_an_error_does_not_leave_old_messages_behind() -> None:
    local, seen = LocalDelivery(('a',)), []

    def fail(message: str) -> None:
        raise RuntimeError(message)

    local.attach('topic', fail)
    local.attach('topic', seen.append)
    with pytest.raises(RuntimeError):
        local.publish('topic', 'old')
    local.detach(fail)
    local.publish('topic', 'new')
    assert seen == ['new']
