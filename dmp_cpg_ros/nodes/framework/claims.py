# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Claims on names in a ROS domain, so that no two suites of one machine run as one.

A claim is an advisory lock on a file, which ends with its process however that ends; looking at
the ROS graph alone would let two suites that start at the same moment miss each other.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import IO

from dmp_cpg_ros.core.errors import ParameterError


class AlreadyRunningError(ParameterError):
    """The domain has such a node, or such a suite, already."""


def claim(name: str, domain: int) -> IO[str]:
    """Claim a name in a domain for as long as the returned file is open.

    Parameters
    ----------
    name : str
        Full name of a node, or of the suite of a namespace.
    domain : int
        ROS domain.

    Raises
    ------
    AlreadyRunningError
        If another process of this user has it; the text says which.
    ParameterError
        If there is no folder for temporary files.
    """
    try:
        folder = Path(tempfile.gettempdir()) / f'dmp_cpg_ros_claims_{os.getuid()}'
        folder.mkdir(mode=0o700, exist_ok=True)
        file = (folder / f'{_network()}_{domain}{name.replace("/", ".")}').open(
            'a+', encoding='utf-8')
    except OSError as error:
        raise ParameterError(f'temporary files cannot be written: {error}; set TMPDIR to a folder '
                             'where they can') from error
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.seek(0)
        owner = file.read().strip()
        file.close()
        raise AlreadyRunningError(already_running(domain, f'{name}, process {owner}')) from None
    file.truncate(0)
    file.write(str(os.getpid()))
    file.flush()
    return file


def claimed(names: Iterable[str], domain: int) -> list[str]:
    """Those of some names that other processes of this user have claimed in a domain."""
    taken = []
    for name in names:
        try:
            claim(name, domain).close()
        except AlreadyRunningError:
            taken.append(name)
    return taken


def already_running(domain: int, who: str) -> str:
    """Say what stands in the way and what to do."""
    return (f'a suite is already running in ROS domain {domain} ({who}); '
            'end it, or set ROS_DOMAIN_ID, or use a namespace (walk --namespace NAME)')


def _network() -> int:
    """Which network this is: containers that share a folder need not share one."""
    try:
        return os.stat('/proc/self/ns/net').st_ino
    except OSError:
        return 0
