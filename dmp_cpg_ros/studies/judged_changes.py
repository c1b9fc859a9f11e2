# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changes of parameters of a suite that walks in real time: when they are answered, and how long
the node that judges them is without a tick meanwhile.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rclpy
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.context import Context
from rclpy.parameter import Parameter

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.suite_parameters import CANONICAL
from dmp_cpg_ros.nodes.framework.execution import make_executor
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.values import Array
from dmp_cpg_ros.studies.walk_process import WITHIN_S, WalkProcess, ahead

JUDGE, OUTPUT = CANONICAL, 'canonical_state'

ASKED: tuple[Mapping[str, object], ...] = (
    {'coupling_gain': 90.0}, {'coupling_gain': 1.0}, {'rho': 6.0}, {'cadence_scale': 4.0},
    {'gait': 'trot'}, {'coupling_gain': 100.0, 'rho': 8.0}, {'coupling_graph': 'path'},
    {'gait': 'amble'}, {'cadence_scale': 3.0, 'coupling_gain': 30.0, 'rho': 3.0},
    {'coupling_graph': 'all_to_all'})
"""What is asked for, in turn: numbers, words, gaits, several at once, about a third refused."""

EVERY_S = 0.6
"""Period of the requests, above that of what a node hears in the long run [s]."""


class Judged(NamedTuple):
    """What was measured.

    Attributes
    ----------
    answers : ndarray (n,)
        From a request to its answer [s].
    refused : int
        How many of them refused.
    busy, quiet : ndarray
        From one tick to the next, where somebody watches [s]: while a request was not yet
        answered, and else.
    """

    answers: Array
    refused: int
    busy: Array
    quiet: Array


def judged_changes(way: Sequence[str], folder: Path, count: int) -> Judged:
    """Ask a suite that walks for changes.

    Parameters
    ----------
    way : sequence of str
        Arguments of ``walk`` that share the processes.
    folder : Path
        For the scenario and the run.
    count : int
        Number of requests.

    Raises
    ------
    DmpCpgError
        If the suite does not come to walk, or does not answer.
    """
    walk, context = WalkProcess.of(folder, 600.0, ahead(), *way), Context()
    try:
        walk.must_walk()
        rclpy.init(context=context, args=[])
        return _ask(context, count)
    finally:
        walk.end()
        context.try_shutdown()


def _ask(context: Context, count: int) -> Judged:
    node, topic = rclpy.create_node('judged_changes', context=context), interface(OUTPUT)
    executor, ticks = make_executor('events', context), list[float]()
    node.create_subscription(topic.type, topic.name, lambda _: ticks.append(time.monotonic()),
                             topic.reader_qos, raw=True)
    client = node.create_client(SetParametersAtomically, f'{JUDGE}/set_parameters_atomically')
    executor.add_node(node)

    def spin(until: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + WITHIN_S
        while not until():
            executor.spin_once(timeout_sec=0.01)
            if time.monotonic() > deadline:
                raise DmpCpgError(what)

    spin(lambda: bool(ticks) and client.service_is_ready(), f'nothing is heard of {JUDGE}')
    asked, refused = list[tuple[float, float]](), 0
    for number in range(count):
        next_s, values = time.monotonic() + EVERY_S, ASKED[number % len(ASKED)]
        while time.monotonic() < next_s:
            executor.spin_once(timeout_sec=0.01)
        future = client.call_async(SetParametersAtomically.Request(parameters=[
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]))
        when = time.monotonic()
        spin(future.done, f'no answer to {values}')
        asked.append((when, time.monotonic()))
        refused += not future.result().result.successful
    executor.remove_node(node)
    node.destroy_node()
    return _sorted(np.array(ticks), np.array(asked), refused)


def _sorted(ticks: Array, asked: Array, refused: int) -> Judged:
    """Periods of ticks by whether a request was open within them."""
    periods, begin, end = np.diff(ticks), ticks[:-1, None], ticks[1:, None]
    busy = np.any((end >= asked[:, 0]) & (begin <= asked[:, 1]), axis=1)
    return Judged(asked[:, 1] - asked[:, 0], refused, periods[busy], periods[~busy])
