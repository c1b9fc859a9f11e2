# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Networks of any size, graph and kind of oscillator (paper, Sections 3.4 and 3.5)."""
