# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Linux drops the packets of writers that are shut out, and no others."""

from __future__ import annotations

import socket
import struct
import sys
from collections.abc import Iterator, Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip('rclpy')

from dmp_cpg_ros.nodes.framework.packet_filter import GUID, MOST_WRITERS, PacketFilter

pytestmark = pytest.mark.skipif(sys.platform != 'linux', reason='such filters are those of Linux')

SENTINEL = b'that was all'
DATA, DATA_FRAG, HEARTBEAT, GAP, ACKNACK = 0x15, 0x16, 0x07, 0x08, 0x06
BEFORE = {'nothing': b'', 'stamp': b'\x09\x01\x08\x00' + bytes(8),
          'destination': b'\x0e\x01\x0c\x00' + bytes(12)}
BEFORE['both'] = BEFORE['destination'] + BEFORE['stamp']

WRITER = b'\x03'
"""Last byte of a writer's number, which no reader's has."""

guids = st.binary(min_size=GUID - 1, max_size=GUID - 1).map(lambda begin: begin + WRITER)


class Receiver:
    """A UDP socket of this process, and a filter that is told to it."""

    def __init__(self) -> None:
        self.filter = PacketFilter()
        self._in, self._out = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self._in.bind(('127.0.0.1', 0))

    def received(self, packets: Sequence[bytes]) -> list[bytes]:
        """What of some packets comes in; over the loopback they keep their order."""
        heard = list[bytes]()
        for packet in packets:  # one by one: none is lost for want of room
            for sent in (packet, SENTINEL):
                self._out.sendto(sent, self._in.getsockname())
            while (got := self._in.recv(2000)) != SENTINEL:
                heard.append(got)
        return heard

    def close(self) -> None:
        """Receive everything again."""
        self.filter.shut_out('test', ())
        self._in.close()
        self._out.close()


@pytest.fixture(scope='module')
def receiver() -> Iterator[Receiver]:
    made = Receiver()
    yield made
    made.close()


def packet(writer: bytes, kind: int, before: str, content: bytes = bytes(32)) -> bytes:
    """What a writer sends, with a submessage of a kind behind what else may come first."""
    ends = bytes(4) + writer[12:]
    body = bytes(4) + ends if kind in (DATA, DATA_FRAG) else ends
    submessage = struct.pack('<BBH', kind, 1, len(body) + len(content)) + body + content
    return b'RTPS\x02\x03\x01\x0f' + writer[:12] + BEFORE[before] + submessage


@settings(deadline=None, max_examples=40)
@given(st.lists(guids, max_size=12, unique=True), st.lists(guids, max_size=6), st.data())
def test_what_the_writers_send_that_are_shut_out_is_dropped_and_nothing_else(
        receiver: Receiver, out: list[bytes], others: list[bytes], data: st.DataObject) -> None:
    """Others may share their participant, or their number, with one that is shut out."""
    others += [one[:12] + other[12:] for one in out[:3] for other in (*others[:2], *out[3:5])]
    others += [other[:12] + one[12:] for one in out[:3] for other in others[:2]]
    sent = [packet(writer, data.draw(st.sampled_from((DATA, DATA_FRAG, HEARTBEAT, GAP))),
                   data.draw(st.sampled_from(sorted(BEFORE))), bytes([k % 256]) * 32)
            for k, writer in enumerate([*out, *others])]
    assert receiver.filter.shut_out('test', out) or not out
    through = [one for one, writer in zip(sent, [*out, *others], strict=True)
               if writer not in out]
    assert receiver.received(sent) == through
    receiver.filter.shut_out('test', ())
    assert receiver.received(sent) == sent


@settings(deadline=None, max_examples=40)
@given(st.binary(max_size=120), guids)
def test_what_is_no_such_packet_is_received(receiver: Receiver, data: bytes, out: bytes) -> None:
    """Of any length: what a filter looks for beyond the end would drop a packet."""
    receiver.filter.shut_out('test', [out])
    begin = b'RTPS\x02\x03\x01\x0f' + out[:12]
    for sent in (data, *(begin[:cut] for cut in range(len(begin)))):
        assert receiver.received([sent]) == [sent]


def test_a_writer_is_shut_out_until_nobody_asks_for_it(receiver: Receiver) -> None:
    one, two = (packet(bytes([k]) * GUID, DATA, 'both') for k in (1, 2))
    for asker, writers, through in (
            ('test', [1], [two]), ('else', [1, 2], []), ('test', [], []), ('else', [2], [one]),
            ('else', [], [one, two])):
        receiver.filter.shut_out(asker, [bytes([k]) * GUID for k in writers])
        assert receiver.received([one, two]) == through


def test_the_most_writers_make_a_program_that_linux_takes(receiver: Receiver) -> None:
    out = [struct.pack('>3I3s', 7, 8, 9, bytes([0, 0, k])) + WRITER
           for k in range(2 * MOST_WRITERS)]
    assert receiver.filter.shut_out('test', out)
    sent = [packet(writer, DATA, 'both') for writer in out]
    assert receiver.received(sent) == sent[MOST_WRITERS:]
    receiver.filter.shut_out('test', ())


def test_acknowledgements_are_received(receiver: Receiver) -> None:
    """A reader of the same participant asks for what it has missed."""
    writer = bytes(range(GUID))
    receiver.filter.shut_out('test', [writer])
    asked = packet(writer[:12] + b'\x00\x00\x12\x04', ACKNACK, 'destination')
    assert receiver.received([asked]) == [asked]
    receiver.filter.shut_out('test', ())
