# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Signals that end a run in order."""

from __future__ import annotations

import os
import select
import signal
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from dmp_cpg_ros.core.errors import DmpCpgError

ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""Signals that end a run in order."""


class InterruptedRunError(DmpCpgError):
    """A signal asked for the end of the run.

    Parameters
    ----------
    number : int
        The signal.
    """

    def __init__(self, number: int) -> None:
        """Name the signal, unless it is Ctrl-C."""
        word = '' if number == signal.SIGINT else f' by {signal.Signals(number).name}'
        super().__init__(f'interrupted{word}')
        self.signal = number


@contextmanager
def ending_signals() -> Iterator[list[int]]:
    """Collect signals that ask for the end instead of being ended by them."""
    received: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        received.append(number)
        if number == signal.SIGHUP:
            _leave_terminal()

    former = {number: signal.signal(number, note) for number in ENDING_SIGNALS}
    try:
        yield received
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


def hang_up() -> None:
    """End the run in order, as when its terminal is closed: nobody reads what it prints."""
    leave_output()
    signal.raise_signal(signal.SIGHUP)


def leave_output() -> None:
    """Write to nowhere what is printed from here on, and what is still to be written."""
    _leave(1)


def is_unread() -> bool:
    """Whether what is printed goes into a pipe that nobody reads any more."""
    waiting = select.poll()
    waiting.register(1, 0)
    return any(events & select.POLLERR for _, events in waiting.poll(0))


def _leave_terminal() -> None:
    """Write to nowhere instead of to a terminal that is gone."""
    for descriptor in (1, 2):
        if stat.S_ISCHR(os.fstat(descriptor).st_mode):
            _leave(descriptor)


def _leave(descriptor: int) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
