# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Finds the YAML files of ``config/`` in every kind of installation, and reads them strictly.

Needs no ROS: a node's parameter file is read here as ROS 2 reads it, so that the plain loop, the
certificate and the studies run with the numbers of the nodes.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Collection, Iterator, Mapping
from difflib import get_close_matches
from itertools import count
from pathlib import Path
from typing import Any

import yaml

from dmp_cpg_ros.core.errors import DataError, MissingFileError

PACKAGE = 'dmp_cpg_ros'
_PACKAGE_FOLDER = Path(__file__).resolve().parent
_IN_SHARE = Path('share', PACKAGE, 'config')
_PARAMETERS_KEY = 'ros__parameters'


def find_config(name: str | Path) -> Path:
    """Find a YAML file of the package by its name below ``config/``, or any file by its path.

    A path that exists is taken as it is. Otherwise the first of `config_folders` that has the
    name wins; the ending ``.yaml`` may be left out.

    Parameters
    ----------
    name : str or Path
        For example ``gaits.yaml``, ``robots/mini_quadruped`` or ``/home/me/my_robot.yaml``.

    Returns
    -------
    Path
        The absolute path of an existing file.

    Raises
    ------
    MissingFileError
        If there is no such file; the text lists the folders searched and the names that exist.
    """
    given = Path(name).expanduser()
    if given.is_file():
        return given.absolute()
    folders = [] if given.is_absolute() else config_folders()
    for folder in folders:
        for candidate in (folder / given, folder / f'{given}.yaml'):
            if candidate.is_file():
                return candidate
    raise MissingFileError(_not_found(name, folders))


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
    """Read a YAML file that holds one mapping.

    Stricter than PyYAML in one thing, a key that stands twice is an error, and as generous as
    ROS 2 in another, ``1e-3`` is a number.

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
        If it is not YAML, or not a mapping; the text names the line.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding='utf-8')
    except OSError as error:
        raise MissingFileError(f"cannot read '{path}': {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise DataError(f"'{path}' is not a text file in UTF-8: {error}") from error
    try:
        content = yaml.load(text, Loader=_StrictLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f', line {mark.line + 1}, column {mark.column + 1}' if mark else ''
        raise DataError(f"'{path}'{where}: {error.problem or error.context}") from error
    except yaml.YAMLError as error:
        raise DataError(f"'{path}' is not YAML: {error}") from error
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise DataError(f"'{path}', line 1: must be a mapping (name: value), "
                        f'not {type(content).__name__}')
    return content


def read_value(text: str) -> Any:
    """Read one value as a parameter file's; raises DataError when it is not YAML."""
    try:
        return yaml.load(text, Loader=_StrictLoader)
    except yaml.YAMLError as error:
        raise DataError(f"'{text}' is no value in YAML: {error}") from error


def node_parameters(path: str | Path, node_name: str) -> dict[str, Any]:
    """Read the parameters of one node from a ROS 2 parameter file, as the node itself would.

    Of the sections that mean the node (its own, ``/**``, ``/**/name`` ...) the later one in the
    file overrides the earlier one. Parameters in groups get dotted names.

    Parameters
    ----------
    path : str or Path
        Parameter file with ``ros__parameters`` under each node's name.
    node_name : str
        With a namespace where it has one: ``/robot_1/posture_control``.

    Returns
    -------
    dict
        Parameter name to value.

    Raises
    ------
    MissingFileError
        If the file does not exist or cannot be read.
    DataError
        If it is no parameter file, or has neither a section ``/**`` nor one for this node.
    """
    sections = _sections(load_yaml(path), '', path)
    matching = [name for name in sections if _applies(name, node_name)]
    if not matching:
        raise DataError(f"'{path}' has no parameters for node '{node_name}'; it has sections for "
                        f"{', '.join(sections) or 'no node'}")
    merged: dict[str, Any] = {}
    for name in matching:
        merged.update(sections[name])
    return merged


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
    found = []
    for section in _sections(load_yaml(path), '', path):
        name = section.rpartition('/')[2]
        if (any(name == kind or name.startswith(f'{kind}_') for kind in kinds)
                and not _applies(section, f'{namespace}/{name}')):
            found.append(section)
    return found


class _StrictLoader(yaml.SafeLoader):
    """A SafeLoader that refuses a key twice and reads ``1e-3`` as a number, as ROS 2 does."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != 'tag:yaml.org,2002:merge':
                if key.value in seen:
                    raise yaml.constructor.ConstructorError(
                        None, None, f"the key '{key.value}' stands twice", key.start_mark)
                seen.add(key.value)
        return super().construct_mapping(node, deep=deep)

    def construct_tuple(self, node: yaml.SequenceNode) -> list[Any]:
        """Read what launch makes of a list that it hands to a node."""
        return list(self.construct_sequence(node))


_StrictLoader.add_implicit_resolver(
    'tag:yaml.org,2002:float', re.compile(r'^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$'),
    list('-+.0123456789'))
_StrictLoader.add_constructor('tag:yaml.org,2002:python/tuple', _StrictLoader.construct_tuple)


def _not_found(name: str | Path, folders: list[Path]) -> str:
    """Say what is there instead: the files of the folder that was meant, and near names."""
    if not folders:
        return f"file '{name}' does not exist"
    meant = Path(name).parent
    exist = sorted({path.relative_to(folder) for folder in folders
                    for path in folder.rglob('*.yaml')})
    beside = [path.as_posix() for path in exist if path.parent == meant]
    by_stem = {path.stem: path for path in exist if path.parent == meant or meant == Path('.')}
    near = get_close_matches(Path(name).stem, by_stem, n=1)
    guess = f'did you mean {by_stem[near[0]].with_suffix("").as_posix()}? ' if near else ''
    return (f"file '{name}' does not exist in the current folder nor in "
            f"{', '.join(map(str, folders))}; {guess}there are {', '.join(beside) or 'no files'}")


def _sections(content: Mapping[str, Any], prefix: str,
              path: str | Path) -> dict[str, dict[str, Any]]:
    """Collect the flat parameters of every node, keyed by the node's full name or pattern."""
    sections: dict[str, dict[str, Any]] = {}
    for key, value in content.items():
        name = f"{prefix}/{str(key).strip('/')}"
        if not isinstance(value, Mapping):
            raise DataError(f"'{path}': '{name}' must be a mapping with '{_PARAMETERS_KEY}:' in "
                            f'it, not {value!r}')
        below = dict(value)
        parameters = below.pop(_PARAMETERS_KEY, {})
        if not isinstance(parameters, Mapping):
            raise DataError(f"'{path}': '{_PARAMETERS_KEY}' of '{name}' must be a mapping, "
                            f'not {parameters!r}')
        if _PARAMETERS_KEY in value:
            sections.setdefault(name, {}).update(_flat(parameters))
        sections.update(_sections(below, name, path))
    return sections


def _flat(parameters: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in parameters.items():
        if isinstance(value, Mapping):
            flat.update(_flat(value, f'{prefix}{key}.'))
        else:
            flat[f'{prefix}{key}'] = value
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
