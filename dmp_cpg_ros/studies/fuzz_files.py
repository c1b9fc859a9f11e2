# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feed mutated files of every kind to what reads them.

Each file is read as its command reads it, and has to be taken, or refused in one line that names
it, with exit status 2; within 5 s of processor time and 500 MB, and nothing is written outside of
the folder of its case. Workers read many files each; one that dies or hangs is replaced.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import logging
import multiprocessing
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from dmp_cpg_ros.commands.ros_arguments import BAD_INPUT, LONGEST_LINE, run_command
from dmp_cpg_ros.studies import fuzz_samples as samples
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results

LONGEST_S, LARGEST = 5, 500 * 2**20
"""Processor time [s] and memory beyond that of the program itself [B] that a file may cost."""

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND

CHANGES = ('os.mkdir', 'os.remove', 'os.rename', 'os.rmdir', 'os.symlink', 'os.link', 'os.chmod',
           'os.truncate', 'shutil.rmtree', 'shutil.move')
NEVER = ('pickle.find_class', 'subprocess.Popen', 'os.system', 'os.exec', 'os.posix_spawn',
         'socket.connect')
"""Audited events that change files, and that no file may cause at all."""


class Outcome(NamedTuple):
    """What became of one file: ``accepted``, ``refused`` or a fault; time [s], memory [B]."""

    kind: str
    number: int
    verdict: str
    told: str
    seconds: float = 0.0
    memory: int = 0

    @property
    def is_good(self) -> bool:
        """Whether it was taken or refused as it has to be."""
        return self.verdict in ('accepted', 'refused')


