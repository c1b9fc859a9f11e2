# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A process that has imported what nodes need, and forks one whenever it is asked to.

To import rclpy, its messages, NumPy and MuJoCo takes most of a node's start. Ten nodes that are
forked pay it once; nothing of ROS runs yet where they are forked. Only the tracer that ROS 2 is
linked with, LTTng, has threads from the first import on, and is told of every fork.

A ``walk`` that was forked, as tests do, has imported all of it, and forks its own server.

Run as a program, ``PARENT SOCKET PADDING``, it is that process, and finds the package only once it
runs. What it forks becomes a child of its parent, which adopts it and waits for it as for any
other, and ends with that parent, in whatever way it ends. Linux only.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import gc
import inspect
import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import NoReturn

MOST_BYTES = 200_000
"""Longest request [bytes]: Linux takes a little more in one message."""

OWN = {'OPENBLAS_NUM_THREADS': '1', 'PYTHONUNBUFFERED': '1'}
"""Variables that have these values unless they are set: matrices have a few rows only, for which
threads of the algebra library would contend for the cores; what nodes say is read at once.
"""

ANSWERS_WITHIN_S = 120.0
"""How long a request may take [s], the server's imports included."""

TITLE_BYTES = 4000
"""Room for the command line that ``ps`` shows [bytes]."""


class Forked:
    """A process that the server has forked, a child of this one.

    Attributes
    ----------
    pid : int
        Its number.
    """

    def __init__(self, pid: int) -> None:
        """Note that it runs."""
        self.pid = pid
        self._status: int | None = None

    def poll(self) -> int | None:
        """Exit status, or less a signal's number; None while it runs."""
        if self._status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self._status = os.waitstatus_to_exitcode(status) if pid else None
        return self._status

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end; returns as :meth:`poll`, or raises subprocess.TimeoutExpired."""
        if self.poll() is None:
            ended = os.pidfd_open(self.pid)
            try:
                select.select([ended], [], [], timeout)
            finally:
                os.close(ended)
        status = self.poll()
        if status is None:
            raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
        return status

    def send_signal(self, number: int) -> None:
        """Send it a signal, unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)


_at_hand: list[tuple[Forked, socket.socket]] = []
"""Server of a process that was forked itself, until it is taken."""


class ForkServer:
    """Forks processes that run executables of this package; a context manager.

    It imports while this process goes on, and ends with :meth:`close`; what it has forked goes on.

    Attributes
    ----------
    program : str
        File of a program that calls :func:`main`.
    """

    program = __file__

    def __init__(self, folder: str | None = None) -> None:
        """Start the server, in a working folder, or take the one at hand."""
        from dmp_cpg_ros.process import adopt_orphans

        adopt_orphans()
        self._server: subprocess.Popen[bytes] | Forked
        if _at_hand and folder is None:
            self._server, self._socket = _at_hand.pop()
            self._socket.settimeout(ANSWERS_WITHIN_S)
            return
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(ANSWERS_WITHIN_S)
        with theirs:
            self._server = subprocess.Popen(
                [sys.executable, '-W', 'ignore::DeprecationWarning:__main__',  # of the tracer
                 self.program, str(os.getpid()), str(theirs.fileno()), ' ' * TITLE_BYTES],
                stdin=subprocess.DEVNULL, start_new_session=True, cwd=folder,
                pass_fds=(theirs.fileno(),), env={**OWN, **os.environ})

    def start(self, command: Sequence[str], output: int = 1, errors: int = 2, *,
              environment: Mapping[str, str] | None = None, folder: str = '') -> Forked:
        """Run ``python -m dmp_cpg_ros command`` in a session of its own, so that Ctrl-C reaches
        this process only; it ends with this process.

        Parameters
        ----------
        command : sequence of str
            Name of the executable and its arguments.
        output, errors : int
            Descriptors of files to which it writes.
        environment : mapping of str to str, optional
            Its environment; default: that of this process.
        folder : str
            Its working folder; default: that of the server.

        Raises
        ------
        OSError
            If it cannot, because the server has ended perhaps or does not answer.
        """
        wanted = os.environ if environment is None else environment
        request = json.dumps([list(command), {**OWN, **wanted}, folder]).encode()
        try:
            socket.send_fds(self._socket, [request], [output, errors])
            answer = self._socket.recv(64)
        except TimeoutError:
            raise TimeoutError(f'the fork server does not answer within {ANSWERS_WITHIN_S:g} s'
                               ) from None
        if answer:
            return Forked(int(answer))
        raise ChildProcessError('the fork server has ended')

    def close(self) -> None:
        """End the server, which has nothing to finish."""
        self._socket.close()
        self._server.kill()
        self._server.wait()

    def __enter__(self) -> ForkServer:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 traceback: TracebackType | None) -> None:
        self.close()


