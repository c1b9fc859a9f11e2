# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every topic and service of the suite: name, type, quality of service, writers and readers.

Quality of service. What is sent at every tick is reliable: in lock-step a single lost message
would stop the run, and in a recording it would be a hole. REP-2003 asks *consumers* of sensor data
to be best effort; a reliable publisher matches such consumers too, so users' tools lose nothing by
this choice. Our own consumers are reliable. Nothing can block: keep-last publishers overwrite
their oldest message when a reader hangs.

Depths. A publisher keeps ``PUBLISHER_DEPTH`` messages, because that is what can still be sent
again to a reader that was not scheduled for a while (the recorder is on no tick's path and may
lag). The suite's nodes are never more than two ticks apart in lock-step. A reader's queue is one
for all publishers, so it is deep enough that a stranger who floods a topic does not push out the
messages of its writer between two looks; how far a late node works through old ticks in real time,
their age bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry, Path
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.estimation.parameters import ESTIMATE, GROUND_TRUTH
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import CANONICAL, INHIBITION, REFERENCE
from dmp_cpg_ros.nodes.messages.transforms import TFMessage
from dmp_cpg_ros.suite_table import DRIVER, KINDS, LEG, POSTURE, RECORDER, ROBOT, VISUALIZATION

PUBLISHER_DEPTH = 2000
"""Messages that a publisher of every tick keeps for readers that lag: 4 s at 500 Hz, more than the
period of 3 s at which Fast DDS tells readers what they have missed."""

READER_DEPTH = 250
"""Messages that a node of the suite queues for each of a topic's writers."""

RECORDER_DEPTH = 8000
"""Messages per topic that the recorder queues."""

GATE_OWNER = ROBOT
"""The node that holds the gate; its private topics bear its name."""

DRIVEN = ('joint_states', 'imu', 'foot_contacts', '/clock', 'drive_mode', 'joint_targets',
          'acting_gains', 'kept_gains')
"""What the driver of a real robot writes and reads in the place of ``ROBOT``."""

JOINT_BROADCASTER, IMU_BROADCASTER = 'joint_state_broadcaster', 'imu_sensor_broadcaster'
"""Broadcasters of ros2_control that the driver reads, by their usual names."""

COMMAND_INTERFACES = ('position', 'velocity', 'effort', 'kp', 'kd')
"""Command interfaces of joints that the driver can write, in the terms of ros2_control."""

POWER = 'power'
"""One more, of drives whose power can be taken: 1 where a drive has power, 0 where it has none."""


def foot_wrench(leg: str) -> str:
    """Topic of the force_torque_sensor_broadcaster of a foot."""
    return f'{leg}_foot_broadcaster/wrench'


def commands_of(command_interface: str) -> str:
    """Topic of the forward_command_controller of a command interface."""
    return f'{command_interface}_controller/commands'


FEELING = (CANONICAL, LEG, INHIBITION, POSTURE)
"""Kinds of nodes that can read the feet."""


def _qos(depth: int, *, latched: bool = False) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)


@dataclass(frozen=True)
class Interface:
    """One topic or service.

    Attributes
    ----------
    name : str
        Relative name, absolute where it starts with ``/``, private where it starts with ``~/``.
    type : type
        Message or service class.
    meaning : str
        What it carries, in a few words.
    publishers, subscribers : tuple of str
        Kinds of nodes that write and read it; of a service: that serve and call it. The recorder
        reads what is ``recorded`` and is named nowhere; ``user`` stands for whoever is outside the
        suite.
    other_type : str
        What to do about publishers of the other type, for the end of a sentence.
    sometimes : tuple of str
        Of both: those that write or read it with some parameters only.
    latched : bool
        Whether a late reader gets the last message (transient local, depth 1).
    recorded : bool
        Whether the recorder takes it: not what only keeps the pace of a run.
    """

    name: str
    type: type[Any]
    meaning: str
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    latched: bool = False
    sometimes: tuple[str, ...] = ()
    recorded: bool = True
    other_type: str = ''

    @property
    def service(self) -> bool:
        """Whether it is a service."""
        return hasattr(self.type, 'Request')

    @property
    def installed(self) -> bool:
        """Whether its type can be sent here."""
        return hasattr(self.type, 'get_fields_and_field_types')

    @property
    def publisher_qos(self) -> QoSProfile:
        """Profile that publishers offer."""
        return _qos(1 if self.latched else PUBLISHER_DEPTH, latched=self.latched)

    @property
    def reader_qos(self) -> QoSProfile:
        """Profile with which the suite's nodes read; deep enough for all of its publishers."""
        depth = READER_DEPTH * max(1, expected_count(self.publishers))
        return _qos(1 if self.latched else depth, latched=self.latched)

    @property
    def lossy_qos(self) -> QoSProfile:
        """Profile with which the suite's nodes read over a link that loses packets: what comes
        anew at every tick is not worth being waited for.
        """
        qos = self.reader_qos
        if self.name in EVERY_TICK:
            qos.reliability = ReliabilityPolicy.BEST_EFFORT
        return qos

    @property
    def recorder_qos(self) -> QoSProfile:
        """Profile with which the recorder reads: compatible with what is offered, and deep."""
        return _qos(RECORDER_DEPTH, latched=self.latched)

    @property
    def type_name(self) -> str:
        """ROS name of the type, such as ``sensor_msgs/msg/JointState``."""
        package, kind = self.type.__module__.split('.')[:2]
        return f'{package}/{kind}/{self.type.__name__}'


