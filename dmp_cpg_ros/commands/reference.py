# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m dmp_cpg_ros.commands.reference``: names of the suite as Markdown, from its tables.

Without an argument all of it, else the sections that are named. ``make doc`` puts them into
``doc/reference.md``.
"""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import Any

from dmp_cpg_ros import primitive_files
from dmp_cpg_ros.analysis.metrics.definitions import DEFINITIONS
from dmp_cpg_ros.commands.security_policy import LIFECYCLE_SERVICES, PARAMETER_SERVICES
from dmp_cpg_ros.configuration import config_folders
from dmp_cpg_ros.core.gait import gait
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.parameters import Key
from dmp_cpg_ros.core.scenario import fault, scenario
from dmp_cpg_ros.core.scenario.scenario import EVENT_KINDS
from dmp_cpg_ros.core.suite_parameters import OWNER
from dmp_cpg_ros.nodes.framework.parameters import (
    ParameterTable,
    as_yaml,
    constraint,
    describe,
    plain,
)
from dmp_cpg_ros.nodes.messages.interfaces import (
    SERVICES,
    TOPICS,
    Interface,
    published_by,
    read_by,
    served_by,
)
from dmp_cpg_ros.robot import robot_file
from dmp_cpg_ros.suite_table import KINDS, RECORDER

SEVERAL = 'several nodes'


def tables_of_parameters() -> dict[str, ParameterTable]:
    """Every kind of node with its parameters."""
    return {kind.name: getattr(import_module(kind.module), kind.class_name).parameter_table()
            for kind in KINDS.values()}


def executables() -> str:
    """Commands, studies and nodes, as ``dmp_cpg_ros`` lists them."""
    listed = subprocess.run([sys.executable, '-m', 'dmp_cpg_ros'], capture_output=True, text=True,
                            check=True).stdout
    return _table(('executable', 'does'), (
        (f'`{name}`', text) for name, text in re.findall(r'^  (\w+) +(.+)$', listed,
                                                         re.MULTILINE)))


def nodes() -> str:
    """Topics and services of every kind of node."""
    def names(entries: Iterable[Interface]) -> str:
        return ', '.join(f'`{entry.name}`' for entry in entries) or '–'

    return _table(('node', 'reads', 'publishes', 'serves'), (
        (', '.join(f'`{name}`' for name in kind.instances),
         'all that is recorded' if kind.name == RECORDER else names(read_by(kind.name)),
         names(published_by(kind.name)), names(served_by(kind.name))) for kind in KINDS.values()))


def topics() -> str:
    """Topics of the suite; those of rclpy itself (``/rosout``, ...) are not among them."""
    return _table(('topic', 'type', 'from', 'to', 'carries', ''), (
        (f'`{topic.name}`', f'`{topic.type_name}`', *_ends(topic), topic.meaning, ', '.join((
            *(['latched'] if topic.latched else []),
            *([] if topic.recorded else ['not recorded'])))) for topic in TOPICS))


def services() -> str:
    """Services of the suite, then those that rclpy gives to every managed node."""
    return _table(('service', 'type', 'served by', 'does'), [
        *((f'`{service.name}`', f'`{service.type_name}`', _ends(service)[0], service.meaning)
          for service in SERVICES),
        *((f'`{name}`', f'`{package}`', 'every node', what) for names, package, what in (
            (PARAMETER_SERVICES, 'rcl_interfaces', 'parameters'),
            (LIFECYCLE_SERVICES, 'lifecycle_msgs', 'states of a managed node'))
          for name in names)])


def parameters() -> str:
    """Parameters of the nodes: each stands under the node that owns it, or alone has it."""
    rows: dict[tuple[str, str, str], list[str]] = {}
    changeable: set[str] = set()
    for kind, table in tables_of_parameters().items():
        changeable |= table.changeable
        for name, field in table.fields.items():
            notes = as_yaml(plain(field.default)), constraint(field)
            valid = f'`{notes[0]}`' + (f', {notes[1]}' if notes[1] else '')
            rows.setdefault((name, valid, describe(field)), []).append(kind)
    groups: dict[str, list[tuple[str, ...]]] = {title: [] for title in (*KINDS, SEVERAL)}
    for (name, valid, text), kinds in rows.items():
        own = kinds[0] if len(kinds) == 1 else OWNER.get(name, SEVERAL)
        where = 'every node' if len(kinds) == len(KINDS) else ', '.join(kinds)
        groups[own].append((f'`{name}`', valid, text, 'yes' if name in changeable else '',
                            *([where] if own == SEVERAL else [])))
    return '\n'.join(
        f'\n### Parameters of {title}\n\n' + _table(
            ('parameter', 'default, valid', 'meaning', 'changes while it runs',
             *(['nodes'] if title == SEVERAL else [])), sorted(group))
        for title, group in groups.items() if group)


def scenarios() -> str:
    """Entries of a scenario, and of each of its events beside what happens."""
    return _keys(scenario.KEYS) + '\nOf every event:\n\n' + _keys(scenario.EVENT_KEYS)


def events() -> str:
    """Kinds of events of a scenario."""
    def meaning(read: Callable[..., Any]) -> str:
        if isinstance(read, partial):
            (what,) = read.args
            return f'`{what}: true` requests it as the service `{what}` does'
        text = (inspect.getdoc(read) or '').split('\n\n')[0].replace('\n', ' ')
        return text.replace('``', '`').removeprefix('Read ')

    assert set(REQUESTS) <= set(EVENT_KINDS)
    return _table(('event', 'value'), (
        (f'`{kind}`', meaning(read)) for kind, read in EVENT_KINDS.items()))


def failures() -> str:
    """Entries of the event ``fail``, what may fail, and how."""
    return '\n'.join((
        _keys(fault.KEYS),
        _table(('component', 'what it is', 'of a leg'), (
            (f'`{name}`', text, 'perhaps' if name in fault.PLACED else '')
            for name, text in fault.COMPONENTS.items())),
        _table(('kind', 'what a component does'), (
            (f'`{name}`', text) for name, text in fault.KINDS.items()))))


WITHOUT_COMMENT = {
    'foxglove/dmp_cpg_ros.json': 'Layout for Foxglove: the robot, plots of oscillators, gains, '
                                 'feet and speed, diagnostics, and buttons to drive and stop.',
    'maps/free_field.pbm': 'The picture of free_field.yaml.',
    'plotjuggler/dmp_cpg_ros.xml': 'Layout for PlotJuggler: tabs of gait, body and joints.',
    'rviz/dmp_cpg_ros.rviz': 'Displays for RViz: the robot, its feet, its path and its frames.'}
"""What files of ``config/`` are that do not say so themselves."""


def first_sentence(text: str) -> str:
    """First sentence of the comment with which a file begins, which may go over several lines;
    empty where there is none. An example of a command below it, which is indented, is not read.
    """
    found = (re.match(r'(?:<\?xml[^>]*>\s*)?<!--(.*?)-->', text, re.DOTALL)
             or re.match(r'((?:# ?\S.*\n)+)', text))
    lines = found[1].splitlines() if found else []
    comment = ' '.join(line.removeprefix('#').strip() for line in lines).strip()
    return re.split(r'(?<=\.)\s', comment)[0].rstrip(':.') + '.' if comment else ''


def robots() -> str:
    """Entries of a robot's file."""
    return _keys(robot_file.KEYS)


