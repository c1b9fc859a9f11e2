# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that are deactivated, cleaned up and brought up again, with nothing of before."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from collections.abc import Iterator
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
import ros_processes
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from ros_processes import Ros
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.nodes.canonical_oscillators import CanonicalOscillators
from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.inhibition import InhibitionNode
from dmp_cpg_ros.nodes.messages.inhibition import inhibition_state
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.nodes.mujoco_robot import MujocoRobotNode
from dmp_cpg_ros.nodes.reference_filter import ReferenceFilter
from dmp_cpg_ros.suite_table import KINDS

ros, ros_domain = ros_processes.ros, ros_processes.ros_domain

BURST, LARGE = 1900, JointState(name=['x' * 1000] * 20)
"""So many of these messages no socket has room for."""


def made(ros: Ros, node_class: type[SuiteNode], **parameters: Any) -> Any:
    """A node of the test that does nothing yet."""
    node = node_class(context=ros.context, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])
    ros.nodes.append(node)
    return node


def begin_anew(node: SuiteNode) -> None:
    """Through all states and back to ``active``."""
    clean_up(node)
    node.start()


def clean_up(node: SuiteNode) -> None:
    """From ``active`` to ``unconfigured``."""
    for transition in (node.trigger_deactivate, node.trigger_cleanup):
        assert transition() == TransitionCallbackReturn.SUCCESS


@pytest.mark.parametrize(('kind', 'lock_step'), [
    (kind, lock_step) for kind, row in KINDS.items() for lock_step in (False, True)
    if not lock_step or kind not in ('bag_recorder', 'ros2_control_driver')])
def test_a_node_that_begins_anew_leaves_nothing_behind(
        ros: Ros, tmp_path: Path, kind: str, lock_step: bool) -> None:
    parameters: dict[str, Any] = {'lock_step': True} if lock_step else {}
    if kind == 'bag_recorder':
        parameters['output'] = str(tmp_path / 'bag')
    node = made(ros, getattr(import_module(KINDS[kind].module), KINDS[kind].class_name),
                **parameters)

    def entities() -> list[int]:
        return [len(list(entries)) for entries in (
            node.publishers, node._subscriptions, node.services, node.clients, node.timers,
            node.waitables)]

    idle = entities()
    node.start()
    active = entities()
    for _ in range(3):
        begin_anew(node)
        assert entities() == active
    clean_up(node)
    assert entities() == idle


def test_a_robot_whose_gate_is_open_goes_on_when_it_is_activated_again(ros: Ros) -> None:
    robot = made(ros, MujocoRobotNode, physics='perfect_tracking', gated=True)
    robot.start()
    ros.executor.add_node(robot)
    opened = Clock()
    opened.clock.sec = 3600
    robot._on_advance(opened)
    for _ in range(2):
        then = robot.health.stamp_ns
        ros.spin_until(lambda then=then: robot.health.stamp_ns > then)
        robot.trigger_deactivate()
        robot.trigger_activate()


@pytest.mark.parametrize('voting', [False, True])
def test_in_lock_step_a_robot_tells_what_it_senses_in_two_ticks_again(
        ros: Ros, voting: bool) -> None:
    """The inhibition, whose gains act one tick later, may have died before its tick ended, with
    the posture, which it waits for.
    """
    robot = made(ros, MujocoRobotNode, gated=True, lock_step=True, voting=voting)
    told = list[Any]()
    robot.start()
    robot._publish_state()
    robot._step()
    robot._publish_state()
    sensed = ('imu', 'foot_contacts', 'joint_states')            # what a tick begins with last
    for name in sensed:
        robot._state_publishers[name].publish = (
            lambda message, name=name: told.append((name, header_ns(message))))
    again = Clock()
    robot._open_until = 0
    robot._on_advance(again)
    assert told == [(name, stamp) for stamp in (0, robot._tick_ns) for name in sensed]


def _read(domain: int, told: Any, wanted: dict[str, int]) -> None:
    """Read topics in another process, tell that it does, and then how much has come of each."""
    with ros_processes.joined(domain) as reader:
        heard = {name: reader.collect(interface(name).type, name, interface(name).recorder_qos,
                                      raw=True) for name in wanted}
        told.send('reads')

        def counts() -> dict[str, int]:
            return {name: len(messages) for name, messages in heard.items()}

        with contextlib.suppress(pytest.fail.Exception):
            reader.spin_until(lambda: counts() == wanted)
        told.send(counts())


@contextlib.contextmanager
def reading(domain: int, **wanted: int) -> Iterator[tuple[Any, int]]:
    """A process that reads, with what it tells and its number."""
    apart = get_context('spawn')
    told, tells = apart.Pipe()
    process = apart.Process(target=_read, args=(domain, tells, wanted), daemon=True)
    process.start()
    assert told.recv() == 'reads' and process.pid is not None
    yield told, process.pid
    process.join()


def publisher_of(ros: Ros, node: Any, topic: str) -> Any:
    """A node's publisher, once it is read."""
    publisher = next(of for of in node.publishers if of.topic.endswith(topic))
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)
    return publisher


