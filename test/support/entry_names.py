# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names of the entries of the messages that are read by name, to make such messages."""

from __future__ import annotations

from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.nodes.conversions import CANONICAL_NAMES, CORRECTION_NAMES, SHIFT_NAMES

ENTRY_NAMES = {
    'joint_states': JOINT_NAMES,
    'canonical_state': CANONICAL_NAMES,
    'posture_feedback': JOINT_NAMES + SHIFT_NAMES + CORRECTION_NAMES,
    'joint_targets': tuple(f'fl_{joint}' for joint in JOINTS_OF_LEG),
    'foot_contacts': tuple(f'{leg}_foot' for leg in LEGS),
}
