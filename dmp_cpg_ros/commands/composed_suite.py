# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All nodes of the suite in one process and one executor."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence

import rclpy
from rclpy.executors import ExternalShutdownException

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.nodes.bag_recorder import BagRecorder
from dmp_cpg_ros.nodes.canonical_oscillators import CanonicalOscillators
from dmp_cpg_ros.nodes.executors import BAD_INPUT, OK, spin
from dmp_cpg_ros.nodes.inhibition import InhibitionNode
from dmp_cpg_ros.nodes.leg_transformation import LegTransformation
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.nodes.mujoco_robot import MujocoRobotNode
from dmp_cpg_ros.nodes.posture_control import PostureControl
from dmp_cpg_ros.nodes.reference_filter import ReferenceFilter
from dmp_cpg_ros.nodes.ros_parameters import NodeParameters
from dmp_cpg_ros.nodes.suite_nodes import RECORDER, SUITE_NODES

CLASSES: dict[str, type[ManagedNode]] = {
    cls.KIND: cls
    for cls in (
        ReferenceFilter,
        CanonicalOscillators,
        InhibitionNode,
        PostureControl,
        LegTransformation,
        MujocoRobotNode,
        BagRecorder,
    )
}
"""Class of every kind of node."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all nodes; arguments as for a node, values come from parameter files by node name.

    Returns
    -------
    int
        0 after Ctrl-C, 2 when a parameter is bad.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    record = '--record' in arguments
    arguments = [argument for argument in arguments if argument != '--record']
    signal.signal(signal.SIGINT, lambda signum, frame: None)
    rclpy.init(args=['composed_suite', *arguments])
    nodes: list[ManagedNode] = []
    try:
        for member in ((RECORDER,) if record else ()) + SUITE_NODES:
            nodes.append(CLASSES[member.kind](member.name))
        for node in nodes:
            node.start()
        spin(nodes, nodes[0].parameters_of(NodeParameters).executor)
        return OK
    except ExternalShutdownException:
        return OK
    except DmpCpgError as error:
        print(f'composed_suite: {error}', file=sys.stderr, flush=True)
        return BAD_INPUT
    finally:
        for node in nodes:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    sys.exit(main())
