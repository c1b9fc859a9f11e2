# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Votes from outside the suite, as messages."""

from __future__ import annotations

from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.errors import DataError


def read_votes(message: JointState) -> tuple[dict[str, float], str]:
    """Weights by leg from ``effort``, or ``position`` without, and the voter's name.

    Raises
    ------
    DataError
        If names and numbers do not match; what the names and numbers say is checked by
        :meth:`~dmp_cpg_ros.core.inhibition.votes.VoteInbox.accept`.
    """
    names = list(message.name)
    weights = message.effort or message.position
    if len(weights) != len(names) or len(set(names)) != len(names):
        raise DataError(
            f'votes for {names} need one weight in effort (or position) for each name, none twice,'
            f' not {list(weights)}')
    return dict(zip(names, map(float, weights), strict=True)), message.header.frame_id