def expected_count(kinds: Sequence[str]) -> int:
    """Number of nodes that some kinds of nodes stand for."""
    return sum(len(KINDS[kind].instances) for kind in kinds if kind in KINDS)


TOPICS: tuple[Interface, ...] = (
    Interface('cmd_vel', Twist,
              'commanded speed and turn rate (TwistStamped with stamped_cmd_vel)',
              ('user',), (REFERENCE, INHIBITION),
              other_type='; with stamped_cmd_vel:=true it reads TwistStamped'),
    Interface('reference', TwistStamped, 'reference: v in linear, gamma in angular.z',
              (REFERENCE,), (CANONICAL, LEG, INHIBITION, POSTURE, VISUALIZATION),
              sometimes=(VISUALIZATION,)),
    Interface('canonical_state', JointState,
              'oscillators, shares of gaits, cadence: position = state, velocity = its rate',
              (CANONICAL,), (REFERENCE, LEG, INHIBITION, POSTURE, VISUALIZATION),
              sometimes=(REFERENCE, VISUALIZATION)),
    Interface('posture_feedback', JointState,
              'balance: torques, measured angles, shift, drift and forces of the feet; '
              "the body's mode and the phase of its movement",
              (POSTURE,), (LEG, INHIBITION, VISUALIZATION), sometimes=(VISUALIZATION,)),
    Interface('joint_targets', JointState, 'targets of the three joints of one leg',
              (LEG,), (ROBOT,)),
    Interface('joint_states', JointState, 'measured joints; the tick of the suite',
              (ROBOT,), (REFERENCE, LEG, POSTURE), sometimes=(LEG,)),
    Interface('votes', JointState, 'votes for a stop: names = voter/leg, effort = weights',
              ('user',), (INHIBITION,), sometimes=(INHIBITION,)),
    Interface('push', WrenchStamped,
              'force on the base from its stamp on, for 0.1 s unless the next one comes before; '
              'frame base_footprint (along the heading), odom or world', ('user',), (ROBOT,)),
    Interface('imu', Imu, 'turn rate and specific force in base_link; no orientation',
              (ROBOT,), (POSTURE, INHIBITION), sometimes=(POSTURE, INHIBITION)),
    Interface('ground_truth', Odometry, 'true pose and twist of base_link in world',
              (ROBOT,), (POSTURE,), sometimes=(POSTURE,)),
    Interface('foot_contacts', JointState, 'effort = normal force of each foot',
              (ROBOT,), FEELING, sometimes=FEELING),
    Interface('joint_work', JointState,
              'position = positive work of each joint since time 0 [J], effort = largest torque '
              'since the last message [N m], over every physics step; rows loss/JOINT: position = '
              'what its damping and dry friction have taken [J]; at every tenth tick',
              (ROBOT,), (), sometimes=(ROBOT,)),
    Interface('odom', Odometry,
              "the robot's own estimate: pose and twist of base_link in odom, at estimate_rate",
              (POSTURE,), (VISUALIZATION,), sometimes=(POSTURE, VISUALIZATION)),
    Interface('markers', MarkerArray,
              'feet and their forces, and how swinging feet go to their footholds; for people',
              (VISUALIZATION,), ('user',), recorded=False),
    Interface('body_path', Path, 'where the body has been, in odom; for people',
              (VISUALIZATION,), ('user',), recorded=False),
    Interface('/tf', TFMessage,
              'odom -> base_link as odom says; joints from robot_state_publisher. '
              'Only where tf2_msgs is installed', (POSTURE,), (), sometimes=(POSTURE,)),
    Interface('/tf_static', TFMessage,
              'fixed joints, from robot_state_publisher. Only where tf2_msgs is installed',
              ('user',), (), latched=True),
    Interface('robot_description', String,
              'URDF of the robot, with links base_link, its bodies and fl_foot to rr_foot',
              (ROBOT,), ('user',), latched=True),
    Interface('/clock', Clock, 'the clock of the robot', (ROBOT,), (INHIBITION,),
              sometimes=(INHIBITION,)),
    Interface('inhibition_state', DiagnosticArray,
              'stop and start for people: state, gains, times, when they change',
              (INHIBITION,), ('user',), latched=True),
    Interface('inhibition_gains', JointState,
              'position = gain of each leg [1/s], region_radius, rest_phase [rad], requested, '
              'at_rest, automatic, opposite, share, quickness, lead until they act [s]; when they '
              'change, and ten times a second',
              (INHIBITION,), (REFERENCE, CANONICAL), latched=True),
    Interface('acting_gains', JointState,
              'what acts of inhibition_gains, when it changes: who restarts inhibition finds it',
              (CANONICAL,), (INHIBITION, ROBOT), latched=True),
    Interface('kept_gains', JointState,
              'the newest of acting_gains: who restarts inhibition and the oscillators finds it',
              (ROBOT,), (INHIBITION,), latched=True, recorded=False),
    Interface('gait_memory', JointState,
              'canonical_state and reference, for who is restarted: in lock-step of every tick, '
              'with return_time ten times a second',
              (INHIBITION,), (REFERENCE, CANONICAL), latched=True,
              sometimes=(REFERENCE, CANONICAL, INHIBITION)),
    Interface('drive_mode', String,
              'following, or what the robot does by itself while legs are silent or joints do not '
              'follow: stand, lie, damp; when it changes', (ROBOT,), (POSTURE, INHIBITION),
              latched=True),
    Interface('body_mode', String,
              'standing, lying, moving between the two, or fallen, when it changes',
              (POSTURE,), (ROBOT,), latched=True),
    Interface('/diagnostics', DiagnosticArray, 'health of every node', tuple(KINDS), ()),
    Interface(f'{GATE_OWNER}/holding_at', Clock, 'stamp of the tick that the gate holds',
              (ROBOT,), ('user',), latched=True, sometimes=(ROBOT,), recorded=False),
    Interface(f'{GATE_OWNER}/advance_until', Clock, 'stamp up to which the gate lets ticks pass',
              ('user',), (ROBOT,), sometimes=(ROBOT,), recorded=False),
    Interface('~/commands_taken', JointState,
              'how many messages on cmd_vel, push and votes (names) the node has taken (position)',
              (REFERENCE, INHIBITION, ROBOT), ('user',), latched=True, recorded=False),
    Interface('~/recorded', JointState,
              'how many messages (position) of each topic (names) are in the bag, at each flush',
              (RECORDER,), ('user',), latched=True, recorded=False),
    Interface(f'{JOINT_BROADCASTER}/joint_states', JointState,
              "a real robot's joints, in any order and at any rate", ('user',), (DRIVER,),
              recorded=False),
    Interface(f'{IMU_BROADCASTER}/imu', Imu,
              "a real robot's IMU, with its orientation, in the axes of base_link",
              ('user',), (DRIVER,), recorded=False),
    *(Interface(foot_wrench(leg), WrenchStamped,
                f"force on a real robot's foot {leg}; its size counts", ('user',), (DRIVER,),
                recorded=False) for leg in LEGS),
    *(Interface(commands_of(name), Float64MultiArray,
                f'{name} of the twelve joints in the order of the robot file, once enabled',
                (DRIVER,), ('user',), sometimes=(DRIVER,), recorded=False)
      for name in (*COMMAND_INTERFACES, POWER)),
)
"""Topics of the suite."""

