# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The study of verdicts says how far it is; how long any of them takes is not tested."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.studies import verdict_times


def test_it_judges_as_many_as_asked_for_and_says_how_far_it_is(
        tmp_path: Path, capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Progress, 'SILENT_S', 0.0)
    file = tmp_path / 'judged.json'
    assert verdict_times.main(['--changes', '20', '--json', str(file)]) in (0, 1)
    said = capsys.readouterr()
    assert re.match(r'\d+/20\n', said.err), said.err
    judged = json.loads(file.read_text(encoding='utf-8'))
    assert len(judged) >= 20 and all(each['change'] for each in judged)
    assert re.search(r'^\| accepted +\| \d', said.out, re.MULTILINE), said.out
