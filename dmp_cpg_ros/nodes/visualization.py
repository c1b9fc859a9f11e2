# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``visualization``: feet, forces, footholds and the body's path, for RViz and Foxglove.

It looks on: it reads best effort, keeps the newest message of each topic and looks into it when it
draws. It also draws what is played from a bag.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.vec3 import upward
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.leg import LegParameters, LegPrimitive
from dmp_cpg_ros.core.transformation.preview import rest_of_swing
from dmp_cpg_ros.nodes.framework.gaits import description_of, known_gaits
from dmp_cpg_ros.nodes.framework.parameters import LockStepParameters
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages import robot_state
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateReader
from dmp_cpg_ros.nodes.messages.cdr import serialized_reader
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.markers import FootMarkers
from dmp_cpg_ros.nodes.messages.posture_feedback import PostureFeedbackReader
from dmp_cpg_ros.nodes.messages.reference import read_reference
from dmp_cpg_ros.nodes.messages.values import header_ns, set_stamp, stamped
from dmp_cpg_ros.primitive_files import load_motion
from dmp_cpg_ros.suite_table import KINDS, VISUALIZATION

NEWEST = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1,
                    reliability=ReliabilityPolicy.BEST_EFFORT)

STEP_M, LONGEST = 0.05, 1000
"""Distance between the points of the body's path [m], and how many there are."""

PATH_EVERY = 10
"""The path comes with every so many drawings."""


@dataclass(frozen=True)
class VisualizationParameters(Parameters):
    """Parameters of the node."""

    drawing_rate: float = parameter(20.0, 'rate of the markers, of wall time', 0.1, 100.0,
                                    unit='Hz')


class Visualization(SuiteNode):
    """Draws what the feet do and where the body has been."""

    KIND = VISUALIZATION
    PARAMETER_SETS = (*KINDS[VISUALIZATION].sets, LockStepParameters, VisualizationParameters)

    def configure(self) -> None:
        """Build the legs whose paths are drawn, and the topics."""
        description, parameters = description_of(self), self.parameters_of(LegParameters)
        motion = load_motion(parameters.motion)
        self._legs = [LegPrimitive(leg, description, parameters, motion) for leg in LEGS]
        self._markers = FootMarkers(description.stance_height, description.mass * GRAVITY)
        self._path = Path()
        self._path.header.frame_id = robot_state.ODOM_FRAME
        self._drawn, self._stamp_ns, self._place = 0, -1, np.zeros(3)
        self._bytes: dict[str, bytes] = {}
        readers: dict[str, Callable[[Any], Any]] = {
            'posture_feedback': stamped(PostureFeedbackReader().read),
            'canonical_state': CanonicalStateReader(known_gaits(self)).read,
            'reference': read_reference,
            'odom': stamped(robot_state.read_odom)}
        self._readers = {name: _of_bytes(serialized_reader(interface(name).type), read)
                         for name, read in readers.items()}
        for name in readers:
            self.listen(name, partial(self._bytes.__setitem__, name), raw=True, qos=NEWEST)
        self._marker_publisher = self.publisher('markers')
        self._path_publisher = self.publisher('body_path')
        self._timer: Any = None

    def activate(self) -> None:
        """Begin to draw."""
        self._timer = self.create_steady_timer(
            1.0 / self.parameters_of(VisualizationParameters).drawing_rate, self._draw)

    def deactivate(self) -> None:
        """Draw no more."""
        self.destroy_timer(self._timer)
        self._timer = None

    def _draw(self) -> None:
        if self._timer is None:                                  # was due when it was destroyed
            return
        values = {name: self._readers[name](data) for name, data in list(self._bytes.items())}
        up = np.array((0.0, 0.0, 1.0))
        if 'odom' in values:
            stamp_ns, motion = values['odom']
            up = np.array(upward(motion.quaternion.tolist()))
            self._follow(stamp_ns, motion)
        stamp_ns, feedback = values.get('posture_feedback', (self._stamp_ns, None))
        if stamp_ns == self._stamp_ns:
            return
        self._stamp_ns = stamp_ns
        self.begin_tick(stamp_ns)
        feet = np.array([leg.kinematics.foot(feedback.measured[3 * i:3 * i + 3])
                         for i, leg in enumerate(self._legs)])
        swings: list[Array | None] = [None] * len(LEGS)
        if {'canonical_state', 'reference'} <= values.keys() and feedback.command.balanced:
            x, x_dot, gait = values['canonical_state']
            swings = [rest_of_swing(leg, gait, x[i], x_dot[i], values['reference'],
                                    feedback.of_leg(i))
                      for i, leg in enumerate(self._legs)]
        self._marker_publisher.publish(self._markers.fill(
            stamp_ns, feet, np.array(feedback.foot_force), up, swings))
        self.end_tick()

    def _follow(self, stamp_ns: int, motion: robot_state.BaseMotion) -> None:
        """Lengthen the path of the body, and publish it now and then."""
        place, poses = motion.position_in_world, self._path.poses
        if poses and header_ns(poses[-1]) > stamp_ns:            # the robot has begun anew
            poses.clear()
        if not poses or np.linalg.norm(place - self._place) >= STEP_M:
            self._place = place
            pose = PoseStamped()
            pose.header.frame_id = self._path.header.frame_id
            set_stamp(pose.header.stamp, stamp_ns)
            to, turn = pose.pose.position, pose.pose.orientation
            to.x, to.y, to.z = place.tolist()
            turn.x, turn.y, turn.z, turn.w = motion.quaternion.tolist()
            poses.append(pose)
            del poses[:-LONGEST]
        self._drawn += 1
        if self._drawn % PATH_EVERY == 1:
            set_stamp(self._path.header.stamp, stamp_ns)
            self._path_publisher.publish(self._path)


def _of_bytes(decode: Callable[[bytes], Any], read: Callable[[Any], Any],
              ) -> Callable[[bytes], Any]:
    return lambda data: read(decode(data))
