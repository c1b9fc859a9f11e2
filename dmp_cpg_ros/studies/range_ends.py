# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Set every number that may change while the robot walks to the ends of its range.

The suite walks in lock-step in one process, so that whoever cannot end a tick any more holds all
of them up. Of each number its least and largest value, their neighbours within the range and the
least that is above zero are asked for, then its default. Whatever is accepted, ticks have to go
on; the robot may fall: gains of zero are gains.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from itertools import groupby
from math import inf, nextafter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import rclpy
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.parameter import Parameter

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.nodes.framework.execution import make_executor
from dmp_cpg_ros.nodes.framework.middleware import prepare_middleware
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.studies.output import markdown_table, parser_of, write_results
from dmp_cpg_ros.studies.walk_process import WalkProcess, ahead
from dmp_cpg_ros.suite_table import WALKING

GO_ON, WITHIN_S = 5, 20.0
"""Ticks that have to follow a change, and for how long they are waited for [s]."""

LASTS_S, RATE_HZ = 36_000.0, '50'
"""Length of the walk, which nobody waits for [s], and its ticks."""


class Asked(NamedTuple):
    """A change that is asked for.

    Attributes
    ----------
    node, name : str
        Whose parameter.
    value : float or int
        What it is set to.
    """

    node: str
    name: str
    value: float


class Answer(NamedTuple):
    """What came of it.

    Attributes
    ----------
    accepted : bool
        Whether the node has taken it.
    went_on : bool
        Whether ticks went on.
    said : str
        Last line of the walk that has ended; else empty.
    """

    accepted: bool
    went_on: bool
    said: str


def questions(kinds: Sequence[str]) -> Iterator[Asked]:
    """Changes of the numbers of the first node of each kind, its default last."""
    for kind in WALKING:
        if kind.name not in kinds:
            continue
        table = getattr(import_module(kind.module), kind.class_name).parameter_table()
        node = next(iter(kind.instances))
        for name, field in table.fields.items():
            usual = field.default
            if name not in table.changeable or isinstance(usual, bool) or not isinstance(
                    usual, (int, float)):
                continue
            low, high = field.metadata['minimum'], field.metadata['maximum']
            ends = {low, high, usual}
            if isinstance(usual, float):
                ends |= {nextafter(low, inf), nextafter(high, -inf), *(
                    value for value in (5e-324, 1e-300) if low <= value <= high)}
            for value in [*sorted(ends - {usual}), usual]:
                yield Asked(node, name, type(usual)(value))


class Client:
    """Sets parameters of a suite and watches its clock."""

    def __init__(self, context: Context) -> None:
        """Listen to the clock."""
        self._node = rclpy.create_node('range_ends', context=context)
        self._executor = make_executor('events', context)
        self._executor.add_node(self._node)
        self._ticks = 0
        clock = interface('/clock')
        self._node.create_subscription(clock.type, clock.name, self._tick, clock.reader_qos)

    def _tick(self, _: Any) -> None:
        self._ticks += 1

    def _until(self, done: Callable[[], bool], walk: WalkProcess) -> bool:
        deadline = time.monotonic() + WITHIN_S
        while not done() and time.monotonic() < deadline and walk.process.poll() is None:
            self._executor.spin_once(timeout_sec=0.01)
        return done()

    def set(self, asked: Asked, walk: WalkProcess) -> Answer:
        """Ask for a change, and wait for ticks."""
        client = self._node.create_client(SetParameters, f'{asked.node}/set_parameters')
        try:
            self._until(client.service_is_ready, walk)
            future = client.call_async(SetParameters.Request(parameters=[
                Parameter(asked.name, value=asked.value).to_parameter_msg()]))
            self._until(future.done, walk)
            begin = self._ticks
            went_on = self._until(lambda: self._ticks >= begin + GO_ON, walk)
            (result,) = future.result().results if future.done() else (None,)
        finally:
            self._node.destroy_client(client)
        return Answer(bool(result and result.successful), went_on,
                      '' if went_on else walk.lines[-1].strip())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status, 1 where ticks have not gone on."""
    parser = parser_of('range_ends', __doc__, 'every change with what came of it', jobs=False)
    kinds = [kind.name for kind in WALKING]
    parser.add_argument('--nodes', nargs='+', choices=kinds, default=kinds)
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: Any) -> int:
    answers: dict[Asked, Answer] = {}
    prepare_middleware()
    context = Context()
    rclpy.init(context=context, args=[])
    client, tell, asked_for = Client(context), Progress(), list(questions(options.nodes))
    with TemporaryDirectory() as scratch:
        walk: WalkProcess | None = None
        for number, asked in enumerate(asked_for):
            tell(f'{number}/{len(asked_for)}: {asked.node} {asked.name}')
            if walk is None:
                walk = WalkProcess.of(Path(scratch) / str(number), LASTS_S, ahead(0.3),
                                      '--lock-step', '--composed', '--rate', RATE_HZ)
                walk.must_walk()
            answers[asked] = client.set(asked, walk)
            if not answers[asked].went_on:
                print(f'{asked}: {answers[asked].said}')
                walk.end()
                walk = None
        if walk is not None:
            walk.end()
    context.try_shutdown()
    rows = []
    for node, of_node in groupby(answers, key=lambda asked: asked.node):
        of = [answers[asked] for asked in of_node]
        names = {asked.name for asked in answers if asked.node == node}
        rows.append([node, *map(str, (len(names), len(of), sum(answer.accepted for answer in of),
                                      sum(not answer.went_on for answer in of)))])
    print(markdown_table(('node', 'numbers', 'values', 'accepted', 'ticks ended'), rows))
    write_results(options.json, [{**asked._asdict(), **answer._asdict()}
                                 for asked, answer in answers.items()])
    return int(not all(answer.went_on for answer in answers.values()))


if __name__ == '__main__':
    sys.exit(main())
