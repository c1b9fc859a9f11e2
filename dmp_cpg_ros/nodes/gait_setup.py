# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes that walk have in common: the robot's description and the gait named by their parameters."""

from __future__ import annotations

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.gait import Gait
from dmp_cpg_ros.core.gait_network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.leg_primitive import body_scale
from dmp_cpg_ros.core.robot_description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import GaitParameters, RobotFileParameters
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_gait


def description_of(node: ManagedNode) -> RobotDescription:
    """Description of the robot that a node's parameters name."""
    return load_description(find_config(node.parameters_of(RobotFileParameters).robot))


def gait_of(node: ManagedNode) -> Gait:
    """Gait that a node's parameters name."""
    parameters = node.parameters_of(GaitParameters)
    return load_gait(parameters.gait, parameters.gaits_file)


def network_of(node: ManagedNode) -> GaitNetwork:
    """Coupled oscillators of a node's gait, robot and canonical parameters."""
    return GaitNetwork(node.parameters_of(CanonicalParameters), gait_of(node), body_scale(description_of(node)))
