# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running nodes: executor, scheduling, and what the process says at its end.

Every message wakes its reader, and a reader that Linux wakes takes the core from the writer, who
has four more messages to publish: ten processes on two cores changed places 9,000 times a second.
Under ``SCHED_BATCH`` (sched(7)) whoever is woken waits until the writer has finished its tick and
sleeps. The policy needs no privilege and changes nobody's share of the processor.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import get_default_context

from dmp_cpg_ros.core.errors import DataError, DmpCpgError, MissingFileError, ParameterError
from dmp_cpg_ros.nodes.framework.claims import claim
from dmp_cpg_ros.nodes.framework.judging import judge
from dmp_cpg_ros.nodes.framework.middleware import (
    cannot_start,
    prepare_middleware,
    start_ros,
    without_ros_arguments,
)
from dmp_cpg_ros.nodes.framework.parameters import BATCH, NodeParameters, help_text
from dmp_cpg_ros.process import collect_seldom
from dmp_cpg_ros.suite_table import KINDS

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

_THREADS = '/proc/self/task'


def schedule(policy: str) -> int:
    """Schedule all threads of this process; those that they start inherit the policy.

    Parameters
    ----------
    policy : str
        ``batch``, or ``normal`` for leaving everything as it is. A thread whose policy somebody
        has chosen already (``chrt``) keeps it, and so do all where the operating system has no
        such policy.

    Returns
    -------
    int
        Number of threads that changed.
    """
    if policy != BATCH or not hasattr(os, 'SCHED_BATCH') or not os.path.isdir(_THREADS):
        return 0
    changed = 0
    for thread in map(int, os.listdir(_THREADS)):
        with contextlib.suppress(OSError):  # one that has just ended, or may not be changed
            if os.sched_getscheduler(thread) == os.SCHED_OTHER:
                os.sched_setscheduler(thread, os.SCHED_BATCH, os.sched_param(0))
                changed += 1
    return changed


FOREVER_S = 1e6
"""A bounded wait: unbounded ones of the events executor do not work in some builds [s]."""

TORN_DOWN_S, ENDED_S = 10.0, 120.0
"""What the middleware may take to end, once a node has completed what it does, and all of an end
since the signal for it [s]. Seldom, once in some thousand ends, a process waits there for ever.
"""

OK, FAILED, BAD_INPUT = 0, 1, 2
"""Exit statuses."""

_BAD_ARGUMENTS = (ParameterError, MissingFileError, DataError, ParameterException)


def make_executor(kind: str, context: Context | None = None) -> Executor:
    """Make an executor.

    Parameters
    ----------
    kind : str
        ``events`` or ``single``. Where the events executor is missing or does not run a first
        task, the single-threaded one is returned, with a warning.
    context : Context, optional
        Default: the global one.
    """
    if kind == 'events':
        try:
            from rclpy.experimental import EventsExecutor
            executor = EventsExecutor(context=context or get_default_context())
            task = executor.create_task(lambda: True)
            executor.spin_until_future_complete(task, timeout_sec=2.0)
            if task.done():
                return executor
            reason = 'it did not run a first task'
        except (ImportError, AttributeError, TypeError, RuntimeError) as error:
            reason = str(error)
        get_logger('executor').warning(
            f'no events executor ({reason}); using the single-threaded one')
    return SingleThreadedExecutor(context=context)


def spin_in_slices(executor: Executor, future: Future, slice_s: float, within_s: float
                   ) -> Iterator[None]:
    """Spin until a future is done, and yield now and then to who waits for it.

    The events executor leaves a callback of its own, some 400 bytes, with every future that it
    has spun for: each slice has a future that is forgotten with it.

    Parameters
    ----------
    executor : Executor
        Spins, at least once if the future is not done.
    future : Future
        What is waited for.
    slice_s : float
        Time of the wall clock between two yields at most [s].
    within_s : float
        How long to wait in all [s].
    """
    deadline, ended = time.monotonic() + within_s, [Future()]
    future.add_done_callback(lambda _: ended[0].set_result(None))
    while not future.done() and time.monotonic() < deadline:
        ended[0] = Future()
        executor.spin_until_future_complete(ended[0], timeout_sec=slice_s)
        yield


