# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot behind a small port: MuJoCo, a perfect-tracking stand-in, the model reader."""
