# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Regression shared by discrete and rhythmic learning.

The output of a primitive is linear in its weights, which leaves three ways to fit them:

- ``response`` (default): the positions are regressed on the movements that each basis causes
  through the spring-damper. Nothing is differentiated, and what is minimised is the error of the
  reproduction.
- ``joint``: the force that the movement requires is regressed on all bases at once.
- ``local``: the same force, one weighted regression per basis (locally weighted regression,
  Ijspeert et al. 2013, Section 2.1.6; Schaal & Atkeson 1998).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, vector
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper, default_gains
from dmp_cpg_ros.core.primitives.time_scaling import Form

Demonstrations = Demonstration | Iterable[Demonstration]
Method = Literal['response', 'joint', 'local']

METHODS: tuple[Method, ...] = ('response', 'joint', 'local')
"""The ways of fitting that are valid."""

BASIS_CANDIDATES = (5, 7, 10, 14, 19, 25, 33, 43)
"""Numbers of bases that are tried when the number is to be chosen."""

LARGEST_ERROR = 0.7
"""Error of a reproduced position, as a fraction of the range, that is no reproduction."""

WIDEST = 1.25
"""Range of a movement, in ranges of its demonstrations, that shows what they never did."""

_LOCAL_OVERLAP = 0.03


@dataclass(frozen=True)
class FitOptions:
    """How weights are fitted.

    Attributes
    ----------
    method : {'response', 'joint', 'local'}
        See the module's text.
    ridge : float
        Regularisation λ ≥ 0, relative to the mean square of the regressors' columns.
    overlap : float, optional
        Value of a basis at the centre of its neighbour, in (0, 1). Without: 0.6 for
        discrete primitives; 0.2 for rhythmic ones, whose vector weights give each basis a slope
        too; 0.03 for the local method, whose separate fits are averaged where bases overlap.

    Raises
    ------
    ParameterError
        If a value is out of range.
    """

    method: Method = 'response'
    ridge: float = 1e-10
    overlap: float | None = None

    def __post_init__(self) -> None:
        """Validate."""
        if self.method not in METHODS:
            raise ParameterError(f'method {self.method!r} must be {", ".join(METHODS)}')
        if not (np.isfinite(self.ridge) and self.ridge >= 0.0):
            raise ParameterError(f'ridge = {self.ridge!r} must be a finite number of at least 0')
        if self.overlap is not None and not 0.0 < self.overlap < 1.0:
            raise ParameterError(f'overlap = {self.overlap!r} must lie between 0 and 1')

    def overlap_or(self, usual: float) -> float:
        """Overlap that is used, given what suits joint fits of the kind of primitive."""
        if self.overlap is not None:
            return self.overlap
        return _LOCAL_OVERLAP if self.method == 'local' else usual


def ridge_regression(regressors: Array, targets: Array, ridge: float) -> Array:
    """Minimise |A W − B|² + λ ā |W|² with ā the mean squared norm of A's columns.

    Solved by the singular value decomposition of the stacked system, not by normal equations,
    which would square the condition number.

    Parameters
    ----------
    regressors : ndarray (m, p)
        A.
    targets : ndarray (m, n)
        B.
    ridge : float
        λ ≥ 0; 0 gives the solution of least norm.

    Returns
    -------
    ndarray (p, n)
    """
    if ridge > 0.0:
        count = regressors.shape[1]
        weight = np.sqrt(ridge * np.sum(regressors**2) / count)
        regressors = np.vstack([regressors, weight * np.eye(count)])
        targets = np.vstack([targets, np.zeros((count, targets.shape[1]))])
    return np.asarray(np.linalg.lstsq(regressors, targets, rcond=None)[0])


def locally_weighted_regression(activations: Array, inputs: Array, targets: Array, ridge: float
                                ) -> Array:
    """Minimise Σ_k ψ_i(k) |targets_k − w_iᵀ inputs_k|² for every basis i on its own.

    Parameters
    ----------
    activations : ndarray (m, b)
        ψ_i at the samples.
    inputs : ndarray (m, p)
        What each local model multiplies: x (p = 1, discrete) or the oscillator state (p = 2,
        rhythmic).
    targets : ndarray (m, n)
    ridge : float
        Relative regularisation of each local problem.

    Returns
    -------
    ndarray (b, p, n)
    """
    weighted = activations.T[:, :, None] * inputs  # (b, m, p)
    gram = np.swapaxes(weighted, 1, 2) @ inputs  # (b, p, p)
    size = np.trace(gram, axis1=1, axis2=2) / inputs.shape[1]
    floor = ridge * size + np.finfo(float).tiny
    gram = gram + floor[:, None, None] * np.eye(inputs.shape[1])
    return np.linalg.solve(gram, np.swapaxes(weighted, 1, 2) @ targets)


