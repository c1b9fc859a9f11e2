# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Daughters: a contracting mother scaled in space and time, and their sums (Section 3.2).

Of any vector field (:class:`Daughter`, :class:`DaughterSum`), and of learned primitives in closed
form: a homogeneous map turns a primitive into one with other weights, goal and start, so such a
daughter costs no more than its mother. General diffeomorphisms have no such form: map the output
with :class:`~dmp_cpg_ros.paper.diffeomorphism.TangentLift`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import check_positive
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicPrimitive
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.paper.diffeomorphism import Array, Diffeomorphism

Primitive = TypeVar('Primitive', DiscretePrimitive, RhythmicPrimitive)
Field = Callable[[float, Array], Array]
"""Vector field: time [s], state (n,) → derivative (n,); phase and references depend on time."""

_POWERS_OF_TAU = {'weights': -2, 'phase_decay': -1, 'start_velocity': -1, 'duration': 1,
                  'omega': -1, 'rho': -1}
"""How what a primitive has scales with τ."""


def transported_metric(M: ArrayLike, J: ArrayLike) -> Array:
    """M' = J⁻ᵀ M J⁻¹: the metric of y' = T(y) in which distances are those of y in M.

    Parameters
    ----------
    M : array_like (n, n)
        Metric at y.
    J : array_like (n, n)
        Jacobian of T at y.

    Returns
    -------
    ndarray (n, n)
        Symmetric.
    """
    J_inverse = np.linalg.inv(np.asarray(J, dtype=float))
    transported = J_inverse.T @ np.asarray(M, dtype=float) @ J_inverse
    return np.asarray(0.5 * (transported + transported.T))


@dataclass(frozen=True, eq=False)
class Daughter:
    """τ(t) ẏ' = J(y) f_y(y) at y = T⁻¹(y') (paper eq. differ).

    If the mother contracts with rate λ in M, the daughter contracts in :func:`transported_metric`
    with rate λ/τ(t).

    Attributes
    ----------
    mother : callable
        f_y(t, y).
    transformation : Diffeomorphism
        T.
    tau : float or callable
        τ, or τ(t) > 0; the field raises ParameterError where it is not.
    """

    mother: Field
    transformation: Diffeomorphism
    tau: float | Callable[[float], float] = 1.0

    def __call__(self, t: float, y_prime: Array, guess: Array | None = None) -> Array:
        """The daughter's vector field.

        Parameters
        ----------
        t : float
            [s]
        y_prime : ndarray (n,)
        guess : ndarray (n,), optional
            A mother state near T⁻¹(y'), for maps without a closed inverse.

        Returns
        -------
        ndarray (n,)
            ẏ'.
        """
        tau = self.tau(t) if callable(self.tau) else self.tau
        check_positive(tau=tau)
        y = self.transformation.inverse(y_prime, guess)
        return self.transformation.velocity(y, self.mother(t, y)) / tau

    def metric(self, y_prime: Array, M: ArrayLike | Callable[[Array], Array]) -> Array:
        """The daughter's metric at y', (n, n), of the mother's metric M (n, n) or M(y)."""
        y = self.transformation.inverse(y_prime)
        return transported_metric(M(y) if callable(M) else M, self.transformation.jacobian(y))


@dataclass(frozen=True, eq=False)
class DaughterSum:
    """ẏ = Σ α_i f_i(t, y): additive copies of daughters, as the force fields found in frogs.

    If all daughters contract in one metric, so does the sum, with rate Σ α_i λ_i at least. In
    different metrics nothing is implied: two contracting fields may add up to an unstable one.

    Attributes
    ----------
    daughters : sequence of callable
        f_i(t, y).
    gains : ndarray (k,)
        α_i ≥ 0, not all zero.

    Raises
    ------
    ParameterError
        If the gains do not fit.
    """

    daughters: Sequence[Field]
    gains: Array

    def __post_init__(self) -> None:
        gains = np.atleast_1d(np.array(self.gains, dtype=float))
        if not (gains.shape == (len(self.daughters),) and np.all(np.isfinite(gains))
                and gains.min() >= 0.0 < gains.max()):
            raise ParameterError(f'gains {gains.tolist()} must be >= 0, one each, not all 0')
        object.__setattr__(self, 'gains', gains)

    def __call__(self, t: float, y: Array) -> Array:
        """The summed vector field at t [s] and y, ndarray (n,) → (n,)."""
        return self.gains @ np.array([daughter(t, y) for daughter in self.daughters])


@dataclass(frozen=True, eq=False)
class Homogeneous(Diffeomorphism):
    """T(y) = s R y + y_T with s > 0 and R ∈ SO(n); maps many points (m, n) at once, too.

    Attributes
    ----------
    scale : float
        s.
    rotation : ndarray (n, n)
        R.
    translation : ndarray (n,)
        y_T.

    Raises
    ------
    ParameterError
        If s is not positive, R is not a rotation or the sizes differ.
    """

    scale: float
    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        R, shift = np.array(self.rotation, float), np.atleast_1d(np.array(self.translation, float))
        if R.shape != (len(shift), len(shift)):
            raise ParameterError(f'rotation {R.shape} and translation {shift.shape} must fit')
        check_positive(scale=self.scale)
        if not (np.allclose(R @ R.T, np.eye(len(R)), atol=1e-9) and np.linalg.det(R) > 0.0):
            raise ParameterError('rotation must be orthogonal with determinant 1')
        object.__setattr__(self, 'rotation', R)
        object.__setattr__(self, 'translation', shift)

    @classmethod
    def of(cls, dofs: int, scale: float = 1.0, rotation: ArrayLike | None = None,
           translation: ArrayLike | None = None) -> Homogeneous:
        """Map of n degrees of freedom in which what is not given does nothing."""
        return cls(scale, np.asarray(np.eye(dofs) if rotation is None else rotation),
                   np.asarray(np.zeros(dofs) if translation is None else translation))

    def forward(self, y: Array) -> Array:
        """T(y)."""
        return self.direction(y) + self.translation

    def jacobian(self, y: Array) -> Array:
        """J = s R."""
        return self.scale * self.rotation

    def inverse(self, y_prime: Array, guess: Array | None = None) -> Array:
        """T⁻¹(y') = Rᵀ(y' − y_T)/s."""
        return (y_prime - self.translation) @ self.rotation / self.scale

    def direction(self, v: Array) -> Array:
        """J v, for velocities and forces."""
        return self.scale * (v @ self.rotation.T)


