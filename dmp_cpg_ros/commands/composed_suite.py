# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All nodes of the suite but the recorder in one process and one executor."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from dmp_cpg_ros.nodes.canonical_oscillators import CanonicalOscillators
from dmp_cpg_ros.nodes.executors import run_nodes
from dmp_cpg_ros.nodes.inhibition import InhibitionNode
from dmp_cpg_ros.nodes.leg_transformation import LegTransformation
from dmp_cpg_ros.nodes.local_delivery import LocalDelivery
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.nodes.mujoco_robot import MujocoRobotNode
from dmp_cpg_ros.nodes.posture_control import PostureControl
from dmp_cpg_ros.nodes.reference_filter import ReferenceFilter
from dmp_cpg_ros.nodes.suite_nodes import SUITE_NODES

CLASSES: dict[str, type[ManagedNode]] = {
    cls.KIND: cls
    for cls in (
        ReferenceFilter,
        CanonicalOscillators,
        InhibitionNode,
        PostureControl,
        LegTransformation,
        MujocoRobotNode,
    )
}
"""Class of every kind of node."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all nodes; arguments as for a node, values come from parameter files by node name.

    Returns
    -------
    int
        Exit status as of a node.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)

    def make() -> Iterator[ManagedNode]:
        local = LocalDelivery(CLASSES)
        for member in SUITE_NODES:
            node = CLASSES[member.kind](member.name)
            node.local = local
            yield node

    return run_nodes('composed_suite', arguments, make)


if __name__ == '__main__':
    sys.exit(main())
