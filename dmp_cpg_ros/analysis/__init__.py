# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a recording to metrics, figures and a report, without ROS."""

from dmp_cpg_ros.analysis.recording import Recording

__all__ = ['Recording']
