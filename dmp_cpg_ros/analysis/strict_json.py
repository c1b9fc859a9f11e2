# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""JSON that every parser reads: no NaN, no infinity, no NumPy types."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Set
from pathlib import Path
from typing import Any

import numpy as np

from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.files import readable, replacing


def plain(value: Any) -> Any:
    """Value in types that JSON knows; numbers that are not finite become None."""
    if isinstance(value, (np.generic, np.ndarray)):
        return plain(value.tolist())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return plain({of.name: getattr(value, of.name) for of in dataclasses.fields(value)})
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, Set):
        return sorted((plain(entry) for entry in value), key=str)
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)


def to_json(value: Any) -> str:
    """Strict, indented JSON text with a newline at its end."""
    return json.dumps(plain(value), indent=2, allow_nan=False, ensure_ascii=False) + '\n'


def write_json(path: Path, value: Any) -> None:
    """Write strict JSON as UTF-8; a file that was there is replaced as a whole, or stays."""
    text = to_json(value)
    with replacing(path) as new:
        new.write_text(text, encoding='utf-8')


def read_json(path: Path) -> dict[str, Any]:
    """Read an earlier result; empty where there is none.

    Raises
    ------
    DataError
        If there is one that cannot be read.
    """
    try:
        content = json.loads(readable(path).read_text(encoding='utf-8'))
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except (MissingFileError, OSError, ValueError, RecursionError) as error:
        raise DataError(f"'{path}' cannot be read: {error}; repair or remove it") from None
    if not isinstance(content, dict):
        raise DataError(f"'{path}' must hold an object of JSON; repair or remove it")
    return content
