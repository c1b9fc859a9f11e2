# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a run was made with: versions, commit, parameters, seeds, host; nothing personal."""

from __future__ import annotations

import datetime
import json
import os
import platform
import re
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import dmp_cpg_ros

PACKAGES = ('numpy', 'mujoco', 'rosbags', 'matplotlib', 'rclpy', 'mcap')


def build_manifest(
        parameters: Mapping[str, Any] | None = None, seeds: Mapping[str, int] | None = None,
        digests: Mapping[str, str] | None = None, **facts: Any) -> dict[str, Any]:
    """Contents of ``manifest.json``.

    Parameters
    ----------
    parameters : mapping, optional
        Parameters of all nodes.
    seeds : mapping, optional
        Every seed by name.
    digests : mapping, optional
        As from :func:`~dmp_cpg_ros.analysis.bag.payload_digests`.
    **facts
        Anything else that matters, such as ``scenario`` or ``mode``.

    Returns
    -------
    dict
        Absolute paths in texts are cut to file names; host and user names are not asked for.
    """
    created = datetime.datetime.now(datetime.timezone.utc).isoformat(timespec='seconds')
    return without_paths({
        'created': created, 'versions': versions(), 'commit': source_commit(), **facts,
        'parameters': dict(parameters or {}), 'seeds': dict(seeds or {}),
        'digests': dict(digests or {}), 'host': host_facts()})


def versions() -> dict[str, str]:
    """Versions of the package, of Python and of what is installed of the packages it stands on."""
    found = {'dmp_cpg_ros': dmp_cpg_ros.__version__, 'python': platform.python_version()}
    for name in PACKAGES:
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    distribution = os.environ.get('ROS_DISTRO')
    return {**found, 'ros_distro': distribution} if distribution else found


def host_facts() -> dict[str, Any]:
    """Facts that change how fast a run goes: processor, number of cores, load, system."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count()
    load = os.getloadavg() if hasattr(os, 'getloadavg') else ()
    model = None
    with suppress(OSError):
        text = Path('/proc/cpuinfo').read_text(encoding='utf-8')
        model = re.search(r'^model name\s*:\s*(.*?)\s*$', text, re.MULTILINE)
    return {
        'system': platform.system(), 'machine': platform.machine(),
        'processor': model[1] if model else platform.processor() or 'unknown',
        'cores': os.cpu_count(), 'usable_cores': usable,
        'load_average': [round(value, 2) for value in load],
        'rmw': os.environ.get('RMW_IMPLEMENTATION', 'default')}


def without_paths(value: Any) -> Any:
    """Copy of nested values in which texts that are absolute paths are cut to their last part."""
    if isinstance(value, Mapping):
        return {key: without_paths(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [without_paths(entry) for entry in value]
    if isinstance(value, Path):
        value = str(value)
    if isinstance(value, str) and re.match(r'~?/|.:[\\/]', value):
        path = Path(value).expanduser()
        # topic names begin with a slash too, but name no folder that exists
        if path.exists() or (len(path.parts) > 2 and path.parent.exists()):
            return re.split(r'[\\/]', value)[-1]
    return value


def source_commit() -> dict[str, Any] | None:
    """Commit of the checkout that the package runs or was installed from.

    Returns
    -------
    dict or None
        ``hash`` and ``changed`` (whether tracked files differ from it); None outside a checkout,
        where the package's version has to do.
    """
    for folder in (Path(dmp_cpg_ros.__file__).resolve().parent, _installed_from()):
        # git has to track the package there, not just a folder around it
        if folder is not None and _git(folder, 'ls-files', '--', '__init__.py'):
            commit = _git(folder, 'rev-parse', 'HEAD')
            changes = _git(folder, 'status', '--porcelain', '--untracked-files=no')
            if commit:
                return {'hash': commit, 'changed': bool(changes)}
    return None


def _installed_from() -> Path | None:
    """Checkout that pip installed the package from (PEP 610), None when it came from elsewhere."""
    try:
        text = metadata.distribution('dmp_cpg_ros').read_text('direct_url.json')
    except metadata.PackageNotFoundError:
        return None
    url = urlparse(json.loads(text or '{}').get('url', ''))
    return Path(unquote(url.path)) / 'dmp_cpg_ros' if url.scheme == 'file' else None


def _git(folder: Path, *arguments: str) -> str:
    """Output of a git command, empty when it fails or there is no git."""
    with suppress(OSError, subprocess.SubprocessError):
        return subprocess.run(['git', '-C', str(folder), *arguments], capture_output=True,
                              text=True, timeout=10, check=True).stdout.strip()
    return ''
