# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Walks a robot on one host with its controllers on another, over a link that delays and loses.

The hosts are two network namespaces; lossy_link.py is the link, with the same conditions in either
direction. On the robot's host are mujoco_robot and who watches and commands it, on the other one
all other nodes. The robot walks for --seconds of its time; with --then the link becomes another
one then, and it goes on for as long. Time never waits for targets here, as that of a real robot
(longest_lag is 0), so that a machine on which others compute is a slow link, too: chrt -r 1 keeps
them out. Needs CAP_SYS_ADMIN, CAP_NET_ADMIN and /dev/net/tun. Exit status 1 when the robot fell.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from math import ceil
from pathlib import Path
from statistics import fmean

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from dmp_cpg_ros.commands.fork_server import ForkServer
from dmp_cpg_ros.commands.processes import ProcessGroup
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments, positive, run_command
from dmp_cpg_ros.commands.suite_run import ENDED_WITHIN_S
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.modes.falls import FALLEN_TILT
from dmp_cpg_ros.nodes.framework.execution import make_executor
from dmp_cpg_ros.nodes.framework.middleware import PROFILES, RANGE, VARIABLES, prepare_middleware
from dmp_cpg_ros.nodes.framework.parameters import BEST_EFFORT, DELIVERIES
from dmp_cpg_ros.studies.link_watch import LinkWatch
from dmp_cpg_ros.studies.lossy_link import Conditions
from dmp_cpg_ros.studies.network_hosts import TwoHosts
from dmp_cpg_ros.studies.output import folder_of_logs, markdown_table, parser_of, write_results
from dmp_cpg_ros.suite import load_suite
from dmp_cpg_ros.suite_table import PROCESSES, ROBOT, instances

PEERS = 'ROS_STATIC_PEERS'

COMPUTED_MS, LONGEST_LEAD_MS = 8.0, 60.0
"""Share of computing in a lead; the longest lead [ms]."""

BEGIN_S, END_S = 3.0, 4.0
"""Of the robot's time before its speed counts, and for its stop at the end [s]."""

COLUMNS = ('gait', 'm/s', 'link, each way', 'lead ms', 's', 'fell', 'm/s kept', 'carried on',
           'after ms, median / 99 %', 'drive', 'body, stop', 'real time')


@dataclass(frozen=True)
class Setting:
    """A walk, and what the suite knows of the link.

    Attributes
    ----------
    gait : str
        Of it.
    speed, seconds : float
        Forward [m/s]; for how long [s].
    lead_ms : float
        ``target_lead`` [ms].
    processes : str
        How the controllers share processes.
    delivery : str
        How what comes at every tick is read.
    parameters : tuple of (str, value)
        Further parameters of all nodes.
    """

    gait: str
    speed: float
    seconds: float
    lead_ms: float
    processes: str
    delivery: str = BEST_EFFORT
    parameters: tuple[tuple[str, object], ...] = ()


@dataclass
class Phase:
    """What became of a walk under some conditions.

    Attributes
    ----------
    link : str
        The conditions.
    fell : bool
        Whether the robot fell.
    speed : float
        Mean [m/s].
    late : float
        Share of ticks at which targets of a leg were late or lost, and former ones carried on.
    median_ms, most_ms : float
        From a state to the last of its targets, in the median and of 99 % [ms].
    drive, body, stop, posture : str
        At the end.
    real_time : float
        How fast the robot's time went.
    """

    link: str
    fell: bool
    speed: float
    late: float
    median_ms: float
    most_ms: float
    drive: str
    body: str
    stop: str
    posture: str
    real_time: float


def lead_for(link: Conditions) -> float:
    """Lead in whole ticks for a link [ms]: there and back, a lost message, and computing."""
    tick_ms = 1e-6 * load_suite().tick_ns
    needed = 2.0 * (link.delay_ms + link.jitter_ms) + tick_ms + COMPUTED_MS
    return min(LONGEST_LEAD_MS, tick_ms * ceil(needed / tick_ms))


