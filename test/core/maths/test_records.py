# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Records that are made at every tick, and copies with other values."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field, fields, replace

import pytest

from dmp_cpg_ros.core.maths.records import made_often, replace_unchecked


@dataclass(frozen=True)
class Place:
    """Anything."""

    x: float
    y: float = 2.0


def test_it_does_what_replace_does() -> None:
    place = Place(1.0)
    moved = replace_unchecked(place, y=3.0)
    assert moved == replace(place, y=3.0) == Place(1.0, 3.0)
    assert place == Place(1.0, 2.0) and replace_unchecked(place) == place
    assert hash(moved) == hash(Place(1.0, 3.0)) and repr(moved) == repr(Place(1.0, 3.0))


def test_a_field_that_does_not_exist() -> None:
    with pytest.raises(TypeError, match='x, y, not all of'):
        replace_unchecked(Place(1.0), z=1.0)


@dataclass(frozen=True)
class Way:
    """Fields of all kinds."""

    begin: float
    end: float = 2.0
    through: list[float] = field(default_factory=list)
    length: float = field(init=False)

    def __post_init__(self) -> None:
        vars(self)['length'] = self.end - self.begin


@made_often
@dataclass(frozen=True)
class OftenWay(Way):
    """The same, made often."""


def test_what_is_made_often_is_as_it_was() -> None:
    for arguments, named in (
            ((1.0,), {}), ((1.0, 5.0, [3.0]), {}), ((), {'end': 7.0, 'begin': 0.0})):
        slow, quick = Way(*arguments, **named), OftenWay(*arguments, **named)
        assert vars(quick) == vars(slow)
        assert repr(quick) == repr(slow).replace('Way', 'OftenWay')
        assert quick == deepcopy(quick) == OftenWay(*arguments, **named) != OftenWay(-1.0)
        assert vars(replace(quick, end=9.0)) == vars(replace(slow, end=9.0))
    assert OftenWay(1.0).through is not OftenWay(1.0).through
    assert [each.name for each in fields(OftenWay)] == [each.name for each in fields(Way)]
    with pytest.raises(TypeError, match='begin'):
        OftenWay()
