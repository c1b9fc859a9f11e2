# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A sample of the study of proofs, and that it would notice a checker that is too kind."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest

from dmp_cpg_ros.studies import proofs


@functools.lru_cache(maxsize=1)
def drawn() -> tuple[tuple[bool, str], ...]:
    """Random settings: whether they are certified, and their proofs."""
    return tuple(proofs.random_attempt((7, seed)) for seed in range(24))


def texts() -> list[str]:
    return [text for _, text in drawn() if text]


real_lie = proofs.lie


@functools.cache
def lie(text: str, kind: str, number: int) -> tuple[str, bool] | None:
    """A forgery, which the checkers judge and one that accepts everything, too."""
    return real_lie(text, kind, np.random.default_rng((number, *kind.encode())))


def verdicts(kind: str, count: int) -> list[str]:
    rng, numbers = np.random.default_rng(list(kind.encode())), itertools.count()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(proofs, 'lie', lambda text, kind, _: lie(text, kind, next(numbers)))
        return [proofs.verdict(one, kind, other, rng) for one, other in [
            (texts()[k], texts()[k - 1]) for k in rng.integers(len(texts()), size=count)]]


def test_a_random_setting_has_a_proof_if_and_only_if_it_is_certified() -> None:
    for certified, text in drawn():
        assert certified == bool(text)
        assert not text or proofs.accepted(text)
    assert 5 < len(texts()) < len(drawn())


def test_no_claim_of_a_proof_is_refuted_by_other_formulas() -> None:
    assert [proofs.all_refuted(text, np.random.default_rng(0)) for text in texts()] == [
        []] * len(texts())


@pytest.mark.parametrize('kind', [*proofs.DAMAGES, *proofs.LIES])
def test_spoiled_proofs_are_refused(kind: str) -> None:
    found = verdicts(kind, 12)
    assert proofs.REFUSED in found and proofs.WRONG not in found


@pytest.mark.parametrize('kind', proofs.LIES)
def test_a_checker_that_accepts_everything_is_noticed(kind: str,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proofs, 'accepted', lambda text: True)
    assert proofs.WRONG in verdicts(kind, 12)
