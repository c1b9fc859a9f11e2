# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Signals that end a run in order."""

from __future__ import annotations

import os
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


def _leave_terminal() -> None:
    """Write to nowhere instead of to a terminal that is gone."""
    for descriptor in (1, 2):
        if stat.S_ISCHR(os.fstat(descriptor).st_mode):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)
