# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Names of the entries of the suite's own ``JointState`` messages, for nodes and analysis."""

from __future__ import annotations

from dmp_cpg_ros.core.robot_model.state import LEGS

CANONICAL_NAMES = tuple(f'{leg}_x{i}' for leg in LEGS for i in (1, 2))
"""Of ``canonical_state``: states in ``position``, their rates in ``velocity``."""

SHIFT_NAMES = tuple(f'{leg}_foot_{axis}' for leg in LEGS for axis in 'xyz')
CORRECTION_NAMES = ('base_x', 'base_y', 'base_yaw')
"""Of ``posture_feedback``, after ``JOINT_NAMES``."""
