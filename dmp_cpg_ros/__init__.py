# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""CPG-based quadruped walking with coupled rhythmic movement primitives on ROS 2."""

__version__ = '0.1.0'
