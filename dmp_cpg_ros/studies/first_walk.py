# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Seconds from one line of a terminal to a robot that walks in a browser, and stops.

Runs ``walk --view`` as it is installed here and, of a wheel, by the lines of ``doc/index.md``
with ``uvx`` and ``pipx``, which make an environment of their own; round after round, so that the
first one shows what it takes with the caches as they are. What a browser asks is asked: the page,
the picture, a start, a velocity, a push, a stop. Exit status 1 when the robot fell, or did not
stop within its bound.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from math import hypot, nan
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import parse_qs, urlsplit

from dmp_cpg_ros.analysis.tables import markdown_table
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.process import end_with_parent
from dmp_cpg_ros.studies.output import at_least_one, parser_of, write_results

ADDRESS = r'live view: (http://127\.0\.0\.1:\d+/\?token=\S+)'
"""What names the page."""

LINES = {'uvx': "uvx --from 'WHEEL[ros]' dmp_cpg_ros walk --view",
         'pipx': "pipx run --spec 'WHEEL[ros]' dmp_cpg_ros walk --view"}
"""What a newcomer types who has a wheel, by the program that makes the environment."""

OF_THIS_PYTHON = ('PYTHONPATH', 'LD_LIBRARY_PATH', 'VIRTUAL_ENV', 'AMENT_PREFIX_PATH',
                  'ROS_DISTRO', '_ROS_WHEELS_BOOTSTRAP_COMPLETE')
"""Variables that would lead what is installed elsewhere to the packages here."""

PATIENCE_S = 300.0
"""How long each step may take, an environment that is made among them [s]."""

WALKED_M = 1.0
"""Way after which a robot walks [m]."""

VELOCITY = (0.4, 0.0, 0.0)
"""v_x, v_y [m/s], γ [rad/s]."""

EVERY_S = 0.1
"""Pause between two velocities, as the page sends them [s]."""

PUSH_N = (0.0, 40.0, 0.0)
"""Force in the world, for as long as the robot's ``push_duration`` [N]."""

STANDS_M = 0.15
"""Height of the body that has not fallen [m]."""

STAGES = {'address_s': 'address printed', 'picture_s': 'robot shown', 'walks_s': 'walked 1 m',
          'stop_s': 'stop', 'predicted_s': 'predicted',
          'bound_s': 'bound'}
"""What is measured, and how a table calls it."""


WAITED = ('address_s', 'picture_s', 'walks_s')
"""Those of them that are counted from the command on."""


class ViewClient:
    """A browser without a picture.

    Parameters
    ----------
    address : str
        Of the page, with its token.
    patience_s : float
        How long an answer may take [s].
    """

    def __init__(self, address: str, patience_s: float = PATIENCE_S) -> None:
        """Take the token out of the address."""
        self.address, self._patience_s = address, patience_s
        url = urlsplit(address)
        self._port, (token,) = url.port, parse_qs(url.query)['token']
        self._headers = {'Authorization': f'Bearer {token}'}

    def ask(self, path: str, body: str | None = None) -> http.client.HTTPResponse:
        """Answer to GET or, with a body, POST."""
        connection = http.client.HTTPConnection('127.0.0.1', self._port, timeout=self._patience_s)
        connection.request('GET' if body is None else 'POST', path, body, self._headers)
        return connection.getresponse()

    def send(self, **command: Any) -> tuple[bool, str]:
        """Send a command; returns whether it was taken, and what the suite says.

        Raises
        ------
        DmpCpgError
            If it is none.
        """
        answer = self.ask('/command', json.dumps(command))
        text = answer.read().decode()
        if answer.status != http.HTTPStatus.OK:
            raise DmpCpgError(text)
        taken, words = json.loads(text).values()
        return taken, words

    def frames(self) -> Iterator[Any]:
        """Frames as they come; lines without one keep the stream alive.

        Raises
        ------
        DmpCpgError
            If there are no more, or it lasts too long.
        """
        stream, end = self.ask('/frames'), time.monotonic() + self._patience_s
        if stream.status != http.HTTPStatus.OK:
            raise DmpCpgError(stream.read().decode())
        while line := stream.readline():
            if line.strip():
                yield json.loads(line)
            if time.monotonic() > end:
                raise DmpCpgError(f'{self._patience_s:g} s of frames')
        raise DmpCpgError('no more frames')


