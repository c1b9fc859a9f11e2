# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Folders of runs: those that begin at the same time, and what a run is given."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
import yaml

from dmp_cpg_ros.commands import walk
from dmp_cpg_ros.commands.run_folder import make_run_folder
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite_table import RETURN_S, ROBOT, WALKING_NODES


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


@pytest.mark.parametrize('options', [(), ('--respawn',), ('--respawn', '--lock-step')])
def test_the_return_time_of_the_parameter_file_wins(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]) -> None:
    monkeypatch.setattr('dmp_cpg_ros.commands.suite_run.run_suite', lambda *_, **__: (True, []))
    usual = {'/**': {'ros__parameters': {'gait': 'amble'}}}
    own = {f'/**/{ROBOT}': {'ros__parameters': {'return_time': 0.25}}}
    for number, content in enumerate((usual, usual | own)):
        file, folder = tmp_path / f'{number}.yaml', tmp_path / f'run_{number}'
        file.write_text(yaml.dump(content), encoding='utf-8')
        assert walk.main(['--parameters', str(file), '--out', str(folder), *options]) == 0
        written = load_yaml(folder / 'parameters.yaml')
        told = {name: values['return_time'] for name in WALKING_NODES if 'return_time' in (
            values := written[f'/**/{name}']['ros__parameters'])}
        expected = dict.fromkeys(WALKING_NODES, RETURN_S) if options == ('--respawn',) else {}
        assert told == expected | ({ROBOT: 0.25} if number else {})


def test_nodes_of_a_walk_are_not_given_one_name(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
        ) -> None:
    """The second one took the first for another suite in the domain."""
    monkeypatch.chdir(tmp_path)
    assert walk.main(['--ros-args', '-r', '__node:=foo']) == 2
    assert "cannot all have the name 'foo'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
