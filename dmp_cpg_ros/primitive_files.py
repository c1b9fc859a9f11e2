# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Movement primitives as YAML files."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from dmp_cpg_ros import configuration
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.core.parameters import Key, check_names, shown
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.primitives.primitive import GaussianBases, VonMisesBases
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicPrimitive
from dmp_cpg_ros.core.primitives.spring_damper import FORMS, SpringDamper
from dmp_cpg_ros.core.transformation.foot_path import Motion
from dmp_cpg_ros.core.transformation.learned_motion import MOTION_NAMES, LearnedMotion
from dmp_cpg_ros.files import writable
from dmp_cpg_ros.strict_yaml import load_yaml, naming

Primitive = DiscretePrimitive | RhythmicPrimitive


class _Kind(NamedTuple):
    """What tells the two kinds of primitive apart, in memory and in files."""

    primitive: Callable[..., Primitive]
    bases: type[GaussianBases] | type[VonMisesBases]
    scalars: tuple[str, ...]
    vectors: tuple[str, ...]
    head: str


_FORMAT = 1

_KINDS = {
    'discrete': _Kind(
        DiscretePrimitive, GaussianBases, ('phase_decay', 'duration', 'goal_rate', 'tau_rate'),
        ('start', 'goal', 'start_velocity'), """\
# Discrete movement primitive, written by dmp_cpg_ros.
# phase_decay, goal_rate, tau_rate [1/s]; duration [s]; stiffness [1/s^2]; damping [1/s];
# weights: one row per basis, one column per degree of freedom.
"""),
    'rhythmic': _Kind(
        RhythmicPrimitive, VonMisesBases,
        ('omega', 'rho', 'centre_rate', 'amplitude_rate', 'tau_rate'), ('centre',), """\
# Rhythmic movement primitive, written by dmp_cpg_ros.
# omega [rad/s]; rho, centre_rate, amplitude_rate, tau_rate [1/s]; stiffness [1/s^2];
# damping [1/s]; weights: per basis and degree of freedom, what multiplies x1 and x2.
"""),
}
_WORDS = ('format', 'kind', 'names', 'form')
_SHARED = ('stiffness', 'damping', 'basis_centres', 'basis_widths', 'weights')

KEYS = {
    'format': Key('number', f'{_FORMAT}'),
    'kind': Key('word', ' or '.join(_KINDS)),
    'names': Key('list', 'degrees of freedom, `[]` where they have no names; those of a motion '
                 f'are {MOTION_NAMES[0]}, {MOTION_NAMES[1]}, ..., {MOTION_NAMES[-1]}'),
    'form': Key('word', f'reading of τ: {" or ".join(FORMS)}'),
    'stiffness': Key('list', 'k of each degree of freedom', '1/s^2'),
    'damping': Key('list', 'b of each degree of freedom', '1/s'),
    'basis_centres': Key('list', 'phases at which the bases are largest; rhythmic ones in rad'),
    'basis_widths': Key('list', 'widths σ of the bases'),
    'weights': Key('lists', 'a row for each basis: a number for each degree of freedom, of a '
                   'rhythmic primitive two, which multiply x1 and x2'),
    'phase_decay': Key('number', 'α_x of the phase', '1/s'),
    'duration': Key('number', 'duration of the demonstration', 's'),
    'goal_rate': Key('number', 'rate of the filter on the goal', '1/s'),
    'start': Key('list', 'start of the demonstration'),
    'goal': Key('list', 'goal of the demonstration'),
    'start_velocity': Key('list', 'velocity at the start at τ = 1, per s'),
    'omega': Key('number', 'ω of the cycle at τ = 1', 'rad/s'),
    'rho': Key('number', 'attraction to the cycle ρ at radius 1', '1/s'),
    'centre_rate': Key('number', 'rate of the filter on the centre', '1/s'),
    'amplitude_rate': Key('number', 'rate of the filter on the amplitude', '1/s'),
    'centre': Key('list', 'centre of the demonstration'),
    'tau_rate': Key('number', 'rate of the filter on τ', '1/s')}
"""Entries of a primitive: those of both kinds, and those of one."""


def keys_of(kind: str) -> dict[str, Key]:
    """Entries of a kind of primitive, ``discrete`` or ``rhythmic``; all of them are needed."""
    of = _KINDS[kind]
    return {name: KEYS[name] for name in (*_WORDS, *_SHARED, *of.scalars, *of.vectors)}


