# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's description and the gaits of the nodes that walk."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core.clock import RESET_NS
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitInForce
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import GaitParameters, RobotFileParameters
from dmp_cpg_ros.nodes.framework.parameters import Sets
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateReader
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_gaits

if TYPE_CHECKING:
    from rclpy.subscription import Subscription

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


def check_gaits(sets: Sets) -> None:
    """Raise ParameterError for a gait that parameters choose and their file does not have."""
    walked = sets[GaitParameters]
    known = KnownGaits(load_gaits(walked.gaits_file))
    known.named(walked.gait)
    known.chosen(sets[GaitChoiceParameters])


def gait_name(node: SuiteNode) -> str:
    """Name of the gait that a node's parameters choose."""
    return node.parameters_of(GaitParameters).gait


def follow_gait(node: SuiteNode, gait: GaitInForce) -> None:
    """Let a node's parameter ``gait`` name the gait that its messages say, once it has changed."""
    if gait.name != gait_name(node) and not isinstance(gait, BlendedGait):
        node.parameter_changes.follow({'gait': gait.name})


class WalkedGaits:
    """Gaits that may be walked, for a node that does not read the oscillators at every tick.

    After a change of the gait what was walked before counts until ``canonical_state`` says that it
    no longer is; only until then that is read.

    Parameters
    ----------
    node : SuiteNode
        Who has to know.
    gaits : KnownGaits
        Gaits that are known.
    """

    def __init__(self, node: SuiteNode, gaits: KnownGaits) -> None:
        """Read on until it is known that what parameters choose is walked."""
        self._node, self._known, self._reader = node, gaits, CanonicalStateReader(gaits)
        self._names, self._since_ns = set[str](), -1
        self._heard: Subscription | None = None
        self._listening = self._reads = False
        self.follow()

    @property
    def gaits(self) -> tuple[Gait, ...]:
        """All of them."""
        return tuple(map(self._known.named, sorted(self._names)))

    def follow(self) -> None:
        """Take the node's parameters, which may choose another gait."""
        chosen = self._chosen()
        if not (self._names and self._names <= chosen):
            self._reads, self._since_ns = True, self._node.health.stamp_ns
            if not self._listening:
                self._heard = self._node.listen('canonical_state', self._hear)
                self._listening = True
        self._names |= chosen

    def _chosen(self) -> set[str]:
        choice = self._node.parameters_of(GaitChoiceParameters)
        return set(choice.auto_gaits) if choice.auto_gait else {gait_name(self._node)}

    def _hear(self, message: Any) -> None:
        if not self._reads or 0 <= self._since_ns - header_ns(message) < RESET_NS:
            return
        walked, chosen = {end.name for end in self._reader.read(message)[2].ends}, self._chosen()
        self._names, self._reads = walked | chosen, not walked <= chosen
        if not self._reads and self._heard is not None:  # else it comes from this process
            self._node.leave(self._heard)
            self._heard, self._listening = None, False
