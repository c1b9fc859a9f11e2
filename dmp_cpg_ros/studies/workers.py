# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the cases of a study run: in processes of this machine, or on a cluster of Dask.

A trial is a function of its case alone, so that the results, which come in the order of the cases,
depend neither on how many work nor on where.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing import Pool
from types import TracebackType
from typing import Any, TypeVar

from dmp_cpg_ros.core.errors import DmpCpgError

Case = TypeVar('Case')
Result = TypeVar('Result')

CONNECTED_WITHIN_S = 10.0
"""How long the scheduler of a cluster may take to answer [s]."""


class Workers:
    """Runs trials; a context manager.

    Parameters
    ----------
    number : int
        Processes of this machine.
    cluster : str, optional
        Address of a cluster's scheduler, which is used instead.
    progress : bool, optional
        Whether to count on standard error; without, where that is a terminal.

    Raises
    ------
    DmpCpgError
        On entry, if the cluster does not answer or its library is missing.
    """

    def __init__(self, number: int, cluster: str = '', progress: bool | None = None) -> None:
        self._number, self._cluster = number, cluster
        self._progress = sys.stderr.isatty() if progress is None else progress
        self._pool: Any = None
        self._client: Any = None

    def __enter__(self) -> Workers:
        if not self._cluster:
            self._pool = Pool(self._number)
            return self
        try:
            from distributed import Client
        except ImportError:
            raise DmpCpgError(
                "--cluster needs dask.distributed: pip install 'dmp_cpg_ros[cluster]'") from None
        try:
            self._client = Client(self._cluster, timeout=CONNECTED_WITHIN_S)
        except (OSError, ValueError) as error:
            raise DmpCpgError(f"no cluster answers at '{self._cluster}': {error}") from None
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if self._pool is not None:
            self._pool.terminate()
        if self._client is not None:
            with suppress(OSError):
                self._client.close()

    def map(self, trial: Callable[[Case], Result], cases: Sequence[Case]) -> Iterator[Result]:
        """Results of all cases, in their order, each as soon as those before it are there."""
        if self._client is None:
            results = self._pool.imap(trial, cases)
        else:
            futures = self._client.map(trial, cases, pure=False)
            results = (future.result() for future in futures)
        for count, result in enumerate(results, 1):
            if self._progress:
                end = '\n' if count == len(cases) else ''
                print(f'\r{count}/{len(cases)} ', end=end, file=sys.stderr, flush=True)
            yield result