def walk(two: TwoHosts, setting: Setting, links: Sequence[Conditions], folder: Path, *,
         peers: bool = False) -> tuple[list[Phase], list[tuple[float, str]]]:
    """Walk under some conditions after the other; the link has the first already.

    Returns
    -------
    list of Phase
        One for each of them.
    list of (float, str)
        When the suite said what [s].
    """
    tell = Progress()
    with _suite(two, setting, folder, peers) as alive:
        def turned() -> None:
            alive()
            tell(f'{max(0.0, watch.seconds):.0f} s of the robot, drive {watch.drive or "unknown"}')

        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        try:
            node = Node('link_watch', enable_rosout=False, start_parameter_services=False)
            watch, phases = LinkWatch(node, make_executor('events'), turned), []
            watch.begin()
            watch.run(0.5)
            watch.command(setting.speed)
            watch.run(BEGIN_S)
            for number, link in enumerate(links):
                if number:
                    two.change(link)
                    watch.said.append((watch.seconds, f'the link becomes {link}'))
                phases.append(_phase(watch, setting, link))
            watch.command(0.0)
            watch.run(END_S)
            phases[-1].fell = watch.highest_tilt > FALLEN_TILT
            phases[-1].posture = watch.posture
            node.destroy_node()
        finally:
            rclpy.try_shutdown()
    return phases, watch.said


def _phase(watch: LinkWatch, setting: Setting, link: Conditions) -> Phase:
    wall, begin, timing, first = (
        time.monotonic(), watch.seconds, watch.timing, len(watch.travelled))
    watch.run(setting.seconds)
    new = watch.timing.since(timing)
    median_s, most_s = (new.latencies.percentile(percent) for percent in (50.0, 99.0))
    return Phase(
        link=str(link), fell=watch.highest_tilt > FALLEN_TILT,
        speed=fmean(speed for _, speed in watch.travelled[first:]),
        late=new.carried / max(1, new.ticks), median_ms=1e3 * median_s, most_ms=1e3 * most_s,
        drive=watch.drive, body=watch.body, stop=watch.stop, posture=watch.posture,
        real_time=(watch.seconds - begin) / (time.monotonic() - wall))


@contextmanager
def _suite(two: TwoHosts, setting: Setting, folder: Path, peers: bool
           ) -> Iterator[Callable[[], None]]:
    """Run the nodes on their hosts; this thread goes to the robot's.

    Yields
    ------
    callable ()
        Raises DmpCpgError when a process has ended.
    """
    file = folder / 'parameters.yaml'
    own = {f'/**/{name}': {'ros__parameters': dict(each)} for _, name, each in instances() if each}
    file.write_text(json.dumps({'/**': {'ros__parameters': {
        'gait': setting.gait, 'target_lead': 1e-3 * setting.lead_ms, 'longest_lag': 0.0,
        'gated': True, 'delivery': setting.delivery, **dict(setting.parameters)}}, **own}))
    arguments = ['--ros-args', '--params-file', str(file)]
    robot, controllers = two.hosts
    groups: list[ProcessGroup] = []

    def alive() -> None:
        if lost := [how for group in groups for how in group.ended().values()]:
            raise DmpCpgError('; '.join(lost))

    try:
        for host, other, processes in (
                (controllers, robot, _without_robot(PROCESSES[setting.processes])),
                (robot, controllers, {ROBOT: (ROBOT,)})):
            host.enter()
            _reach(other.address if peers else '')
            with ForkServer() as server:
                groups.append(ProcessGroup(folder, server))
                groups[-1].start_nodes(processes, arguments)
        yield alive
    finally:
        for group in groups:
            group.stop(ENDED_WITHIN_S)


