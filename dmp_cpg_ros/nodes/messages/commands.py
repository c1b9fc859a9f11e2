# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is commanded: velocities, pushes and votes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Twist, WrenchStamped
from sensor_msgs.msg import JointState

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.scenario.push import FRAMES, PushForce
from dmp_cpg_ros.nodes.messages.values import checked_numbers, header_ns, set_stamp


def read_twist(message: Twist) -> tuple[float, float, float]:
    """(v_x, v_y, γ) of a velocity command [m/s, m/s, rad/s]; raises DataError."""
    linear, angular = message.linear, message.angular
    v_x, v_y, gamma = linear.x, linear.y, angular.z
    checked_numbers((v_x, v_y, gamma, linear.z, angular.x, angular.y), 'velocity')
    return v_x, v_y, gamma


def twist(kind: type[Any], velocity: Sequence[float]) -> Any:
    """Command of a velocity (v_x, v_y, γ) [m/s, m/s, rad/s]: a ``Twist`` or ``TwistStamped``."""
    message = kind()
    of = getattr(message, 'twist', message)
    of.linear.x, of.linear.y, of.angular.z = velocity
    return message


def read_push_force(message: WrenchStamped) -> PushForce:
    """Force of a push with its time and frame; raises DataError."""
    force, torque = message.wrench.force, message.wrench.torque
    x, y, z = checked_numbers((force.x, force.y, force.z), 'force of the push')
    if (torque.x, torque.y, torque.z) != (0.0, 0.0, 0.0):
        raise DataError('push: only a force can act, the torque must be zero')
    return PushForce(header_ns(message), (x, y, z), message.header.frame_id or FRAMES[0])


def push_force(force: Sequence[float], frame: str = '', time_ns: int = 0) -> WrenchStamped:
    """Push by a force (3,) [N] in a frame, by default in that of the heading, from a time on."""
    message = WrenchStamped()
    set_stamp(message.header.stamp, time_ns)
    message.header.frame_id, vector = frame, message.wrench.force
    vector.x, vector.y, vector.z = force
    return message


def read_votes(message: JointState) -> tuple[dict[str, float], str]:
    """Weights by leg from ``effort`` and the voter's name, of rows ``<voter>/<leg>`` or ``<leg>``.

    Raises
    ------
    DataError
        If names and numbers do not match, or are of several voters; what they say is checked by
        :meth:`~dmp_cpg_ros.core.voting.votes.VoteInbox.accept`.
    """
    voters, _, legs = zip(*(name.rpartition('/') for name in message.name), strict=True) if (
        message.name) else ((), (), ())
    if len(message.effort) != len(legs) or len(set(legs)) != len(legs) or len(set(voters)) > 1:
        raise DataError(
            f'votes {list(message.name)} need one weight in effort for each row voter/leg, none '
            f'twice and all of one voter, not {list(message.effort)}')
    return dict(zip(legs, map(float, message.effort), strict=True)), ''.join(voters[:1])
