# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter sets as ROS parameters: declaration, values, help."""

from __future__ import annotations

import array
import dataclasses
import inspect
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeVar

import yaml
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterEvent,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from dmp_cpg_ros.configuration import misspelt_sections, nearest
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.suite_parameters import OWNER
from dmp_cpg_ros.nodes.messages.interfaces import published_by, read_by, served_by
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite_table import KIND_OF, KINDS, WALKING

BATCH, NORMAL = 'batch', 'normal'

POLICIES = (BATCH, NORMAL)
"""Values of the parameter ``scheduling``."""

P = TypeVar('P', bound=Parameters)

Sets = Mapping[type[Any], Any]
"""Parameter sets by their class."""

FOREIGN_PREFIXES = ('use_sim_time', 'qos_overrides.', 'start_type_description_service')
"""Parameters that rclpy itself declares."""

RELIABLE, BEST_EFFORT = 'reliable', 'best_effort'

DELIVERIES = (RELIABLE, BEST_EFFORT)
"""Values of the parameter ``delivery``."""


@dataclass(frozen=True)
class NodeParameters(Parameters):
    """Parameters of every node."""

    autostart: bool = parameter(
        True, 'whether the node configures and activates itself when it starts')
    executor: str = parameter(
        'events', "rclpy's executor; events needs a quarter of the CPU time of single",
        choices=('events', 'single'))
    scheduling: str = parameter(
        BATCH, 'policy of the Linux scheduler; batch keeps a reader from interrupting its writer',
        choices=POLICIES)
    delivery: str = parameter(
        RELIABLE, 'how the node reads what comes at every tick; best_effort, for links that lose '
        'packets: nothing waits for what was lost. In lock-step, and by the recorder, it is read '
        'reliably all the same', choices=DELIVERIES)
    expected_nodes: tuple[str, ...] = parameter(
        tuple(kind.name for kind in WALKING),
        'kinds of nodes that must be connected before ~/ready says yes', choices=tuple(KINDS))


@dataclass(frozen=True)
class LockStepParameters(Parameters):
    """Parameters of every node that takes part in ticks."""

    lock_step: bool = parameter(
        False, 'whether ticks wait for all their inputs instead of for the wall clock')
    return_time: float = parameter(
        0.0, 'real time: how much longer than otherwise the gait goes on without a node that may '
        'come back; walk --respawn and the launch file with respawn:=true set it', 0.0, 2.0,
        unit='s')


class ParameterTable:
    """All parameters of a node: the fields of several parameter sets.

    Parameters
    ----------
    sets : sequence of Parameters classes
        A name that occurs in several sets is one parameter; the first set's default and range are
        declared and all sets check it.
    changeable : collection of str
        Names that may be set while the node runs; all others are read-only.
    """

    def __init__(self, sets: Sequence[type[Parameters]], changeable: Collection[str] = ()) -> None:
        """Collect the fields."""
        self.sets = tuple(dict.fromkeys(sets))
        self.fields: dict[str, dataclasses.Field[Any]] = {}
        for parameter_set in self.sets:
            for field in dataclasses.fields(parameter_set):
                self.fields.setdefault(field.name, field)
        unknown = set(changeable) - set(self.fields)
        if unknown:
            raise ParameterError(f'changeable names {sorted(unknown)} are no parameters')
        self.changeable = frozenset(changeable)

    def build(self, values: Mapping[str, Any]) -> dict[type[Parameters], Parameters]:
        """Validate values and build every set; names that are absent have their defaults.

        Raises
        ------
        ParameterError
            If a name is unknown (the valid ones are listed) or a value is bad.
        """
        for name in values:
            if name not in self.fields:
                raise ParameterError(self.unknown(name))
        return {parameter_set: parameter_set(**{
            field.name: values.get(field.name, self.fields[field.name].default)
            for field in dataclasses.fields(parameter_set)}) for parameter_set in self.sets}

    def unknown(self, name: str) -> str:
        """Say that there is no such parameter, and which there are."""
        return (f"there is no parameter '{name}'; {nearest(name, self.fields)}valid are "
                f"{', '.join(sorted(self.fields))}")

    def values(self, sets: Mapping[type[Parameters], Parameters]) -> dict[str, Any]:
        """Flatten sets to a dict from every name to its value."""
        return {name: getattr(instance, name) for instance in reversed(list(sets.values()))
                for name in (field.name for field in dataclasses.fields(instance))}

    def descriptor(self, name: str) -> ParameterDescriptor:
        """Describe a parameter to ROS: text, unit, range, words, whether it is read-only."""
        field = self.fields[name]
        low, high = field.metadata.get('minimum'), field.metadata.get('maximum')
        descriptor = ParameterDescriptor(
            description=describe(field), read_only=name not in self.changeable,
            additional_constraints=constraint(field))
        if (low, high) == (None, None):
            return descriptor
        if isinstance(field.default, float):
            huge = sys.float_info.max
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=-huge if low is None else float(low),
                to_value=huge if high is None else float(high))]
        elif isinstance(field.default, int):
            descriptor.integer_range = [IntegerRange(
                from_value=-2**63 if low is None else int(low),
                to_value=2**63 - 1 if high is None else int(high), step=1)]
        return descriptor


