# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fork server of the tests, which start hundreds of commands, each walk in a domain of its own.

Run as a program it is that server. It has imported what commands need after a walk and beside it,
too, and has read the suite's parameters; its walks look for others in the graph for as long as
discovery takes on one machine.
"""

from __future__ import annotations

from dmp_cpg_ros.commands import (  # noqa: F401
    analyze,
    fork_server,
    live_view,
    robot_client,
    suite_domain,
)
from dmp_cpg_ros.suite import load_suite

LOOK_S = 0.2


class TestServer(fork_server.ForkServer):
    __test__ = False
    program = __file__


if __name__ == '__main__':
    import parsed_once  # noqa: F401  # not of processes that a command starts

    suite_domain.LOOK_S = LOOK_S
    load_suite()
    fork_server.end(fork_server.main())
