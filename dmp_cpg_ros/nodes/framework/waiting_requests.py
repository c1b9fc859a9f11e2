# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to stop or start the gait that wait beside the ticks for their answer.

A start waits while the robot stands by itself, as it does for a moment where targets are late. A
request that acts waits until it has been predicted when it will be fulfilled. Of each there is one
at most, and none is left without an answer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from dmp_cpg_ros.nodes.framework.judging import Later

Answer = tuple[bool, str]
"""Whether a request is accepted, and what will happen or why not."""

PATIENCE_NS = 5_000_000_000
"""How long a start waits for a robot that stands by itself [ns]."""

OVERTAKEN = 'done; another request came before it was predicted'
"""Answer to a request that was no longer in force when it had been predicted."""


class PutOff(NamedTuple):
    """A start that waits for the robot, until a stamp [ns] at most."""

    answer: Later
    until_ns: int


class Acting(NamedTuple):
    """A stop, or a start, that acts and waits for what is predicted of it."""

    stop: bool
    answer: Later


class WaitingRequests:
    """The requests of one service that are answered later."""

    def __init__(self) -> None:
        """Nothing waits."""
        self._put_off: PutOff | None = None
        self._acting: Acting | None = None

    # A start that waits for the robot ------------------------------------------------------------

    def put_off(self, answer: Later, now_ns: int) -> Later:
        """Let a start wait from a stamp on [ns]; returns its answer to be."""
        self._put_off = PutOff(answer, now_ns + PATIENCE_NS)
        return answer

    def is_overdue(self, now_ns: int) -> bool:
        """Whether a start has waited for too long."""
        return self._put_off is not None and now_ns > self._put_off.until_ns

    def resumed(self) -> Later | None:
        """The answer to be of the start that waits, which waits no longer; None without one."""
        put_off, self._put_off = self._put_off, None
        return put_off and put_off.answer

    def refuse(self, why: str) -> None:
        """Refuse the start that waits, if there is one."""
        if (answer := self.resumed()) is not None:
            answer.deliver((False, why))

    # A request that waits for its prediction -----------------------------------------------------

    def acts(self, stop: bool, answer: Later) -> None:
        """Let a request wait for its prediction; the one before it is overtaken."""
        if self._acting is not None:
            self._acting.answer.deliver((True, OVERTAKEN))
        self._acting = Acting(stop, answer)

    def predicted(self, told: Callable[[bool], Answer]) -> None:
        """Answer the request that waits, if there is one, with what is told of a stop or start."""
        acting, self._acting = self._acting, None
        if acting is not None:
            acting.answer.deliver(told(acting.stop))
