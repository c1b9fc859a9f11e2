# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads launch files by stand-ins for ROS 2's launch system, which the wheels do not have."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from checkout import ROOT

NAMES = {
    'launch': ['LaunchContext', 'LaunchDescription'],
    'launch.actions': ['DeclareLaunchArgument', 'IncludeLaunchDescription', 'OpaqueFunction',
                       'Shutdown'],
    'launch.launch_description_sources': ['PythonLaunchDescriptionSource'],
    'launch_ros': [],
    'launch_ros.actions': ['Node'],
    'launch_ros.parameter_descriptions': ['ParameterValue'],
}
"""What the launch files use of ROS 2's launch system."""


class Recorded(SimpleNamespace):
    """Anything of launch: keeps what it was made with."""

    def __init__(self, *positional: Any, **named: Any) -> None:
        super().__init__(positional=positional, **named)


def read_launch_file(name: str, patch: pytest.MonkeyPatch) -> ModuleType:
    """Import a launch file of the package; its ``described`` makes nodes of given arguments."""
    for module, members in NAMES.items():
        stand_in = ModuleType(module)
        for member in members:
            setattr(stand_in, member, type(member, (Recorded,), {}))
        patch.setitem(sys.modules, module, stand_in)
    spec = importlib.util.spec_from_file_location(
        name.replace('.', '_'), ROOT / 'launch' / f'{name}.launch.py')
    assert spec is not None and spec.loader is not None
    file = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(file)
    return file


def with_arguments(arguments: Mapping[str, str]) -> Any:
    """Context in which a launch file has arguments."""
    return SimpleNamespace(launch_configurations=arguments)
