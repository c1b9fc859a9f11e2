# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of parameters as a scenario asks for them: of one owner's, all at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.suite_parameters import OWNER, SuiteParameters


def read_change(value: Any, where: str) -> tuple[dict[str, Any], str]:
    """Read a mapping from names of parameters to values.

    Parameters
    ----------
    value : object
        What the file says, such as ``{inhibition_gain: 300}``.
    where : str
        For messages.

    Returns
    -------
    values : dict of str to value
        Whole numbers are floats where the parameter is one, lists are tuples. Ranges are left to
        the owner, which refuses what is outside.
    label : str
        What to tell the user.

    Raises
    ------
    DataError
        If it is no such mapping, a parameter may not change while walking, or the parameters
        belong to several nodes, so that no node could take them all at once.
    """
    if not isinstance(value, Mapping) or not value:
        raise DataError(f'{where}: set must be a mapping from parameters to values, not {value!r}')
    for name in value:
        if name not in OWNER:
            raise DataError(f"{where}: '{name}' may not be changed while walking; valid are "
                            f'{", ".join(sorted(OWNER))}')
    owners = sorted({OWNER[name] for name in value})
    if len(owners) > 1:
        raise DataError(f'{where}: {", ".join(value)} belong to {" and ".join(owners)}; make one '
                        'event for each')
    values = {name: _like(_defaults().get(name), entry) for name, entry in value.items()}
    return values, 'set ' + ', '.join(f'{name} = {entry}' for name, entry in value.items())


def _defaults() -> dict[str, Any]:
    parts = SuiteParameters()
    return {field.name: field.default for part in dataclasses.fields(parts)
            for field in dataclasses.fields(getattr(parts, part.name))}


def _like(default: Any, value: Any) -> Any:
    if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return tuple(value) if isinstance(value, list) else value
