# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far long work is, for whoever waits for it."""

from __future__ import annotations

import sys
import time


class Progress:
    """Tells on stderr how far long work is: after some seconds, and not too often.

    Parameters
    ----------
    of : str
        What stands before.
    every_s : float
        Shortest time between two lines [s].
    """

    SILENT_S = 3.0

    def __init__(self, of: str = '', every_s: float = 5.0) -> None:
        """The work begins."""
        self._of, self._every_s, self._next = of, every_s, time.monotonic() + self.SILENT_S

    def __call__(self, text: str) -> None:
        """Tell."""
        if time.monotonic() >= self._next:
            print(f'{self._of}{text}', file=sys.stderr, flush=True)
            self._next = time.monotonic() + self._every_s
