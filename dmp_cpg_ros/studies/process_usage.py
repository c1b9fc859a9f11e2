# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What processes use, as Linux counts it for each of their threads."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple


class Usage(NamedTuple):
    """Of one process: time on a core and time waiting for one [s]; changes of context: how often
    it slept and was woken, and was preempted; memory with its share of what processes have
    together [MB]; time on a core by the name of the thread [s].
    """

    cpu_s: float
    waited_s: float
    wakeups: int
    preempted: int
    memory_mb: float
    threads: Mapping[str, float]


def usage(pid: int) -> Usage:
    """Read all counts of a process."""
    root, threads = Path(f'/proc/{pid}'), Counter[str]()
    waited, changes, own = 0, Counter[str](), (root / 'comm').read_text().strip()
    for task in (root / 'task').iterdir():
        with suppress(OSError):  # a thread may have ended
            ran, waits, _ = map(int, (task / 'schedstat').read_text().split())
            for kind, count in re.findall(r'(\w+)_ctxt_switches:\s*(\d+)',
                                          (task / 'status').read_text()):
                changes[kind] += int(count)
            name = re.sub(r'[\d.]+$', '', (task / 'comm').read_text().strip())
            threads['main' if task.name == root.name else
                    'other' if name == own else name] += ran
            waited += waits
    share = re.search(r'^Pss:\s*(\d+)', (root / 'smaps_rollup').read_text(), re.MULTILINE)
    return Usage(1e-9 * threads.total(), 1e-9 * waited, changes['voluntary'],
                 changes['nonvoluntary'], int(share[1]) / 1024 if share else 0.0,
                 {name: 1e-9 * ran for name, ran in threads.items()})


def private_mb(pid: int) -> float:
    """Memory that a process shares with no other [MB]."""
    rollup = Path(f'/proc/{pid}/smaps_rollup').read_text()
    return sum(map(int, re.findall(r'^Private_\w+:\s*(\d+)', rollup, re.MULTILINE))) / 1024


def resident_mb(pid: int) -> float:
    """Memory of a process that is not swapped out [MB]; 0 of one that has ended."""
    with suppress(OSError):
        pages = int(Path(f'/proc/{pid}/statm').read_text().split()[1])
        return pages * os.sysconf('SC_PAGE_SIZE') / 1e6
    return 0.0


def children(pid: int) -> list[int]:
    """Processes that a process has started, and those that they have."""
    found = []
    for task in Path(f'/proc/{pid}/task').glob('*/children'):
        with suppress(OSError):
            for child in map(int, task.read_text().split()):
                found += [child, *children(child)]
    return found


def pid_of(walk: int, nodes: Sequence[str]) -> int:
    """Process of some nodes of a walk that is the process ``walk``; 0 when there is none."""
    wanted = [{node.encode(), f'__node:={node}'.encode()} for node in nodes]
    for path in Path('/proc').glob('[0-9]*/cmdline'):
        with suppress(OSError):
            words = set(path.read_bytes().split(b'\0'))
            if str(walk).encode() in words and all(words & names for names in wanted):
                return int(path.parent.name)
    return 0


def between(first: Usage, last: Usage) -> Usage:
    """What was used from one reading to another; memory is what there was at the end."""
    return Usage(last.cpu_s - first.cpu_s, last.waited_s - first.waited_s,
                 last.wakeups - first.wakeups, last.preempted - first.preempted, last.memory_mb,
                 {name: ran - first.threads.get(name, 0.0) for name, ran in last.threads.items()})
