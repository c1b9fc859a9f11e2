# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Grades of what is found about contraction."""

from __future__ import annotations

PROVED = 'proved'
"""Grade of a bound that holds at every point: a closed form, or intervals rounded outwards."""

CONTINUOUS = 'continuous'
"""Grade of a bound that is proved of the differential equation, of which the suite runs steps."""

SAMPLED = 'sampled'
"""Grade of a bound that was evaluated at points, and may fail between them."""

GRADES = (PROVED, CONTINUOUS, SAMPLED)
"""All grades, the stronger one first."""


def weakest(grades: tuple[str, ...]) -> str:
    """Grade of a conclusion from several premises: that of the weakest."""
    return max(grades, key=GRADES.index, default=PROVED)