def test_what_a_node_has_said_is_heard_before_its_publishers_go(
        ros: Ros, ros_domain: int) -> None:
    """A reader that has lost something of a burst asks for it again, and had nobody to ask."""
    with reading(ros_domain, canonical_state=BURST) as (told, _):
        node = made(ros, CanonicalOscillators)
        node.start()
        publisher = publisher_of(ros, node, 'canonical_state')
        for _ in range(BURST):
            publisher.publish(LARGE)
        clean_up(node)
        assert told.recv() == {'canonical_state': BURST}


def test_in_lock_step_a_recorder_that_lags_hears_every_state(ros: Ros, ros_domain: int) -> None:
    """A latched topic keeps its last message only, and cannot repeat the one before."""
    flooded = BURST // 2
    with reading(ros_domain, inhibition_state=2, canonical_state=flooded) as (told, pid):
        node = made(ros, InhibitionNode, lock_step=True)
        node.start()
        publisher_of(ros, node, 'inhibition_state')
        flood = ros.node.create_publisher(
            JointState, 'canonical_state', interface('canonical_state').publisher_qos)
        ros.spin_until(lambda: flood.get_subscription_count() > 1)
        os.kill(pid, signal.SIGSTOP)
        for _ in range(flooded):
            flood.publish(LARGE)
        # not a thread of this process, which the middleware keeps from running while it waits
        wakes = subprocess.Popen(['sh', '-c', f'sleep 0.2; kill -CONT {pid}'])
        for word in ('waiting', 'captured'):
            node._told._state_publisher.publish(inhibition_state(1, word, {}))
        assert told.recv() == {'inhibition_state': 2, 'canonical_state': flooded}
        assert wakes.wait() == 0


@pytest.mark.parametrize('node_class', [ReferenceFilter, InhibitionNode])
def test_what_was_due_when_a_node_was_cleaned_up_harms_nobody(
        ros: Ros, node_class: type[SuiteNode]) -> None:
    """Messages and requests that an executor had taken already."""
    node = made(ros, node_class)
    node.start()
    node._joined = True
    subscriptions, services = list(node._subscriptions), list(node.services)
    clean_up(node)
    for subscription in subscriptions:
        message = subscription.msg_type()
        if isinstance(message, String):
            message.data = 'lie'
        information = {'publication_sequence_number': 1, 'received_timestamp': 1}
        numbered = type(subscription).CallbackType.WithMessageInfo
        subscription.callback(serialize_message(message), *(
            [information] if subscription._callback_type is numbered else []))
    assert node.health.rejected == {}
    gone = [service for service in services if service not in list(node.services)]
    for service in gone:
        service.send_response(service.srv_type.Response(), None)
    assert bool(gone) == (node_class is InhibitionNode)


def test_what_was_wrong_before_a_node_begins_anew_is_not_told_any_more(ros: Ros) -> None:
    oscillators = made(ros, CanonicalOscillators)
    oscillators.start()
    late = 2_000_000_000
    oscillators._take_inhibition(late, (1, Announced(oscillators._inhibition)))

    def told() -> Any:
        return oscillators.health.status('', {}, periodic=False).status[0]

    assert 'inhibition is silent' in told().message
    begin_anew(oscillators)
    assert isinstance(oscillators._inhibition, Inhibition)
    oscillators._take_inhibition(late, (late, Announced(oscillators._inhibition)))
    assert told().level == DiagnosticStatus.OK


def test_a_node_that_begins_anew_is_told_what_is_latched_within_its_process(ros: Ros) -> None:
    local = LocalDelivery(('canonical_oscillators', 'inhibition', 'mujoco_robot'))
    reference, oscillators, inhibition = (
        made(ros, kind) for kind in (ReferenceFilter, CanonicalOscillators, InhibitionNode))
    for node in (reference, oscillators, inhibition):
        node.local = local
        node.start()
    assert inhibition._others.newest[0] == 0
    oscillators._take_inhibition(1, (1, Announced(oscillators._inhibition)))
    for node in (reference, inhibition):  # both have a topic ~/commands_taken
        clean_up(node)
    inhibition.start()
    assert inhibition._others.newest[0] == 1
    clean_up(oscillators)
    begin_anew(inhibition)
    assert inhibition._others.newest is None


def test_a_node_is_configured_with_what_was_accepted_last(ros: Ros) -> None:
    oscillators = made(ros, CanonicalOscillators)
    oscillators.trigger_configure()
    assert oscillators.set_parameters([Parameter('gait', value='trot')])[0].successful
    oscillators.trigger_cleanup()
    oscillators.start()
    assert oscillators.diagnostic_values()['gait'] == 'trot'


@pytest.mark.parametrize('again', [False, True])
def test_a_gait_that_there_is_not_is_refused_before_the_node_is_configured(
        ros: Ros, again: bool) -> None:
    oscillators = made(ros, CanonicalOscillators, auto_gaits=['walk', 'hop'])
    if again:
        oscillators.trigger_configure()
        oscillators.trigger_cleanup()
    for name, value, strange in (('gait', 'gallop', 'gallop'), ('auto_gait', True, 'hop')):
        (result,) = oscillators.set_parameters([Parameter(name, value=value)])
        assert not result.successful
        assert f"no gait '{strange}'; valid are amble" in result.reason
    assert oscillators.set_parameters([Parameter('gait', value='trot')])[0].successful
    oscillators.start()
