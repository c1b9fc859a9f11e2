# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Finds the YAML files of ``config/`` in every kind of installation, and what they say to a node.

Needs no ROS: a node's parameter file is read here as ROS 2 reads it, so that the plain loop, the
certificate and the studies run with the numbers of the nodes.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Collection, Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.core.parameters import shown
from dmp_cpg_ros.files import other_than_file
from dmp_cpg_ros.strict_yaml import load_yaml

PACKAGE = 'dmp_cpg_ros'
_PACKAGE_FOLDER = Path(__file__).resolve().parent
_IN_SHARE = Path('share', PACKAGE, 'config')
_PARAMETERS_KEY = 'ros__parameters'

ROBOTS, SCENARIOS, MOTIONS, POLICIES = 'robots', 'scenarios', 'motions', 'policies'
"""Folders of ``config/`` for files of one kind."""

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
