# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A running suite as seen from outside: its services, and what it reads."""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rclpy.client import Client
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future
from std_srvs.srv import Trigger

from dmp_cpg_ros.commands.ros_arguments import checked_namespace
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.nodes.framework.execution import BAD_INPUT, FAILED
from dmp_cpg_ros.nodes.framework.middleware import (
    prepare_middleware,
    start_ros,
    without_ros_arguments,
)
from dmp_cpg_ros.nodes.framework.strangers import ANYBODYS, Strangers
from dmp_cpg_ros.nodes.messages.commands import twist
from dmp_cpg_ros.nodes.messages.interfaces import (
    STAMPED_CMD_VEL,
    Interface,
    interface,
    private,
)

ASK_AGAIN_S = 0.3
"""Time after which a request that may be repeated is repeated [s]."""

ANSWER_WITHIN_S = 60.0
"""How long an answer may take [s]: to refuse a parameter, the nearest good value is sought."""

ACKNOWLEDGED_WITHIN_S = 2.0
"""How long to wait for readers at the end [s]."""

STEP_S = 0.05
"""How long one turn of the executor waits at most [s]."""


class ClientError(DmpCpgError):
    """Nobody answers, or the suite refuses."""


class SuiteClient:
    """A node that calls the services of a running suite and publishes to its topics.

    A server drops its response when it has not yet matched the client's reply reader, and a
    reliable volatile writer may lose what it sends before its reader knows it. Discovery tells a
    participant's ends in the order in which they were made. So what must not be lost or repeated
    goes out only after a client that was made later has been answered (:meth:`meet`).

    Parameters
    ----------
    node : Node
        Its node; its namespace is the suite's.
    wait_s : float
        How long to look for the suite [s].
    """

    def __init__(self, node: Node, wait_s: float) -> None:
        """Add the node to an executor."""
        self.node, self._wait_s, self._strangers = node, wait_s, Strangers(node)
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)

    def spin_until(self, condition: Callable[[], object], within_s: float = math.inf) -> bool:
        """Run callbacks until a condition holds; returns whether it does. An interrupt that was
        lost, as in what Python calls while it tidies up, counts as well.
        """
        deadline = time.monotonic() + within_s
        _end_if_interrupted()
        while not condition() and time.monotonic() < deadline:
            _end_if_interrupted()
            left_s = max(0.0, deadline - time.monotonic())
            try:
                self._executor.spin_once(timeout_sec=min(STEP_S, left_s))
            except RuntimeError:  # what C++ makes of an interrupt that meets it in a callback
                _end_if_interrupted()
                raise
        return bool(condition())

    def meet(self, kinds: Sequence[str], *clients: Client) -> None:
        """Wait until nodes of the suite know what this client has made so far, and the clients
        their servers; raises ClientError when they are not there.
        """
        for kind in kinds:
            self.ask(self.node.create_client(Trigger, f'{kind}/ready'), Trigger.Request())
        for client in clients:
            self._find(client)

    def call(self, name: str, request: Any) -> Any:
        """Answer of a service of the suite; asked once."""
        service = interface(name)
        if name.startswith('~'):
            service = private(name, *service.publishers)
        client = self.node.create_client(service.type, service.name)
        self.meet(service.publishers, client)
        return self.answer([client.call_async(request)], client.service_name)

    def ask(self, client: Client, request: Any) -> Any:
        """Answer to a request that may be repeated."""
        self._find(client)
        futures: list[Future] = []
        end = time.monotonic() + ANSWER_WITHIN_S
        while time.monotonic() < end and not any(future.done() for future in futures):
            futures.append(client.call_async(request))
            self.spin_until(lambda: any(future.done() for future in futures), ASK_AGAIN_S)
        return self.answer(futures, client.service_name, 0.0)

    def answer(self, futures: Sequence[Future], name: str,
               within_s: float = ANSWER_WITHIN_S) -> Any:
        """Result of the first future that is done; raises ClientError when none is in time."""
        if not self.spin_until(lambda: any(future.done() for future in futures), within_s):
            raise ClientError(f'{name} did not answer within {ANSWER_WITHIN_S:g} s')
        if who := self._strangers.serving(name):
            print(f'warning: {ANYBODYS.format(name, who)}', file=sys.stderr)
        return next(future for future in futures if future.done()).result()

    def publisher(self, topic: Interface) -> Publisher:
        """Publisher whose readers all know it; raises ClientError when they want another type."""
        publisher = self.node.create_publisher(topic.type, topic.name, topic.publisher_qos)
        self.meet(topic.subscribers)

        def matched() -> bool:
            return bool(publisher.get_subscription_count() >= len(topic.subscribers))

        def others() -> list[str]:
            ends = self.node.get_subscriptions_info_by_topic(publisher.topic_name)
            return sorted({end.topic_type for end in ends} - {topic.type_name})

        self.spin_until(lambda: matched() or others(), self._wait_s)
        if not matched():
            raise ClientError(
                f'nobody reads {publisher.topic_name} as {topic.type_name}; it is read as '
                f'{", ".join(others()) or "nothing"}')
        return publisher

    def _find(self, client: Client) -> None:
        """Wait for a server; raises ClientError with what is there instead."""
        if self.spin_until(client.service_is_ready, self._wait_s):
            return
        node, service = self.node, client.service_name
        nodes = node.get_node_names_and_namespaces()
        suites = {space for name, space in nodes if name == 'inhibition'}
        if node.get_namespace() in suites:
            names = {name for name, space in nodes if space == node.get_namespace()}
            raise ClientError(f'nobody offers {service}; nodes are '
                              f'{", ".join(sorted(names - {node.get_name()}))}')
        hint = f' (there is one with --namespace {", ".join(sorted(suites))})' if suites else ''
        raise ClientError(
            f'no suite answers in ROS domain {node.context.get_domain_id()}{hint}: nobody offers '
            f'{service}; start one with walk, such as: walk stand_by.yaml')


