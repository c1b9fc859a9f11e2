# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The launch file starts the suite, as seen by recorders in the place of ROS 2's launch system."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from checkout import ROOT, setup_constant

ARGUMENTS = {'parameters': 'suite.yaml', 'robot': '', 'lock_step': '', 'record': 'false'}


class Recorded(SimpleNamespace):
    """Anything of launch: keeps what it was made with."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        super().__init__(positional=positional, **named)

    def perform(self, context: dict[str, str]) -> str:
        return context[self.positional[0]]


def launch_file(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    names = {
        'launch': ['LaunchContext', 'LaunchDescription'],
        'launch.actions': ['DeclareLaunchArgument', 'OpaqueFunction', 'Shutdown'],
        'launch.conditions': ['IfCondition'],
        'launch.substitutions': ['LaunchConfiguration', 'PathJoinSubstitution'],
        'launch_ros': [],
        'launch_ros.actions': ['Node'],
        'launch_ros.substitutions': ['FindPackageShare'],
    }
    for module, members in names.items():
        stand_in = ModuleType(module)
        for member in members:
            setattr(stand_in, member, type(member, (Recorded,), {}))
        monkeypatch.setitem(sys.modules, module, stand_in)
    path = ROOT / 'launch' / 'suite.launch.py'
    spec = importlib.util.spec_from_file_location('suite_launch', path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_node_is_started_once_and_each_leg_has_its_own(
        monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = launch_file(monkeypatch).nodes(ARGUMENTS)
    executables = setup_constant('EXECUTABLES')
    assert isinstance(executables, dict)
    wanted = {name for name, target in executables.items() if '.nodes.' in target}
    assert {node.executable for node in nodes} == wanted
    names = [node.name for node in nodes]
    assert len(set(names)) == len(names) == len(wanted) + 3
    for leg in ('fl', 'fr', 'rl', 'rr'):
        node = nodes[names.index(f'leg_{leg}')]
        assert node.executable == 'leg_transformation'
        assert node.parameters[-1] == {'leg': leg}


def test_arguments_left_empty_override_nothing_and_given_ones_reach_the_nodes(
        monkeypatch: pytest.MonkeyPatch) -> None:
    module = launch_file(monkeypatch)
    quiet = {node.name: node.parameters[1:] for node in module.nodes(ARGUMENTS)}
    assert quiet['mujoco_robot'] == quiet['reference_filter'] == quiet['inhibition'] == []
    given = {node.name: node.parameters[1:]
             for node in module.nodes({**ARGUMENTS, 'robot': 'go2.yaml', 'lock_step': 'true'})}
    assert given['mujoco_robot'] == [{'lock_step': True, 'robot': 'go2.yaml'}]
    assert given['reference_filter'] == [{'lock_step': True}]
    assert given['leg_rr'] == [{'lock_step': True, 'robot': 'go2.yaml', 'leg': 'rr'}]
    assert given['bag_recorder'] == []


def test_the_arguments_are_declared(monkeypatch: pytest.MonkeyPatch) -> None:
    description = launch_file(monkeypatch).generate_launch_description()
    declared = [entity.positional[0] for entity in description.positional[0]
                if type(entity).__name__ == 'DeclareLaunchArgument']
    assert set(declared) == set(ARGUMENTS)
