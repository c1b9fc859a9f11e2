# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of faults: what it does with a walk that goes wrong."""

from __future__ import annotations

import random
from math import inf
from pathlib import Path

import pytest

from dmp_cpg_ros.studies import study_faults


class Stuck:
    """A walk that never comes to walk, and does not end by itself."""

    lines: list[str] = []
    process = None

    def said(self, pattern: str, begin: int = 0) -> float:
        """Nothing."""
        return inf

    def end(self) -> int:
        """End it."""
        return 137


def test_a_walk_that_never_walks_is_ended(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_faults.WalkProcess, 'of', lambda *_, **__: Stuck())
    monkeypatch.setattr(study_faults, '_judge', lambda *_: None)
    outcome = study_faults.run(
        'amble', 0.5, False, False, ['inhibition'], random.Random(0), tmp_path)
    assert (outcome.status, outcome.kills) == (137, [])
