# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Daughters of learned primitives in closed form: scaled in space and time, and added.

A homogeneous map turns a primitive into one with other weights, goal and start, so a daughter
costs no more than its mother. General diffeomorphisms have no such form: map the output with
:class:`~dmp_cpg_ros.paper.diffeomorphism.TangentLift`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.primitives.discrete import DiscretePrimitive
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicPrimitive
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.paper.homogeneous import Homogeneous

Array = NDArray[np.float64]
Primitive = TypeVar('Primitive', DiscretePrimitive, RhythmicPrimitive)


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
        raise ParameterError(
            f'a map of {len(R)} degrees of freedom does not fit a primitive of {n}'
        )
    for gains in (spring.stiffness, spring.damping):
        if not np.allclose(R * gains, gains[:, None] * R, atol=1e-12 * float(gains.max())):
            raise ParameterError(
                'a rotation can be taken into the weights only when the degrees of freedom that '
                f'it mixes have equal gains; they have {gains.tolist()}'
            )
    names = primitive.names if np.array_equal(R, np.eye(n)) else ()
    if isinstance(primitive, DiscretePrimitive):
        return replace(
            primitive,
            weights=map_.direction(primitive.weights),
            start=map_.forward(primitive.start),
            goal=map_.forward(primitive.goal),
            start_velocity=map_.direction(np.asarray(primitive.start_velocity)),
            names=names,
        )
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
    if not (np.isfinite(tau) and tau > 0.0):
        raise ParameterError(f'tau = {tau!r} must be a positive finite number')
    if primitive.form != 'scaled':
        raise ParameterError(
            "only primitives of the form 'scaled' keep their path when they are slowed"
        )
    spring = primitive.transformation
    gains = SpringDamper(spring.stiffness / tau**2, spring.damping / tau, spring.form)
    if isinstance(primitive, DiscretePrimitive):
        return replace(
            primitive,
            weights=primitive.weights / tau**2,
            phase_decay=primitive.phase_decay / tau,
            transformation=gains,
            duration=primitive.duration * tau,
            start_velocity=np.asarray(primitive.start_velocity) / tau,
        )
    return replace(
        primitive,
        weights=primitive.weights / tau**2,
        omega=primitive.omega / tau,
        rho=primitive.rho / tau,
        transformation=gains,
    )


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
        raise ParameterError(
            f'a sum needs one finite gain per primitive; there are {len(primitives)} primitives '
            f'and gains of shape {gains.shape}'
        )
    first = primitives[0]
    for other in primitives[1:]:
        for name, ours, theirs in zip(_SHARED, _shared(first), _shared(other), strict=True):
            if np.shape(ours) != np.shape(theirs) or not np.allclose(
                ours, theirs, rtol=1e-12, atol=0.0
            ):
                raise ParameterError(
                    f'primitives can be added when they share {", ".join(_SHARED)}; they differ '
                    f'in {name}'
                )

    def blend(name: str) -> Array:
        return np.tensordot(gains, np.array([getattr(p, name) for p in primitives]), axes=1)

    if isinstance(first, DiscretePrimitive):
        return replace(
            first,
            weights=blend('weights'),
            start=blend('start'),
            goal=blend('goal'),
            start_velocity=blend('start_velocity'),
        )
    return replace(first, weights=blend('weights'), centre=blend('centre'))


_SHARED = (
    'the kind',
    'basis centres',
    'basis widths',
    'stiffness',
    'damping',
    'the reading of tau',
    'the phase',
    'the filter rates',
    'degrees of freedom',
)


def _shared(primitive: DiscretePrimitive | RhythmicPrimitive) -> list[ArrayLike]:
    spring, bases = primitive.transformation, primitive.bases
    if isinstance(primitive, DiscretePrimitive):
        phase, rates = [primitive.phase_decay], [primitive.goal_rate, primitive.tau_rate]
    else:
        phase = [primitive.omega, primitive.rho]
        rates = [primitive.centre_rate, primitive.amplitude_rate, primitive.tau_rate]
    return [
        float(isinstance(primitive, DiscretePrimitive)),
        bases.centres,
        bases.widths,
        spring.stiffness,
        spring.damping,
        float(spring.form == 'scaled'),
        phase,
        rates,
        float(primitive.dofs),
    ]
