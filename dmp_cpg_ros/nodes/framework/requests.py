# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to the services of a suite: whether they agree, and in which words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.task import Future

from dmp_cpg_ros.core.suite_parameters import CHANGEABLE, OWNER
from dmp_cpg_ros.nodes.framework.parameters import plain


def ask(client: Any, request: Any, done: Callable[[bool, str], None]) -> None:
    """Call a service, of one of a node's parameters or another one; ``done`` is told whether it
    agrees, and in which words.
    """

    def answered(future: Future) -> None:
        answer = future.result()
        (result,) = getattr(answer, 'results', [getattr(answer, 'result', answer)])
        if result is None:
            done(False, 'no answer')
        elif result is answer:
            done(result.success, result.message)
        else:
            done(result.successful, result.reason)

    client.call_async(request).add_done_callback(answered)


class ParameterSetter:
    """Calls the nodes' own parameter services, as ``ros2 param set`` does.

    Parameters
    ----------
    node : Node
        Who asks.
    """

    def __init__(self, node: Node) -> None:
        """Create the clients."""
        self._setters = {owner: node.create_client(
            SetParametersAtomically, f'{owner}/set_parameters_atomically') for owner in CHANGEABLE}
        self._getters = {owner: node.create_client(GetParameters, f'{owner}/get_parameters')
                         for owner in CHANGEABLE}

    def connected(self) -> bool:
        """Whether all services are there."""
        return all(client.service_is_ready()
                   for client in (*self._setters.values(), *self._getters.values()))

    def set(self, values: Mapping[str, Any], done: Callable[[str], None]) -> None:
        """Ask for a change.

        Parameters
        ----------
        values : mapping of str to value
            Parameters of one owner.
        done : callable (reason)
            Called with why the change is refused, or with an empty text once the owner has
            accepted it and all followers know it.
        """
        owner = OWNER[next(iter(values))]
        wanted = {name: plain(value) for name, value in values.items()}
        request = SetParametersAtomically.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in wanted.items()])

        def answered(agreed: bool, reason: str) -> None:
            if agreed:
                self._await([node for node in CHANGEABLE if node != owner], wanted, done)
            else:
                done(reason)

        ask(self._setters[owner], request, answered)

    def _await(self, followers: list[str], wanted: Mapping[str, Any],
               done: Callable[[str], None]) -> None:
        """Ask each follower until it has the values."""
        if not followers:
            done('')
            return

        def answered(future: Future) -> None:
            answer = future.result()
            known = [] if answer is None else [
                plain(parameter_value_to_python(value)) for value in answer.values]
            follow = followers[1:] if known == list(wanted.values()) else followers
            self._await(follow, wanted, done)

        request = GetParameters.Request(names=list(wanted))
        self._getters[followers[0]].call_async(request).add_done_callback(answered)