def as_demonstrations(demonstrations: Demonstrations) -> list[Demonstration]:
    """List of demonstrations that agree in their degrees of freedom.

    Raises
    ------
    DataError
        If there is none or the numbers of degrees of freedom differ.
    """
    result = [demonstrations] if isinstance(demonstrations, Demonstration) else [*demonstrations]
    if not result:
        raise DataError('learning needs at least one demonstration')
    dofs = [demonstration.dofs for demonstration in result]
    if len(set(dofs)) > 1:
        raise DataError(f'demonstrations must have the same degrees of freedom; they have {dofs}')
    return result


def prepared(demonstrations: Demonstrations, options: FitOptions) -> list[Demonstration]:
    """:func:`as_demonstrations`, with the derivatives that the method needs."""
    result = as_demonstrations(demonstrations)
    return result if options.method == 'response' else [d.with_derivatives() for d in result]


def targets_of(given: Sequence[ArrayLike] | None, usual: list[Array], name: str) -> list[Array]:
    """Goals or centres that are given, one (n,) for each demonstration, or the usual ones."""
    if given is None:
        return usual
    if len(given) != len(usual):
        raise ParameterError(f'{len(given)} {name}s do not match {len(usual)} demonstrations')
    return [vector(target, len(usual[0]), name) for target in given]


def chosen_gains(durations: Sequence[float], stiffness: ArrayLike | None,
                 damping: ArrayLike | None, dofs: int, form: Form) -> SpringDamper:
    """Spring-damper with the given gains; what is missing is chosen for critical damping.

    Parameters
    ----------
    durations : sequence of float
        Durations or periods, whose mean sets the gains when none is given [s].
    stiffness, damping : array_like (n,) or float, optional
        k [1/s²] and b [1/s].
    dofs : int
        n.
    form : {'scaled', 'printed'}
        Reading of τ.

    Returns
    -------
    SpringDamper
    """
    if stiffness is None and damping is None:
        stiffness, damping = default_gains(float(np.mean(durations)))
    elif damping is None:
        damping = 2.0 * np.sqrt(np.maximum(np.asarray(stiffness, dtype=float), 0.0))
    elif stiffness is None:
        stiffness = 0.25 * np.asarray(damping, dtype=float) ** 2
    return SpringDamper(np.asarray(stiffness), np.asarray(damping), form).spread(dofs)


def smallest_good(errors: dict[int, float], tolerance: float = 0.05, floor: float = 1e-3) -> int:
    """Smallest number of bases whose held-out error is close to the best.

    Parameters
    ----------
    errors : dict
        Number of bases → held-out error, as a fraction of the range.
    tolerance : float
        Excess over the least error that is accepted, relative.
    floor : float
        Error that is small enough in any case, as a fraction of the range.

    Returns
    -------
    int
    """
    limit = max((1.0 + tolerance) * min(errors.values()), floor)
    return min(count for count, error in errors.items() if error <= limit)


def ranges(demonstrations: Sequence[Demonstration]) -> Array:
    """Range of every degree of freedom; one that rests takes the largest range.

    Returns
    -------
    ndarray (n,)
    """
    low = np.min([d.positions.min(axis=0) for d in demonstrations], axis=0)
    high = np.max([d.positions.max(axis=0) for d in demonstrations], axis=0)
    span = high - low
    largest = float(span.max()) or 1.0
    return np.where(span > 1e-9 * largest, span, largest)


def largest_errors(demonstrations: Sequence[Demonstration], made: Sequence[Array]) -> Array:
    """Largest distance of positions that were made (m, n) from the demonstrated ones, (n,), as a
    fraction of the range.
    """
    errors = [np.abs(positions - demonstration.positions).max(axis=0)
              for demonstration, positions in zip(demonstrations, made, strict=True)]
    return np.asarray(np.max(errors, axis=0) / ranges(demonstrations))


def check_reproduction(errors: Array, options: FitOptions) -> None:
    """Raise DataError where a fit of forces, which needs derivatives, reproduces nothing."""
    worst = float(np.max(errors))
    if not worst < LARGEST_ERROR:
        raise DataError(
            f"method '{options.method}' misses the demonstrations by {100.0 * worst:.0f} % of "
            "their range: noise or gaps spoil their derivatives; use the method 'response', "
            'or record velocities and accelerations')


def check_range(demonstrations: Sequence[Demonstration], made: Array) -> None:
    """Raise DataError where the positions (m, n) of a whole movement go much farther than those of
    its demonstrations: between their samples nothing told the weights apart.
    """
    wide = float(np.max(np.ptp(made, axis=0) / ranges(demonstrations)))
    if not wide < WIDEST:
        raise DataError(
            f'the movement takes {wide:.3g} times the range of its demonstrations, in gaps of '
            'their samples; take fewer bases or a larger ridge, or record what is missing')