def save_primitive(primitive: Primitive, path: str | Path) -> None:
    """Write a primitive; :func:`load_primitive` gives the same numbers back, bit for bit.

    Parameters
    ----------
    primitive : DiscretePrimitive or RhythmicPrimitive
    path : str or Path
        YAML file; folders above it are made.

    Raises
    ------
    MissingFileError
        If the file cannot be written.
    """
    kind = 'discrete' if isinstance(primitive, DiscretePrimitive) else 'rhythmic'
    of, spring, bases = _KINDS[kind], primitive.transformation, primitive.bases
    content: dict[str, Any] = {
        'format': _FORMAT, 'kind': kind, 'names': list(primitive.names), 'form': spring.form}
    for name in (*of.scalars, *of.vectors):
        content[name] = np.asarray(getattr(primitive, name), dtype=float).tolist()
    arrays = (spring.stiffness, spring.damping, bases.centres, bases.widths, primitive.weights)
    content.update({name: array.tolist() for name, array in zip(_SHARED, arrays, strict=True)})
    text = of.head + yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=99)
    path = writable(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')
    except OSError as error:
        raise MissingFileError(f'{path} cannot be written: {error.strerror}') from error


def load_primitive(path: str | Path) -> Primitive:
    """Read a primitive.

    Parameters
    ----------
    path : str or Path
        YAML file that :func:`save_primitive` wrote.

    Returns
    -------
    DiscretePrimitive or RhythmicPrimitive

    Raises
    ------
    MissingFileError
        If the file does not exist or cannot be read.
    DataError
        If it does not hold a primitive; the text names the key and what is valid.
    ParameterError
        If a number is out of its range.
    """
    content = load_yaml(path)
    kind = content.get('kind')
    if not isinstance(kind, str) or kind not in _KINDS:
        raise DataError(
            f"{path} is not a movement primitive: its 'kind' must be one of {', '.join(_KINDS)}")
    if content.get('format') != _FORMAT:
        raise DataError(
            f'{path}: format {shown(content.get("format"))} is not known; valid is {_FORMAT}')
    with naming(path):
        return _read(kind, content, path)


def _read(kind: str, content: dict[str, Any], path: str | Path) -> Primitive:
    of, keys = _KINDS[kind], tuple(keys_of(kind))
    check_names(content, keys, keys, str(path))
    names = content['names']
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise DataError(f"{path}: 'names' must be a list of words")
    numbers: dict[str, Any] = {key: _numbers(content, key, path) for key in keys[len(_WORDS):]}
    for key in of.scalars:
        if numbers[key].shape:
            raise DataError(f"{path}: '{key}' must be one number")
        numbers[key] = float(numbers[key])
    stiffness, damping, centres, widths, weights = (numbers.pop(key) for key in _SHARED)
    return of.primitive(
        weights=weights, transformation=SpringDamper(stiffness, damping, content['form']),
        bases=of.bases(centres, widths), names=tuple(names), **numbers)


def _numbers(content: dict[str, Any], key: str, path: str | Path) -> Any:
    try:
        return np.array(content[key], dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{path}: '{key}' must hold numbers only") from error


MOTIONS = 'dmp_cpg_ros.motions'
"""Group of entry points by which other packages offer motions of the feet."""


def load_motion(name: str) -> Motion | None:
    """Motion of the feet that the parameter ``motion`` names.

    Parameters
    ----------
    name : str
        An entry point of the group ``MOTIONS``, which is called without arguments, or a file that
        ``learn --motion`` wrote, by its path or in the config folder. Empty for none.

    Returns
    -------
    Motion or None

    Raises
    ------
    MissingFileError
        If there is neither.
    DataError
        If the file holds no motion; the text says what is wrong.
    """
    if not name:
        return None
    for offered in entry_points(group=MOTIONS, name=name):
        motion: Motion = offered.load()()
        return motion
    path = find_config(name, configuration.MOTIONS)
    with naming(path):
        primitive = load_primitive(path)
        if not isinstance(primitive, RhythmicPrimitive):
            raise DataError('a motion is a rhythmic primitive, and this one is discrete')
        with np.errstate(all='ignore'):  # what is not finite no foot can walk with
            return LearnedMotion(primitive)


def motion_overrides(name: str) -> dict[str, Any]:
    """Parameters with which a suite plays a motion at its own height: motion and clearance."""
    motion = load_motion(name)
    if motion is None:
        return {}
    known = name if Path(name).suffix == '' and not Path(name).exists() else find_config(
        name, configuration.MOTIONS)
    return {'motion': str(known), 'clearance': motion.clearance}
