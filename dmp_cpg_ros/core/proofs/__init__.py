# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proofs of certificates, and the scripts that check them without this package."""
