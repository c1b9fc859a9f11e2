# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Packets of writers that flood a topic, dropped by Linux before they reach the middleware.

A reader's socket, the thread that empties it and its queue are one for all writers, so whoever
sends thousands of messages a second to a topic takes room and time from the topic's own writer,
however cheaply each message is refused when it is read. Linux lets a process attach a small
program to its own sockets that looks at each packet where it comes in (socket(7),
SO_ATTACH_FILTER): over the loopback the sender's time pays for that. It needs no privilege, and
of the middleware only that it speaks RTPS over UDP.

A packet begins with the writer's participant (12 bytes), and the submessages that a writer sends
bear its number there: DATA and DATA_FRAG in their bytes 12 to 15, HEARTBEAT and GAP in 8 to 11
(OMG DDSI-RTPS 2.5, section 9.4.5). The first of them follows an INFO_DST, an INFO_TS, both or
none. What the same participant sends else, such as a request to stop the gait, is not touched.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import socket
import struct
from collections.abc import Collection, Hashable, Iterator

SO_ATTACH_FILTER, SO_DETACH_FILTER = 26, 27
"""Options of socket(7), which Python does not name."""

GUID = 16
"""Bytes by which a writer is known: its participant's twelve and its own four."""

MOST_WRITERS = 20
"""Writers that are shut out at one time. A program and the one before it have to fit into the
memory that Linux gives a socket for such things (``net.core.optmem_max``).
"""

_LOAD, _LENGTH, _AT_LEAST, _EQUAL, _RETURN = 0x20, 0x80, 0x35, 0x15, 0x06
"""Steps of such a program (linux/bpf_common.h): load a word, load the length of the packet,
compare with it, compare with a word, end.
"""

_DROP, _PASS = 0, 0xFFFFFFFF
"""How many bytes of a packet are received."""

_UDP = 8
"""Bytes of a packet before what was sent."""

_PARTICIPANT, _FIRST = 8, 20
"""Where in what was sent the participant stands, and where the submessages begin."""

_BEFORE = (0, 12, 16, 28)
"""Length of what comes before the first submessage of a writer: an INFO_TS has 12 bytes, an
INFO_DST 16.
"""

_PLACES = sorted({_UDP + _FIRST + before + place for before in _BEFORE for place in (8, 12)})
"""Where in a packet the writer's number can stand."""

_SHORTEST = _PLACES[-1] + 4
"""Length of a packet from which all these places are in it; no message of data is shorter."""


def filter_program(writers: Collection[bytes]) -> bytes:
    """A program for SO_ATTACH_FILTER that drops what some writers send.

    Parameters
    ----------
    writers : collection of bytes (16,)
        GUIDs of at most ``MOST_WRITERS``, as the graph tells them.

    Returns
    -------
    bytes
        Steps of eight bytes: what to do, how many steps to go on beyond the next one if the
        comparison holds and if it does not, and with which number.
    """
    steps = [(_LENGTH, 0, 0, 0), (_AT_LEAST, 1, 0, _SHORTEST), (_RETURN, 0, 0, _PASS)]
    for writer in writers:
        *participant, number = struct.unpack('!4I', writer)
        left = 2 * len(_PLACES) + 1                 # steps up to and with the one that drops
        for i, word in enumerate(participant):
            to_next = 2 * (len(participant) - 1 - i) + left
            steps += [(_LOAD, 0, 0, _UDP + _PARTICIPANT + 4 * i), (_EQUAL, 0, to_next, word)]
        for i, place in enumerate(_PLACES):
            to_drop = 2 * (len(_PLACES) - 1 - i)
            steps += [(_LOAD, 0, 0, place), (_EQUAL, to_drop, int(not to_drop), number)]
        steps.append((_RETURN, 0, 0, _DROP))
    return b''.join(struct.pack('=HBBI', *step) for step in [*steps, (_RETURN, 0, 0, _PASS)])


class PacketFilter:
    """Writers whose packets the UDP sockets of this process do not receive.

    Several may ask for that; a writer is received again once nobody asks for it any more.
    """

    def __init__(self) -> None:
        """Receive everything."""
        self._asked: dict[Hashable, frozenset[bytes]] = {}

    def shut_out(self, asker: Hashable, writers: Collection[bytes]) -> bool:
        """Do not receive some writers.

        Parameters
        ----------
        asker : hashable
            Who asks; what it asked for before is forgotten.
        writers : collection of bytes (16,)
            Their GUIDs; none to receive them all.

        Returns
        -------
        bool
            Whether there was a socket to which this could be told.
        """
        self._asked[asker] = frozenset(writers)
        if not writers:
            del self._asked[asker]
        out = sorted(frozenset().union(*self._asked.values()))[:MOST_WRITERS]
        return sum(_attached(sock, out) for sock in _udp_sockets()) > 0


def _attached(sock: socket.socket, writers: Collection[bytes]) -> bool:
    """Whether a socket takes a filter, or none where there is nobody to shut out."""
    program = filter_program(writers)
    steps = ctypes.create_string_buffer(program, len(program))
    with contextlib.suppress(OSError):  # it has no filter, or takes none
        if writers:
            sock.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, struct.pack(
                'HP', len(program) // 8, ctypes.addressof(steps)))
        else:
            sock.setsockopt(socket.SOL_SOCKET, SO_DETACH_FILTER, 0)
        return True
    return False


def _udp_sockets() -> Iterator[socket.socket]:
    """UDP sockets of this process, whoever has opened them. Linux only."""
    with contextlib.suppress(OSError):
        for descriptor in map(int, os.listdir('/proc/self/fd')):
            with contextlib.suppress(OSError):  # closed meanwhile, or no socket
                if os.readlink(f'/proc/self/fd/{descriptor}').startswith('socket:'):
                    with socket.socket(fileno=os.dup(descriptor)) as sock:
                        if sock.type == socket.SOCK_DGRAM and sock.family in (
                                socket.AF_INET, socket.AF_INET6):
                            yield sock


OWN_SOCKETS = PacketFilter()
"""That of this process: sockets are a process's, not a node's."""
