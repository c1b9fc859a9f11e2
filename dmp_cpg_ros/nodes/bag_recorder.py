# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The node that records the suite's topics into a rosbag2 folder."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosgraph_msgs.msg import Clock

from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.framework.ticks import drain
from dmp_cpg_ros.nodes.messages.interfaces import RECORDED, STAMPED_CMD_VEL, Interface
from dmp_cpg_ros.nodes.messages.values import counts_message
from dmp_cpg_ros.nodes.recording.bag_writing import STORAGES, BagWriter, RecordingError
from dmp_cpg_ros.suite_table import RECORDER

ALL = 'all'

CLOCK_TOPICS = ('joint_states', 'imu', 'ground_truth', 'foot_contacts')
"""Topics whose stamps are the robot's clock, because this robot itself writes them; of ``/clock``
there may be several.
"""

TICK_TOPIC = 'joint_states'

TAKE_EVERY_S = 0.05
"""How often messages are taken that bear the robot's time [s]: nobody waits for the recorder."""


@dataclass(frozen=True)
class RecorderParameters(Parameters):
    """Parameters of the recorder."""

    output: str = parameter(
        'bag', 'folder of the recording; if it exists, the next free of bag_1, bag_2, ...')
    storage: str = parameter(
        'mcap', 'file format; only mcap stays readable when the recorder is killed',
        choices=STORAGES)
    topics: tuple[str, ...] = parameter(
        (ALL,), 'topics to record', choices=(ALL, *(topic.name for topic in RECORDED)))
    flush_period: float = parameter(
        0.25, 'time between flushes to disk; older messages survive when the recorder is killed',
        0.02, 60.0, unit='s')
    stamped_cmd_vel: bool = parameter(False, 'whether cmd_vel is TwistStamped')


class BagRecorder(SuiteNode):
    """Records the suite's topics into a rosbag2 folder (MCAP or SQLite), bytes as received.

    It records while it is active. The bag is opened when the node is configured and completed when
    it is cleaned up or its process ends; a killed recorder leaves a bag that `analyze` can rescue.
    """

    KIND = RECORDER
    PARAMETER_SETS = (RecorderParameters,)
    ENDS_WITH = (RecordingError,)

    def configure(self) -> None:
        """Open the bag and subscribe."""
        parameters = self.parameters_of(RecorderParameters)
        wanted = Path(parameters.output).expanduser()
        self._bag = BagWriter(wanted, parameters.storage)
        if self._bag.folder != wanted:
            self.get_logger().warning(f"'{wanted}' exists: recording into '{self._bag.folder}'")
        topics = [topic for topic in RECORDED if topic.installed
                  and (ALL in parameters.topics or topic.name in parameters.topics)]
        stamped = [topic.name for topic in topics if _bears_robot_time(topic)]
        clocks = [name for name in stamped if name in CLOCK_TOPICS] or stamped
        topics.sort(key=lambda topic: topic.name not in clocks)  # the others wait for a clock
        self._drained_at_end = [
            self._record(STAMPED_CMD_VEL if parameters.stamped_cmd_vel and topic.name == 'cmd_vel'
                         else topic, topic.name in stamped, topic.name in clocks)
            for topic in topics]
        self._clocks = self._drained_at_end[:len(clocks)]
        self.look_every(TAKE_EVERY_S)
        self._recorded = self.publisher('~/recorded')
        self._started = time.monotonic()
        # The wall clock drives only how much a kill may cost.
        self._flush_timer = self.create_steady_timer(parameters.flush_period, self._flush)

    def deactivate(self) -> None:
        """Take what has arrived."""
        self.active = True
        for subscription in self._drained_at_end:
            drain(subscription)
        self.active = False
        self._bag.flush()

    def cleanup(self) -> None:
        """Complete the bag."""
        self.destroy_timer(self._flush_timer)
        self._drained_at_end = []
        self._bag.close()
        if self.context.ok():
            count = sum(self._bag.counts.values())
            self.get_logger().info(f"{count} messages in '{self._bag.folder}'")

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Messages per topic, messages on disk, seconds of wall time."""
        counts = self._bag.counts
        return {**{f'messages.{topic}': count for topic, count in counts.items()},
                'messages': sum(counts.values()), 'messages_on_disk': self._bag.flushed,
                'wall_s': time.monotonic() - self._started}

    def _flush(self) -> None:
        self._bag.flush()
        self._recorded.publish(counts_message(self._bag.counts))

    def _record(self, topic: Interface, stamped: bool, clock: bool) -> Any:
        write = self._bag.add_topic(
            self.resolve_topic_name(topic.name), topic.type_name, topic.publisher_qos,
            stamped=stamped, clock=clock)
        is_tick = topic.name == TICK_TOPIC

        def receive(data: bytes) -> None:
            if not self._clocks:
                self._bag.advance(time.time_ns())
            elif not stamped:  # it gets the time that the clock shows
                for subscription in self._clocks:
                    drain(subscription)
            write(data)
            if is_tick:
                self.begin_tick(self._bag.newest_ns or 0)
                self.end_tick()

        return self.listen(topic, receive, raw=True, wakes=not stamped, qos=topic.recorder_qos)


def _bears_robot_time(topic: Interface) -> bool:
    """Whether the messages of a topic begin with a stamp that the suite itself sets."""
    begins = 'header' in topic.type.get_fields_and_field_types() or topic.type is Clock
    return begins and 'user' not in topic.publishers
