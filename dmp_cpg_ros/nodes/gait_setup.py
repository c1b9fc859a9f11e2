# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes that walk have in common: the robot's description and the gait named by their
parameters.
"""

from __future__ import annotations

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.certificate import Certificate
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait import Gait
from dmp_cpg_ros.core.gait_word import read_gait_word
from dmp_cpg_ros.core.robot_description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import GaitParameters, RobotFileParameters
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_gait, load_gaits


def description_of(node: ManagedNode) -> RobotDescription:
    """Description of the robot that a node's parameters name."""
    return load_description(find_config(node.parameters_of(RobotFileParameters).robot))


def gait_of(node: ManagedNode) -> Gait:
    """Gait that a node's parameters name."""
    parameters = node.parameters_of(GaitParameters)
    return load_gait(parameters.gait, parameters.gaits_file)


def gaits_of(node: ManagedNode) -> dict[str, Gait]:
    """All gaits of the file that a node's parameters name."""
    return load_gaits(node.parameters_of(GaitParameters).gaits_file)


class GaitReader:
    """Gaits by the words that travel with the phases.

    Parameters
    ----------
    node : ManagedNode
        Its gait holds where a message says nothing.
    """

    def __init__(self, node: ManagedNode) -> None:
        """Read all gaits, so that none is read in mid-tick."""
        self._gaits = gaits_of(node)
        self.gait = self._gaits[''] = gait_of(node)
        self._word = ''

    def read(self, word: str) -> Gait:
        """Gait of a word; the same object while the word stays.

        Raises
        ------
        DataError
            If there is no such gait, or its factor on the cadence is impossible.
        """
        if word != self._word:
            name, cadence_scale = read_gait_word(word)
            if name not in self._gaits:
                valid = ', '.join(filter(None, self._gaits))
                raise DataError(f"there is no gait '{name}'; valid are {valid}")
            self.gait, self._word = self._gaits[name].scaled(cadence_scale), word
        return self.gait


def certificate_words(certificate: Certificate) -> str:
    """Certificate in a few words: whether it holds, its grade, what is sampled."""
    if not certificate.holds:
        return f'certificate fails: {", ".join(entry.name for entry in certificate.failing)}'
    sampled = f', sampled: {", ".join(certificate.sampled)}' if certificate.sampled else ''
    return f'certificate holds, {certificate.contraction_grade} grade{sampled}'
