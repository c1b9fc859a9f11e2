# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Switched inhibition: the state machine of stopping and starting, and what asks for it."""