class FirstWalk:
    """One ``walk --view`` from its command to its end.

    Parameters
    ----------
    command : sequence of str
        Starts it.
    folder : Path
        Where it runs, and keeps its run.

    Attributes
    ----------
    said : str
        What it has written so far.
    """

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        """Start it; what is installed elsewhere hears nothing of the packages here."""
        self._begin, self.said = time.monotonic(), ''
        self._known = threading.Event()
        own = () if command[0] == sys.executable else OF_THIS_PYTHON
        self._process = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            start_new_session=True, preexec_fn=partial(end_with_parent, signal.SIGINT),
            env={name: value for name, value in os.environ.items() if name not in own} | {
                'PYTHONUNBUFFERED': '1'})
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.said += line
            if re.search(ADDRESS, line):
                self._known.set()
        self._known.set()

    def seconds(self) -> float:
        """Time since the command [s]."""
        return time.monotonic() - self._begin

    def fails(self, what: str) -> DmpCpgError:
        """What is raised when a step does not come."""
        return DmpCpgError(f'{what} after {self.seconds():.1f} s: {self.said}')

    def address(self) -> str:
        """Wait for the address of the page.

        Raises
        ------
        DmpCpgError
            If none is printed.
        """
        self._known.wait(PATIENCE_S)
        if not (found := re.search(ADDRESS, self.said)):
            raise self.fails('no address')
        return found[1]

    def measure(self) -> dict[str, float]:
        """Look at the page, drive, push and stop the robot; returns when what was so [s].

        Raises
        ------
        DmpCpgError
            If a step does not come.
        """
        address = self.address()
        results = {'address_s': self.seconds()}
        client = ViewClient(address)
        if client.ask(urlsplit(address)._replace(scheme='', netloc='').geturl()).status != 200:
            raise self.fails('no page')
        while client.ask('/scene').status != 200:
            if self.seconds() > PATIENCE_S or self._process.poll() is not None:
                raise self.fails('nothing to draw')
            time.sleep(EVERY_S)
        base = json.loads(client.ask('/scene').read())['base']
        frames = client.frames()
        first = next(frames)
        results['picture_s'] = self.seconds()
        taken, words = client.send(inhibit=False)
        if not taken:
            raise self.fails(f'no start: {words}')
        self._drive(client, frames, base, first['bodies'][base])
        results['walks_s'] = self.seconds()
        client.send(push=PUSH_N)
        frame = self._drive(client, frames, base, next(frames)['bodies'][base])
        taken, words = client.send(inhibit=True)
        if not taken:
            raise self.fails(f'no stop: {words}')
        while frame['stop']['state'] != 'at_rest':
            frame = next(frames)
        stop = frame['stop']
        return results | {
            'stop_s': float(stop['measured_s']), 'height_m': frame['bodies'][base][2],
            **{name: float(stop.get(name, nan)) for name in ('predicted_s', 'bound_s')}}

    def _drive(self, client: ViewClient, frames: Iterator[Any], base: int, begin: Sequence[float]
               ) -> Any:
        """Command a velocity until it has walked; returns the last frame."""
        last = 0.0
        for frame in frames:
            x, y = (now - then for now, then in zip(
                frame['bodies'][base][:2], begin[:2], strict=True))
            if hypot(x, y) > WALKED_M:
                return frame
            if self.seconds() > last + EVERY_S:
                last = self.seconds()
                client.send(velocity=VELOCITY)
        raise AssertionError

    def end(self) -> int:
        """End it as Ctrl-C does, if it has not ended; returns the exit status."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGINT)
        try:
            return self._process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            return self._process.wait()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('first_walk', __doc__, 'what was measured', jobs=False)
    add = parser.add_argument
    add('--wheel', type=Path, metavar='FILE',
        help='also of this wheel (pip wheel --no-deps . makes one); needs uv or pipx')
    add('--by', nargs='+', choices=LINES, default=['uvx'], help='what runs it (default: uvx)')
    add('--rounds', type=at_least_one, default=3, metavar='N', help='of each way (default: 3)')
    return run_command(parser, arguments, _main)


def _main(options: argparse.Namespace, _: RosArguments) -> int:
    ways = {'installed: `walk --view`': [sys.executable, '-m', 'dmp_cpg_ros', 'walk', '--view']}
    if options.wheel:
        ways |= {f'`{LINES[name]}`': typed(LINES[name], options.wheel) for name in options.by}
    results = []
    for way, command in ways.items():
        for number in range(options.rounds):
            with TemporaryDirectory() as folder:
                walk = FirstWalk([*command, '--no-report'], Path(folder))
                try:
                    results.append({'way': way, 'round': number + 1} | walk.measure())
                finally:
                    walk.end()
            print(f'{way}, round {number + 1}: address after {results[-1]["address_s"]:.1f} s')
    print('\n' + table(results))
    write_results(options.json, results)
    return int(not all(map(as_promised, results)))


def typed(line: str, wheel: Path) -> list[str]:
    """Words of a line with a wheel in it.

    Raises
    ------
    DmpCpgError
        If there is no such program.
    """
    name, *words = shlex.split(line)
    program = shutil.which(name)
    if program is None:
        raise DmpCpgError(f'there is no {name} on the PATH')
    return [program, *(word.replace('WHEEL', str(wheel.resolve())) for word in words)]


def as_promised(result: dict[str, Any]) -> bool:
    """Whether a robot stands, and stopped within its bound."""
    return bool(result['height_m'] > STANDS_M and result['stop_s'] <= result['bound_s'])


def table(results: Sequence[dict[str, Any]]) -> str:
    """What was measured, as Markdown [s]."""
    return markdown_table(['way', 'round', *STAGES.values()], list(map(cells, results)))


def cells(result: dict[str, Any]) -> list[str]:
    """A row of the table: a person's waiting to a tenth of a second, the robot's times exactly."""
    return [result['way'], str(result['round']), *(
        f'{result[name]:.{1 if name in WAITED else 3}f} s' for name in STAGES)]


if __name__ == '__main__':
    sys.exit(main())