def describe(field: dataclasses.Field[Any]) -> str:
    """Description of a parameter with its unit."""
    unit = field.metadata.get('unit', '')
    return f"{field.metadata.get('description', '')}{f' [{unit}]' if unit else ''}"


def constraint(field: dataclasses.Field[Any]) -> str:
    """What values are valid, as text; empty when every value of the type is."""
    choices = field.metadata.get('choices', ())
    if choices:
        each = 'each ' if isinstance(field.default, tuple) else ''
        return f"{each}one of {', '.join(choices)}"
    low, high = field.metadata.get('minimum'), field.metadata.get('maximum')
    if low is None and high is None:
        return ''
    return f'from {-inf if low is None else low:g} to {inf if high is None else high:g}'


def plain(value: Any) -> Any:
    """Value as ROS takes it: arrays and tuples as lists."""
    return list(value) if isinstance(value, (array.array, list, tuple)) else value


def declare(node: Node, table: ParameterTable) -> dict[type[Parameters], Parameters]:
    """Declare a node's parameters with the overrides that it was given.

    The command line of the process tells values that a parameter file shares among all nodes
    (``/**``), which a node need not know, from misspelt ones.

    Parameters
    ----------
    node : Node
        Node whose overrides came from the command line, parameter files or its constructor.
    table : ParameterTable
        Its parameters.

    Returns
    -------
    dict from class to instance
        Every set with the values in effect.

    Raises
    ------
    ParameterError
        If an override is unknown, of the wrong type, not finite or out of range.
    """
    for path in parameter_files(sys.argv):
        for section in misspelt_sections(path, node.get_name(), {*KINDS, *KIND_OF}):
            node.get_logger().warning(f"'{path}' has a section '{section}', which means no node; "
                                      f'did you mean {node.get_name()}?')
    shared = shared_names(sys.argv)
    sets = table.build({
        name: plain(override.value) for name, override in node._parameter_overrides.items()
        if not name.startswith(FOREIGN_PREFIXES)
        and (name in table.fields or name not in shared)})
    with _told_at_once(node):
        for name, value in table.values(sets).items():
            if value == ():
                raise ParameterError(f"parameter '{name}' must not be an empty list; "
                                     f'{constraint(table.fields[name])}')
            if name in node._parameter_overrides:
                node._parameter_overrides[name] = Parameter(name, value=plain(value))
            if not node.has_parameter(name):
                node.declare_parameter(name, plain(table.fields[name].default),
                                       table.descriptor(name))
    return sets


@contextmanager
def _told_at_once(node: Node) -> Iterator[None]:
    """Gather the events of all parameters that are declared, of which rclpy publishes one each: a
    node that comes back would wake all that follow it a hundred times.
    """
    publisher, gathered = node._parameter_event_publisher, list[ParameterEvent]()
    node._parameter_event_publisher = SimpleNamespace(publish=gathered.append)
    try:
        yield
    finally:
        node._parameter_event_publisher = publisher
    if gathered:
        whole = gathered[-1]
        whole.new_parameters = [entry for event in gathered for entry in event.new_parameters]
        publisher.publish(whole)


def parameter_files(arguments: Sequence[str]) -> list[str]:
    """Parameter files of a command line that are there."""
    return [path for flag, path in zip(arguments, arguments[1:], strict=False)
            if flag == '--params-file' and Path(path).is_file()]


def shared_names(arguments: Sequence[str]) -> set[str]:
    """Names under ``/**`` in the parameter files of a command line."""
    names: set[str] = set()
    for path in parameter_files(arguments):
        section = load_yaml(path).get('/**')
        values = section.get('ros__parameters') if isinstance(section, dict) else None
        names |= set(_flat_names(values)) if isinstance(values, dict) else set()
    return names


def _flat_names(values: Mapping[str, Any], prefix: str = '') -> Iterable[str]:
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flat_names(value, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}'


if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode


def help_text(node_class: type[SuiteNode]) -> str:
    """Say what a node does, and name its topics, services and parameters."""
    kind = node_class.KIND
    summary = inspect.cleandoc(node_class.__doc__ or '').split('\n\n')[0]
    parts = [f'usage: {kind} [--help] [--ros-args [-p NAME:=VALUE] [-r FROM:=TO] '
             '[--params-file FILE] ...]', summary]
    for title, interfaces in (('subscribes to', read_by(kind)), ('publishes', published_by(kind)),
                              ('serves', served_by(kind))):
        lines = [f'  {entry.name} ({entry.type_name}{", latched" if entry.latched else ""})\n'
                 f'      {entry.meaning}' for entry in interfaces]
        parts += ['\n'.join([f'{title}:', *lines])] if lines else []
    table, lines = node_class.parameter_table(), ['parameters:']
    for name, field in table.fields.items():
        notes = (f'default {as_yaml(plain(field.default))}', constraint(field),
                 '' if name not in table.changeable else 'changeable'
                 if OWNER.get(name, kind) == kind else f'follows {OWNER[name]}')
        lines += [f'  {name}: {describe(field)}', f"      {', '.join(filter(None, notes))}"]
    return '\n\n'.join([*parts, '\n'.join(lines)])


def as_yaml(value: object) -> str:
    """Value as one would type it on the command line."""
    return str(yaml.safe_dump(value, default_flow_style=True, width=1000)).splitlines()[0]
