# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A group of child processes: started together, watched, ended together, their output kept."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from dmp_cpg_ros.commands.fork_server import Forked, ForkServer
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.suite_table import COMPOSED, KIND_OF


class ProcessGroup:
    """Child processes that run modules of this package.

    Parameters
    ----------
    logs : Path
        Folder for one file of output per process.
    server : ForkServer
        What starts them.

    Attributes
    ----------
    failed : list of str
        How those ended that did not end well when they were told to.
    """

    def __init__(self, logs: Path, server: ForkServer) -> None:
        """Start with no process."""
        logs.mkdir(parents=True, exist_ok=True)
        self._logs, self._server = logs, server
        self._processes: dict[str, Forked] = {}
        self._commands: dict[str, Sequence[str]] = {}
        self._ends: dict[str, str] = {}
        self.failed: list[str] = []

    def start(self, name: str, command: Sequence[str], *, logged: bool = True) -> None:
        """Run an executable of this package with arguments, as :meth:`.ForkServer.start`. What is
        not logged is written where this process writes.
        """
        self._commands[name] = command
        self._ends.pop(name, None)
        with open(self._logs / f'{name}.log' if logged else os.devnull, 'ab') as log:
            files = (log.fileno(), log.fileno()) if logged else ()
            try:
                self._processes[name] = self._server.start(command, *files)
            except OSError as error:
                raise DmpCpgError(f'cannot start {name}: {error}') from None

    def start_nodes(self, shared: Mapping[str, Sequence[str]], arguments: Sequence[str]) -> None:
        """Run every process with its nodes, by their names in the graph."""
        for process, nodes in shared.items():
            alone = nodes[0] if len(nodes) == 1 else ''
            self.start(process, [KIND_OF[alone], *arguments, '-r', f'__node:={alone}'] if alone
                       else [COMPOSED, *nodes, *arguments])

    def restart(self, name: str) -> None:
        """Start a process that has ended once more."""
        self.start(name, self._commands[name])

    def pid(self, name: str) -> int:
        """Number of a process."""
        return self._processes[name].pid

    def kill(self, name: str) -> None:
        """End a process that does not answer."""
        self._processes[name].kill()

    def ended(self) -> dict[str, str]:
        """Say by the name of every process that has ended how, with the last line of its
        output.
        """
        for name, process in self._processes.items():
            if name not in self._ends and (status := process.poll()) is not None:
                how = (f'was ended by signal {-status} ({signal.Signals(-status).name})'
                       if status < 0 else f'ended with status {status}')
                log = self._logs / f'{name}.log'  # who writes to the terminal has none
                text = log.read_text(encoding='utf-8', errors='replace') if log.is_file() else ''
                last = text.strip().rpartition('\n')[2]
                self._ends[name] = f'{name} {how}{last and ": " + last}'
        return dict(self._ends)

    def stop(self, patience_s: float) -> list[str]:
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
        ends = self.ended()
        self.failed = [ends[name] for name, process in running.items()
                       if name not in killed and process.poll()]
        return killed
