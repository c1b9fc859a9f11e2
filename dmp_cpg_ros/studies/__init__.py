# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Studies, benchmarks and trials: the source of the figures in the documentation."""
