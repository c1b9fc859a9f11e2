# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names of the entries of the messages that are read by name, to make such messages."""

from __future__ import annotations

from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.layouts import GAIN_ROWS, POSTURE_ROWS, canonical_rows
from dmp_cpg_ros.suite import load_gaits

ENTRY_NAMES = {
    'joint_states': JOINT_NAMES,
    'canonical_state': canonical_rows(load_gaits()),
    'posture_feedback': POSTURE_ROWS,
    'inhibition_gains': GAIN_ROWS,
    'joint_targets': tuple(f'fl_{joint}' for joint in JOINTS_OF_LEG),
    'foot_contacts': tuple(f'{leg}_foot' for leg in LEGS),
}
