# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Voted inhibition: who votes, how votes fade, and what a majority of them does."""
