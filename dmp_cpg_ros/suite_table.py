# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The table of the suite's nodes: executables, names in the graph, classes, parameter sets.

A node that predicts or certifies another part declares that part's set too. In a parameter file
such shared values stand once, under ``/**``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from dmp_cpg_ros.core import suite_parameters as core
from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters, StateSourceParameters
from dmp_cpg_ros.core.modes.manager import ModeParameters
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.robot_model.mismatch import MismatchParameters
from dmp_cpg_ros.core.robot_model.sensors import SensorParameters
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.robot_model.world import WorldParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.core.voting.parameters import VoteSourceParameters, VotingSwitch

LEG, POSTURE, ROBOT, RECORDER, VISUALIZATION, DRIVER = (
    'leg_transformation', 'posture_control', 'mujoco_robot', 'bag_recorder', 'visualization',
    'ros2_control_driver')

ABSOLUTE_TOPICS = ('/clock', '/diagnostics', '/tf', '/tf_static')
"""Topics that ROS names absolutely, once for all nodes of a domain."""


@dataclass(frozen=True)
class Kind:
    """One kind of node.

    Attributes
    ----------
    name : str
        Its executable.
    class_name : str
        Its class in :attr:`module`.
    sets : tuple of Parameters classes
        Parameter sets of its part of the core; those that it has as a node are its class's.
    instances : mapping of str to mapping
        Name in the graph of each of its nodes, with the parameters that make it that one.
    """

    name: str
    class_name: str
    sets: tuple[type[Parameters], ...]
    instances: Mapping[str, Mapping[str, str]]

    @property
    def module(self) -> str:
        """Module of its class."""
        return f'dmp_cpg_ros.nodes.{self.name}'


def _single(name: str, class_name: str, *sets: type[Parameters]) -> Kind:
    return Kind(name, class_name, sets, {name: {}})


SUITE_TABLE: tuple[Kind, ...] = (
    _single(core.REFERENCE, 'ReferenceFilter',
            *core.CERTIFIED, core.CommandParameters, core.CertificateParameters),
    _single(core.CANONICAL, 'CanonicalOscillators', *core.CERTIFIED, core.CertificateParameters),
    _single(core.INHIBITION, 'InhibitionNode', *core.CERTIFIED, core.CommandParameters,
            core.CertificateParameters, VoteSourceParameters, core.RequestParameters),
    _single(POSTURE, 'PostureControl', PostureParameters, ModeParameters, EstimationParameters,
            StateSourceParameters, core.GaitParameters, core.RobotFileParameters),
    Kind(LEG, 'LegTransformation',
         (core.LegChoice, LegParameters, core.GaitParameters, core.RobotFileParameters),
         {f'{LEG}_{leg}': {'leg': leg} for leg in LEGS}),
    _single(ROBOT, 'MujocoRobotNode', core.RobotParameters, SensorParameters, MismatchParameters,
            WorldParameters, StateSourceParameters, core.TickParameters, core.RobotFileParameters,
            VotingSwitch),
    _single(RECORDER, 'BagRecorder'),
    _single(VISUALIZATION, 'Visualization',
            LegParameters, core.GaitParameters, core.RobotFileParameters),
    _single(DRIVER, 'Ros2ControlDriver',
            core.DriveParameters, core.TickParameters, core.RobotFileParameters),
)
"""All kinds of nodes in the order of the data flow; the robot comes last of those that walk, so
that its first state finds everybody listening. After it come those that look on, and who stands
for the robot where that is a real one.
"""

KINDS: dict[str, Kind] = {kind.name: kind for kind in SUITE_TABLE}
"""The table by the name of the kind."""

KIND_OF: dict[str, str] = {name: kind.name for kind in SUITE_TABLE for name in kind.instances}
"""Kind of every node that there can be, by its name in the graph."""

WALKING: tuple[Kind, ...] = tuple(
    kind for kind in SUITE_TABLE if kind.name not in (RECORDER, VISUALIZATION, DRIVER))
"""Kinds of nodes that walk in simulation: all but those that look on."""

RECORDED_WALK: tuple[str, ...] = (*(kind.name for kind in WALKING), RECORDER)
"""Names of the kinds that wait for one another where a walk is recorded."""

WALKING_NODES: tuple[str, ...] = tuple(name for kind in WALKING for name in kind.instances)
"""Names in the graph of all nodes that walk."""


RETURN_S = 0.8
"""``return_time`` of nodes that are started again when they die [s]: another writer of a topic is
believed after half a second of silence, and the robot goes on with its rhythm as safely for so
long as it stops at once. With 1.3 a trot at 100 Hz fell that did not with this.
"""

COMPOSED = 'composed_suite'
"""Executable that runs several nodes in one process."""

PROCESSES: dict[str, dict[str, tuple[str, ...]]] = {
    'each': {name: (name,) for name in WALKING_NODES},
    'blocks': {'gait': (core.REFERENCE, core.CANONICAL), 'supervision': (core.INHIBITION, POSTURE),
               'legs': tuple(KINDS[LEG].instances), ROBOT: (ROBOT,)},
    'composed': {COMPOSED: WALKING_NODES},
}
"""How the nodes that walk share processes: names of the nodes by process, in starting order. What
stops the gait is not where the oscillators are: either tells the other what acts when it is back.
"""


def instances() -> Iterator[tuple[Kind, str, Mapping[str, str]]]:
    """Every node of the suite, the recorder first: its kind, its name, its own parameters."""
    for kind in (KINDS[RECORDER], *WALKING, KINDS[VISUALIZATION]):
        for name, own in kind.instances.items():
            yield kind, name, own


def namespace_rules(namespace: str) -> list[tuple[str, str]]:
    """Remapping rules (from, to) with which a whole suite runs in a namespace.

    A robot in a namespace has its own clock, diagnostics and frames there: absolute names would
    mix those of two robots in one domain.
    """
    if namespace in ('', '/'):
        return []
    return [('__ns', namespace), *((name, name.strip('/')) for name in ABSOLUTE_TOPICS)]