SHARED = ('/diagnostics', '/tf', '/tf_static')
"""Topics that nodes of other packages may write too."""

SILENT_NS = 500_000_000
"""Age of the newest ``inhibition_gains`` from which inhibition counts as gone [ns]."""

BLIND_NS = 250_000_000
"""Time on the robot's clock without a tick after which nothing is known of the gait [ns]."""

REPEATED = ('reference', 'canonical_state', 'posture_feedback', 'joint_targets',
            'inhibition_gains')
"""What nodes publish again in lock-step when they hear the trigger of one of their last two ticks
again.
"""

SELDOM = ('inhibition_state', 'drive_mode', 'body_mode')
"""What is latched, recorded, and told when something begins: a recording without one of them tells
another story.
"""

EVERY_TICK = ('joint_states', 'imu', 'ground_truth', 'foot_contacts', '/clock', 'reference',
              'canonical_state', 'posture_feedback', 'joint_targets')
"""What comes anew at every tick, or nearly so."""

RECORDED = tuple(topic for topic in TOPICS if topic.recorded)
"""Topics that a bag can have."""

SERVICES: tuple[Interface, ...] = (
    Interface('inhibit', SetBool, 'true stops the gait, false resumes it',
              (INHIBITION,), ('user',)),
    Interface('stand_up', Trigger, 'stand up from lying or lowering', (POSTURE,), ('user',)),
    Interface('lie_down', Trigger, 'stop the gait and lie down on the belly',
              (POSTURE,), ('user',)),
    Interface('recover', Trigger, 'after a fall: roll over and stand up', (POSTURE,), ('user',)),
    Interface('~/enable', SetBool,
              'true lets the driver command the joints; false stops following the legs, and the '
              'robot looks after itself', (DRIVER,), ('user',)),
    Interface('~/ready', Trigger, 'whether the node is active and connected with its neighbours',
              tuple(KINDS), ('user',)),
)
"""Services of the suite."""

