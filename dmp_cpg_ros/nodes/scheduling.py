# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scheduling policy of a node's threads.

Every message wakes its reader, and under the default policy the reader preempts the writer before
the writer has published the rest of its tick: ten processes on two cores switched 9,000 times a
second. Under ``SCHED_BATCH`` (sched(7)) a woken reader waits until the writer sleeps. The policy
needs no privilege and does not change the processes' shares of the processor.
"""

from __future__ import annotations

import contextlib
import os

BATCH, NORMAL = 'batch', 'normal'

POLICIES = (BATCH, NORMAL)
"""Values of the parameter ``scheduling``."""

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
