# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rehearses a robot behind ros2_control, and says whether this machine holds 500 Hz.

A low-level robot, ros2_control_driver and the suite without its simulator run as processes in a
domain of their own. The robot is enabled, stands up, walks, comes to rest and is left alone, as
doc/how_to/hardware.md says. What the low-level robot has measured is printed: run it
where nothing else computes. Exit status 1 when a step was refused, or a process ended.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import yaml

from dmp_cpg_ros.analysis.strict_json import read_json
from dmp_cpg_ros.commands.fork_server import ForkServer
from dmp_cpg_ros.commands.low_level_robot import LAGS_S, NAME, told
from dmp_cpg_ros.commands.processes import ProcessGroup
from dmp_cpg_ros.commands.ros_arguments import RosArguments, positive, run_command, within
from dmp_cpg_ros.commands.suite_domain import alone_in_domain
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.nodes.messages.interfaces import COMMAND_INTERFACES
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.studies.output import folder_of_logs, parser_of, write_results
from dmp_cpg_ros.studies.process_usage import Usage, between, usage
from dmp_cpg_ros.suite_table import COMPOSED, DRIVER, ROBOT, WALKING, WALKING_NODES

WITHIN_S = 60.0
"""How long a client looks for its node, and processes may take to end [s]."""

UNHEARD = 'are needed first'
"""What the driver says that has not heard of the robot yet."""

COMES_WITHIN_S = 60.0
"""How long the robot may take to be followed, and to come to its legs [s]."""


class RehearsalError(DmpCpgError):
    """A step was refused, or a process ended."""


class Rehearsal:
    """Robot, driver and suite as processes, and what is asked of them.

    Parameters
    ----------
    group : ProcessGroup
        Runs them.
    server : ForkServer
        Runs the clients that ask.
    folder : Path
        For the suite's parameters, and what the robot measures.
    rate_hz : float
        ``control_rate``.
    longest_lag_s : float
        Of the low-level robot.
    """

    def __init__(self, group: ProcessGroup, server: ForkServer, folder: Path, rate_hz: float,
                 longest_lag_s: float) -> None:
        """Start them."""
        self._group, self._server = group, server
        self._measured = folder / 'measured.json'
        content = load_yaml(find_config('suite.yaml'))
        content['/**']['ros__parameters'] |= {
            'start_mode': 'lying', 'control_rate': rate_hz,
            'expected_nodes': [kind.name for kind in WALKING if kind.name != ROBOT]}
        file = folder / 'my_suite.yaml'
        file.write_text(yaml.safe_dump(content), encoding='utf-8')
        ros = ['--ros-args', '--params-file', str(file)]
        group.start(NAME, [NAME, '--longest-lag', f'{longest_lag_s:g}',
                           '--json', str(self._measured)])
        group.start(DRIVER, [DRIVER, *ros, '-p',
                             f'command_interfaces:=[{", ".join(COMMAND_INTERFACES)}]'])
        group.start(COMPOSED, [COMPOSED, *(name for name in WALKING_NODES if name != ROBOT),
                               *ros])

    def ask(self, *words: str) -> str:
        """Ask by ``robot_client``; returns what it answers.

        Raises
        ------
        RehearsalError
            If it is refused, or a process has ended.
        """
        with TemporaryFile() as output:
            status = self._server.start(
                ['robot_client', '--wait', f'{WITHIN_S:g}', *words],
                output.fileno(), output.fileno()).wait()
            output.seek(0)
            answer = output.read().decode(errors='replace').strip()
        if lost := self._group.ended():
            raise RehearsalError('; '.join(lost.values()))
        if status:
            raise RehearsalError(f'{" ".join(words)}: {answer}')
        return answer

    def tell(self, *words: str) -> None:
        """Ask, and say what is answered."""
        print(f'{" ".join(words)}: {self.ask(*words) or "done"}', flush=True)

    def enable(self) -> None:
        """Enable the driver, once it has heard of the robot."""
        deadline = time.monotonic() + COMES_WITHIN_S
        while True:
            try:
                return self.tell('enable')
            except RehearsalError as error:
                if UNHEARD not in str(error) or time.monotonic() > deadline:
                    raise

    def becomes(self, topic: str, state: str) -> None:
        """Wait until a latched topic says a word; raises RehearsalError when it does not."""
        deadline = time.monotonic() + COMES_WITHIN_S
        while f'data: {state}' not in (heard := self.ask('echo', topic, '--once')):
            if time.monotonic() > deadline:
                raise RehearsalError(f'{topic} is not {state} after {COMES_WITHIN_S:g} s: {heard}')
            time.sleep(0.5)
        print(f'{topic}: {state}', flush=True)

    def used(self) -> dict[str, Usage]:
        """What the processes have used so far."""
        return {name: usage(self._group.pid(name)) for name in (NAME, DRIVER, COMPOSED)}

    def end(self) -> dict[str, Any]:
        """End all; returns what the robot has measured."""
        if killed := self._group.stop(WITHIN_S):
            raise RehearsalError(f'{", ".join(killed)} had to be killed')
        return read_json(self._measured)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('rehearsal', __doc__, 'what was measured', jobs=False, logs=True)
    add = parser.add_argument
    add('--seconds', metavar='S', type=positive, default=30.0, help='of walking (default: 30)')
    add('--speed', metavar='V', type=positive, default=0.4, help='[m/s] (default: 0.4)')
    add('--rate', metavar='HZ', type=positive, default=250.0,
        help='control_rate of the suite (default: 250)')
    add('--longest-lag', metavar='S', type=within(*LAGS_S), default=0.0,
        help='of the low-level robot: more than 0 for a machine that is too slow (default: 0)')
    return run_command(parser, arguments, _main)


def _main(options: argparse.Namespace, _: RosArguments) -> int:
    cores: dict[str, float] = {}
    refused = ''
    with folder_of_logs(options.logs) as folder, alone_in_domain(''), ForkServer() as server:
        group = ProcessGroup(folder, server)
        try:
            robot = Rehearsal(group, server, folder, options.rate, options.longest_lag)
            try:
                cores = _walk(robot, options.speed, options.seconds)
            except RehearsalError as error:
                refused = str(error)
            results = robot.end()
        finally:
            group.stop(WITHIN_S)
    print(f'\n{told(results)}')
    if cores:
        print('cores while it walked: ' + ', '.join(
            f'{name} {used:.2f}' for name, used in cores.items()))
    write_results(options.json, {**results, 'cores': cores, 'refused_step': refused})
    if refused:
        print(f'rehearsal: {refused}', file=sys.stderr)
    return int(bool(refused))


def _walk(robot: Rehearsal, speed: float, seconds: float) -> dict[str, float]:
    """Go through the steps; returns the cores that the processes took while it walked.

    Raises
    ------
    RehearsalError
        At the first step that is refused.
    """
    robot.enable()
    robot.becomes('drive_mode', 'following')
    robot.tell('stand_up')
    robot.becomes('body_mode', 'standing')
    before = robot.used()
    robot.tell('cmd_vel', f'{speed:g}', '--for', f'{seconds:g}')
    after = robot.used()
    robot.becomes('body_mode', 'standing')
    robot.tell('inhibit')
    robot.tell('disable')
    return {name: between(before[name], after[name]).cpu_s / seconds for name in after}


if __name__ == '__main__':
    sys.exit(main())
