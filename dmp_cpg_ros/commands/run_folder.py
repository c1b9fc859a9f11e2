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
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.suite_nodes import RECORDER, SUITE_NODES
from dmp_cpg_ros.suite import node_sets


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


def resolved_parameters(file: Path, overrides: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Every parameter of every node of the suite by node name, as it will run.

    Parameters
    ----------
    file : Path
        Parameter file.
    overrides : dict
        Values by name that hold for every node that has the parameter.

    Returns
    -------
    dict of node name → dict of parameter → value
    """
    resolved: dict[str, dict[str, Any]] = {}
    for node in SUITE_NODES:
        values: dict[str, Any] = {}
        for part in reversed(list(node_sets(file, node.kind, overrides).values())):
            values.update(
                {
                    name: list(value) if isinstance(value, tuple) else value
                    for name, value in dataclasses.asdict(part).items()
                }
            )
        if node.kind == 'leg_transformation':
            values['leg'] = node.name[-len(LEGS[0]) :]
        values.update(
            {name: overrides[name] for name in ('lock_step', 'executor') if name in overrides}
        )
        resolved[node.name] = values
    return resolved


def write_parameters(
    folder: Path, resolved: dict[str, dict[str, Any]], recorder: dict[str, Any] | None
) -> Path:
    """Write ``parameters.yaml``, the parameter file that all processes of the run read."""
    nodes = dict(resolved)
    if recorder is not None:
        nodes[RECORDER.name] = recorder
    path = folder / 'parameters.yaml'
    content = {name: {'ros__parameters': values} for name, values in nodes.items()}
    path.write_text(
        '# Parameters of every node of this run.\n' + yaml.safe_dump(content, sort_keys=False),
        encoding='utf-8',
    )
    return path
