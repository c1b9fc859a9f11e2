# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of the robot's feet for RViz and Foxglove, as markers in ``base_link``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.messages.robot_state import BASE_FRAME
from dmp_cpg_ros.nodes.messages.values import set_stamp

FORCES, FEET, PATHS, FOOTHOLDS = 'foot_forces', 'feet', 'swing_paths', 'footholds'
"""Namespaces of markers, which viewers show and hide one by one; each leg has its place as id."""

_LOOKS = {
    FORCES: (Marker.ARROW, (0.06, 0.12, 0.0), (0.9, 0.25, 0.15)),
    FEET: (Marker.SPHERE, (0.12, 0.12, 0.12), (0.9, 0.25, 0.15)),
    PATHS: (Marker.LINE_STRIP, (0.03, 0.0, 0.0), (0.15, 0.45, 0.9)),
    FOOTHOLDS: (Marker.SPHERE, (0.16, 0.16, 0.03), (0.15, 0.45, 0.9)),
}
"""Kind, scale in standing heights and colour."""


class FootMarkers:
    """Writes what feet do: how they are loaded, and where they go while they swing.

    Parameters
    ----------
    stance_height : float
        Standing height of the robot [m], which everything is scaled to.
    weight : float
        Weight of the robot [N]; a foot that bears it has an arrow as long as the robot is high.
    """

    def __init__(self, stance_height: float, weight: float) -> None:
        """Lay the markers out."""
        self._length = stance_height / weight
        self._markers = {(space, place): _marker(space, place, stance_height)
                         for space in _LOOKS for place in range(len(LEGS))}
        self._message = MarkerArray(markers=list(self._markers.values()))

    def fill(self, time_ns: int, feet: Array, forces: Array, up: Array,
             swings: Sequence[Array | None]) -> MarkerArray:
        """Refill the message.

        Parameters
        ----------
        time_ns : int
            Stamp [ns].
        feet : ndarray (4, 3)
            Centres of the feet in the base [m].
        forces : ndarray (4,)
            Normal forces [N].
        up : ndarray (3,)
            Direction of the forces in the base.
        swings : sequence of ndarray (n, 3) or None
            Ways of swinging feet to their footholds in the base [m]; None of those that stand.
        """
        for place, (foot, force, swing) in enumerate(zip(feet, forces, swings, strict=True)):
            self._show(FEET, place, time_ns, foot[None] if force > 0.0 else None)
            self._show(FORCES, place, time_ns, np.array(
                (foot, foot + self._length * force * up)) if force > 0.0 else None)
            self._show(PATHS, place, time_ns, swing)
            self._show(FOOTHOLDS, place, time_ns, None if swing is None else swing[-1:])
        return self._message

    def _show(self, space: str, place: int, time_ns: int, points: Array | None) -> None:
        """Points of a line or an arrow, or the one where a shape is; None hides it."""
        marker = self._markers[space, place]
        set_stamp(marker.header.stamp, time_ns)
        marker.action = Marker.DELETE if points is None else Marker.ADD
        if points is None:
            marker.points = []
        elif len(points) == 1:
            position = marker.pose.position
            position.x, position.y, position.z = points[0].tolist()
        else:
            marker.points = [Point(x=x, y=y, z=z) for x, y, z in points.tolist()]


def _marker(space: str, place: int, stance_height: float) -> Marker:
    kind, scale, (red, green, blue) = _LOOKS[space]
    x, y, z = (stance_height * value for value in scale)
    marker = Marker(ns=space, id=place, type=kind, scale=Vector3(x=x, y=y, z=z),
                    color=ColorRGBA(r=red, g=green, b=blue, a=1.0))
    marker.header.frame_id = BASE_FRAME
    marker.pose.orientation.w = 1.0
    return marker
