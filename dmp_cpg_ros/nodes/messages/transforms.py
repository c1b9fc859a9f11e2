# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``/tf``, where ROS 2 has its message: ``tf2_msgs`` is not among the wheels of the package index.

Message types are C libraries that their package brings along, so that no class written in Python
can stand in for one on the wire. Without ``tf2_msgs`` nobody publishes or records ``/tf``, and
``odom`` tells the same pose.
"""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import TransformStamped

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.nodes.messages.values import set_stamp

try:
    from tf2_msgs.msg import TFMessage
except ImportError:
    class TFMessage:  # type: ignore[no-redef]
        """Stands for the type in the table of topics: a name, and no message."""

        __module__ = 'tf2_msgs.msg._tf_message'

WITHOUT_TF = ('no /tf here: tf2_msgs cannot be imported, which comes with ROS 2 and not with the '
              'wheels; odom tells the pose of base_link')
"""What is said once where there is none."""


class TransformWriter:
    """Writes the transform from one frame to another as a message of ``/tf``.

    Parameters
    ----------
    parent, child : str
        Frames.
    """

    def __init__(self, parent: str, child: str) -> None:
        """Lay the message out."""
        self._transform = TransformStamped(child_frame_id=child)
        self._transform.header.frame_id = parent
        self._message = TFMessage(transforms=[self._transform])

    def fill(self, time_ns: int, position: Array, quaternion: Array) -> Any:
        """Refill with the child's position [m] and orientation x, y, z, w in its parent."""
        set_stamp(self._transform.header.stamp, time_ns)
        place, turn = self._transform.transform.translation, self._transform.transform.rotation
        place.x, place.y, place.z = position.tolist()
        turn.x, turn.y, turn.z, turn.w = quaternion.tolist()
        return self._message
