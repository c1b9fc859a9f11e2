# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Theorems 2 and 3 and Proposition 6 as printed; the suite needs what follows from them."""

from __future__ import annotations

from dmp_cpg_ros.core.contraction.hierarchy import CONTRACTING, TRANSVERSE, Part, primitive
from dmp_cpg_ros.core.errors import ParameterError


def discrete_primitive(reference: Part, canonical: Part, transformation: Part) -> Part:
    """Theorem 2: a hierarchy of three contracting systems is contracting.

    Raises
    ------
    ParameterError
        If a part is not of the contracting kind.
    """
    return primitive(CONTRACTING, reference, canonical, (transformation,))


def rhythmic_primitive(reference: Part, canonical: Part, transformation: Part) -> Part:
    """Theorem 3: a transverse contracting canonical system makes the whole so.

    It holds for a fixed external reference.

    Raises
    ------
    ParameterError
        If the canonical system is not of the transverse kind or another part is.
    """
    return primitive(TRANSVERSE, reference, canonical, (transformation,))


def critical_scaling(beta: float, rate: float) -> float:
    """α0 = β/2λ2: f1 + α f2 is contracting for every α > α0.

    Parameters
    ----------
    beta : float
        Smallest b with ∂M/∂x·f1 + A1ᵀM + MA1 < bM on the region [1/s]; under the identity metric
        twice the largest λ_max(A1_s).
    rate : float
        λ2 > 0, contraction rate of f2 under M [1/s].

    Returns
    -------
    float
        Never below zero.

    Raises
    ------
    ParameterError
        If f2 is not contracting.
    """
    if not rate > 0.0:
        raise ParameterError(f'rate = {rate!r} 1/s must be positive: f2 is not contracting')
    return max(0.0, beta / (2.0 * rate))