BODY_TOPICS = {ESTIMATE: ('imu', 'foot_contacts'), GROUND_TRUTH: ('ground_truth',)}
"""What the posture controller reads besides joints, by the parameter ``state_source``."""

INTERFACES: dict[str, Interface] = {interface.name: interface for interface in TOPICS + SERVICES}


def interface(name: str) -> Interface:
    """Look an interface up.

    Raises
    ------
    ParameterError
        If there is none of that name; the valid names are listed.
    """
    if name not in INTERFACES:
        raise ParameterError(f"there is no interface '{name}'; valid are {', '.join(INTERFACES)}")
    return INTERFACES[name]


def private(name: str, kind: str) -> Interface:
    """A private topic ``~/...`` as everybody names that of one kind of node."""
    return replace(interface(name), name=name.replace('~', kind, 1), publishers=(kind,))


def published_by(kind: str) -> tuple[Interface, ...]:
    """Topics that a kind of node writes."""
    return tuple(topic for topic in TOPICS if _is_among(kind, topic, topic.publishers))


def read_by(kind: str) -> tuple[Interface, ...]:
    """Topics that a kind of node reads."""
    return RECORDED if kind == RECORDER else tuple(
        topic for topic in TOPICS if _is_among(kind, topic, topic.subscribers))


def _is_among(kind: str, topic: Interface, ends: Sequence[str]) -> bool:
    return kind in ends or (kind == DRIVER and ROBOT in ends and topic.name in DRIVEN)


def served_by(kind: str) -> tuple[Interface, ...]:
    """Services that a kind of node offers."""
    return tuple(service for service in SERVICES if kind in service.publishers)


def partners(topic: Interface, *, readers: bool) -> tuple[str, ...]:
    """Kinds of nodes that always read (the recorder included) or always write a topic."""
    recorder = (RECORDER,) if topic.recorded else ()
    kinds = (*topic.subscribers, *recorder) if readers else topic.publishers
    return tuple(kind for kind in kinds if kind in KINDS and kind not in topic.sometimes)


STAMPED_CMD_VEL = replace(
    INTERFACES['cmd_vel'], type=TwistStamped,
    other_type='; with stamped_cmd_vel:=false it reads Twist')
"""``cmd_vel`` with parameter ``stamped_cmd_vel:=true``."""
