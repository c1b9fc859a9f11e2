# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An intruder in the robot's ROS domain: whether it can topple, stop, start or steer the robot.

``python -m dmp_cpg_ros.studies.intruder --duration S --seed N`` walks the robot at 0.5 m/s, in
real time unless ``--lock-step`` is given, and publishes forged messages, replays, garbage and
floods on every topic of the suite, parameter events and requests, and transitions that are not
possible. After each attack it looks whether the robot is on its feet and at its speed, and how
soon the intruder was named on ``/diagnostics``. In the middle of each flood it asks for a stop, as
a user may, and resumes when the robot rests. Exit status 1 when an attack succeeded, a stop was
not heard, or whoever attacked was not named.

The documented services and ``cmd_vel`` are open to everybody and are not attacked; neither are
requests that are valid, such as deactivating a node, which only DDS Security can refuse.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from math import isfinite, nan, remainder, tau
from pathlib import Path

import numpy as np
import rclpy

from dmp_cpg_ros.nodes.framework.middleware import prepare_middleware
from dmp_cpg_ros.studies.intruder_attacks import ATTACKS, LAST_S, NOTHING
from dmp_cpg_ros.studies.intruder_node import Intruder
from dmp_cpg_ros.studies.output import markdown_table, write_results
from dmp_cpg_ros.studies.process_usage import children, resident_mb
from dmp_cpg_ros.studies.walk_process import WITHIN_S, WalkProcess

SPEED = 0.5
"""Commanded speed of the walk [m/s]."""

STEADY_S = 4.0
"""Time of the robot from which it walks steadily [s]."""

RESTING = 0.05
"""Speed below which the robot has stopped [m/s]."""

RECOVERY_S, LATEST_S = 3.0, 8.0
"""Times of the robot after an attack from and until which it is looked whether it walks as before
[s]: whoever took up a stand by himself at its end has to come to rest and to start.
"""

SLOWEST, FASTEST, LOWEST, MOST_TURNED = 0.35, 0.65, 0.15, 0.5
"""Speeds [m/s], height of the base [m] and turn by an attack [rad] of a robot that walks on."""


@dataclass
class Outcome:
    """What came of an attack; it failed when the robot walked on, and came to rest where it was
    told to. The memory is that which the suite's processes had after it together [MB];
    ``refused`` are the messages that nodes told to have refused, and ``shutters`` those nodes that
    did not receive the intruder any more.
    """

    attack: str
    messages: int
    fell: bool
    speed: float
    turned: float
    named_s: float
    memory_mb: float = nan
    refused: int = 0
    shutters: int = 0
    stopped: bool = True

    @property
    def walked_on(self) -> bool:
        """Whether the robot walked on as commanded."""
        return (not self.fell and SLOWEST <= self.speed <= FASTEST
                and abs(self.turned) <= MOST_TURNED)

    @property
    def told(self) -> bool:
        """Whether the intruder was named where it did something."""
        return self.attack == NOTHING or isfinite(self.named_s)


class Suite:
    """A walk at ``SPEED`` with more options of ``walk``; started again after a fall."""

    def __init__(self, folder: Path, options: Sequence[str]) -> None:
        self._folder, self._options, self._runs = folder, options, 0
        self._walk: WalkProcess | None = None
        self.begin_mb = 0.0

    def start(self, node: Intruder) -> None:
        """Walk until the speed is steady; raises DmpCpgError when it does not come up."""
        self.end()
        node.spin(1.0)  # what the last run has left in queues
        node.fell, self._runs = False, self._runs + 1
        node.poses.clear()
        self._walk = WalkProcess.of(self._folder / f'run{self._runs}', LAST_S, [
            {'at': 0.5, 'inhibit': False}, {'at': 1.0, 'command': {'v_x': SPEED}}],
            *self._options)
        end = time.monotonic() + WITHIN_S
        while not (node.poses and node.poses[-1].time_s > STEADY_S):
            node.spin(0.2)
            if time.monotonic() > end or not self.running():
                raise self._walk.failure()
        self.begin_mb = self.memory_mb()

    def memory_mb(self) -> float:
        """Resident memory of its processes [MB]; 0 where it does not run."""
        if self._walk is None or not self.running():
            return 0.0
        return sum(map(resident_mb, children(self._walk.process.pid)))

    def running(self) -> bool:
        """Whether no node has died."""
        return self._walk is not None and self._walk.process.poll() is None

    def end(self) -> None:
        """End it; what it said is kept with its run."""
        if self._walk is not None:
            self._walk.end()
            (self._folder / f'run{self._runs}' / 'said.txt').write_text(
                ''.join(self._walk.lines), encoding='utf-8')


