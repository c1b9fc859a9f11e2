# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shared memory of nodes that were killed is removed, that of living ones is not."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from ros_processes import NodeProcess, Processes, reserved_domain, wait_until

from dmp_cpg_ros.nodes.framework import shared_memory
from dmp_cpg_ros.nodes.framework.shared_memory import FOLDER, remove_left_behind

LIVING, DEAD, FRESH = (f'fastrtps_{digit * 16}' for digit in 'abc')
PORT, FOREIGN = 'fastrtps_port7415', 'somebody_else'


def of(process: NodeProcess) -> set[Path]:
    """Files of the participant of a process: what it holds locked, and what belongs to that."""
    links = [os.readlink(path) for path in Path(f'/proc/{process.pid}/fd').iterdir()]
    stems = [Path(link).name.removesuffix('_el') for link in links if link.endswith('_el')]
    return {path for path in FOLDER.iterdir() for stem in stems
            if stem in path.name and shared_memory.SEGMENT.fullmatch(path.name)}


def test_only_files_without_an_owner_are_removed(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [*(name + end for name in (LIVING, DEAD, FRESH) for end in ('', '_el')),
             PORT, f'{PORT}_el', f'sem.{PORT}_mutex', FOREIGN]
    for name in names:
        (tmp_path / name).touch()
    monkeypatch.setattr(shared_memory, 'NEW_S', 0.0)
    with (tmp_path / f'{LIVING}_el').open('rb') as owner:
        fcntl.flock(owner, fcntl.LOCK_EX)
        removed = remove_left_behind(tmp_path)
    kept = {name for name in names if LIVING in name or PORT in name or name == FOREIGN}
    assert set(removed) == set(names) - kept
    assert {path.name for path in tmp_path.iterdir()} == kept


def test_what_has_just_been_made_is_left_to_who_made_it(tmp_path: Path) -> None:
    for name in (FRESH, f'{FRESH}_el'):
        (tmp_path / name).touch()
    assert not remove_left_behind(tmp_path)


def test_there_need_be_no_shared_memory(tmp_path: Path) -> None:
    assert not remove_left_behind(tmp_path / 'none')


def test_a_killed_node_leaves_nothing_and_its_neighbour_keeps_all() -> None:
    with reserved_domain() as one, reserved_domain() as other:
        processes, neighbours = Processes(one), Processes(other)
        try:
            node = processes.executable('reference_filter')
            neighbour = neighbours.executable('reference_filter')
            for process in (node, neighbour):
                process.wait_for_output('active')
            dead, living = of(node), of(neighbour)
            assert dead and living
            node.kill()
            node.wait(60.0)
            wait_until(lambda: remove_left_behind() is not None and not any(
                path.exists() for path in dead), 60.0)
            assert of(neighbour) == living
        finally:
            processes.end()
            neighbours.end()
