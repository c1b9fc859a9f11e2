# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rules for hierarchies, and their conclusions against simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.contraction.finding import PROVED, SAMPLED
from dmp_cpg_ros.core.contraction.hierarchy import (
    CONTRACTING,
    TRANSVERSE,
    Part,
    coupled_primitives,
    hierarchy,
)
from dmp_cpg_ros.core.contraction.synchronisation import synchronisation
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.paper.theorems import discrete_primitive, rhythmic_primitive

FILTER = Part('filter', CONTRACTING, 3.0)
CYCLE = Part('cycle', TRANSVERSE, 16.0)
SPRING = Part('spring', CONTRACTING, 9.0, SAMPLED)


def test_contracting_parts_make_a_contracting_whole_and_one_cycle_a_transverse_one() -> None:
    assert hierarchy(FILTER, FILTER).kind == CONTRACTING
    assert hierarchy(FILTER, CYCLE).kind == TRANSVERSE
    assert hierarchy(CYCLE, FILTER).kind == TRANSVERSE
    with pytest.raises(ParameterError, match='both transverse'):
        hierarchy(CYCLE, CYCLE)


def test_the_whole_is_as_slow_as_its_slowest_part_and_as_sure_as_the_least_sure() -> None:
    whole = rhythmic_primitive(FILTER, CYCLE, SPRING)
    assert whole.kind == TRANSVERSE and whole.rate == 3.0 and whole.grade == SAMPLED
    assert hierarchy(FILTER, CYCLE).grade == PROVED
    assert not hierarchy(FILTER, Part('unstable', CONTRACTING, -1.0)).holds


def test_theorems_refuse_parts_of_the_wrong_kind() -> None:
    assert discrete_primitive(FILTER, FILTER, SPRING).kind == CONTRACTING
    with pytest.raises(ParameterError, match="'cycle' must be contracting"):
        discrete_primitive(FILTER, CYCLE, SPRING)
    with pytest.raises(ParameterError, match="'filter' must be transverse"):
        rhythmic_primitive(FILTER, FILTER, SPRING)
    with pytest.raises(ParameterError, match='kind must be one of'):
        Part('x', 'nice', 1.0)


@pytest.mark.parametrize(('gain', 'holds'), [(30.0, True), (3.0, False)])
def test_coupled_primitives_need_the_synchronisation_condition(gain: float, holds: bool) -> None:
    found = synchronisation(graph_from_edges(4, topology('path', 4), gain), 8.0)
    whole = coupled_primitives(FILTER, CYCLE, found, [SPRING])
    assert whole.holds is holds and whole.kind == TRANSVERSE


def test_a_contracting_hierarchy_forgets_its_initial_state_at_the_promised_rate() -> None:
    rates = np.array([1.0, 2.0, 1.5])

    def field(x: np.ndarray) -> np.ndarray:
        return np.array([-rates[0] * x[0], -rates[1] * x[1] + 5.0 * np.sin(x[0]),
                         -rates[2] * x[2] + 4.0 * x[0] * np.cos(x[1])])

    whole = discrete_primitive(*(Part('p', CONTRACTING, float(rate)) for rate in rates))
    a, b = np.array([2.0, -1.0, 0.5]), np.array([-1.0, 3.0, 0.0])
    distances = []
    for _ in range(1200):
        a, b = (solve_ivp(lambda _, x: field(x), (0.0, 0.01), x, rtol=1e-9, atol=1e-12).y[:, -1]
                for x in (a, b))
        distances.append(np.linalg.norm(a - b))
    decay = np.log(distances[400] / distances[1200 - 1]) / 7.99
    assert decay >= 0.95 * whole.rate  # every rate below it, after a transient