class _Reader:
    """Reads mutated files, in a process of its own."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder, self._seed, self._outside = folder, seed, []  # type: Path, int, list[str]
        self._samples, self._case = samples.make(folder / 'samples'), folder / 'case'
        logging.disable()
        tempfile.tempdir = str(folder / 'tmp')
        os.mkdir(tempfile.tempdir)
        signal.setitimer(signal.ITIMER_PROF, 0)
        used = int(Path('/proc/self/statm').read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + LARGEST, used + LARGEST))
        sys.addaudithook(self._audit)

    def read(self, kind: str, number: int) -> Outcome:
        """Make, read and judge one file."""
        shutil.rmtree(self._case, ignore_errors=True)
        place = self._case / 'input'
        path = samples.mutated(self._samples, kind, place, random.Random(
            f'{self._seed}/{kind}/{number}'))
        os.chdir(self._case)
        before, self._outside, told = _digest(path), [], io.StringIO()
        began = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
        try:
            with contextlib.redirect_stderr(told), contextlib.redirect_stdout(io.StringIO()):
                status = samples.read(kind, path, self._case / 'out')
            text = told.getvalue()
        except BaseException as error:  # noqa: BLE001 - whatever it is, it is what is looked for
            status, text = -1, ''.join(traceback.format_exception(error)[-3:])
        signal.setitimer(signal.ITIMER_PROF, 0)
        seconds = time.process_time() - began
        verdict = 'accepted' if status == 0 else 'refused'
        if status == -1:
            verdict = 'exception'
        elif status not in (0, BAD_INPUT, samples.NO_PROOF):
            verdict = f'status {status}'
        elif status != 0 and (
                text.count('\n') != 1 or len(text) > LONGEST_LINE + 100 or str(path) not in text):
            verdict = 'not one line that names the file'
        elif self._outside or _digest(path) != before:
            verdict, text = 'changed something outside', ', '.join(self._outside) or 'its input'
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        return Outcome(kind, number, verdict, text.strip(), seconds, memory)

    def _audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in NEVER and arguments[0] != 'git':  # of which the manifest asks the version
            self._outside.append(f'{event} {arguments[:2]}')
        elif event in CHANGES or (event == 'open' and (arguments[2] or 0) & WRITING):
            path = arguments[0]
            if isinstance(path, (str, bytes)) and os.fsdecode(path) != os.devnull and (
                    not Path(os.path.abspath(os.fsdecode(path))).is_relative_to(self._folder)):
                self._outside.append(f'{event} {os.fsdecode(path)}')


def _digest(folder: Path) -> str:
    """What a folder holds."""
    content = hashlib.sha256()
    for path in (folder, *sorted(folder.rglob('*'))):
        content.update(str(path.relative_to(folder)).encode())
        content.update(path.read_bytes() if path.is_file() else b'')
    return content.hexdigest()


def _work(connection: Any, folder: Path, seed: int) -> None:
    """Body of a worker: read what is asked for until there is nothing more."""
    reader = _Reader(folder, seed)
    while (asked := connection.recv()) is not None:
        connection.send(reader.read(*asked))


def _worked(cases: Sequence[tuple[str, int]], seed: int, tell: Callable[[Outcome], None]) -> None:
    """Read all cases in a worker, which is replaced when it dies."""
    context, waiting = multiprocessing.get_context('spawn'), list(reversed(cases))
    while waiting:
        here, there = context.Pipe()
        with tempfile.TemporaryDirectory(prefix='fuzz_') as folder:
            worker = context.Process(target=_work, args=(there, Path(folder).resolve(), seed))
            worker.start()
            there.close()
            try:
                while waiting:
                    case = waiting.pop()
                    here.send(case)
                    if not here.poll(60.0 * LONGEST_S):
                        raise EOFError
                    tell(here.recv())
                here.send(None)
            except (EOFError, OSError):
                worker.kill()
                worker.join()
                tell(Outcome(*case, 'hung' if worker.exitcode in (
                    -signal.SIGPROF, -signal.SIGKILL) else 'crashed', f'{worker.exitcode}'))
            worker.join()


def fuzz(count: int, seed: int, kinds: Sequence[str] = samples.KINDS, workers: int = 2,
         tell: Callable[[Outcome], None] = lambda _: None) -> list[Outcome]:
    """Read mutated files.

    Parameters
    ----------
    count : int
        Number of files, spread evenly over the kinds.
    seed : int
        The same seed makes the same files.
    kinds : sequence of str
        Of :data:`~dmp_cpg_ros.studies.fuzz_samples.KINDS`.
    workers : int
        Number of processes.
    tell : callable (outcome)
        Told of every file.

    Returns
    -------
    list of Outcome
    """
    outcomes: list[Outcome] = []

    def note(outcome: Outcome) -> None:
        outcomes.append(outcome)
        tell(outcome)

    cases = [(kinds[i % len(kinds)], i // len(kinds)) for i in range(count)]
    random.Random(seed).shuffle(cases)
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda share: _worked(share, seed, note),
                      [cases[i::workers] for i in range(workers)]))
    return outcomes


def table(outcomes: Sequence[Outcome]) -> str:
    """One line per kind: how many were taken, refused, and what else happened to how many."""
    rows = []
    for kind in sorted({outcome.kind for outcome in outcomes}):
        of = [outcome for outcome in outcomes if outcome.kind == kind]
        told = Counter(outcome.verdict for outcome in of)
        wrong = ', '.join(f'{n} {verdict}' for verdict, n in told.items()
                          if verdict not in ('accepted', 'refused'))
        rows.append([kind, f'{len(of):,}', f'{told["accepted"]:,}', f'{told["refused"]:,}',
                     wrong or '0', f'{max(outcome.seconds for outcome in of):.2f}'])
    return markdown_table(('kind', 'files', 'taken', 'refused', 'anything else', 'longest [s]'),
                          rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status: 1 when a file did anything else."""
    parser = parser_of('fuzz_files', __doc__, 'every outcome that is wrong', jobs=False)
    parser.add_argument('--workers', '--jobs', type=at_least_one, default=2, metavar='N',
                        help='processes (default: 2)')
    parser.add_argument('--count', type=at_least_one, default=20_000, help='number of files')
    parser.add_argument('--seed', type=int, default=0, help='default: 0')
    parser.add_argument('--kinds', nargs='+', choices=samples.KINDS, default=samples.KINDS)
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: Any) -> int:
    def tell(outcome: Outcome) -> None:
        if not outcome.is_good:
            print(f'{outcome.kind} {outcome.number}: {outcome.verdict}: {outcome.told}',
                  flush=True)

    began = time.monotonic()
    outcomes = fuzz(options.count, options.seed, options.kinds, options.workers, tell)
    wrong = [outcome for outcome in outcomes if not outcome.is_good]
    print(table(outcomes))
    print(f'\n{len(outcomes):,} files in {time.monotonic() - began:.0f} s, {len(wrong)} wrong; at '
          f'most {max(outcome.memory for outcome in outcomes) / 1e6:.0f} MB resident, the program '
          'itself included')
    write_results(options.json, [outcome._asdict() for outcome in wrong])
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
