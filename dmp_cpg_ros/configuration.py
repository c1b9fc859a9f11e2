# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Finds the YAML files of ``config/`` in every kind of installation, and reads them strictly.

Needs no ROS: a node's parameter file is read here as ROS 2 reads it, so that the plain loop, the
certificate and the studies run with the numbers of the nodes.
"""

from __future__ import annotations

import glob
import os
import re
import stat
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from functools import lru_cache
from itertools import count
from math import inf
from pathlib import Path
from typing import Any

import yaml

from dmp_cpg_ros.core.errors import DataError, DmpCpgError, MissingFileError
from dmp_cpg_ros.core.parameters import shown

PACKAGE = 'dmp_cpg_ros'
_PACKAGE_FOLDER = Path(__file__).resolve().parent
_IN_SHARE = Path('share', PACKAGE, 'config')
_PARAMETERS_KEY = 'ros__parameters'

ROBOTS, SCENARIOS, MOTIONS, POLICIES = 'robots', 'scenarios', 'motions', 'policies'
"""Folders of ``config/`` for files of one kind."""

LARGEST_FILE = 2**18
"""Longest file that is read [B]."""

_PROCESSES = Path('/proc')
"""Where Linux has a folder for every process that runs."""

SHORT = 2**15
"""Texts whose parse is kept are shorter [characters]."""

DEEPEST = 32
"""Deepest nesting of mappings and lists."""


def find_config(name: str | Path, folder: str = '') -> Path:
    """Find a YAML file of the package by its name below ``config/``, or any file by its path.

    A path that exists is taken as it is. Otherwise the first of `config_folders` that has the
    name wins; the ending ``.yaml`` may be left out.

    Parameters
    ----------
    name : str or Path
        For example ``gaits.yaml``, ``robots/mini_quadruped`` or ``/home/me/my_robot.yaml``.
    folder : str
        Folder of the kind of file that is meant, such as ``ROBOTS``: there a name without a
        folder of its own is looked for.

    Returns
    -------
    Path
        The absolute path of an existing file.

    Raises
    ------
    MissingFileError
        If there is no such file; the text says what else bears the name, or lists the folders
        searched and the names that exist.
    """
    if not isinstance(name, (str, Path)) or '\0' in str(name) or name in ('', Path()):
        raise MissingFileError(f'{shown(name)} is no name of a file')
    given = Path(os.path.expanduser(name))
    if os.path.isfile(given):
        return given.absolute()
    places = [] if given.is_absolute() else config_folders()
    meant = folder / given if given.parent == Path() else given
    candidates = [place / name for place in places for name in (meant, f'{meant}.yaml')]
    for candidate in candidates:
        if os.path.isfile(candidate):
            return candidate
    for candidate in (given, *candidates):
        if kind := other_than_file(candidate):
            raise MissingFileError(f'{str(candidate)!r} {kind}, not a file')
    raise MissingFileError(_not_found(name, meant, places))


_FOLDER, _PIPE = 'is a folder', 'is a pipe'
_KINDS = ((stat.S_ISDIR, _FOLDER), (stat.S_ISFIFO, _PIPE), (stat.S_ISSOCK, 'is a socket'),
          (stat.S_ISCHR, 'is a device'), (stat.S_ISBLK, 'is a device'))


def other_than_file(path: str | Path) -> str:
    """What a path is that is no file, such as ``is a folder``; empty where there is nothing."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return ''
    return next((kind for holds, kind in _KINDS if holds(mode)), '')


def readable(path: str | Path) -> Path:
    """Path of a file that a user names, which is about to be read to its end.

    A pipe without a writer is waited for, and a device such as ``/dev/zero`` has no end.

    Parameters
    ----------
    path : str or Path
        Need not exist: to open it then fails by itself.

    Raises
    ------
    MissingFileError
        If it is, or links to, a folder, a pipe, a socket or a device.
    """
    if kind := other_than_file(path):
        raise MissingFileError(f"'{path}' {kind}, not a file")
    return Path(path)


