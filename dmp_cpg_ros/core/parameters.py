# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters as fields of frozen dataclasses: description, unit and range in one place.

A class that derives from :class:`Parameters` validates itself when it is made, and the ROS layer
declares its node parameters from the same fields.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple, TypeVar

from dmp_cpg_ros.core.errors import ParameterError

P = TypeVar('P', bound='Parameters')

LONGEST_SHOWN = 120
"""Length up to which an error shows a wrong value."""


def parameter(
    default: Any, description: str, minimum: float | None = None, maximum: float | None = None, *,
    unit: str = '', choices: tuple[str, ...] = (),
) -> Any:
    """Describe one parameter.

    Parameters
    ----------
    default : bool, int, float, str or tuple of these
        Default value; its type is the parameter's type.
    description : str
        What it does, in one sentence.
    minimum, maximum : float, optional
        Closed range for numbers (for every entry of a tuple).
    unit : str
        SI unit as text, empty for pure numbers and words.
    choices : tuple of str
        The words that are allowed, for strings.

    Returns
    -------
    dataclasses.Field
        For use as a default in a class body.
    """
    return dataclasses.field(default=default, metadata={
        'description': description, 'minimum': minimum, 'maximum': maximum, 'unit': unit,
        'choices': choices})


@dataclasses.dataclass(frozen=True)
class Parameters:
    """Base of all parameter sets; checks type, finiteness and range of every field."""

    def __post_init__(self) -> None:
        """Validate; raises ParameterError that names the field, the value and what is valid."""
        held = self.__dict__
        for field, kind, low, high in _kinds(type(self)):
            value = held[field.name]
            if not (type(value) is kind and low <= value <= high):  # as it mostly is
                object.__setattr__(self, field.name, _checked(field, value))

    @classmethod
    def from_mapping(cls: type[P], values: Mapping[str, Any], where: str = 'parameters') -> P:
        """Build from a mapping such as a YAML section; unknown names are errors.

        Raises
        ------
        ParameterError
            If a name is not a parameter (the valid names are listed) or a value is bad.
        """
        check_names(values, [field.name for field in dataclasses.fields(cls)], (), where)
        return cls(**values)


class Key(NamedTuple):
    """Entry of a file, in the table by which the file is read.

    Attributes
    ----------
    value : str
        What it holds, in words.
    meaning : str
        What it is, in one sentence.
    unit : str
        SI unit as text, empty for pure numbers and words.
    default : str
        What holds without it, in words; empty where it is needed.
    """

    value: str
    meaning: str
    unit: str = ''
    default: str = ''


def needed(keys: Mapping[str, Key]) -> tuple[str, ...]:
    """Entries that have no default."""
    return tuple(name for name, key in keys.items() if not key.default)


def range_of(cls: type[Parameters], name: str) -> tuple[float, float]:
    """Smallest and largest value that a parameter may have; infinite where there is no bound."""
    return _range(cls.__dataclass_fields__[name])


def check_names(
    values: Any, valid: Collection[str], required: Collection[str], where: str,
) -> None:
    """Raise ParameterError unless the values are a mapping with valid names, the required ones
    among them; the text says what is valid.
    """
    if not isinstance(values, Mapping):
        raise ParameterError(f'{where} must be a mapping with {", ".join(valid)}, '
                             f'not {shown(values)}')
    for name in values:
        if name not in valid:
            raise ParameterError(
                f"{where}: there is no entry {shown(name)}; valid are {', '.join(valid)}")
    for name in required:
        if name not in values:
            raise ParameterError(
                f"{where}: the entry '{name}' is missing; required are {', '.join(required)}")


def shown(value: Any) -> str:
    """Any value in an error: one line that is not long."""
    text = repr(value)
    return text if len(text) <= LONGEST_SHOWN else f'{text[:LONGEST_SHOWN]}...'


def typed(value: Any) -> str:
    """Value as one types it for a parameter: lists in brackets, floats never as whole numbers and
    with all of their digits but rounding.
    """
    if isinstance(value, (tuple, list)):
        return f'[{", ".join(map(str, value))}]'
    if isinstance(value, float):
        text = f'{value:.12g}'
        return text if set(text) & set('.en') else f'{text}.0'
    return str(value)


def _range(field: dataclasses.Field[Any]) -> tuple[float, float]:
    low, high = field.metadata['minimum'], field.metadata['maximum']
    return -math.inf if low is None else low, math.inf if high is None else high


_Kinds = list[tuple[dataclasses.Field[Any], Any, Any, Any]]
_KINDS = dict[type, _Kinds]()


def _kinds(cls: type) -> _Kinds:
    """Fields, with the type and the range of those whose values need no other look; kept."""
    if cls not in _KINDS:
        kinds = _KINDS[cls] = _Kinds()
        for field in dataclasses.fields(cls):
            kind, (low, high) = type(field.default), _range(field)
            kinds.append((field, kind, False, True) if kind is bool else (
                field, kind, max(low, -sys.float_info.max), min(high, sys.float_info.max))
                if kind in (int, float) else (field, None, 0.0, 0.0))
    return _KINDS[cls]


def _checked(field: dataclasses.Field[Any], value: Any) -> Any:
    """Return the value converted to the type of its default, or raise ParameterError."""
    if not isinstance(field.default, tuple):
        return _checked_scalar(field, field.default, value)
    if not isinstance(value, (tuple, list)):
        such = f', such as {typed((value,))}' if isinstance(value, type(field.default[0])) else ''
        raise ParameterError(f"parameter '{field.name}' must be a list{such}, not {shown(value)}")
    return tuple(_checked_scalar(field, field.default[0], entry) for entry in value)


def _checked_scalar(field: dataclasses.Field[Any], like: Any, value: Any) -> Any:
    name, unit, choices = field.name, field.metadata['unit'], field.metadata['choices']
    if isinstance(like, bool):
        fits, valid = isinstance(value, bool), 'true or false'
    elif isinstance(like, str):
        fits = isinstance(value, str) and (not choices or value in choices)
        valid = f'one of {", ".join(choices)}' if choices else 'text'
    else:
        whole = isinstance(like, int)
        fits = isinstance(value, int if whole else (int, float)) and not isinstance(value, bool)
        valid = 'a whole number' if whole else 'a number'
    if not fits:
        raise ParameterError(f"parameter '{name}' must be {valid}, not {shown(value)}")
    if isinstance(like, (bool, str)):
        return value
    low, high = _range(field)
    if not (abs(value) <= sys.float_info.max and low <= value <= high):
        raise ParameterError(
            f"parameter '{name}' = {shown(value)} {unit} is outside its range "
            f'[{low:g}, {high:g}] {unit}'.replace('  ', ' ').rstrip())
    return value if whole else float(value)
