# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run's folder: ``runs/<time>/`` with the parameters of every node, and ``runs/latest``."""

from __future__ import annotations

import dataclasses
import datetime
from pathlib import Path
from typing import Any

import yaml

from dmp_cpg_ros.configuration import first_free
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.suite import node_sets
from dmp_cpg_ros.suite_table import RECORDER, instances


def make_run_folder(out: Path | None) -> Path:
    """Make the folder of a new run.

    Parameters
    ----------
    out : Path, optional
        The folder itself; must not exist or be empty. Without, a new one in ``runs`` that
        ``runs/latest`` points at.

    Raises
    ------
    DataError
        If ``out`` holds something or cannot be made.
    """
    try:
        if out is not None:
            if out.exists() and (not out.is_dir() or any(out.iterdir())):
                raise DataError(
                    f"'{out}' exists and is not an empty folder; name another with --out"
                )
            out.mkdir(parents=True, exist_ok=True)
            return out.resolve()
        runs = Path('runs')
        runs.mkdir(exist_ok=True)
        folder = first_free(runs / datetime.datetime.now().strftime('%Y-%m-%d_%H-%M-%S'))
        folder.mkdir()
        latest = runs / 'latest'
        if latest.is_symlink() or not latest.exists():
            latest.unlink(missing_ok=True)
            latest.symlink_to(folder.name, target_is_directory=True)
        return folder.resolve()
    except OSError as error:
        raise DataError(f'cannot make the folder of the run: {error}') from error


def resolved_parameters(
    file: Path, overrides: dict[str, Any], namespace: str = ''
) -> dict[str, dict[str, Any]]:
    """Every parameter of every node of the suite by node name, as it will run.

    Parameters
    ----------
    file : Path
        Parameter file.
    overrides : dict
        Values by name that hold for every node that has the parameter.
    namespace : str
        Namespace of the nodes.

    Returns
    -------
    dict of node name → dict of parameter → value
    """
    resolved: dict[str, dict[str, Any]] = {}
    for kind, name, own in instances():
        if kind.name == RECORDER:
            continue
        values: dict[str, Any] = {}
        sets = node_sets(file, kind.name, overrides, namespace, name)
        for part in reversed(list(sets.values())):
            values.update(
                {
                    name: list(value) if isinstance(value, tuple) else value
                    for name, value in dataclasses.asdict(part).items()
                }
            )
        values.update(own)
        values.update(
            {key: overrides[key] for key in ('lock_step', 'executor') if key in overrides}
        )
        resolved[name] = values
    return resolved


def write_parameters(
    folder: Path, resolved: dict[str, dict[str, Any]], recorder: dict[str, Any] | None
) -> Path:
    """Write ``parameters.yaml``, which all processes of the run read, in any namespace."""
    nodes = dict(resolved)
    if recorder is not None:
        nodes[RECORDER] = recorder
    path = folder / 'parameters.yaml'
    content = {f'/**/{name}': {'ros__parameters': values} for name, values in nodes.items()}
    path.write_text(
        '# Parameters of every node of this run.\n' + yaml.safe_dump(content, sort_keys=False),
        encoding='utf-8',
    )
    return path
