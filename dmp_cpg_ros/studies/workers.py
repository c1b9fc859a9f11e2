# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the cases of a study run: in processes of this machine, or on a cluster of Dask.

A trial is a function of its case alone, so that the results, which come in the order of the cases,
depend neither on how many work nor on where.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from multiprocessing import get_context, parent_process
from types import TracebackType
from typing import Any, TypeVar

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.core.errors import DmpCpgError

Case = TypeVar('Case')
Result = TypeVar('Result')

CONNECTED_WITHIN_S = 10.0
"""How long the scheduler of a cluster may take to answer [s]."""


SPARSE_S = 10.0
"""How often is counted where there is no terminal [s]."""


class Workers:
    """Runs trials; a context manager.

    Parameters
    ----------
    number : int
        Processes of this machine.
    cluster : str, optional
        Address of a cluster's scheduler, which is used instead.
    progress : bool, optional
        Whether to count on standard error; without, where that is a terminal, and on another
        every ten seconds.
    prepare : callable, optional
        What every process of this machine does first.

    Raises
    ------
    DmpCpgError
        On entry, if the cluster does not answer or its library is missing; from :meth:`map`, if
        a process ends before its case does.
    """

    def __init__(self, number: int, cluster: str = '', progress: bool | None = None,
                 prepare: Callable[[], object] | None = None) -> None:
        self._number, self._cluster, self._prepare = number, cluster, prepare
        self._progress = progress
        self._pool: ProcessPoolExecutor | None = None
        self._client: Any = None

    def __enter__(self) -> Workers:
        if not self._cluster:
            # Fresh processes: a fork has the locks, but not the threads, of whoever starts it.
            self._pool = ProcessPoolExecutor(
                self._number, get_context('spawn'), _begin, (self._prepare,))
            return self
        try:
            from distributed import Client
        except ImportError:
            raise DmpCpgError(
                '--cluster needs dask.distributed: pip install distributed') from None
        try:
            self._client = Client(self._cluster, timeout=CONNECTED_WITHIN_S)
        except (OSError, ValueError) as error:
            raise DmpCpgError(f"no cluster answers at '{self._cluster}': {error}") from None
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
        if self._client is not None:
            with suppress(OSError):
                self._client.close()

    def map(self, trial: Callable[[Case], Result], cases: Sequence[Case], batch: int = 1,
            ) -> Iterator[Result]:
        """Results of all cases, in their order, each as soon as those before it are there.

        Short cases cost less in batches, which go to a process together.
        """
        if self._pool is not None:
            results = self._pool.map(trial, cases, chunksize=batch)
        else:
            futures = self._client.map(trial, cases, pure=False)
            results = (future.result() for future in futures)
        tell = self._counter(len(cases))
        try:
            for count, result in enumerate(results, 1):
                tell(count)
                yield result
        except BrokenProcessPool:
            raise DmpCpgError('a process of the study has ended before its case, killed perhaps '
                              'for want of memory') from None


    def _counter(self, cases: int) -> Callable[[int], None]:
        """Return what tells how many cases are done."""
        sparse = Progress(every_s=SPARSE_S)

        def count(done: int) -> None:
            if self._progress or self._progress is None and sys.stderr.isatty():
                print(f'\r{done}/{cases} ', end='\n' if done == cases else '', file=sys.stderr,
                      flush=True)
            elif self._progress is None:
                sparse(f'{done}/{cases}')

        return count


def _begin(prepare: Callable[[], object] | None) -> None:
    """Begin a process, which Ctrl-C ends without a word, and the end of its study as well."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_end_with_the_study, daemon=True).start()
    if prepare is not None:
        prepare()


def _end_with_the_study() -> None:
    """End this process when the one that started it has: killed, it could not say so."""
    study = parent_process()
    if study is not None:
        study.join()
        os._exit(1)