def _reach(peer: str) -> None:
    """Let nodes that begin from now on look beyond their host, by a peer's address perhaps."""
    for name in VARIABLES:  # who has started this may keep to this machine
        if os.environ.get(name) == str(find_config(PROFILES[1])):
            del os.environ[name]
    os.environ.update({RANGE: 'SUBNET', PEERS: peer})
    prepare_middleware()


def _without_robot(processes: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    others = {name: tuple(node for node in nodes if node != ROBOT)
              for name, nodes in processes.items()}
    return {name: nodes for name, nodes in others.items() if nodes}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    return run_command(_parser(), arguments, _main, parameters=True)


def _main(options: argparse.Namespace, ros: RosArguments) -> int:
    first = Conditions(options.delay_ms, options.jitter_ms, options.loss, not options.peers)
    links = [first]
    if options.then:
        delay_ms, jitter_ms, loss = options.then
        links.append(Conditions(delay_ms, jitter_ms, loss, first.multicast))
    lead_ms = lead_for(first) if options.lead_ms is None else options.lead_ms
    setting = Setting(options.gait, options.speed, options.seconds, lead_ms, options.processes,
                      options.delivery, tuple(ros.parameters.items()))
    with folder_of_logs(options.logs) as folder, TwoHosts(first, options.seed) as two:
        phases, said = walk(two, setting, links, folder, peers=options.peers)
        carried = two.end_link()
    for seconds, text in said:
        print(f'{seconds:8.3f} s  {text}')
    print(f'\nlink: {carried}')
    print(markdown_table(COLUMNS, [_row(setting, phase) for phase in phases]))
    write_results(options.json, {'setting': asdict(setting), 'phases': list(map(asdict, phases)),
                                 'said': said, 'link': json.loads(carried or '{}')})
    return int(any(phase.fell for phase in phases))


def _row(setting: Setting, phase: Phase) -> tuple[str, ...]:
    return (
        setting.gait, f'{setting.speed:g}', phase.link, f'{setting.lead_ms:g}',
        f'{setting.seconds:g}', 'yes' if phase.fell else 'no', f'{phase.speed:.2f}',
        f'{100.0 * phase.late:.1f} %', f'{phase.median_ms:.0f} / {phase.most_ms:.0f}',
        phase.drive, f'{phase.posture}, {phase.stop}', f'{phase.real_time:.2f}')


def _parser() -> argparse.ArgumentParser:
    parser = parser_of('two_hosts', __doc__, 'what happened', jobs=False, logs=True)
    for name, kind, default, text in (
            ('delay-ms', float, 5.0, 'delay of the link each way'),
            ('jitter-ms', float, 2.0, 'by how much it varies to either side, uniform'),
            ('loss', float, 1.0, 'share of packets that are lost, in percent'),
            ('seconds', positive, 60.0, "of the robot's time at its speed"),
            ('speed', positive, 0.5, 'forward, m/s')):
        parser.add_argument(f'--{name}', type=kind, default=default, metavar='X',
                            help=f'{text} (default: {default:g})')
    parser.add_argument('--gait', default='amble', help='(default: amble)')
    parser.add_argument('--lead-ms', type=positive, metavar='X',
                        help='target_lead, whole ticks (default: what the link needs)')
    parser.add_argument('--then', type=float, nargs=3, metavar=('DELAY', 'JITTER', 'LOSS'),
                        help='what the link becomes after that, for as long again')
    parser.add_argument('--processes', choices=tuple(PROCESSES), default='composed',
                        help='how the controllers share processes (default: composed)')
    parser.add_argument('--delivery', choices=DELIVERIES, default=BEST_EFFORT,
                        help='of what comes at every tick (default: best_effort)')
    parser.add_argument('--peers', action='store_true',
                        help='no multicast crosses the link; the hosts name each other as '
                        'ROS_STATIC_PEERS')
    parser.add_argument('--seed', type=int, default=0, help="of the link's draws (default: 0)")
    return parser


if __name__ == '__main__':
    sys.exit(main())
