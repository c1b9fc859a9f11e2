# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which commit the running code comes from."""

from __future__ import annotations

import json
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import dmp_cpg_ros


def source_commit() -> dict[str, Any] | None:
    """Commit of the checkout that the package runs or was installed from.

    Returns
    -------
    dict or None
        ``hash`` and ``changed`` (whether tracked files differ from it); None outside a checkout,
        where the package's version has to do.
    """
    package = Path(dmp_cpg_ros.__file__).resolve().parent
    for folder in (package, _installed_from()):
        if folder is not None and _tracks(folder):
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
    url = urlparse(json.loads(text).get('url', '')) if text else None
    if url is None or url.scheme != 'file':
        return None
    folder = Path(unquote(url.path)) / 'dmp_cpg_ros'
    return folder if folder.is_dir() else None


def _tracks(folder: Path) -> bool:
    """Whether git tracks the package there, not just a folder around it."""
    return bool(_git(folder, 'ls-files', '--', '__init__.py'))


def _git(folder: Path, *arguments: str) -> str:
    """Output of a git command, empty when it fails or there is no git."""
    try:
        done = subprocess.run(
            ['git', '-C', str(folder), *arguments], capture_output=True, text=True, timeout=10,
            check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ''
    return done.stdout.strip() if done.returncode == 0 else ''
