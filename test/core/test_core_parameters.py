# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter sets check themselves and say what is valid."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters

SETS = (CanonicalParameters, InhibitionParameters, LegParameters, PostureParameters,
        ReferenceParameters)


@dataclasses.dataclass(frozen=True)
class Example(Parameters):
    rate: float = parameter(2.0, 'a rate', unit='1/s', minimum=0.0, maximum=10.0)
    count: int = parameter(3, 'a count', minimum=1)
    name: str = parameter('a', 'a word', choices=('a', 'b'))
    switch: bool = parameter(False, 'a switch')
    rates: tuple[float, ...] = parameter((1.0, 2.0), 'rates', maximum=5.0)


@pytest.mark.parametrize(('name', 'value', 'words'), [
    ('rate', -0.1, 'outside its range [0, 10] 1/s'),
    ('rate', 10.1, 'outside its range'),
    ('rate', np.nan, 'outside its range'),
    ('rate', np.inf, 'outside its range'),
    ('rate', 'fast', 'must be a number'),
    ('rate', True, 'must be a number'),
    ('count', 0, 'outside its range [1, inf]'),
    ('count', 2.5, 'must be a whole number'),
    ('count', True, 'must be a whole number'),
    ('name', 'c', 'one of a, b'),
    ('name', 1, 'one of a, b'),
    ('switch', 1, 'true or false'),
    ('rates', 3.0, 'must be a list'),
    ('rates', [1.0, 6.0], 'outside its range'),
    ('rates', [1.0, 'x'], 'must be a number'),
])
def test_bad_values_are_refused_by_name_with_what_is_valid(
        name: str, value: object, words: str) -> None:
    with pytest.raises(ParameterError) as raised:
        Example.from_mapping({name: value})
    assert f"'{name}'" in str(raised.value) and words in str(raised.value)


def test_unknown_names_list_the_known_ones() -> None:
    with pytest.raises(ParameterError, match="here: .* no entry 'speed'; valid are rate,"):
        Example.from_mapping({'speed': 1.0}, 'here')


def test_values_become_the_type_of_their_default() -> None:
    made = Example.from_mapping({'rate': 3, 'rates': [1, 2]})
    assert type(made.rate) is float
    assert made.rates == (1.0, 2.0) and all(type(value) is float for value in made.rates)


@pytest.mark.parametrize('kind', SETS)
def test_every_parameter_is_described_and_its_default_is_valid(kind: type[Parameters]) -> None:
    made = kind()
    for field in dataclasses.fields(kind):
        assert field.metadata['description'], field.name
        assert kind.from_mapping({field.name: getattr(made, field.name)}) == made
