# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Copies of frozen records with other values."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from dmp_cpg_ros.core.maths.records import replace_unchecked


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
