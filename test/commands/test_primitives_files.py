# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Primitives as YAML: numbers come back bit for bit, and what is wrong with a file is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml
from demonstrations import joint_angles, walking_joints

from dmp_cpg_ros.core.errors import DataError, MissingFileError, ParameterError
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.learning.rhythmic import learn_rhythmic
from dmp_cpg_ros.primitive_files import load_primitive, save_primitive

PRIMITIVES = {
    'discrete': learn_discrete(joint_angles(), 7, form='printed'),
    'rhythmic': learn_rhythmic(walking_joints(), 7, period=0.5),
}


@pytest.mark.parametrize('kind', PRIMITIVES)
def test_a_primitive_comes_back_bit_for_bit(kind, tmp_path):
    primitive, path = PRIMITIVES[kind], tmp_path / 'new folder' / 'primitive.yaml'
    save_primitive(primitive, path)
    loaded, times = load_primitive(path), np.linspace(0.0, 1.0, 50)
    assert loaded.names == primitive.names
    assert loaded.form == primitive.form
    np.testing.assert_array_equal(loaded.weights, primitive.weights)
    np.testing.assert_array_equal(
        loaded.rollout(times).positions, primitive.rollout(times).positions
    )


def test_extreme_numbers_come_back(tmp_path):
    weights = np.array([[1e-300, -1e300, 1e-5], [np.pi, 1e16, -0.0]])
    first = PRIMITIVES['discrete']
    primitive = replace(
        first,
        weights=weights,
        bases=type(first.bases)(np.array([1.0, 0.1]), np.array([0.3, 1e-7])),
    )
    save_primitive(primitive, tmp_path / 'a.yaml')
    np.testing.assert_array_equal(load_primitive(tmp_path / 'a.yaml').weights, weights)


@pytest.mark.parametrize(
    ('change', 'error', 'text'),
    [
        ({'kind': 'magic'}, DataError, 'discrete, rhythmic'),
        ({'format': 2}, DataError, 'format'),
        ({'weights': 'many'}, DataError, 'weights'),
        ({'weights': [[1.0], [2.0, 3.0]]}, DataError, 'weights'),
        ({'weights': [[1.0]]}, ParameterError, 'weights'),
        ({'colour': 'red'}, ParameterError, 'colour'),
        ({'duration': -1.0}, ParameterError, 'duration'),
        ({'duration': [1.0, 2.0]}, DataError, 'one number'),
        ({'form': 'other'}, ParameterError, 'scaled, printed'),
        ({'names': 3}, DataError, 'names'),
    ],
)
def test_wrong_content_is_named(change, error, text, tmp_path):
    path = tmp_path / 'primitive.yaml'
    save_primitive(PRIMITIVES['discrete'], path)
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), **change}))
    with pytest.raises(error, match=text):
        load_primitive(path)


def test_a_missing_key_is_named(tmp_path):
    path = tmp_path / 'primitive.yaml'
    save_primitive(PRIMITIVES['rhythmic'], path)
    content = yaml.safe_load(path.read_text())
    del content['omega']
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(ParameterError, match="'omega' is missing"):
        load_primitive(path)


def test_files_that_are_none_are_named(tmp_path):
    with pytest.raises(MissingFileError, match='nowhere.yaml'):
        load_primitive(tmp_path / 'nowhere.yaml')
    (tmp_path / 'list.yaml').write_text('[1, 2]')
    with pytest.raises(DataError, match='must be a mapping'):
        load_primitive(tmp_path / 'list.yaml')
    (tmp_path / 'broken.yaml').write_text('{a: [')
    with pytest.raises(DataError, match='line 1'):
        load_primitive(tmp_path / 'broken.yaml')
    (tmp_path / 'file').write_text('')
    with pytest.raises(MissingFileError, match='cannot be written'):
        save_primitive(PRIMITIVES['discrete'], tmp_path / 'file' / 'below.yaml')
