# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's description and the gaits of the nodes that walk."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitInForce
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import GaitParameters, RobotFileParameters
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_gaits

if TYPE_CHECKING:
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode


def description_of(node: SuiteNode) -> RobotDescription:
    """Description of the robot that a node's parameters name."""
    return load_description(find_config(node.parameters_of(RobotFileParameters).robot, ROBOTS))


def known_gaits(node: SuiteNode) -> KnownGaits:
    """Read all gaits of the file that a node's parameters name; raises ParameterError when the
    gait that they choose is not among them.
    """
    gaits = KnownGaits(load_gaits(node.parameters_of(GaitParameters).gaits_file))
    gaits.named(gait_name(node))
    return gaits


def gait_name(node: SuiteNode) -> str:
    """Name of the gait that a node's parameters choose."""
    return node.parameters_of(GaitParameters).gait


def follow_gait(node: SuiteNode, gait: GaitInForce) -> None:
    """Let a node's parameter ``gait`` name the gait that its messages say, once it has changed."""
    if gait.name != gait_name(node) and not isinstance(gait, BlendedGait):
        node.parameter_changes.follow({'gait': gait.name})
