# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Movement primitives as YAML files."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from dmp_cpg_ros.configuration import find_config, load_yaml
from dmp_cpg_ros.core.errors import DataError, MissingFileError, ParameterError
from dmp_cpg_ros.core.parameters import check_names, shown
from dmp_cpg_ros.core.primitives.basis import GaussianBases, VonMisesBases
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicPrimitive
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.transformation.foot_motion import Motion
from dmp_cpg_ros.core.transformation.learned_motion import LearnedMotion

_FORMAT = 1

_HEADER = {
    'discrete': '# Discrete movement primitive, written by dmp_cpg_ros.\n'
    '# phase_decay, goal_rate, tau_rate [1/s]; duration [s]; stiffness [1/s^2]; damping [1/s];\n'
    '# weights: one row per basis, one column per degree of freedom.\n',
    'rhythmic': '# Rhythmic movement primitive, written by dmp_cpg_ros.\n'
    '# omega [rad/s]; rho, centre_rate, amplitude_rate, tau_rate [1/s]; stiffness [1/s^2];\n'
    '# damping [1/s]; weights: per basis and degree of freedom, what multiplies x1 and x2.\n',
}

_SCALARS = {
    'discrete': ('phase_decay', 'duration', 'goal_rate', 'tau_rate'),
    'rhythmic': ('omega', 'rho', 'centre_rate', 'amplitude_rate', 'tau_rate'),
}
_VECTORS = {'discrete': ('start', 'goal', 'start_velocity'), 'rhythmic': ('centre',)}
_COMMON = (
    'format',
    'kind',
    'names',
    'form',
    'stiffness',
    'damping',
    'basis_centres',
    'basis_widths',
    'weights',
)


def save_primitive(primitive: DiscretePrimitive | RhythmicPrimitive, path: str | Path) -> None:
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
    spring = primitive.transformation
    content: dict[str, Any] = {
        'format': _FORMAT,
        'kind': kind,
        'names': list(primitive.names),
        'form': spring.form,
    }
    content.update({name: float(getattr(primitive, name)) for name in _SCALARS[kind]})
    content.update(
        {name: np.asarray(getattr(primitive, name)).tolist() for name in _VECTORS[kind]}
    )
    content.update(
        stiffness=spring.stiffness.tolist(),
        damping=spring.damping.tolist(),
        basis_centres=primitive.bases.centres.tolist(),
        basis_widths=primitive.bases.widths.tolist(),
        weights=primitive.weights.tolist(),
    )
    text = _HEADER[kind] + yaml.safe_dump(
        content, sort_keys=False, default_flow_style=None, width=99
    )
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')
    except OSError as error:
        raise MissingFileError(f'{path} cannot be written: {error.strerror}') from error


def load_primitive(path: str | Path) -> DiscretePrimitive | RhythmicPrimitive:
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
    path = Path(path)
    content = load_yaml(path)
    kind = content.get('kind')
    if not isinstance(kind, str) or kind not in _SCALARS:
        raise DataError(
            f"{path} is not a movement primitive: its 'kind' must be one of {', '.join(_SCALARS)}"
        )
    if content.get('format') != _FORMAT:
        raise DataError(
            f'{path}: format {shown(content.get("format"))} is not known; valid is {_FORMAT}'
        )
    keys = (*_COMMON, *_SCALARS[kind], *_VECTORS[kind])
    check_names(content, keys, keys, str(path))
    return _built(content, path)


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
    path = find_config(name)
    try:
        primitive = load_primitive(path)
        if not isinstance(primitive, RhythmicPrimitive):
            raise DataError('a motion is a rhythmic primitive, and this one is discrete')
        return LearnedMotion(primitive)
    except (DataError, ParameterError) as error:
        told = str(error)
        raise DataError(told if str(path) in told else f'{path}: {told}') from error


def motion_overrides(name: str) -> dict[str, Any]:
    """Parameters with which a suite plays a motion at its own height: motion and clearance."""
    motion = load_motion(name)
    if motion is None:
        return {}
    known = name if Path(name).suffix == '' and not Path(name).exists() else find_config(name)
    return {'motion': str(known), 'clearance': motion.clearance}


def _built(content: dict[str, Any], path: Path) -> DiscretePrimitive | RhythmicPrimitive:
    kind = content['kind']
    numbers = {
        key: _numbers(content, key, path)
        for key in (
            'stiffness',
            'damping',
            'basis_centres',
            'basis_widths',
            'weights',
            *_VECTORS[kind],
        )
    }
    vectors: dict[str, Any] = {key: numbers[key] for key in _VECTORS[kind]}
    scalars: dict[str, Any] = {}
    for key in _SCALARS[kind]:
        value = _numbers(content, key, path)
        if value.shape != ():
            raise DataError(f"{path}: '{key}' must be one number")
        scalars[key] = float(value)
    names = content['names']
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise DataError(f"{path}: 'names' must be a list of words")
    spring = SpringDamper(numbers['stiffness'], numbers['damping'], content['form'])
    if kind == 'discrete':
        return DiscretePrimitive(
            weights=numbers['weights'],
            transformation=spring,
            names=tuple(names),
            bases=GaussianBases(numbers['basis_centres'], numbers['basis_widths']),
            **scalars,
            **vectors,
        )
    return RhythmicPrimitive(
        weights=numbers['weights'],
        transformation=spring,
        names=tuple(names),
        bases=VonMisesBases(numbers['basis_centres'], numbers['basis_widths']),
        **scalars,
        **vectors,
    )


def _numbers(content: dict[str, Any], key: str, path: Path) -> Any:
    try:
        return np.array(content[key], dtype=float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{path}: '{key}' must hold numbers only") from error
