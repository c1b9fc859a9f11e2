# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Physical constants."""

from __future__ import annotations

GRAVITY = 9.81
"""Acceleration of gravity that robots and gaits are planned with [m/s^2]."""