def gaits() -> str:
    """Entries of each gait, below its name, below ``gaits``."""
    return _keys(gait.KEYS)


def primitives() -> str:
    """Entries of a primitive's file by its kind; a motion is a rhythmic one."""
    of = {kind: primitive_files.keys_of(kind) for kind in ('discrete', 'rhythmic')}
    shared = {name: key for name, key in of['discrete'].items() if name in of['rhythmic']}
    return '\n'.join((_keys(shared), *(
        f'Of a {kind} one besides:\n\n'
        + _keys({name: key for name, key in keys.items() if name not in shared})
        for kind, keys in of.items())))


def files() -> str:
    """Files of ``config/``, with the sentence with which each of them begins."""
    folder, *_ = config_folders()
    names = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob('*.*'))]
    return _table(('file', 'what it is'), (
        (f'`{name}`', WITHOUT_COMMENT.get(name) or first_sentence(
            (folder / name).read_text(encoding='utf-8'))) for name in names))


def metrics() -> str:
    """Numbers of ``metrics.json``."""
    return _table(('metric', 'unit', 'meaning'), (
        (f'`{name}`', unit, text) for name, (unit, text) in DEFINITIONS.items()))


SECTIONS: dict[str, Callable[[], str]] = {section.__name__: section for section in (
    executables, nodes, topics, services, parameters, scenarios, events, failures, robots, gaits,
    primitives, files, metrics)}
"""Sections by their name."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print sections; returns the exit status."""
    asked = sys.argv[1:] if arguments is None else arguments
    for name in asked or SECTIONS:
        if name not in SECTIONS:
            print(f"reference: there is no section '{name}'; valid are {', '.join(SECTIONS)}",
                  file=sys.stderr)
            return 2
        print(f'## {name.capitalize()}\n\n{SECTIONS[name]()}')
    return 0


def _ends(entry: Interface) -> tuple[str, str]:
    """Who writes and who reads, or serves and calls."""
    every = set(KINDS)
    return tuple('every node' if every <= set(kinds) else ', '.join(
        f'{kind}{" (sometimes)" if kind in entry.sometimes else ""}' for kind in kinds) or '–'
        for kinds in (entry.publishers, entry.subscribers))  # type: ignore[return-value]


def _keys(keys: Mapping[str, Key]) -> str:
    """Table of the entries of a file."""
    return _table(('entry', 'value', 'unit', 'without it', 'meaning'), (
        (f'`{name}`', key.value, key.unit, key.default or 'refused', key.meaning)
        for name, key in keys.items()))


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    def line(cells: Sequence[str]) -> str:
        return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"

    return line(head) + line(['---'] * len(head)) + ''.join(map(line, rows))


if __name__ == '__main__':
    sys.exit(main())
