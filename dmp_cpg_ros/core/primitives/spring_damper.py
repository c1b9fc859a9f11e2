# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The transformation system: a spring-damper that the forcing function drives (eq. p2p_trans).

Two readings of the paper's τ are kept apart by ``form``:

``'scaled'`` (the default): the state is (y, z), τẏ = z, τż = k(g − y) − b z + f. This is the
paper's own rule of scaling in time (eq. differ) applied to the first-order form, and eq. 2.1 of
Ijspeert et al. (2013). In second order it reads τ²ÿ = k(g − y) − bτẏ + f for constant τ: the path
stays the same, only the speed changes.

``'printed'``: τÿ = k(g − y) − bẏ + f, word for word. For constant τ that is the scaled form with
stiffness τk and force τf, so τ acts as an inertia: the natural frequency is √(k/τ), the damping
ratio b/(2√(kτ)) moves with τ, and a movement replayed at τ ≠ 1 takes another path. At τ = 1 the
two forms are one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array, check_positive
from dmp_cpg_ros.core.maths.exponential import exponential
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.primitives.demonstration import columns
from dmp_cpg_ros.core.primitives.time_scaling import Form, StepGrid

FORMS: tuple[Form, ...] = ('scaled', 'printed')
"""The readings of τ that are valid."""


@made_often
@dataclass(frozen=True, eq=False)
class SpringState:
    """Positions y and velocities ẏ of n degrees of freedom, in numbers, for every tick."""

    position: tuple[float, ...]
    velocity: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class SpringDamper:
    """One spring and damper per degree of freedom.

    Attributes
    ----------
    stiffness, damping : ndarray (n,)
        k > 0 [1/s²] and b > 0 [1/s].
    form : {'scaled', 'printed'}
        Reading of τ, see the module's text.

    Raises
    ------
    ParameterError
        If an entry is not positive and finite, the lengths differ or the form is unknown.
    """

    stiffness: Array
    damping: Array
    form: Form = 'scaled'
    _propagators: dict[float, tuple[Array, list[list[float]]]] = field(
        default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        """Validate."""
        for name in ('stiffness', 'damping'):
            values = np.atleast_1d(np.array(getattr(self, name), dtype=float))
            check_positive(**{name: values})
            object.__setattr__(self, name, values)
        if self.stiffness.shape != self.damping.shape:
            raise ParameterError('stiffness and damping must have one length')
        if self.form not in FORMS:
            raise ParameterError(f'form must be one of {", ".join(FORMS)}, not {self.form!r}')

    def spread(self, dofs: int) -> SpringDamper:
        """The same with one entry per degree of freedom; one number serves for all. Raises
        ParameterError if there is neither one entry nor one per degree of freedom.
        """
        return SpringDamper(columns(self.stiffness, dofs, 'stiffness'),
                            columns(self.damping, dofs, 'damping'), self.form)

    def groups(self) -> list[tuple[float, float, NDArray[np.int_]]]:
        """Degrees of freedom that share their gains: k, b and their indices."""
        pairs = np.stack([self.stiffness, self.damping], axis=1)
        return [(float(k), float(b), np.flatnonzero(np.all(pairs == (k, b), axis=1)))
                for k, b in np.unique(pairs, axis=0)]

    def acceleration(self, position: Array, velocity: Array, goal: Array, force: Array,
                     tau: ArrayLike = 1.0, tau_rate: ArrayLike = 0.0) -> Array:
        """Acceleration ÿ of the continuous system.

        Parameters
        ----------
        position, velocity, goal, force : ndarray (..., n)
            y, ẏ, g and f.
        tau, tau_rate : array_like (...)
            τ and τ̇ [1/s].

        Returns
        -------
        ndarray (..., n)
        """
        tau, tau_rate = (np.asarray(v, dtype=float)[..., None] for v in (tau, tau_rate))
        spring = self.stiffness * (goal - position) + force
        if self.form == 'printed':
            return (spring - self.damping * velocity) / tau
        return spring / tau**2 - (self.damping + tau_rate) * velocity / tau

    def required_force(self, position: Array, velocity: Array, acceleration: Array, goal: Array,
                       tau: ArrayLike = 1.0) -> Array:
        """Force f that makes the system follow a movement at constant τ.

        Parameters
        ----------
        position, velocity, acceleration, goal : ndarray (..., n)
            y, ẏ, ÿ and g.
        tau : array_like (...)
            τ, constant in time.

        Returns
        -------
        ndarray (..., n)
        """
        tau = np.asarray(tau, dtype=float)[..., None]
        spring = self.stiffness * (goal - position)
        if self.form == 'printed':
            return tau * acceleration + self.damping * velocity - spring
        return tau**2 * acceleration + tau * self.damping * velocity - spring

    def step(self, position: Array, velocity: Array, goals: Array, forces: Array, grid: StepGrid
             ) -> tuple[Array, Array]:
        """Advance by one step; fourth order in both forms.

        The scaled form is solved exactly for the quadratic through the drive k g + f at the nodes,
        so it has no stability limit and keeps an equilibrium exactly. The printed form has no
        constant matrix when τ varies; it takes one Runge-Kutta step, stable for √(k/τ) dt and
        (b/τ) dt up to about 2.7.

        Parameters
        ----------
        position, velocity : ndarray (n,)
            y and ẏ at the start of the step.
        goals, forces : ndarray (3, n)
            g and f at the three nodes of the grid.
        grid : StepGrid
            Made with three nodes and this system's form.

        Returns
        -------
        position, velocity : ndarray (n,)
            y and ẏ at the end.
        """
        drives = self.stiffness * goals + forces
        if self.form == 'printed':
            return self._runge_kutta(position, velocity, drives, grid)
        y, z = quadratic_drive_step(
            self.stiffness, self.damping, self.propagator(grid.length), position,
            grid.tau[0] * velocity, drives, grid.length)
        return y, z / grid.tau[-1]

    def follow(self, state: SpringState, goal: Sequence[float], goal_velocity: Sequence[float],
               dt: float) -> SpringState:
        """Advance ÿ = k (g − y) + b (ġ − ẏ) to the time at which the goals hold (eq. 28).

        Exact for goals that move at ``goal_velocity`` during the step.

        Parameters
        ----------
        state : SpringState
            State one step before.
        goal, goal_velocity : sequence of n floats
            Goals at the end of the step.
        dt : float
            [s]

        Returns
        -------
        SpringState
        """
        position, velocity = [], []
        for i, (a, b, c, d) in enumerate(self._propagator(dt)[1]):
            at, rate = goal[i], goal_velocity[i]
            error, error_rate = state.position[i] - (at - rate * dt), state.velocity[i] - rate
            position.append(at + a * error + b * error_rate)
            velocity.append(rate + c * error + d * error_rate)
        return SpringState(tuple(position), tuple(velocity))

    def goals(self, position: Array, velocity: Array, dt: Array) -> Array:
        """Goals (m, n) at the ends of steps of dt (m,) [s] that states, ndarrays (m + 1, n), have
        followed: the inverse of :meth:`follow`.
        """
        h = dt[:, None]
        (a, b), (c, d) = spring_exponential(self.stiffness, self.damping, h)  # (m, n) each
        y = position[1:] - a * position[:-1] - b * velocity[:-1]  # (1 − a) g + (a h − b) ġ
        v = velocity[1:] - c * position[:-1] - d * velocity[:-1]  # −c g + (1 − d + c h) ġ
        A, B, C, D = 1.0 - a, a * h - b, -c, 1.0 - d + c * h
        return np.asarray((D * y - B * v) / (A * D - B * C))

    def propagator(self, length: float) -> Array:
        """Exponential exp(A s), A = [[0, 1], [−k, −b]], for a length s [s]: (2, 2, n)."""
        return self._propagator(length)[0]

    def _propagator(self, length: float) -> tuple[Array, list[list[float]]]:
        """The same as an array, and by rows as a list for each degree of freedom."""
        known = self._propagators.get(length)
        if known is None:
            if len(self._propagators) > 256:
                self._propagators.clear()
            E = spring_exponential(self.stiffness, self.damping, length)
            known = self._propagators[length] = (E, E.reshape(4, -1).T.tolist())
        return known

    def _runge_kutta(self, y: Array, v: Array, drives: Array, grid: StepGrid
                     ) -> tuple[Array, Array]:
        """One step of the classical fourth-order method on the printed form."""
        def slope(state: Array, drive: Array, tau: float) -> Array:
            spring = drive - self.stiffness * state[0] - self.damping * state[1]
            return np.stack([state[1], spring / tau])

        s, h = np.stack([y, v]), grid.length
        k_1 = slope(s, drives[0], grid.tau[0])
        k_2 = slope(s + 0.5 * h * k_1, drives[1], grid.tau[1])
        k_3 = slope(s + 0.5 * h * k_2, drives[1], grid.tau[1])
        k_4 = slope(s + h * k_3, drives[2], grid.tau[2])
        position, velocity = s + h / 6.0 * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4)
        return position, velocity