def spin(nodes: Sequence[Node], kind: str, until: Future) -> None:
    """Run nodes of one context in one executor until it is shut down or a future is done.

    Parameters
    ----------
    nodes : sequence of Node
        Several nodes make up a composed process.
    kind : str
        As for :func:`make_executor`.
    until : Future
        Ends the run.
    """
    context = nodes[0].context
    executor = make_executor(kind, context)
    collect_seldom()
    try:
        for node in nodes:
            executor.add_node(node)
        while context.ok() and not until.done():
            begin = time.monotonic()
            executor.spin_until_future_complete(until, timeout_sec=FOREVER_S)
            if context.ok() and not until.done() and time.monotonic() - begin < 1.0:
                raise RuntimeError("the executor returned at once; try parameter 'executor'")
    except ExternalShutdownException:
        pass
    finally:
        for node in nodes:
            executor.remove_node(node)


def run_node(kind: str) -> int:
    """Body of the executable of a kind of node, with the command line of the process.

    Returns
    -------
    int
        Exit status: 0 after Ctrl-C, SIGTERM or SIGHUP, 2 when a parameter, an argument or a file
        that one names is bad, 1 when something else failed.
    """
    node_class = getattr(import_module(KINDS[kind].module), KINDS[kind].class_name)
    arguments = sys.argv[1:]
    own = arguments[:arguments.index('--ros-args')] if '--ros-args' in arguments else arguments
    if {'-h', '--help'} & set(own):
        print(help_text(node_class))
        return OK
    return run_nodes(kind, arguments, lambda: [node_class(node_class.default_name(arguments))],
                     node_class.JUDGES)


def run_nodes(program: str, arguments: Sequence[str],
              make: Callable[[], Iterable[SuiteNode]], judging: bool) -> int:
    """Run nodes in one process and one executor, from ``rclpy.init`` to the exit status.

    Parameters
    ----------
    program : str
        Name for messages.
    arguments : sequence of str
        Command line without the program's name; all of it for ROS.
    make : callable () → iterable of SuiteNode
        Makes the nodes; called after ``rclpy.init``. The first node's parameters ``executor`` and
        ``scheduling`` decide for all.
    judging : bool
        Whether one of them judges changes.

    Returns
    -------
    int
        As for :func:`run_node`.
    """
    nodes: list[SuiteNode] = []
    if judging:
        judge().fork()
    until = first_signal()
    status = _status(program, lambda: _run(program, arguments, make, nodes, until))
    for node in nodes:
        status = max(status, _status(program, node.close))
        _end_within(TORN_DOWN_S)
        status = max(status, _status(program, node.destroy_node))
    rclpy.try_shutdown()
    return status


def _end_within(seconds: float) -> None:
    """End the process at the latest after a time, saying where its threads are, whoever holds
    Python's lock then.
    """
    faulthandler.dump_traceback_later(seconds, exit=True, file=2)


def _run(program: str, arguments: Sequence[str], make: Callable[[], Iterable[SuiteNode]],
         nodes: list[SuiteNode], until: Future) -> None:
    unknown = without_ros_arguments(arguments)
    if unknown:
        raise ParameterError(
            f"unknown argument '{unknown[0]}'; valid are --help and --ros-args ...")
    prepare_middleware()
    start_ros([program, *arguments])
    with cannot_start():
        nodes.extend(make())
    claims = [claim(node.get_fully_qualified_name(), node.context.get_domain_id())
              for node in nodes]
    for node in nodes:
        node.start()
    parameters = nodes[0].parameters_of(NodeParameters)
    schedule(parameters.scheduling)
    spin(nodes, parameters.executor, until)
    del claims


def _status(program: str, body: Callable[[], object]) -> int:
    """Run a body; what it raises becomes a message and an exit status."""
    try:
        body()
    except _BAD_ARGUMENTS as error:
        status, message = BAD_INPUT, str(error)
    except DmpCpgError as error:
        status, message = FAILED, str(error)
    except Exception:  # noqa: BLE001 - the last resort of a process
        status, message = FAILED, traceback.format_exc()
    else:
        return OK
    print(f'{program}: {message}', file=sys.stderr, flush=True)
    return status


def first_signal() -> Future:
    """Return a future that SIGINT, SIGTERM or SIGHUP, of a terminal that is closed, completes;
    nothing else comes of them.

    rclpy's handler would end the context under callbacks that still run, and Python's would raise
    in one of them; a second Ctrl-C must not break into what is being completed: a recording.
    """
    until = Future()
    readable, writable = os.pipe()
    os.set_blocking(writable, False)
    # Python runs handlers between two of its own instructions, of which a waiting executor
    # executes none; the byte is written at once.
    signal.set_wakeup_fd(writable, warn_on_full_buffer=False)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:  # as by nohup
            signal.signal(number, lambda *_: None)

    def wait() -> None:
        os.read(readable, 1)
        _end_within(ENDED_S)
        until.set_result(None)

    threading.Thread(target=wait, daemon=True).start()
    return until
