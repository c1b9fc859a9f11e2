# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A ``walk`` in a process of its own, for studies that do something to it or measure it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from math import inf
from pathlib import Path
from typing import Any

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.inhibition.supervisor import STATES
from dmp_cpg_ros.process import end_with_parent
from dmp_cpg_ros.studies.process_usage import pid_of

WITHIN_S = 120.0
"""How long the suite may take to be ready, at first and again, before a walk is given up [s]."""

GAIT_STATE = rf'^ *[\d.]+ s  ({"|".join(STATES).replace("_", " ")})$'
"""Line that tells a new state of the gait."""


Event = Mapping[str, Any]


def ahead(speed: float = 0.5) -> list[Event]:
    """Events of a scenario that walks ahead [m/s]."""
    return [{'at': 0.5, 'command': {'v_x': speed}}]


class WalkProcess:
    """A running ``walk`` with what it says; it ends with this process.

    Parameters
    ----------
    arguments : sequence of str
        Of ``walk``.

    Attributes
    ----------
    lines, times : list
        What it has said, and when on the monotonic clock [s].
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        """Start it."""
        self.lines: list[str] = []
        self.times: list[float] = []
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'dmp_cpg_ros', 'walk', *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            env={**os.environ, 'PYTHONUNBUFFERED': '1'},
            preexec_fn=partial(end_with_parent, signal.SIGINT))
        threading.Thread(target=self._read, daemon=True).start()

    @classmethod
    def of(cls, folder: Path, duration_s: float, events: Iterable[Event], *options: str,
           **parameters: object) -> WalkProcess:
        """Walk a scenario, recorded into the folder ``run`` of a folder, without a report."""
        folder.mkdir(parents=True, exist_ok=True)
        scenario = folder / 'scenario.yaml'
        scenario.write_text(json.dumps({
            'name': 'study', 'duration': duration_s, 'parameters': parameters,
            'events': list(events)}), encoding='utf-8')
        return cls([str(scenario), '--no-report', '--out', str(folder / 'run'), *options])

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.times.append(time.monotonic())
            self.lines.append(line)

    def _wait(self, done: Callable[[], bool]) -> bool:
        """Wait until something is so, or the walk has ended, or for too long; whether it is so."""
        deadline = time.monotonic() + WITHIN_S
        while time.monotonic() < deadline and self.process.poll() is None:
            if done():
                return True
            time.sleep(0.05)
        return False

    def told(self, pattern: str, begin: int = 0) -> list[float]:
        """Times of the lines that end like that [s]."""
        found = (re.search(rf'^ *([\d.]+) s .*{pattern}', line) for line in self.lines[begin:])
        return [float(line[1]) for line in found if line]

    def said(self, pattern: str, begin: int = 0) -> float:
        """Wait for a line that ends like that; its time [s], infinite when it does not come."""
        return self.told(pattern, begin)[0] if self._wait(
            lambda: bool(self.told(pattern, begin))) else inf

    def walks(self) -> bool:
        """Wait until its last words of the gait are that it walks; whether they are."""
        def walking() -> bool:
            states = [found[1] for line in self.lines if (found := re.search(GAIT_STATE, line))]
            return states[-1:] == ['walking']

        return self._wait(walking)

    def must_walk(self) -> None:
        """Raise :meth:`failure` where it does not walk."""
        if not self.walks():
            raise self.failure()

    def failure(self) -> DmpCpgError:
        """What is raised where it does not walk, with what it says."""
        return DmpCpgError(f'the suite does not walk: {"".join(self.lines)}')

    def pid_of(self, nodes: Sequence[str]) -> int:
        """Process of some nodes; 0 when there is none."""
        return pid_of(self.process.pid, nodes)

    def end(self) -> int:
        """Interrupt it, skip its report, and wait, or kill it when it hangs; returns the exit
        status.
        """
        waiting, deadline = True, time.monotonic() + WITHIN_S
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        while self.process.poll() is None:
            if waiting and any('a second Ctrl-C skips' in line for line in self.lines):
                waiting = False
                self.process.send_signal(signal.SIGINT)
            if time.monotonic() > deadline:
                self.process.kill()
            time.sleep(0.05)
        return self.process.returncode