def attacked(node: Intruder, suite: Suite, name: str) -> Outcome:
    """Attack and look what comes of it."""
    node.named, node.begin, sent = nan, time.monotonic(), node.sent
    heading, refused = node.poses[-1].yaw, sum(node.refused.values())
    node.stop = None
    node.shutters.clear()
    ATTACKS[name](node)
    named, shutters = node.named, len(node.shutters)
    node.leave()
    stopped = node.stop is None or came_to_rest(node, suite)
    ended_s, deadline = node.poses[-1].time_s, time.monotonic() + WITHIN_S
    while suite.running() and time.monotonic() < deadline:
        passed_s = node.poses[-1].time_s - ended_s
        if passed_s >= LATEST_S or (
                passed_s >= RECOVERY_S and SLOWEST <= node.speed() <= FASTEST):
            break
        node.spin(0.1)
    fell = node.fell or not suite.running() or node.poses[-1].z < LOWEST
    return Outcome(name, node.sent - sent, fell, node.speed(),
                   remainder(node.poses[-1].yaw - heading, tau), max(named - node.begin, 0.0),
                   suite.memory_mb(), sum(node.refused.values()) - refused, shutters, stopped)


def came_to_rest(node: Intruder, suite: Suite) -> bool:
    """Whether a stop that was asked for was answered and the robot rests; it is resumed then."""
    def wait(done: Callable[[], bool]) -> bool:
        begin_s, deadline = node.poses[-1].time_s, time.monotonic() + WITHIN_S
        while not done() and suite.running() and time.monotonic() < deadline and (
                node.poses[-1].time_s < begin_s + LATEST_S):
            node.spin(0.1)
        return done()

    # While nothing is known of the gait no time is promised, but it is stopped.
    rests = wait(lambda: node.stop.done() and abs(node.speed(0.5)) < RESTING)
    resumed = node.ask(False)
    return wait(resumed.done) and resumed.result().success and rests


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns the exit status."""
    parser = argparse.ArgumentParser(prog='intruder', description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--duration', type=float, default=60.0, metavar='S',
                        help='time of attacks [s]; each is tried once at least, and before any '
                        'is tried again')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--composed', action='append_const', dest='walk', const='--composed',
                        default=[], help='all nodes in one process')
    parser.add_argument('--lock-step', action='append_const', dest='walk', const='--lock-step',
                        help='not in real time: the outcome does not depend on the machine')
    parser.add_argument('--rate', type=float, metavar='HZ', help='control rate of the suite')
    parser.add_argument('--out', type=Path, metavar='DIR', help='keep the runs in an old folder')
    parser.add_argument('--attacks', nargs='+', metavar='NAME', default=list(ATTACKS),
                        help=f'those whose names hold these words, of {"; ".join(ATTACKS)}')
    parser.add_argument('--json', type=Path, metavar='FILE', help='write every attack')
    options = parser.parse_args(arguments)
    names = [name for name in ATTACKS if any(word in name for word in options.attacks)]
    if not names:
        parser.error(f'no attack is named so; valid are {"; ".join(ATTACKS)}')
    prepare_middleware()
    rclpy.init()
    node, outcomes = Intruder(options.seed), list[Outcome]()
    with tempfile.TemporaryDirectory(prefix='intruder') as folder:
        rate = [] if options.rate is None else ['--rate', str(options.rate)]
        suite = Suite(options.out or Path(folder), [*options.walk, *rate])
        try:
            suite.start(node)
            end, left = time.monotonic() + options.duration, list[str]()
            while len(outcomes) < len(names) or time.monotonic() < end:
                left = left or node.draw.sample(names, len(names))
                outcomes.append(attacked(node, suite, left.pop()))
                print(outcomes[-1], flush=True)
                if not outcomes[-1].walked_on:
                    suite.start(node)
        finally:
            suite.end()
            rclpy.try_shutdown()
    print(table(outcomes))
    print(f'{node.sent:,} messages and requests, seed {options.seed}; memory of the suite at the '
          f'begin {suite.begin_mb:.0f} MB, {memories(outcomes)}')
    write_results(options.json, {
        'seed': options.seed, 'duration_s': options.duration, 'messages': node.sent,
        'begin_mb': suite.begin_mb, 'attacks': list(map(asdict, outcomes))})
    return int(not all(one.walked_on and one.told and one.stopped for one in outcomes))


def memories(outcomes: Sequence[Outcome]) -> str:
    """Memory of the suite each time that every attack has been made once more, and at the end."""
    kinds = len({outcome.attack for outcome in outcomes})
    rounds = [f'{one.memory_mb:.0f}' for one in outcomes[kinds - 1::kinds]]
    return (f'{", ".join(rounds)} MB after every attack, at the end '
            f'{outcomes[-1].memory_mb:.0f} MB')


def table(outcomes: Sequence[Outcome]) -> str:
    """Markdown table by attack."""
    rows = []
    for name in ATTACKS:
        of = [outcome for outcome in outcomes if outcome.attack == name]
        if of:
            late = np.max([outcome.named_s for outcome in of])
            rows.append((name, str(len(of)), f'{sum(outcome.messages for outcome in of):,}',
                         str(sum(outcome.fell for outcome in of)),
                         str(sum(not outcome.walked_on for outcome in of)),
                         f'{max(abs(outcome.turned) for outcome in of):.2f} rad',
                         f'{sum(outcome.refused for outcome in of):,}',
                         str(max(outcome.shutters for outcome in of)),
                         str(sum(not outcome.stopped for outcome in of)),
                         f'{late:.1f} s' if isfinite(late) else '-'))
    return markdown_table(('attack', 'times', 'messages', 'falls', 'did not walk on', 'turned',
                           'refused', 'shut out by', 'stops unheard', 'named within'), rows)


if __name__ == '__main__':
    sys.exit(main())
