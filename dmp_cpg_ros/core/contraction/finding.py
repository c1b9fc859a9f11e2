# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Result of a contraction test, with its grade."""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.errors import ParameterError

PROVED = 'proved'
"""Grade of a bound that holds at every point: a closed form, or intervals rounded outwards."""

CONTINUOUS = 'continuous'
"""Grade of a bound that is proved of the differential equation, of which the suite runs steps."""

SAMPLED = 'sampled'
"""Grade of a bound that was evaluated at points, and may fail between them."""

GRADES = (PROVED, CONTINUOUS, SAMPLED)
"""All grades, the stronger one first."""


@dataclass(frozen=True)
class Finding:
    """Outcome of a contraction test on a region.

    Attributes
    ----------
    rate : float
        λ of the definitions in Section 3.1 [1/s]: distances shrink at least like exp(−λt).
        Negative where the test found no contraction.
    grade : str
        ``proved``, ``continuous`` or ``sampled``.
    evaluations : int
        Points (sampled) or boxes (proved) at which the Jacobian was evaluated; 0 for closed forms.
    statement : str
        The result in one sentence.

    Raises
    ------
    ParameterError
        If the grade is none of the three.
    """

    rate: float
    grade: str
    evaluations: int
    statement: str

    def __post_init__(self) -> None:
        """Validate."""
        if self.grade not in GRADES:
            raise ParameterError(f"grade '{self.grade}' is not known; valid are "
                                 f"{', '.join(GRADES)}")


def weakest(grades: tuple[str, ...]) -> str:
    """Grade of a conclusion from several premises: that of the weakest."""
    return max(grades, key=GRADES.index, default=PROVED)