def writable(path: str | Path) -> Path:
    """Path that a user names, which is about to be written.

    What is open already may be: ``/dev/stdout``, also into a pipe, and the shell's ``>(...)``.

    Parameters
    ----------
    path : str or Path
        Need not exist.

    Raises
    ------
    MissingFileError
        If it is, or links to, a folder, or a pipe by name: to open that waits for a reader.
    """
    kind = other_than_file(path)
    if kind == _FOLDER or kind == _PIPE and os.path.exists(os.path.realpath(path)):
        raise MissingFileError(f"'{path}' {kind}, not a file to write")
    return Path(path)


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """File to write that takes the place of a path when it is whole; what is there stays until
    then. What is no file, such as ``/dev/stdout``, is written itself; errors are as of
    :func:`writable`. What a process that was killed has left of the same file is removed.
    """
    path = writable(path)
    if path.exists() and not path.is_file():
        yield path
        return
    path = path.resolve()
    new = path.with_name(f'.{os.getpid()}.{path.name}')  # its ending may say what it is to be
    _remove_left(path)
    try:
        yield new
        os.replace(new, path)
    finally:
        new.unlink(missing_ok=True)


def _remove_left(path: Path) -> None:
    """Remove what processes that do not run any more have begun instead of a file."""
    for left in path.parent.glob(f'.*.{glob.escape(path.name)}'):
        writer = left.name[1:-len(path.name) - 1]
        if writer.isdecimal() and _PROCESSES.is_dir() and not (_PROCESSES / writer).exists():
            left.unlink(missing_ok=True)


def nearest(name: str, valid: Iterable[str]) -> str:
    """Question for an error whether a name that is near was meant; empty where none is."""
    near = get_close_matches(name, list(valid), n=1)
    return f'did you mean {near[0]}? ' if near else ''


def config_folders() -> list[Path]:
    """List the package's ``config/`` folders, the one that belongs to the running code first.

    Returns
    -------
    list of Path
        Those that exist of: beside the package in a source checkout; under the prefix that the
        package is installed in (pip, colcon); under each prefix of ``AMENT_PREFIX_PATH``; under
        ``sys.prefix``.
    """
    checkout = _PACKAGE_FOLDER.parent
    places = [checkout / 'config'] if (checkout / 'package.xml').is_file() else []
    places += [parent / _IN_SHARE for parent in _PACKAGE_FOLDER.parents]
    prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    places += [Path(prefix) / _IN_SHARE for prefix in (*prefixes, sys.prefix) if prefix]
    return [place for place in dict.fromkeys(places) if place.is_dir()]


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


def node_parameters(content: Mapping[str, Any], node_name: str, path: str | Path
                    ) -> dict[str, Any]:
    """Pick the parameters of one node from a ROS 2 parameter file, as the node itself would.

    Of the sections that mean the node (its own, ``/**``, ``/**/name`` ...) the later one in the
    file overrides the earlier one. Parameters in groups get dotted names.

    Parameters
    ----------
    content : mapping
        Of the file, with ``ros__parameters`` under each node's name.
    node_name : str
        With a namespace where it has one: ``/robot_1/posture_control``.
    path : str or Path
        The file, for errors.

    Returns
    -------
    dict
        Parameter name to value.

    Raises
    ------
    DataError
        If it is no parameter file, or has neither a section ``/**`` nor one for this node.
    """
    sections = _sections(content, path)
    matching = [values for name, values in sections.items() if _applies(name, node_name)]
    if not matching:
        raise DataError(f"'{path}' has no parameters for node '{node_name}'; it has sections for "
                        f"{', '.join(sections) or 'no node'}")
    return {name: value for values in matching for name, value in values.items()}


