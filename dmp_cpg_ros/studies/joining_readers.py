# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long a writer waits in ``publish`` while readers come, and are killed.

One process publishes states of twelve joints some thousand times a second; others begin to read
them, and end after some seconds by SIGKILL. With the profile of the suite (config/fastdds.xml),
and with the transports that rmw_fastrtps takes by itself, shared memory among them. Exit status 1
when the former waited long.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import time
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.nodes.framework.execution import (
    RANGE,
    VARIABLES,
    make_executor,
    prepare_middleware,
)
from dmp_cpg_ros.studies.output import at_least_one, markdown_table, parser_of, write_results

WAYS = ('suite', 'default')

READERS, LIFE_S = 3, (1.5, 3.0)
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


def _read(way: str, domain: int) -> None:
    """Body of a reader: it reads until it is killed."""
    import rclpy
    from sensor_msgs.msg import JointState

    _enter(way, domain)
    rclpy.init()
    node = rclpy.create_node(f'reader_{os.getpid()}')
    node.create_subscription(JointState, TOPIC, lambda _: None, 10)
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


def measure(way: str, readers: int, domain: int, rng: random.Random) -> tuple[int, list[float]]:
    """Let readers come and be killed; returns the number of messages, and the long waits [s]."""
    context = get_context('spawn')
    ours, theirs = context.Pipe()
    writer = context.Process(target=_write, args=(way, domain, theirs))
    writer.start()
    living, begun = dict[SpawnProcess, float](), 0
    while living or begun < readers:
        while len(living) < READERS and begun < readers:
            begun += 1
            reader = context.Process(target=_read, args=(way, domain))
            reader.start()
            living[reader] = time.monotonic() + 1.0 + rng.uniform(*LIFE_S)
        for reader in [one for one, end in living.items() if time.monotonic() > end]:
            assert reader.pid is not None
            os.kill(reader.pid, signal.SIGKILL)
            reader.join()
            del living[reader]
        time.sleep(rng.uniform(0.001, 0.02))
    ours.send(None)
    count, waits = ours.recv()
    writer.join()
    return count, waits


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = parser_of('joining_readers', __doc__, 'the long waits', jobs=False)
    parser.add_argument('--readers', type=at_least_one, default=100, metavar='N',
                        help='with either profile (default: 100)')
    parser.add_argument('--seed', type=int, default=0, help='of the moments (default: 0)')
    return run_command(parser, arguments, _main)


def _main(options: argparse.Namespace, ros: RosArguments) -> int:
    domain = int(os.environ.get('ROS_DOMAIN_ID', '0'))
    measured = {way: measure(way, options.readers, domain, random.Random(options.seed))
                for way in WAYS}
    print(markdown_table(
        ('transports', 'readers', 'messages', f'waits above {LONG_S:g} s', 'longest, s'),
        [(way, str(options.readers), f'{count:,}', str(len(waits)), f'{max(waits, default=0):.2f}')
         for way, (count, waits) in measured.items()]))
    write_results(options.json, {way: waits for way, (_, waits) in measured.items()})
    return int(bool(measured['suite'][1]))


if __name__ == '__main__':
    sys.exit(main())
