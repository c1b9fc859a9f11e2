# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A link between two TUN devices that delays and loses packets, for kernels without netem.

``python -m dmp_cpg_ros.studies.lossy_link FD FD SEED`` hands IP packets from either device to the
other. Every packet is lost or delayed by a draw of its own, uniform in delay ± jitter, so that
packets may overtake one another, as with ``tc qdisc add dev DEVICE root netem delay 5ms 2ms loss
1%`` on both ends. What it does is told on its standard input, one line of numbers at a time, and
it ends with that; what it has done is then the line that it writes.
"""

from __future__ import annotations

import heapq
import json
import os
import random
import selectors
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass
from math import inf

from dmp_cpg_ros.core.errors import ParameterError

LONGEST_PACKET = 65536
"""Of IP [bytes]."""

DESTINATION, MULTICAST = 16, range(224, 240)
"""Byte of an IPv4 packet with which its destination begins, and what it is for multicast."""


@dataclass(frozen=True)
class Conditions:
    """What a link does to packets, in either direction.

    Attributes
    ----------
    delay_ms, jitter_ms : float
        Every packet takes delay ± jitter, uniform [ms].
    loss : float
        Share of packets that are lost [%].
    multicast : bool
        Whether multicast crosses it.

    Raises
    ------
    ParameterError
        If one of these numbers is impossible.
    """

    delay_ms: float = 0.0
    jitter_ms: float = 0.0
    loss: float = 0.0
    multicast: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.jitter_ms <= self.delay_ms < inf:
            raise ParameterError(f'a link takes delay ± jitter, finite and with 0 <= jitter <= '
                                 f'delay, not {self.delay_ms:g} ± {self.jitter_ms:g} ms')
        if not 0.0 <= self.loss <= 100.0:
            raise ParameterError(f'a link loses 0 to 100 % of its packets, not {self.loss:g} %')

    def __str__(self) -> str:
        return f'{self.delay_ms:g} ± {self.jitter_ms:g} ms, {self.loss:g} %'

    @property
    def line(self) -> str:
        """The conditions as the process reads them."""
        return ' '.join(str(float(value)) for value in astuple(self)) + '\n'

    @classmethod
    def parse(cls, line: str) -> Conditions:
        """Read what :attr:`line` is."""
        delay, jitter, loss, multicast = map(float, line.split())
        return cls(delay, jitter, loss, bool(multicast))


class LossyLink:
    """Packets under way.

    Parameters
    ----------
    seed : int
        Of the draws.

    Attributes
    ----------
    conditions : Conditions
        In force for what comes next.
    packets, lost : int
        How many have come; how many of them were lost.
    worst_s : float
        How much later than drawn a packet has left at most [s]: on a busy machine the link waits
        for a processor.
    """

    def __init__(self, seed: int) -> None:
        """Start as a link that does nothing."""
        self._random, self._under_way = random.Random(seed), list[tuple[float, int, int, bytes]]()
        self.conditions = Conditions()
        self.packets = self.lost = 0
        self.worst_s = 0.0

    def take(self, packet: bytes, now_s: float, to: int) -> None:
        """Lose a packet that goes to a descriptor, or draw when it arrives."""
        its = self.conditions
        if not its.multicast and packet[0] >> 4 == 4 and packet[DESTINATION] in MULTICAST:
            return
        self.packets += 1
        if self._random.random() < 1e-2 * its.loss:
            self.lost += 1
            return
        delay_ms = its.delay_ms + its.jitter_ms * self._random.uniform(-1.0, 1.0)
        heapq.heappush(self._under_way,
                       (now_s + 1e-3 * delay_ms, self.packets, to, packet))

    def due(self, now_s: float) -> list[tuple[int, bytes]]:
        """Descriptors and packets that arrive now, in the order of their times."""
        arrived = []
        while self._under_way and self._under_way[0][0] <= now_s:
            time_s, _, to, packet = heapq.heappop(self._under_way)
            self.worst_s = max(self.worst_s, now_s - time_s)
            arrived.append((to, packet))
        return arrived

    def patience_s(self, now_s: float) -> float | None:
        """Time until the next one arrives [s]; None when nothing is under way."""
        return max(0.0, self._under_way[0][0] - now_s) if self._under_way else None


def _read_all(device: int) -> list[bytes]:
    packets = []
    with suppress(BlockingIOError):
        while True:
            packets.append(os.read(device, LONGEST_PACKET))
    return packets


def _write(device: int, packet: bytes) -> None:
    with suppress(OSError):  # a full queue, or a device that is going: lost, as on any link
        os.write(device, packet)


def main(arguments: Sequence[str] | None = None) -> int:
    """Be the link until the standard input ends."""
    one, other, seed = map(int, sys.argv[1:] if arguments is None else arguments)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal: who has started it ends it
    with suppress(OSError):  # a link that waits for a processor would be another one
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    link, opposite = LossyLink(seed), {one: other, other: one}
    # What select(2) waits is exact to a microsecond, of epoll to a millisecond.
    with selectors.SelectSelector() as selector:
        for descriptor in (one, other, sys.stdin.fileno()):
            os.set_blocking(descriptor, descriptor == sys.stdin.fileno())
            selector.register(descriptor, selectors.EVENT_READ)
        while _go_on(link, selector, opposite):
            pass
    print(json.dumps({'packets': link.packets, 'lost': link.lost, 'worst_s': link.worst_s}),
          flush=True)
    return 0


def _go_on(link: LossyLink, selector: selectors.SelectSelector, opposite: dict[int, int]) -> bool:
    """Take and hand over what there is; returns whether the standard input goes on."""
    ready = {key.fd for key, _ in selector.select(link.patience_s(time.monotonic()))}
    for device in ready & opposite.keys():
        now = time.monotonic()
        for packet in _read_all(device):
            link.take(packet, now, opposite[device])
    for device, packet in link.due(time.monotonic()):
        _write(device, packet)
    if sys.stdin.fileno() in ready:
        line = os.read(sys.stdin.fileno(), 1000).decode()
        if not line:
            return False
        link.conditions = Conditions.parse(line.strip().rpartition('\n')[2])
    return True


if __name__ == '__main__':
    sys.exit(main())
