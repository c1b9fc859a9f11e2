# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes that walk have in common: the robot's description and the gait named by their
parameters.
"""

from __future__ import annotations

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.certificate import Certificate, certify
from dmp_cpg_ros.core.gait import Gait
from dmp_cpg_ros.core.gait_network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.inhibition import InhibitionParameters
from dmp_cpg_ros.core.leg_primitive import LegParameters, body_scale
from dmp_cpg_ros.core.posture import PostureParameters
from dmp_cpg_ros.core.reference import ReferenceParameters
from dmp_cpg_ros.core.robot_description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import GaitParameters, RobotFileParameters, TickParameters
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
    return GaitNetwork(
        node.parameters_of(CanonicalParameters), gait_of(node), body_scale(description_of(node))
    )


def certificate_of(node: ManagedNode, network: GaitNetwork) -> Certificate:
    """Certificate of a node's parameters; the node declares the sets in ``CERTIFIED``."""
    of = node.parameters_of
    return certify(
        network,
        of(InhibitionParameters),
        of(ReferenceParameters),
        of(LegParameters),
        of(PostureParameters),
        of(TickParameters).tick_ns * 1e-9,
    )


def certificate_words(certificate: Certificate) -> str:
    """Certificate in a few words: whether it holds, its grade, what is sampled."""
    if not certificate.holds:
        return f'certificate fails: {", ".join(entry.name for entry in certificate.failing)}'
    sampled = f', sampled: {", ".join(certificate.sampled)}' if certificate.sampled else ''
    return f'certificate holds, {certificate.contraction_grade} grade{sampled}'
