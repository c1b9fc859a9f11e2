# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writers of messages as the suite's nodes have them."""

from __future__ import annotations

from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateWriter
from dmp_cpg_ros.suite import load_gaits


def canonical_writer() -> CanonicalStateWriter:
    """Writer of ``canonical_state`` with the gaits of the package."""
    return CanonicalStateWriter(tuple(load_gaits()))