def _serve(parent: int, requests: socket.socket) -> None:
    """Fork for every request until there are no more; returns in what was forked, ready to run."""
    from dmp_cpg_ros.process import show_command

    show_command([sys.executable, __file__, str(parent)])  # without the padding
    while True:
        message, files, _, _ = socket.recv_fds(requests, MOST_BYTES, 2)
        if not message:
            os._exit(0)
        command, environment, folder = json.loads(message)
        _read_ahead(command)
        adopted, go = os.pipe()
        said, say = os.pipe()
        middle = os.fork()
        if not middle:
            os.close(go)
            if os.fork():
                os._exit(0)
            os.read(adopted, 1)  # which ends when the server, the last that could write, says so
            _become(parent, files, command, environment)
            os.chdir(folder or '.')
            os.write(say, str(os.getpid()).encode())
            for descriptor in (adopted, said, say, requests.detach()):
                os.close(descriptor)
            return
        os.waitpid(middle, 0)  # whose child is the parent's from now on
        for descriptor in (go, adopted, say, *files):
            os.close(descriptor)
        requests.send(os.read(said, 64))
        os.close(said)


def _prepare() -> None:
    """Import what nodes need, and fill what they would fill; what is wrong is for them to say."""
    from dmp_cpg_ros.suite_table import SUITE_TABLE

    for name in (*(kind.module for kind in SUITE_TABLE), 'dmp_cpg_ros.robot.mujoco_robot',
                 'dmp_cpg_ros.nodes.framework.execution', 'numpy.random',
                 'dmp_cpg_ros.commands.composed_suite'):
        with contextlib.suppress(Exception):
            import_module(name)
    for fill in (load_type_supports, read_own_files):
        with contextlib.suppress(Exception):
            fill()
    # rclpy names the line of a log message; for its first one it looks through all modules.
    inspect.getframeinfo(sys._getframe())
    _tell_tracer()
    gc.collect()
    gc.freeze()  # the collector of a child would otherwise write to, and so copy, all of it


def _fork_server() -> None:
    """Fork a server for this process, which has not begun yet; returns in what that forks, too."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    parent, server = os.getpid(), os.fork()
    if server:
        theirs.close()
        from dmp_cpg_ros.commands import fork_server  # which this program is not

        fork_server._at_hand.append((fork_server.Forked(server), ours))
    else:
        ours.close()
        os.setsid()
        _serve(parent, theirs)


def load_type_supports() -> None:
    """Load what publishers, readers and services of the suite's messages need."""
    from lifecycle_msgs.srv import ChangeState
    from rclpy.type_support import check_for_type_support

    from dmp_cpg_ros.nodes.messages.interfaces import INTERFACES

    for message in (ChangeState, *(interface.type for interface in INTERFACES.values())):
        if hasattr(type(message), '_TYPE_SUPPORT'):  # and not a stand-in for one that is missing
            check_for_type_support(message)


def read_own_files() -> None:
    """Parse the package's robot and gaits; what was parsed is kept."""
    from dmp_cpg_ros.robot.model_reader import load_description
    from dmp_cpg_ros.suite import load_gaits

    load_description()
    load_gaits()


def _read_ahead(arguments: Sequence[str]) -> None:
    """Parse the parameter files of a command, which the next commands name, too."""
    from dmp_cpg_ros.nodes.framework.parameters import shared_names

    with contextlib.suppress(Exception):
        shared_names(arguments)


def _tell_tracer() -> None:
    """Call before and after every fork what ``liblttng-ust-fork.so`` would."""
    maps = Path('/proc/self/maps').read_text(encoding='utf-8')
    former = ctypes.create_string_buffer(1024)  # a set of signals
    for path in set(re.findall(r'/\S+/liblttng-ust[-.]\S+', maps)):
        library = ctypes.CDLL(path)
        for name in ('lttng_ust', 'ust'):  # since 2.13, and before
            if hasattr(library, f'{name}_before_fork'):
                os.register_at_fork(
                    before=partial(library[f'{name}_before_fork'], former),
                    after_in_parent=partial(library[f'{name}_after_fork_parent'], former),
                    after_in_child=partial(library[f'{name}_after_fork_child'], former))
                break


def _become(parent: int, files: Sequence[int], command: Sequence[str],
            environment: Mapping[str, str]) -> None:
    """Be the process that was asked for: its session, files, environment, arguments, name."""
    from dmp_cpg_ros.process import end_with_parent, show_command, show_name

    os.setsid()
    for number, descriptor in enumerate(files, 1):
        os.dup2(descriptor, number)
        os.close(descriptor)
    end_with_parent(signal.SIGTERM)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGTERM)
    os.environ.clear()
    os.environ.update(environment)
    show_command([sys.executable, __file__, str(parent), *command])
    show_name(command[0])
    sys.argv = list(command)


def main() -> int:
    """Be the program; returns the exit status of what it has forked."""
    sys.path[0] = str(Path(__file__).parents[2])  # and not what lies in the working folder
    _prepare()
    _serve(int(sys.argv[1]), socket.socket(fileno=int(sys.argv[2])))
    if sys.argv[0] == 'walk':
        _fork_server()
    return int(import_module('dmp_cpg_ros.__main__').run(sys.argv[0]))


def end(status: int) -> NoReturn:
    """End a process that has done all it was for: to take apart what it has imported would take
    ten times as long as to fork it, and copy the memory that it shares.
    """
    atexit._run_exitfuncs()
    try:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        ctypes.CDLL(None).fflush(None)
    except (OSError, ValueError):  # nobody reads it, of which Python makes a status
        sys.exit(status)
    os._exit(status)


if __name__ == '__main__':
    end(main())
