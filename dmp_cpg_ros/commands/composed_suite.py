# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All nodes of the suite but the recorder in one process and one executor."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib import import_module

from dmp_cpg_ros.nodes.framework.execution import run_nodes
from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.suite_table import WALKING


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all nodes; arguments as for a node, values come from parameter files by node name.

    Returns
    -------
    int
        Exit status as of a node.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)

    def make() -> Iterator[SuiteNode]:
        local = LocalDelivery([kind.name for kind in WALKING])
        for kind in WALKING:
            node_class = getattr(import_module(kind.module), kind.class_name)
            for name in kind.instances:
                node = node_class(name)
                node.local = local
                yield node

    return run_nodes('composed_suite', arguments, make)


if __name__ == '__main__':
    sys.exit(main())
