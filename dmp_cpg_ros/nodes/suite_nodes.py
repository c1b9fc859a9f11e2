# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of the suite with their names, in the order of the data flow; the robot comes last,
so that its first state finds everybody listening.
"""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.robot_model.state import LEGS


@dataclass(frozen=True)
class SuiteNode:
    """One node of the suite.

    Attributes
    ----------
    kind : str
        Its executable.
    name : str
        Its name in the graph.
    """

    kind: str
    name: str

    @property
    def module(self) -> str:
        """Module whose ``main`` runs it."""
        return f'dmp_cpg_ros.nodes.{self.kind}'


SUITE_NODES: tuple[SuiteNode, ...] = (
    SuiteNode('reference_filter', 'reference_filter'),
    SuiteNode('canonical_oscillators', 'canonical_oscillators'),
    SuiteNode('inhibition', 'inhibition'),
    SuiteNode('posture_control', 'posture_control'),
    *(SuiteNode('leg_transformation', f'leg_transformation_{leg}') for leg in LEGS),
    SuiteNode('mujoco_robot', 'mujoco_robot'),
)
"""All nodes but the recorder."""

RECORDER = SuiteNode('bag_recorder', 'bag_recorder')
"""The recorder."""
