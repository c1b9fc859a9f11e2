# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite's messages: their table, their bytes, and the arrays that they carry.

Values pass bit for bit. What enters is taken by name and checked;
:class:`~dmp_cpg_ros.core.errors.DataError` is raised for what must not enter.
"""
