# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Coupling graphs: Laplacians of known spectrum, phase offsets, errors that name the culprit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.coupling import (
    TOPOLOGIES,
    CouplingGraph,
    graph_from_edges,
    topology,
)
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.errors import ParameterError

NAMES = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')


def laplacian_spectrum(name: str, size: int) -> np.ndarray:
    """Eigenvalues of the scalar Laplacian, from textbooks on spectral graph theory."""
    k = np.arange(size)
    if name == 'all_to_all':
        return np.array([0.0] + [float(size)] * (size - 1))
    if name == 'ring':
        return np.sort(2.0 - 2.0 * np.cos(2.0 * np.pi * k / size))
    if name == 'path':
        return np.sort(2.0 - 2.0 * np.cos(np.pi * k / size))
    return np.array([0.0] + [1.0] * (size - 2) + [float(size)])


@pytest.mark.parametrize('name', NAMES[:4])
@given(size=st.integers(3, 8), gain=st.floats(0.1, 100.0))
def test_block_laplacians_have_the_textbook_spectrum_twice(
        name: str, size: int, gain: float) -> None:
    L = graph_from_edges(size, topology(name, size), gain).block_laplacian()
    assert np.allclose(L, L.T)
    expected = np.repeat(gain * laplacian_spectrum(name, size), 2)
    assert np.allclose(np.linalg.eigvalsh(L), expected, atol=1e-9 * gain * size)


@given(size=st.integers(2, 8), gain=st.floats(0.1, 100.0))
def test_in_the_directed_ring_everyone_follows_the_one_before(size: int, gain: float) -> None:
    L = graph_from_edges(size, topology('directed_ring', size), gain).block_laplacian()
    shift = np.roll(np.eye(size), 1, axis=0)
    assert np.allclose(L, gain * np.kron(np.eye(size) - shift, np.eye(2)))


@pytest.mark.parametrize('name', NAMES)
@given(data=st.data())
def test_locked_states_feel_no_coupling(name: str, data: st.DataObject) -> None:
    size = data.draw(st.integers(2, 6))
    phases = np.array(data.draw(st.lists(st.floats(-7.0, 7.0), min_size=size, max_size=size)))
    K = np.array([[2.0, 1.5], [-1.0, 3.0]])  # not symmetric; its symmetric part is positive
    graph = graph_from_edges(size, topology(name, size), K, phases)
    locked = state_at(phases + data.draw(st.floats(-4.0, 4.0)))
    assert np.allclose(graph.coupling_matrix() @ locked.ravel(), 0.0, atol=1e-9)


@given(seed=st.integers(0, 1000))
def test_turning_each_node_into_its_place_gives_the_block_laplacian(seed: int) -> None:
    rng = np.random.default_rng(seed)
    K = rng.normal(size=(2, 2)) + 4.0 * np.eye(2)
    graph = graph_from_edges(4, topology('ring', 4), K, rng.uniform(-3.0, 3.0, 4))
    y = rng.normal(size=(4, 2))
    turn = [np.array([[np.cos(p), np.sin(p)], [-np.sin(p), np.cos(p)]]) for p in graph.phases]
    x = np.array([R @ v for R, v in zip(turn, y, strict=True)])
    back = (graph.coupling_matrix() @ x.ravel()).reshape(4, 2)
    seen = np.array([R.T @ v for R, v in zip(turn, back, strict=True)])
    assert np.allclose(seen.ravel(), -graph.block_laplacian() @ y.ravel())


@pytest.mark.parametrize(('edges', 'gain', 'words'), [
    (((0, 4),), 1.0, 'nodes 0 to 3'),
    (((2, 2),), 1.0, 'edge \\(2, 2\\)'),
    (((0, 1),), 0.0, 'positive definite'),
    (((0, 1),), np.diag([1.0, -0.1]), 'smallest eigenvalue is -0.1'),
    (((0, 1),), np.nan, 'finite'),
    (((0, 1), (1, 0)), np.ones(3), 'one for each of 2 edges'),
    (((0, 1), (1, 0)), np.ones((2, 2, 2)), r'not \(2, 2, 2\)'),
    (((0, 1), (1, 0)), np.array([[1.0, 2.0]]), r'not \(1, 2\)'),
])
def test_impossible_graphs_are_refused(
        edges: tuple[tuple[int, int], ...], gain: float | np.ndarray, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        graph_from_edges(4, edges, gain)


def test_sparse_graphs_of_many_nodes_are_made_without_the_dense_one() -> None:
    for name, edges in (('ring', 100_000), ('path', 99_998), ('directed_ring', 50_000)):
        assert len(topology(name, 50_000)) == edges


def test_shapes_must_fit() -> None:
    with pytest.raises(ParameterError, match='need gains'):
        CouplingGraph(2, ((0, 1),), np.eye(2), np.zeros(2))


@pytest.mark.parametrize('name', TOPOLOGIES)
def test_one_oscillator_has_no_coupling_and_none_are_no_graph(name: str) -> None:
    assert topology(name, 1) == ()
    with pytest.raises(ParameterError, match='at least 1'):
        graph_from_edges(0, topology(name, 0), 1.0)


def test_an_unknown_topology_lists_the_known_ones() -> None:
    with pytest.raises(ParameterError, match='all_to_all, ring, path, star or directed_ring'):
        topology('tree', 4)