def misspelt_sections(path: str | Path, name: str, names: Collection[str]) -> list[str]:
    """Sections of a parameter file that mean none of some nodes, but are nearest to one of them.

    Parameters
    ----------
    path : str or Path
        Parameter file.
    name : str
        Of the one node, without its namespace.
    names : collection of str
        Of all nodes that there are.
    """
    own = {section: section.rpartition('/')[2] for section in _sections(load_yaml(path), path)}
    return [section for section, last in own.items() if last not in names
            and get_close_matches(last, list(names), n=1) == [name]]


def unused_sections(path: str | Path, namespace: str, kinds: Collection[str]) -> list[str]:
    """Sections of a parameter file that mean a kind of node, but none in a namespace.

    Parameters
    ----------
    path : str or Path
        Parameter file.
    namespace : str
        For example ``/robot1``.
    kinds : collection of str
        Names that nodes have or begin with.
    """
    named = {section: section.rpartition('/')[2] for section in _sections(load_yaml(path), path)}
    return [section for section, name in named.items()
            if any(f'{name}_'.startswith(f'{kind}_') for kind in kinds)
            and not _applies(section, f'{namespace}/{name}')]


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


def _not_found(name: str | Path, meant: Path, places: list[Path]) -> str:
    """Say what is there instead: the files of the folder that was meant, and near names."""
    if not places:
        return f'file {str(name)!r} does not exist'
    exist = sorted({path.relative_to(place) for place in places for path in place.rglob('*.yaml')})
    beside = [path.as_posix() for path in exist if path.parent == meant.parent]
    by_stem = {path.stem: path.with_suffix('').as_posix() for path in exist
               if meant.parent in (path.parent, Path())}
    near = get_close_matches(meant.stem, by_stem, n=1)
    guess = f'did you mean {by_stem[near[0]]}? ' if near else ''
    told = f"; {guess}there are {', '.join(beside)}" if beside else ''
    searched = ', '.join(str(place / meant.parent) for place in places)
    return f'file {str(name)!r} does not exist in the current folder nor in {searched}{told}'


def _sections(content: Mapping[str, Any], path: str | Path, prefix: str = ''
              ) -> dict[str, dict[str, Any]]:
    """Collect the flat parameters of every node, keyed by the node's full name or pattern."""
    sections: dict[str, dict[str, Any]] = {}
    for key, value in content.items():
        name = f"{prefix}/{key.strip('/')}"
        if not isinstance(value, Mapping):
            raise DataError(f"'{path}': '{name}' must be a mapping with '{_PARAMETERS_KEY}:' in "
                            f'it, not {shown(value)}')
        below = dict(value)
        if _PARAMETERS_KEY in below:
            parameters = below.pop(_PARAMETERS_KEY)
            if not isinstance(parameters, Mapping):
                raise DataError(f"'{path}': '{_PARAMETERS_KEY}' of '{name}' must be a mapping, "
                                f'not {shown(parameters)}')
            sections.setdefault(name, {}).update(_flat(parameters))
        sections.update(_sections(below, path, name))
    return sections


def _flat(parameters: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in parameters.items():
        name = f'{prefix}{key}'
        flat.update(_flat(value, f'{name}.') if isinstance(value, Mapping) else {name: value})
    return flat


def _applies(section: str, node_name: str) -> bool:
    """Tell whether a section, ``*`` for one level and ``**`` for any number, means this node."""
    words = {'**': '(/[^/]+)*', '*': '/[^/]+'}
    pattern = ''.join(words.get(word, f'/{re.escape(word)}')
                      for word in section.strip('/').split('/'))
    return re.fullmatch(pattern, f"/{node_name.strip('/')}") is not None


def numbered(path: Path) -> Iterator[Path]:
    """A path, then the same with ``_1``, ``_2``, … at its end, without an end."""
    yield path
    for number in count(1):
        yield path.with_name(f'{path.name}_{number}')


def first_free(path: Path) -> Path:
    """The first of :func:`numbered` that does not exist."""
    return next(name for name in numbered(path) if not name.exists())
