# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers from a recording, one file per group of ``metrics.json``."""
