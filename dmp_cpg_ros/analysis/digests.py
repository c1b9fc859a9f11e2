# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fingerprints of a run: equal digests mean that every byte that was published is equal."""

from __future__ import annotations

import hashlib
from pathlib import Path

from rosbags.highlevel import AnyReader

from dmp_cpg_ros.analysis.bag import base_name, find_bag, opened

TOPICS = ('canonical_state', 'joint_states', 'joint_targets')
SHARED_TOPIC = 'joint_targets'
"""Topic with one publisher per leg; their messages interleave differently in every run."""

WORDED_TOPIC = 'canonical_state'
"""The one whose text changes its length: the name of the gait, or of the change between two."""


def payload_digests(path: Path | str) -> dict[str, str]:
    """One SHA-256 per publisher over the message payloads as recorded, in their order.

    Parameters
    ----------
    path : path-like
        Bag or run's folder.

    Returns
    -------
    dict of str to str
        Hexadecimal digests of ``joint_states``, ``canonical_state``, and ``joint_targets/fl``, …,
        whose publisher is known by the leg that its first joint's name begins with.

    Raises
    ------
    MissingFileError, DataError
        If there is no readable bag.
    """
    hashes: dict[str, hashlib._Hash] = {}
    with opened(find_bag(path)) as reader:
        used = [c for c in reader.connections if base_name(c.topic) in TOPICS]
        for connection, _, raw in reader.messages(used) if used else ():
            key = base_name(connection.topic)
            if key == SHARED_TOPIC:
                key = f'{key}/{_leg(reader, raw, connection.msgtype)}'
            elif key == WORDED_TOPIC:
                raw = _content(reader, raw, connection.msgtype)
            hashes.setdefault(key, hashlib.sha256()).update(raw)
    return {key: value.hexdigest() for key, value in sorted(hashes.items())}


def _content(reader: AnyReader, raw: bytes, msgtype: str) -> bytes:
    """Payload with zeros for its alignment bytes.

    In them the middleware leaves what was in its buffer before: where texts change their length
    that is a piece of an earlier message, and which one depends on time.
    """
    message = reader.deserialize(raw, msgtype)  # type: ignore[attr-defined]
    return bytes(reader.typestore.serialize_cdr(message, msgtype))


def _leg(reader: AnyReader, raw: bytes, msgtype: str) -> str:
    names = reader.deserialize(raw, msgtype).name  # type: ignore[attr-defined]
    return str(names[0]).split('_', 1)[0] if names else 'unnamed'
