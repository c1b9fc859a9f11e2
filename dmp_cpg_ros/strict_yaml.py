# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads YAML strictly, with the scalars of ROS 2, and says where it is not such YAML."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from math import inf
from pathlib import Path
from typing import Any

import yaml

from dmp_cpg_ros.core.errors import DataError, DmpCpgError, MissingFileError
from dmp_cpg_ros.files import readable

LARGEST_FILE = 2**18
"""Longest file that is read [B]."""

SHORT = 2**15
"""Texts whose parse is kept are shorter [characters]."""

DEEPEST = 32
"""Deepest nesting of mappings and lists."""


def load_yaml(path: str | Path) -> dict[str, Any]:
    """Read a YAML file that holds one mapping, see :func:`parse_yaml`.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    dict
        Its content; empty for a file without content.

    Raises
    ------
    MissingFileError
        If the file does not exist or cannot be read.
    DataError
        If it is too large, not YAML, or not a mapping; the text names the line.
    """
    path = readable(path)
    try:
        with path.open('rb') as file:
            data = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise MissingFileError(f"cannot read '{path}': {reason}") from error
    # Bytes that are no UTF-8 become characters that are no YAML.
    content = parse_yaml(data.decode(errors='surrogateescape'), f"'{path}'")
    if not isinstance(content, (dict, type(None))):
        raise DataError(f"'{path}', line 1: must be a mapping (name: value), "
                        f'not {type(content).__name__}')
    return content or {}


@contextmanager
def naming(path: str | Path) -> Iterator[None]:
    """Name a file in the errors about what it holds; too much of it is such an error as well."""
    try:
        yield
    except DmpCpgError as error:
        if str(path) in str(error):
            raise
        raise type(error)(f"'{path}': {error}") from error
    except (MemoryError, OverflowError, RecursionError) as error:
        raise DataError(f"'{path}' holds more than can be read: {error}") from error


def parse_yaml(text: str, where: str) -> Any:
    """Read YAML strictly: mappings, lists, and scalars as ROS 2 reads them.

    Stricter than PyYAML: a name that stands twice, an alias and a tag other than those of the
    scalars are errors (an alias can stand for more values than there is memory; ROS 2 refuses
    them too). ``1e-3`` is a number, a date is text, and names are always text.

    Parameters
    ----------
    text : str
        At most ``LARGEST_FILE`` characters, nested at most ``DEEPEST`` deep.
    where : str
        What the text is, for errors.

    Returns
    -------
    dict, list, str, float, int, bool or None

    Raises
    ------
    DataError
        If it is not such YAML; the text names line and column.
    """
    if len(text) > LARGEST_FILE:
        raise DataError(f'{where} is longer than {LARGEST_FILE} characters')
    try:
        node = _kept(text) if len(text) < SHORT else _Composer(text).get_single_node()
        return None if node is None else _value(node)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f', line {mark.line + 1}, column {mark.column + 1}' if mark else ''
        raise DataError(f'{where}{place}: {error.problem or error.context}') from error
    except yaml.reader.ReaderError as error:
        line = text.count('\n', 0, error.position) + 1
        raise DataError(f'{where}, line {line}: not YAML in UTF-8: {error.reason}') from error


class _Composer(yaml.SafeLoader):
    """PyYAML's parser with the scalars of ROS 2, without aliases and bottomless nesting."""

    _depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent):
            raise _error(event, 'an alias (*name) is not valid; write out what it stands for')
        if self._depth >= DEEPEST:
            raise _error(event, f'nested deeper than {DEEPEST}')
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


@lru_cache(maxsize=16)
def _kept(text: str) -> yaml.Node | None:
    """Parse a text that is parsed again: all nodes of a process read the same few files."""
    return _Composer(text).get_single_node()


def _value(node: yaml.Node) -> Any:
    """Content of a node as plain Python values."""
    kind = node.tag.removeprefix(_TAG)
    if kind == 'map' and isinstance(node, yaml.MappingNode):
        content: dict[str, Any] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or not key.value.isprintable():
                raise _error(key, 'a name must be a word or text on one line')
            if key.value in content:
                raise _error(key, f'the key {key.value!r} stands twice')
            content[key.value] = _value(value)
        return content
    # launch writes the lists that it hands to a node as tuples.
    if kind in ('seq', 'python/tuple') and isinstance(node, yaml.SequenceNode):
        return [_value(entry) for entry in node.value]
    if kind not in _SCALARS or not isinstance(node, yaml.ScalarNode):
        raise _error(node, f'the tag {node.tag!r} is not valid here; valid are '
                           f"{', '.join(_SCALARS)}")
    try:
        return _SCALARS[kind][1](node.value)
    except (KeyError, ValueError) as error:
        raise _error(node, f'no value of type {kind}: {error}') from error


def _error(place: Any, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=place.start_mark)


def _whole(text: str) -> int:
    """Whole number in decimal, octal (``010``) or hexadecimal notation."""
    digits = text.lstrip('+-').lower()
    base = 16 if digits.startswith('0x') else 8 if digits.startswith('0') else 10
    value = int(text, base) if len(text) < 80 else inf
    if not -2**63 <= value < 2**63:
        raise ValueError('a whole number has at most 64 bits')
    return int(value)


_TAG = 'tag:yaml.org,2002:'
_SCALARS: dict[str, tuple[str | None, Callable[[str], Any]]] = {
    'str': (None, str),
    'null': ('~|null|Null|NULL|', lambda _: None),
    'bool': ('(?i:true|false|yes|no|on|off)', lambda text: _Composer.bool_values[text.lower()]),
    'int': ('[-+]?(0[0-7]*|[1-9][0-9]*|0x[0-9a-fA-F]+)', _whole),
    'float': (r'[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?\.(?i:inf)|\.(?i:nan)',
              lambda text: float(re.sub(r'\.(?=[iInN])', '', text)))}
"""Kinds of scalars: what is one without a tag, first match first, and how it is read."""

_Composer.yaml_implicit_resolvers = {}
for _kind, (_pattern, _) in _SCALARS.items():
    if _pattern is not None:
        _Composer.add_implicit_resolver(_TAG + _kind, re.compile(f'(?:{_pattern})$'), None)
