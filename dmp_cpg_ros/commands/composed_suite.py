# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``composed_suite``: several nodes in one process and one executor: a block of them, or all."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from importlib import import_module

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.suite_table import WALKING, WALKING_NODES


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the nodes; returns the exit status of :func:`.execution.run_nodes`."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    own = given.index('--ros-args') if '--ros-args' in given else len(given)
    parser = _parser()
    chosen = parser.parse_args(given[:own]).nodes or WALKING_NODES
    if unknown := [name for name in chosen if name not in WALKING_NODES]:
        parser.error(f"there is no node '{unknown[0]}'; valid are {', '.join(WALKING_NODES)}")
    from dmp_cpg_ros.nodes.framework.execution import run_nodes
    from dmp_cpg_ros.nodes.framework.local_delivery import LocalDelivery
    from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode

    classes = {kind.name: getattr(import_module(kind.module), kind.class_name)
               for kind in WALKING if set(chosen) & set(kind.instances)}

    def make() -> Iterator[SuiteNode]:
        # A kind with nodes elsewhere, too, is not in this process: its readers hear all of it.
        local = LocalDelivery(
            [kind.name for kind in WALKING if set(kind.instances) <= set(chosen)])
        for kind in WALKING:
            for name in filter(chosen.__contains__, kind.instances):
                try:
                    node = classes[kind.name](name)
                except ParameterError as error:
                    raise ParameterError(f'{name}: {error}') from error
                node.local = local
                yield node

    return run_nodes('composed_suite', given[own:], make,
                     any(node_class.JUDGES for node_class in classes.values()))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='composed_suite',
        description='Run nodes of the suite in one process, where messages between them need no '
        'middleware. Their values come from parameter files, by the names of the nodes.',
        epilog='Arguments of ROS follow: --ros-args ...')
    parser.add_argument('nodes', nargs='*', metavar='NODE',
                        help=f'any of {", ".join(WALKING_NODES)} (default: all)')
    return parser


if __name__ == '__main__':
    sys.exit(main())
