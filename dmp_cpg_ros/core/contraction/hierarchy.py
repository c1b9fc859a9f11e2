# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Hierarchies of contracting systems: Propositions contrheirarchy, tcontr1, tcontr2; Theorems 2 to 4.

A part is contracting or transverse contracting for each fixed value of what drives it. The rules
combine parts from the top down; a transverse contracting part may stand once in a hierarchy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

from dmp_cpg_ros.core.contraction.finding import GRADES, PROVED, weakest
from dmp_cpg_ros.core.contraction.synchronisation import Synchronisation
from dmp_cpg_ros.core.errors import ParameterError

CONTRACTING = 'contracting'
"""Any two solutions converge."""

TRANSVERSE = 'transverse contracting'
"""Any two solutions converge up to a reparameterization of time."""

_KINDS = (CONTRACTING, TRANSVERSE)


@dataclass(frozen=True)
class Part:
    """A system with what is known about its convergence.

    Attributes
    ----------
    name : str
        What it is, for sentences.
    kind : str
        ``contracting`` or ``transverse contracting``, for each fixed value of its inputs.
    rate : float
        λ [1/s]; the part has the property of its kind when the rate is positive.
    grade : str
        ``proved``, ``continuous`` or ``sampled``.

    Raises
    ------
    ParameterError
        If the kind or the grade is not one of these.
    """

    name: str
    kind: str
    rate: float
    grade: str = PROVED

    def __post_init__(self) -> None:
        """Validate."""
        if self.kind not in _KINDS or self.grade not in GRADES:
            raise ParameterError(f"part '{self.name}': the kind must be one of "
                                 f"{', '.join(_KINDS)} and the grade one of {', '.join(GRADES)}, "
                                 f"not '{self.kind}' and '{self.grade}'")

    @property
    def holds(self) -> bool:
        """Whether the part has the property of its kind."""
        return self.rate > 0.0


def hierarchy(upper: Part, lower: Part) -> Part:
    """Combine a system with one that it drives (Propositions contrheirarchy, tcontr1, tcontr2).

    Parameters
    ----------
    upper, lower : Part
        The driving and the driven system.

    Returns
    -------
    Part
        The kind is transverse when one of them is. The rate is the smaller of the two: joint
        solutions converge at every rate below it.

    Raises
    ------
    ParameterError
        If both are transverse contracting: two phases would remain, and no rule covers that.
    """
    if upper.kind == TRANSVERSE and lower.kind == TRANSVERSE:
        raise ParameterError(f"'{upper.name}' and '{lower.name}' are both transverse contracting; "
                             'a hierarchy may have one such part')
    kind = TRANSVERSE if TRANSVERSE in (upper.kind, lower.kind) else CONTRACTING
    return Part(f'{upper.name} → {lower.name}', kind, min(upper.rate, lower.rate),
                weakest((upper.grade, lower.grade)))


def primitive(kind: str, reference: Part, canonical: Part, transformations: Sequence[Part]
              ) -> Part:
    """Theorems 2 and 3: a reference that drives a canonical system that drives transformation
    systems is, for a fixed external reference, of the kind of the canonical system.

    Raises
    ------
    ParameterError
        If the canonical system is not of that kind, or another part is not contracting.
    """
    for part in (reference, *transformations):
        _require(part, CONTRACTING)
    _require(canonical, kind)
    return reduce(hierarchy, transformations, hierarchy(reference, canonical))


def coupled_primitives(reference: Part, oscillator: Part, found: Synchronisation,
                       transformations: Sequence[Part]) -> Part:
    """Theorem 4: coupled rhythmic primitives with one reference are transverse contracting.

    Parameters
    ----------
    reference : Part
        Common reference system, contracting.
    oscillator : Part
        The reduced system ż = f_x(z, r) that the oscillators converge to, transverse contracting.
    found : Synchronisation
        Condition (eigcond) for the graph.
    transformations : sequence of Part
        Transformation systems of all primitives, contracting.

    Returns
    -------
    Part

    Raises
    ------
    ParameterError
        If a part is of the wrong kind.
    """
    agreement = Part('synchronisation', CONTRACTING, found.rate)
    return primitive(TRANSVERSE, reference, hierarchy(agreement, oscillator), transformations)


def _require(part: Part, kind: str) -> None:
    if part.kind != kind:
        raise ParameterError(f"'{part.name}' must be {kind}, not {part.kind}")
