# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What takes longer than a tick, computed beside the ticks; requests that wait for it.

A verdict on a change of parameters takes several ticks. It is a function of values alone, so that
another process can find it while the node goes on: threads of one interpreter would share its
lock, and a tick would wait for it at every product of matrices. The process is forked by one that
runs nodes before there is anything of ROS in it, or else started when it is first needed; it
yields to the nodes, and ends with the one that started it.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable, Generator
from functools import lru_cache, partial
from typing import IO, TYPE_CHECKING, Any, NamedTuple

from dmp_cpg_ros.process import collect_seldom, show_command, show_name

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

Compute = Callable[[], Any]
"""What is computed: a function without arguments that can be pickled."""

Use = Callable[[Any], None]

Step = tuple[Compute, Use]
"""What has to be computed before something goes on, and who takes the result."""

Steps = Generator[Step, None, None]
"""What has to be computed, one after the other. What a computation or its use raises is raised in
them."""

NAME = 'judge'
"""By which ``ps`` shows what was forked."""

NICENESS = 10
"""How far the process yields to those with ticks."""


class JudgeError(Exception):
    """It could not be computed beside the ticks."""


class ForkedJudge:
    """A process that computes, forked from this one; as much of a :class:`subprocess.Popen` as is
    needed.

    Attributes
    ----------
    pid : int
        Its number.
    stdin, stdout : file
        For questions and of answers.
    """

    def __init__(self) -> None:
        """Fork it; what is forked does not return from here."""
        questions, ask = os.pipe()
        answers, answer = os.pipe()
        self.pid = os.fork()
        if not self.pid:
            status = 1
            try:
                os.close(ask)
                os.close(answers)
                show_command([NAME])
                show_name(NAME)
                _serve(os.fdopen(questions, 'rb'), os.fdopen(answer, 'wb'))
                status = 0
            finally:
                os._exit(status)  # the end of what it was forked from is not its own
        os.close(questions)
        os.close(answer)
        self.stdin, self.stdout = os.fdopen(ask, 'wb'), os.fdopen(answers, 'rb')

    def kill(self) -> None:
        """End it at once."""
        os.kill(self.pid, signal.SIGKILL)

    def wait(self) -> None:
        """Wait for its end."""
        os.waitpid(self.pid, 0)


class Judge:
    """A process that computes one thing after the other."""

    def __init__(self) -> None:
        """Start nothing yet."""
        self._asked: queue.SimpleQueue[tuple[Compute, Use]] = queue.SimpleQueue()
        self._process: subprocess.Popen[bytes] | ForkedJudge | None = None
        self._thread: threading.Thread | None = None

    @property
    def pid(self) -> int | None:
        """Of the process; None while there is none."""
        return None if self._process is None else self._process.pid

    def fork(self) -> None:
        """Have the process from now on. Where it can be forked it is there in a moment, and has
        imported all; but nothing of ROS may run yet, whose threads it would not have.
        """
        if self._process is None and hasattr(os, 'fork'):
            self._process = ForkedJudge()

    def ask(self, compute: Compute, use: Use) -> None:
        """Have something computed.

        Parameters
        ----------
        compute : callable () → object
            What; it and its result go through :mod:`pickle`.
        use : callable (object)
            Called in a thread with the result, or with what was raised; a :class:`JudgeError`
            where the process did not answer. What it raises itself is printed.
        """
        self._asked.put((compute, use))
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, daemon=True)
            self._thread.start()

    def _work(self) -> None:
        while True:
            compute, use = self._asked.get()
            try:
                use(self._computed(compute))
            except Exception:  # noqa: BLE001 - those that asked later wait for this thread
                traceback.print_exc()

    def _computed(self, compute: Compute) -> Any:
        try:
            process = self._started()
            assert process.stdin is not None and process.stdout is not None
            process.stdin.write(pickle.dumps(compute))
            process.stdin.flush()
            return pickle.load(process.stdout)
        except Exception as error:  # noqa: BLE001 - whatever it is, the node can compute it itself
            if self._process is not None:
                self._process.kill()
                self._process.wait()
                self._process = None
            return JudgeError(f'{type(error).__name__}: {error}')

    def _started(self) -> subprocess.Popen[bytes] | ForkedJudge:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, '-c', f'import sys; sys.path[:] = {sys.path!r}; '
                 f'from {__name__} import main; main()'],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        return self._process


@lru_cache(maxsize=1)
def judge() -> Judge:
    """The one of this process, whatever nodes it has."""
    return Judge()


def beside_ticks(node: SuiteNode, compute: Compute, use: Use) -> None:
    """Have something computed that takes longer than a tick of a node, and use it between two.

    In lock-step, where the robot waits, and without an executor it is computed at once; so it is
    where it cannot be done elsewhere.
    """
    if node.lock_step or node.executor is None:
        use(compute())
    else:
        judge().ask(compute, partial(_computed, node, compute, use))


def _computed(node: SuiteNode, compute: Compute, use: Use, result: Any) -> None:
    """Pass on, from another thread, what was computed."""
    executor = node.executor
    if executor is None:  # the node has ended
        return
    task = node.guarded('beside ticks', lambda: use(
        compute() if isinstance(result, Exception) else result))
    with contextlib.suppress(AttributeError, RuntimeError):  # of an executor that was shut down
        executor.create_task(task)


