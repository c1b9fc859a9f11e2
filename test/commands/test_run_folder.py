# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Folders of runs that begin at the same time."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from dmp_cpg_ros.commands.run_folder import make_run_folder


def test_walks_that_begin_at_once_have_folders_of_their_own_and_latest_is_always_there(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first, make, forestalled = make_run_folder(None), Path.mkdir, list[Path]()

    def late(path: Path, *arguments: Any, **options: Any) -> None:
        if path.parent.name == 'runs' and not forestalled:
            os.mkdir(path)  # by the other walk
            forestalled.append(path.resolve())
        make(path, *arguments, **options)

    def gone(path: Path, *_: Any, **__: Any) -> None:
        pytest.fail(f'{path} is away for a while')

    monkeypatch.setattr(Path, 'mkdir', late)
    monkeypatch.setattr(Path, 'unlink', gone)
    second = make_run_folder(None)
    assert len({first, second, *forestalled}) == 3
    assert (tmp_path / 'runs' / 'latest').resolve() == second
    assert len(list((tmp_path / 'runs').iterdir())) == 4
