# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How much a node is asked about its parameters before it refuses: ticks must not starve.

What counts is how many, not how long: a slow machine refuses no other requests than a quick one.
In lock-step, where the robot waits, only the size of one request is limited.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.lifecycle import GuardedLifecycleNode

CHANGES, CHANGES_HZ = 20.0, 2.0
"""Requests to change parameters that are heard at once, and in the long run [1/s]: to judge one
takes longer than a tick.
"""

READ, READ_HZ = 2000.0, 500.0
"""Parameters that may be asked for at once, and in the long run [1/s]: to write an answer takes
some 75 µs for each.
"""

MOST = 200
"""Parameters that one request may change or ask for."""

READS = {GetParameters: 'names', GetParameterTypes: 'names', DescribeParameters: 'names',
         ListParameters: 'prefixes'}
"""Services that tell of parameters, and where their requests say of which."""


class Allowance:
    """So many at once, and so many in the long run.

    Parameters
    ----------
    most, per_s : float
        How many, and how many each second [1/s].
    """

    def __init__(self, most: float, per_s: float) -> None:
        """Begin with all of it."""
        self._most, self._per_s, self._left, self._then = most, per_s, most, time.monotonic()

    def take(self, number: float) -> bool:
        """Take so many, if they are left."""
        now = time.monotonic()
        self._left = min(self._most, self._left + self._per_s * (now - self._then))
        self._then, enough = now, self._left >= number
        self._left -= number * enough
        return enough


class RequestLimits:
    """What one node may still be asked.

    Parameters
    ----------
    node : GuardedLifecycleNode
        The node.
    """

    def __init__(self, node: GuardedLifecycleNode) -> None:
        """Begin with all that is allowed."""
        self._node = node
        self._changes, self._reads = Allowance(CHANGES, CHANGES_HZ), Allowance(READ, READ_HZ)

    def limited(self, kind: Any, service: str, callback: Callable[..., Any]
                ) -> Callable[..., Any]:
        """Callback of a service that refuses what is too much; others stay as they are."""
        if kind in (SetParameters, SetParametersAtomically):
            return self._changing(service, callback)
        return self._reading(service, callback, READS[kind]) if kind in READS else callback

    def _allowed(self, allowance: Allowance, number: float, size: int) -> bool:
        return size <= MOST and (self._node.lock_step or allowance.take(number))

    def _changing(self, service: str, callback: Callable[..., Any]) -> Callable[..., Any]:
        def answer(request: Any, response: Any) -> Any:
            if self._allowed(self._changes, 1.0, len(request.parameters)):
                return self._node.change(callback, request, response)
            refusal = SetParametersResult(successful=False, reason=(
                'too many changes of parameters; ask again in a few seconds'))
            self._tell('set_parameters', refusal.reason, service)
            if hasattr(response, 'results'):
                response.results = [refusal] * min(len(request.parameters), MOST)
            else:
                response.result = refusal
            return response

        return answer

    def _reading(self, service: str, callback: Callable[..., Any], where: str
                 ) -> Callable[..., Any]:
        """An empty answer is all that such a service can say to refuse."""
        def answer(request: Any, response: Any) -> Any:
            size = len(getattr(request, where))
            if self._allowed(self._reads, max(1.0, size), size):
                return callback(request, response)
            self._tell('get_parameters', f'asked for too many parameters; at most {MOST} at once '
                       f'and {READ_HZ:g} each second are told', service)
            return response

        return answer

    def _tell(self, counted: str, reason: str, service: str) -> None:
        if self._node.health.reject(counted, reason + self._node.strangers.asking(service)):
            self._node.report()