def prepared(parser: argparse.ArgumentParser, arguments: Sequence[str] | None
             ) -> tuple[argparse.Namespace, list[str]]:
    """Options of a client's command line, and its words for ROS with the option ``namespace``;
    from now on SIGTERM ends as Ctrl-C does.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        options = parser.parse_args(without_ros_arguments(words))
        namespace = None if options.namespace is None else checked_namespace(options.namespace)
    except ParameterError as error:
        parser.error(str(error))
    if namespace is not None:
        words += ['--ros-args', '-r', f'__ns:={namespace or "/"}']
    prepare_middleware()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)
    return options, words


_interrupts: list[int] = []
"""Signals that asked this process to end."""


def _interrupt(number: int, _: object) -> None:
    _interrupts.append(number)
    raise KeyboardInterrupt


def _end_if_interrupted() -> None:
    if _interrupts:
        raise KeyboardInterrupt from None


def connected(name: str, words: Sequence[str], wait_s: float) -> SuiteClient:
    """Begin with ROS, as a node that looks for the suite so long [s]."""
    start_ros([name, *words])
    return SuiteClient(Node(name, enable_rosout=False, start_parameter_services=False), wait_s)


def status_of(name: str, error: Exception) -> int:
    """Say what ended a client; returns its exit status, 2 for bad input."""
    print(f'{name}: {error}', file=sys.stderr)
    return BAD_INPUT if isinstance(error, ParameterError) else FAILED


@contextmanager
def velocity_command(client: SuiteClient, *, stamped: bool
                     ) -> Iterator[Callable[[Sequence[float]], None]]:
    """Find the readers of velocity commands, and command zero at the end.

    Parameters
    ----------
    client : SuiteClient
        Who sends.
    stamped : bool
        Whether the suite runs with ``stamped_cmd_vel:=true``: ``TwistStamped``, not ``Twist``.

    Yields
    ------
    callable ((v_x, v_y, γ) [m/s, m/s, rad/s])
        Sends a command; raises ClientError when nobody reads it.

    Raises
    ------
    ClientError
        If there are no readers of this type.
    """
    topic = STAMPED_CMD_VEL if stamped else interface('cmd_vel')
    publisher = client.publisher(topic)

    def publish(velocity: Sequence[float]) -> None:
        publisher.publish(twist(topic.type, velocity))

    def send(velocity: Sequence[float]) -> None:
        if not publisher.get_subscription_count():
            raise ClientError('the suite has ended')
        publish(velocity)

    try:
        yield send
    finally:
        publish((0.0, 0.0, 0.0))
        deliver(publisher)


def deliver(publisher: Publisher) -> None:
    """Wait until the readers have what was published."""
    publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED_WITHIN_S))