class Slices:
    """What a node computes by itself, a slice at a time between its callbacks: it depends on too
    much for another process. What is begun later takes the place of what is not done.

    Parameters
    ----------
    node : SuiteNode
        In lock-step, where the robot waits, and without an executor it computes at once.
    length : int
        Steps of a slice.
    """

    def __init__(self, node: SuiteNode, length: int) -> None:
        """Begin nothing yet."""
        self._node, self._length, self._waits = node, length, False
        self._work: tuple[Generator[None, None, Any], Use] | None = None

    def begin(self, work: Generator[None, None, Any], use: Use) -> None:
        """Begin some work, and use what it returns, or the :class:`Raised` that it ended with."""
        self._work = work, use
        if self._node.lock_step or self._node.executor is None:
            while self._work is not None:
                self._go_on()
        elif not self._waits:
            self._later()

    def _later(self) -> None:
        executor = self._node.executor
        self._waits = executor is not None  # else the node has ended
        if executor is not None:
            executor.create_task(self._node.guarded('between ticks', self._slice))

    def _slice(self) -> None:
        self._waits = False
        self._go_on()
        if self._work is not None and not self._waits:
            self._later()

    def _go_on(self) -> None:
        if self._work is None:
            return
        work, use = self._work
        try:
            for _ in range(self._length):
                next(work)
            return
        except StopIteration as end:
            result = end.value
        except Exception as error:  # noqa: BLE001 - whoever waits for the result has to know
            result = Raised(error)
        self._work = None
        use(result)


def main() -> None:
    """Compute what comes on standard input until it ends."""
    answers = os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)  # nothing else gets between the answers
    _serve(sys.stdin.buffer, answers)


def _serve(questions: IO[bytes], answers: IO[bytes]) -> None:
    """Answer questions, pickled, until they end; the process gives way to those with ticks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever asks
    os.nice(NICENESS)
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            _answer(pickle.load(questions), answers)
            collect_seldom()


def _answer(compute: Compute, answers: IO[bytes]) -> None:
    try:
        result = compute()
    except Exception as error:  # noqa: BLE001 - it is an answer too
        result = error
    answers.write(pickle.dumps(result))
    answers.flush()


class Raised(NamedTuple):
    """What was raised instead of a result."""

    error: Exception


def attempted(compute: Compute) -> Any:
    """What is computed, or what was raised."""
    try:
        return compute()
    except Exception as error:  # noqa: BLE001 - whoever waits for the result has to know
        return Raised(error)


class Later:
    """Stands for the response of a service that is not there yet.

    Attributes
    ----------
    delivered : object
        What was delivered before it was known where to; None before.
    """

    def __init__(self) -> None:
        """Wait for both the response and where it goes."""
        self.delivered: Any = None
        self._send: Callable[[Any], None] | None = None
        self._make: Callable[[Any], Any] | None = None

    def made_by(self, make: Callable[[Any], Any]) -> Later:
        """Make the response of what is delivered."""
        self._make = make
        return self

    def bound_for(self, send: Callable[[Any], None]) -> None:
        """Take note of what sends the response."""
        self._send = send

    def deliver(self, response: Any) -> None:
        """Send the response."""
        if self._send is None:
            self.delivered = response
        else:
            self._send(response if self._make is None else self._make(response))


def sends_later(service: Any) -> None:
    """Let a service's callback return :class:`Later`."""
    send = service.send_response

    def send_or_wait(response: Any, header: Any) -> None:
        if isinstance(response, Later):
            response.bound_for(lambda known: send(known, header))
        else:
            send(response, header)

    service.send_response = send_or_wait


class InTurn:
    """Requests of which each begins when the one before it is answered.

    Parameters
    ----------
    beside : callable (compute, use)
        Has something computed beside the ticks, and the result used between two of them.
    """

    def __init__(self, beside: Callable[[Compute, Use], None]) -> None:
        """Start without requests."""
        self._beside = beside
        self._waiting: deque[tuple[Steps, Any, Later]] = deque()

    def take(self, steps: Steps, response: Any) -> Any:
        """Answer a request.

        Parameters
        ----------
        steps : Steps
            What has to be computed before it goes on, each time; fills the response meanwhile.
        response : object
            Of the service.

        Returns
        -------
        object
            The response, or :class:`Later`.
        """
        if not self._waiting:
            first = next(steps, None)
            if first is None:
                return response
            self._waiting.append((steps, response, later := Later()))
            self._compute(*first)
            return later
        self._waiting.append((steps, response, later := Later()))
        return later

    def _compute(self, compute: Compute, use: Use) -> None:
        self._beside(partial(attempted, compute), partial(self._used, use))

    def _used(self, use: Use, result: Any) -> None:
        self._go_on(result if isinstance(result, Raised) else attempted(partial(use, result)))

    def _go_on(self, before: Any = None) -> None:
        """Go on with the request whose turn it is, whatever came of its last step."""
        steps, response, later = self._waiting[0]
        step = None
        with contextlib.suppress(StopIteration):
            step = steps.throw(before.error) if isinstance(before, Raised) else next(steps)
        if step is not None:
            self._compute(*step)
            return
        self._waiting.popleft()
        try:
            later.deliver(response)
        finally:
            if self._waiting:
                self._go_on()
