# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes that walk have in common: the robot's description and the gait named by their
parameters.
"""

from __future__ import annotations

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.certificates.certify import Certificate
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitInForce
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import GaitParameters, RobotFileParameters
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_gaits


def description_of(node: ManagedNode) -> RobotDescription:
    """Description of the robot that a node's parameters name."""
    return load_description(find_config(node.parameters_of(RobotFileParameters).robot))


def known_gaits(node: ManagedNode) -> KnownGaits:
    """Read all gaits of the file that a node's parameters name; raises ParameterError when the
    gait that they choose is not among them.
    """
    gaits = KnownGaits(load_gaits(node.parameters_of(GaitParameters).gaits_file))
    gaits.named(gait_name(node))
    return gaits


def gait_name(node: ManagedNode) -> str:
    """Name of the gait that a node's parameters choose."""
    return node.parameters_of(GaitParameters).gait


def follow_gait(node: ManagedNode, gait: GaitInForce) -> None:
    """Let a node's parameter ``gait`` name the gait that its messages say, once it has changed."""
    if gait.name != gait_name(node) and not isinstance(gait, BlendedGait):
        node.follow({'gait': gait.name})


def certificate_words(certificate: Certificate) -> str:
    """Certificate in a few words: whether it holds, its grade, what is sampled."""
    if not certificate.holds:
        return f'certificate fails: {", ".join(entry.name for entry in certificate.failing)}'
    sampled = f', sampled: {", ".join(certificate.sampled)}' if certificate.sampled else ''
    return f'certificate holds, {certificate.contraction_grade} grade{sampled}'