def quadratic_drive_step(k: float | Array, b: float | Array, propagator: Array, y: Array, z: Array,
                         drives: Array, length: float | Array) -> tuple[Array, Array]:
    """Exact solution of y' = z, z' = u(s) − k y − b z for a quadratic u; all arguments broadcast.

    Parameters
    ----------
    k, b : float or ndarray (...)
        Stiffness and damping.
    propagator : ndarray (2, 2, ...)
        :func:`spring_exponential` of the same k, b and length.
    y, z : ndarray (...)
        State at s = 0.
    drives : ndarray (3, ...)
        u at 0, length/2 and length.
    length : float or ndarray (...)
        Length of the step [s].

    Returns
    -------
    y, z : ndarray (...)
    """
    first, middle, last = drives
    u2 = 2.0 * (first - 2.0 * middle + last) / length**2
    u1 = (4.0 * middle - 3.0 * first - last) / length
    a2 = u2 / k  # particular solution a0 + a1 s + a2 s²
    a1 = (u1 - 2.0 * b * a2) / k
    a0 = (first - b * a1 - 2.0 * a2) / k
    y, z = y - a0, z - a1
    (a, b), (c, d) = propagator
    return (a * y + b * z + a0 + length * (a1 + length * a2),
            c * y + d * z + a1 + 2.0 * length * a2)


def spring_exponential(k: ArrayLike, b: ArrayLike, length: ArrayLike) -> Array:
    """Exponential (2, 2, ...) of A s, A = [[0, 1], [−k, −b]], for k, b and s that broadcast."""
    k, b, length = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (k, b, length)))
    matrices = np.array([[np.zeros(k.shape), length], [-k * length, -b * length]])
    return np.moveaxis(exponential(np.moveaxis(matrices, (0, 1), (-2, -1))), (-2, -1), (0, 1))


def default_gains(duration: float) -> tuple[float, float]:
    """Critically damped gains that settle within a movement of the given duration.

    b = 25/T, k = b²/4: the constants of Ijspeert et al. (2013) for a movement of T seconds at τ =
    1.

    Parameters
    ----------
    duration : float
        Duration of the movement or period of the cycle [s].

    Returns
    -------
    stiffness, damping : float
        [1/s²], [1/s]
    """
    damping = 25.0 / duration
    return 0.25 * damping**2, damping
