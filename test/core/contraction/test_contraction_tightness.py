# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The tightness table: certified values work, and ask for little more than what works."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from dmp_cpg_ros.studies import tightness
from dmp_cpg_ros.studies.tightness import threshold

Trial = Callable[[str], tightness.Row]


def test_thresholds_are_found_from_either_side() -> None:
    assert threshold(lambda x: x > 3.0, 1.0, 2.0) == pytest.approx(3.0, rel=0.011)
    assert threshold(lambda x: x < 3.0, 40.0, 20.0) == pytest.approx(3.0, rel=0.011)


def test_every_row_is_told_as_it_is_found() -> None:
    told: list[str] = []
    row = next(tightness.rows(['ring', 'path'], told.append))
    assert told == [f'row 1 of 20: {row.condition}, ring']


@pytest.mark.parametrize(('row', 'loosest'), [
    (tightness.synchronisation_row, 1.05), (tightness.capture_row, 1.15),
    (tightness.vote_row, 1.1)])
@pytest.mark.parametrize('graph', ['ring', 'path'])
def test_gains_are_certified_above_and_close_to_what_works(row: Trial, loosest: float,
                                                           graph: str) -> None:
    found = row(graph)
    assert found.certified >= 0.985 * found.works            # the bisection's own precision
    assert found.ratio <= loosest


@pytest.mark.parametrize('graph', ['all_to_all', 'directed_ring'])
def test_contraction_costs_what_the_origin_costs(graph: str) -> None:
    found = tightness.contraction_row(graph, tightness.OMEGA)
    assert found.certified >= found.works and found.ratio < 1.7


@pytest.mark.parametrize(('graph', 'omega'), [
    ('path', tightness.SLOW_OMEGA), ('ring', tightness.OMEGA)])
def test_contraction_along_tubes_costs_hardly_more_than_what_works(
        graph: str, omega: float) -> None:
    found = tightness.tube_row(graph, omega=omega)
    assert 0.985 * found.works <= found.certified and found.ratio <= 1.15


@pytest.mark.parametrize('row', [tightness.mismatch_row, tightness.step_row])
def test_limits_are_certified_below_and_close_to_what_works(row: Trial) -> None:
    found = row('star')
    assert found.certified <= found.works and found.ratio <= 1.5


@pytest.mark.parametrize('graph', ['all_to_all', 'path'])
def test_the_bound_on_the_time_to_rest_is_kept_and_close(graph: str) -> None:
    found = tightness.rest_row(graph)
    assert found.works <= found.certified and found.ratio <= 1.5


def test_the_table_has_a_reason_for_every_condition(capsys: pytest.CaptureFixture[str]) -> None:
    assert tightness.main(['--graphs', 'ring']) == 0
    out = capsys.readouterr().out
    for reason in tightness.REASONS.values():
        assert reason in out