def transformed(primitive: Primitive, map_: Homogeneous) -> Primitive:
    """Daughter whose movement is T of the mother's: y'(t) = s R y(t) + y_T.

    Parameters
    ----------
    primitive : DiscretePrimitive or RhythmicPrimitive
    map_ : Homogeneous
        T on the primitive's degrees of freedom.

    Returns
    -------
    DiscretePrimitive or RhythmicPrimitive
        Of the same kind; names are kept only when the map does not rotate.

    Raises
    ------
    ParameterError
        If the sizes differ, or the map rotates degrees of freedom that have different gains.
    """
    n, R, spring = primitive.dofs, map_.rotation, primitive.transformation
    if len(R) != n:
        raise ParameterError(f'a map of {len(R)} dofs does not fit a primitive of {n}')
    for gains in (spring.stiffness, spring.damping):
        if not np.allclose(R * gains, gains[:, None] * R, atol=1e-12 * float(gains.max())):
            raise ParameterError('a rotation mixes only degrees of freedom of equal gains')
    names = primitive.names if np.array_equal(R, np.eye(n)) else ()
    if isinstance(primitive, DiscretePrimitive):
        return replace(primitive, weights=map_.direction(primitive.weights),
                       start=map_.forward(primitive.start), goal=map_.forward(primitive.goal),
                       start_velocity=map_.direction(np.asarray(primitive.start_velocity)),
                       names=names)
    weights = map_.scale * np.einsum('ij,mjc->mic', R, primitive.weights)
    return replace(primitive, weights=weights, centre=map_.forward(primitive.centre), names=names)


def slowed(primitive: Primitive, tau: float) -> Primitive:
    """Daughter that at τ = 1 moves as the mother does at the given τ; scaled form only.

    Parameters
    ----------
    primitive : DiscretePrimitive or RhythmicPrimitive
    tau : float
        Factor by which the movement is slower.

    Returns
    -------
    DiscretePrimitive or RhythmicPrimitive

    Raises
    ------
    ParameterError
        If τ is not positive or the primitive has the printed form, whose path changes with τ.
    """
    check_positive(tau=tau)
    if primitive.form != 'scaled':
        raise ParameterError("only primitives of the form 'scaled' keep their path when slowed")
    spring = primitive.transformation
    gains = SpringDamper(spring.stiffness / tau**2, spring.damping / tau, spring.form)
    changed: dict[str, Any] = {
        name: np.multiply(getattr(primitive, name), tau**power)[()]
        for name, power in _POWERS_OF_TAU.items() if hasattr(primitive, name)}
    return replace(primitive, transformation=gains, **changed)


def summed(primitives: Sequence[Primitive], gains: ArrayLike) -> Primitive:
    """Primitive whose movement is Σ α_i y_i(t), on one canonical system.

    Parameters
    ----------
    primitives : sequence of DiscretePrimitive or of RhythmicPrimitive
        With the same bases, phase and spring-damper.
    gains : array_like (k,)
        α_i of either sign.

    Returns
    -------
    DiscretePrimitive or RhythmicPrimitive

    Raises
    ------
    ParameterError
        If the primitives do not share what they must, or the gains do not fit.
    """
    gains = np.atleast_1d(np.asarray(gains, dtype=float))
    if not primitives or gains.shape != (len(primitives),) or not np.all(np.isfinite(gains)):
        raise ParameterError(f'{len(primitives)} primitives need one finite gain each')
    first = primitives[0]
    ours = _to_share(first)
    for theirs in map(_to_share, primitives[1:]):
        for name, value in ours.items():
            if np.shape(value) != np.shape(theirs[name]) or not np.allclose(
                    value, theirs[name], rtol=1e-12, atol=0.0):
                raise ParameterError(f'primitives of one sum must share {name}')
    names = ('weights', 'start', 'goal', 'start_velocity') if isinstance(
        first, DiscretePrimitive) else ('weights', 'centre')
    blended: dict[str, Any] = {
        name: np.tensordot(gains, np.array([getattr(p, name) for p in primitives]), axes=1)
        for name in names}
    return replace(first, **blended)


def _to_share(primitive: DiscretePrimitive | RhythmicPrimitive) -> dict[str, Any]:
    """What primitives that are added must have in common."""
    spring, bases = primitive.transformation, primitive.bases
    return {'the kind': isinstance(primitive, DiscretePrimitive), 'degrees of freedom':
            primitive.dofs, 'basis centres': bases.centres, 'basis widths': bases.widths,
            'stiffness': spring.stiffness, 'damping': spring.damping,
            'the reading of tau': spring.form == 'scaled',
            'phase and filter rates': [getattr(primitive, name) for name in primitive.SCALARS
                                       if name != 'duration']}
