# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The answer to ``--help`` of a node, from the interfaces table and the parameter sets."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from typing import TYPE_CHECKING

import yaml

from dmp_cpg_ros.nodes.interfaces import Interface, published_by, read_by, served_by
from dmp_cpg_ros.nodes.ros_parameters import ParameterTable, constraint, describe, ros_value

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.managed_node import ManagedNode


def help_text(node_class: type[ManagedNode]) -> str:
    """Say what a node does, and name its topics, services and parameters."""
    kind = node_class.KIND
    summary = inspect.cleandoc(node_class.__doc__ or '').split('\n\n')[0]
    parts = [f'usage: {kind} [--help] [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] '
             '[--params-file FILE] ...]', summary]
    for title, interfaces in (('subscribes to', read_by(kind)), ('publishes', published_by(kind)),
                              ('serves', served_by(kind))):
        if interfaces:
            parts.append('\n'.join([f'{title}:', *_interface_lines(interfaces)]))
    parts.append('\n'.join(['parameters:', *_parameter_lines(node_class.parameter_table())]))
    return '\n\n'.join(parts)


def _interface_lines(interfaces: Iterable[Interface]) -> list[str]:
    return [f'  {entry.name} ({entry.type_name}{", latched" if entry.latched else ""})\n'
            f'      {entry.meaning}' for entry in interfaces]


def _parameter_lines(table: ParameterTable) -> list[str]:
    lines = []
    for name, field in table.fields.items():
        notes = [f'default {_yaml(ros_value(field.default))}']
        notes += [text for text in (constraint(field),) if text]
        notes += ['changeable'] if name in table.changeable else []
        lines += [f'  {name}: {describe(field)}', f"      {', '.join(notes)}"]
    return lines


def _yaml(value: object) -> str:
    """Value as one would type it on the command line."""
    return str(yaml.safe_dump(value, default_flow_style=True, width=1000)).splitlines()[0]
