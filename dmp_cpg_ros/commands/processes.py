# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A group of child processes: started together, watched, ended together, their output kept.

Run as a program it is the beginning of such a child: ``PARENT MODULE [ARGUMENT ...]`` runs a
module that is asked to end when its parent has ended, in whatever way.
"""

from __future__ import annotations

import ctypes
import os
import runpy
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path


class ProcessGroup:
    """Child processes that run modules of this package.

    Parameters
    ----------
    logs : Path
        Folder for one file of output per process.
    """

    def __init__(self, logs: Path) -> None:
        """Start with no process."""
        logs.mkdir(parents=True, exist_ok=True)
        self._logs = logs
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._commands: dict[str, tuple[str, Sequence[str]]] = {}

    def start(self, name: str, module: str, arguments: Sequence[str], *,
              logged: bool = True) -> None:
        """Run ``python -m module arguments`` with this copy of the package, in a session of its
        own so that Ctrl-C reaches this process only; it ends with this process. What is not logged
        is written where this process writes.
        """
        self._commands[name] = module, arguments
        # Matrices of a few rows: threads of the algebra library would only contend for the cores.
        environment = {'OPENBLAS_NUM_THREADS': '1', **os.environ, 'PYTHONUNBUFFERED': '1'}
        with open(self._logs / f'{name}.log' if logged else os.devnull, 'ab') as log:
            output = log if logged else None
            self._processes[name] = subprocess.Popen(
                [sys.executable, __file__, str(os.getpid()), module, *arguments],
                stdin=subprocess.DEVNULL, stdout=output,
                stderr=subprocess.STDOUT if logged else None,
                start_new_session=True, env=environment)

    def restart(self, name: str) -> None:
        """Start a process that has ended once more."""
        self.start(name, *self._commands[name])

    def kill(self, name: str) -> None:
        """End a process that does not answer."""
        self._processes[name].kill()

    def ended(self) -> dict[str, str]:
        """Say by the name of every process that has ended how, with the last line of its
        output.
        """
        found = {}
        for name, process in self._processes.items():
            status = process.poll()
            if status is not None:
                how = (f'was ended by signal {-status} ({signal.Signals(-status).name})'
                       if status < 0 else f'ended with status {status}')
                log = (self._logs / f'{name}.log').read_text(encoding='utf-8', errors='replace')
                last = log.strip().rpartition('\n')[2]
                found[name] = f'{name} {how}{last and ": " + last}'
        return found

    def stop(self, patience_s: float = 15.0) -> list[str]:
        """End all processes: interrupt, and after a time kill.

        Returns
        -------
        list of str
            Names of those that had to be killed.
        """
        running = {name: process for name, process in self._processes.items()
                   if process.poll() is None}
        for process in running.values():
            process.send_signal(signal.SIGINT)
        deadline, killed = time.monotonic() + patience_s, []
        for name, process in running.items():
            try:
                process.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                killed.append(name)
                process.kill()
                process.wait()
        return killed


PR_SET_PDEATHSIG = 1
"""Of Linux's ``prctl``: which signal a process gets when the thread that started it ends."""


def end_with(parent: int) -> None:
    """Let this process get SIGTERM when its parent ends; at once when it has ended already."""
    if sys.platform == 'linux':
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGTERM)


if __name__ == '__main__':
    end_with(int(sys.argv[1]))
    sys.path[0] = str(Path(__file__).parents[2])  # and not what lies in the working folder
    del sys.argv[:2]
    runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)
