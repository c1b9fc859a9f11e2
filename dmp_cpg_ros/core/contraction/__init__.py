# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Contraction analysis: the paper's Sections 3 and 4 and its appendix as functions.

Every result says whether it is *proved*, by a closed form or by outward-rounded interval bounds,
or *sampled*, which is evidence and no more.
"""
