# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long a writer waits in ``publish`` while readers come, and are killed, and they for it.

One process publishes states of twelve joints some thousand times a second; others begin to read
them, say how long it took until they heard it, and end after some seconds by SIGKILL. With the
profile of the suite (config/fastdds.xml), and with the transports that rmw_fastrtps takes by
itself, shared memory among them. Exit status 1 when with the former the writer waited long.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import time
from collections.abc import Sequence
from math import inf
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from statistics import median

from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.nodes.framework.execution import make_executor
from dmp_cpg_ros.nodes.framework.middleware import RANGE, VARIABLES, prepare_middleware
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results

WAYS = ('suite', 'default')

READERS, LIFE_S = 3, (4.0, 6.0)
"""Readers at one time, and how long each lives [s]."""

PAUSE_S = 3e-4
"""Between two messages [s]."""

LONG_S = 0.1
"""A wait that is counted: 25 ticks of the suite [s]."""

TOPIC = 'joining_readers'


def _enter(way: str, domain: int) -> None:
    for name in VARIABLES:
        os.environ.pop(name, None)
    os.environ.update({'ROS_DOMAIN_ID': str(domain), RANGE: 'LOCALHOST'})
    if way == 'suite':
        prepare_middleware()


def _read(way: str, domain: int, end: Connection) -> None:
    """Body of a reader: it says when it hears the writer, and reads until it is killed."""
    import rclpy
    from sensor_msgs.msg import JointState

    _enter(way, domain)
    rclpy.init()
    node = rclpy.create_node(f'reader_{os.getpid()}')
    begin, heard = time.monotonic(), False

    def hear(_: JointState) -> None:
        nonlocal heard
        if not heard:
            heard = True
            end.send(time.monotonic() - begin)

    node.create_subscription(JointState, TOPIC, hear, 10)
    executor = make_executor('events')
    executor.add_node(node)
    executor.spin_until_future_complete(rclpy.task.Future(), timeout_sec=1e6)


def _write(way: str, domain: int, end: Connection) -> None:
    """Body of the writer: it publishes until something is said, and says how long it waited."""
    import rclpy
    from sensor_msgs.msg import JointState

    _enter(way, domain)
    rclpy.init()
    publisher = rclpy.create_node('writer').create_publisher(JointState, TOPIC, 10)
    message = JointState(name=[f'joint_{number}' for number in range(12)], position=[0.0] * 12)
    count, waits = 0, list[float]()
    while not end.poll():
        begin = time.perf_counter()
        publisher.publish(message)
        waited = time.perf_counter() - begin
        count, waits = count + 1, [*waits, waited] if waited > LONG_S else waits
        time.sleep(PAUSE_S)
    end.send((count, waits))


def measure(way: str, readers: int, domain: int, rng: random.Random
            ) -> tuple[int, list[float], list[float]]:
    """Let readers come and be killed; returns the number of messages, the long waits, and how long
    each reader waited for its first message [s].
    """
    context = get_context('spawn')
    ours, theirs = context.Pipe()
    writer = context.Process(target=_write, args=(way, domain, theirs))
    writer.start()
    living, begun, heard = dict[SpawnProcess, tuple[float, Connection]](), 0, list[float]()
    tell = Progress(f'{way}: ')
    while living or begun < readers:
        while len(living) < READERS and begun < readers:
            begun += 1
            mine, its = context.Pipe()
            reader = context.Process(target=_read, args=(way, domain, its))
            reader.start()
            living[reader] = time.monotonic() + 1.0 + rng.uniform(*LIFE_S), mine
        for reader in [one for one, (end, _) in living.items() if time.monotonic() > end]:
            assert reader.pid is not None
            os.kill(reader.pid, signal.SIGKILL)
            reader.join()
            _, mine = living.pop(reader)
            heard.append(mine.recv() if mine.poll() else inf)
            tell(f'{len(heard)}/{readers} readers')
        time.sleep(rng.uniform(0.001, 0.02))
    ours.send(None)
    count, waits = ours.recv()
    writer.join()
    return count, waits, heard


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('joining_readers', __doc__, 'all long waits', jobs=False)
    parser.add_argument('--readers', type=at_least_one, default=100, metavar='N',
                        help='with either profile (default: 100)')
    parser.add_argument('--seed', type=int, default=0, help='of the moments (default: 0)')
    return run_command(parser, arguments, _main)


def _main(options: argparse.Namespace, ros: RosArguments) -> int:
    domain = int(os.environ.get('ROS_DOMAIN_ID', '0'))
    measured = {way: measure(way, options.readers, domain, random.Random(options.seed))
                for way in WAYS}
    print(markdown_table(
        ('profile', 'readers', 'messages', f'waits above {LONG_S:g} s', 'longest, s',
         'a reader waits for the first message, s: median, longest'),
        [(way, str(options.readers), f'{count:,}', str(len(waits)),
          f'{max(waits, default=0):.2f}', f'{median(heard):.2f}, {max(heard):.2f}')
         for way, (count, waits, heard) in measured.items()]))
    write_results(options.json, {way: {'waits_s': waits, 'heard_s': heard}
                                 for way, (_, waits, heard) in measured.items()})
    return int(bool(measured['suite'][1]))


if __name__ == '__main__':
    sys.exit(main())
