# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rhythmic primitives: Andronov-Hopf phase, von Mises bases, vector weights (Section 2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.phase import phase, phase_generator, state_at
from dmp_cpg_ros.core.maths import Array, check_positive
from dmp_cpg_ros.core.maths.first_order import FirstOrderFilter
from dmp_cpg_ros.core.primitives.demonstration import vector
from dmp_cpg_ros.core.primitives.primitive import Primitive
from dmp_cpg_ros.core.primitives.responses import periodic_responses
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.primitives.time_scaling import StepGrid


@dataclass(frozen=True, eq=False)
class RhythmicInput:
    """What may change while the movement runs; held during a step.

    Attributes
    ----------
    centre : ndarray (n,)
        External centre of the oscillation g_ext.
    amplitude : float
        External amplitude r_ext > 0; 1 is the demonstration's.
    tau : float
        Commanded τ_ext > 0; 2 makes the movement twice as slow.
    """

    centre: Array
    amplitude: float = 1.0
    tau: float = 1.0


@dataclass(frozen=True, eq=False)
class RhythmicState:
    """State of reference, canonical and transformation system.

    Attributes
    ----------
    position, velocity : ndarray (n,)
        y and ẏ.
    x : ndarray (2,)
        State of the oscillator.
    centre : ndarray (n,)
        Filtered centre g.
    amplitude, tau : float
        Filtered r and τ.
    """

    position: Array
    velocity: Array
    x: Array
    centre: Array
    amplitude: float
    tau: float


@dataclass(frozen=True, eq=False, kw_only=True)
class RhythmicPrimitive(Primitive):
    """f(x) = Σ Φ_i(φ(x)) w_iᵀ x / Σ Φ_i(φ(x)) on an Andronov-Hopf oscillator of radius r.

    Since f is of degree one in x, the amplitude of the movement is proportional to r.

    Attributes
    ----------
    omega : float
        ω > 0 at τ = 1 [rad/s].
    rho : float
        Attraction to the limit cycle ρ > 0 [1/s at radius 1].
    centre : ndarray (n,)
        Centre of the demonstration.
    centre_rate, amplitude_rate : float
        Rates of the filters on g and r [1/s].
    """

    WEIGHT, TARGET, LENGTH, VECTORS = (2,), 'centre', 'period', ('centre',)
    SCALARS = ('omega', 'rho', 'centre_rate', 'amplitude_rate', 'tau_rate')

    omega: float
    rho: float
    centre: Array
    centre_rate: float = 10.0
    amplitude_rate: float = 10.0

    def part(self, dofs: slice) -> RhythmicPrimitive:
        """Return the primitive of some of the degrees of freedom."""
        spring = self.transformation
        return replace(
            self, weights=self.weights[:, dofs], centre=self.centre[dofs], names=self.names[dofs],
            transformation=SpringDamper(spring.stiffness[dofs], spring.damping[dofs], self.form))

    @classmethod
    def joined(cls, parts: Sequence[RhythmicPrimitive], names: tuple[str, ...] = ()
               ) -> RhythmicPrimitive:
        """Primitive of the degrees of freedom of several that share bases and oscillator."""
        k, b = (np.concatenate([getattr(part.transformation, name) for part in parts])
                for name in ('stiffness', 'damping'))
        return replace(
            parts[0], weights=np.concatenate([part.weights for part in parts], axis=1),
            centre=np.concatenate([part.centre for part in parts]), names=names,
            transformation=SpringDamper(k, b, parts[0].form))

    @property
    def period(self) -> float:
        """Period at τ = 1 [s]."""
        return 2.0 * np.pi / self.omega

    def forcing(self, x: ArrayLike) -> Array:
        """Forcing function f(x) (..., n) at states x (..., 2) of the oscillator."""
        x = np.asarray(x, dtype=float)
        # No matrix product: its bits depend on the number of threads.
        activations = self.bases.activations(phase(x))
        return np.asarray(np.einsum('...m,mnc,...c->...n', activations, self.weights, x))

    def default_input(self) -> RhythmicInput:
        """The demonstration's centre, amplitude and speed."""
        return RhythmicInput(self.centre)

    def on_cycle(self, phi: ArrayLike, tau: float = 1.0) -> tuple[Array, Array]:
        """Limit cycle at constant τ and amplitude 1, as departure from the centre.

        Parameters
        ----------
        phi : array_like (m,)
            Phases [rad].
        tau : float
            τ; it changes the path in the printed form only.

        Returns
        -------
        positions, velocities : ndarray (m, n)
        """
        phi = np.atleast_1d(np.asarray(phi, dtype=float))
        stretch = tau if self.form == 'printed' else 1.0
        cycle = np.empty((2, len(phi), self.dofs))
        for k, b, members in self.transformation.groups():
            def force(angle: Array, members: NDArray[np.int_] = members) -> Array:
                return stretch * self.forcing(state_at(angle))[:, members]

            cycle[:, :, members] = periodic_responses(
                stretch * k, b, self.omega, force, phi, 4 * self.bases.count + 32)[:2]
        return cycle[0], cycle[1] / tau

    def initial_state(self, phi: float = 0.0, command: RhythmicInput | None = None
                      ) -> RhythmicState:
        """State on the limit cycle, with filters at rest.

        Parameters
        ----------
        phi : float
            Phase [rad].
        command : RhythmicInput, optional
            Centre, amplitude and τ; the demonstration's without.

        Returns
        -------
        RhythmicState

        Raises
        ------
        ParameterError
            If the amplitude or τ is not positive or the centre does not fit.
        """
        command = command or self.default_input()
        check_positive(amplitude=command.amplitude, tau=command.tau)
        positions, velocities = self.on_cycle(phi, command.tau)
        centre, r = vector(command.centre, self.dofs, 'centre'), float(command.amplitude)
        return RhythmicState(centre + r * positions[0], r * velocities[0], state_at(phi, r),
                             centre, r, float(command.tau))

    def _start(self, command: RhythmicInput) -> RhythmicState:
        return self.initial_state(0.0, command)

    def step(self, state: RhythmicState, command: RhythmicInput, dt: float) -> RhythmicState:
        """Advance by one step with the input held.

        Filters and phase are exact, the oscillator's radius is exact once r has settled; else
        fourth order, as the transformation is (see ``SpringDamper.step``).

        Parameters
        ----------
        state : RhythmicState
            State at the start.
        command : RhythmicInput
            Centre, amplitude and τ that are commanded during the step.
        dt : float
            Length of the step in real time [s].

        Returns
        -------
        RhythmicState

        Raises
        ------
        ParameterError
            If amplitude, τ or dt is not positive or the centre does not fit.
        """
        check_positive(amplitude=command.amplitude, tau=command.tau)
        grid = self._grid(state, command, dt, 5)
        radii = FirstOrderFilter(self.amplitude_rate).at(
            state.amplitude, command.amplitude, grid.elapsed)
        x = hopf_flow(state.x, self.omega, self.rho, radii, grid)
        return self._moved(state, command, x, float(radii[-1]), grid)

    def follow(self, state: RhythmicState, x: Array, command: RhythmicInput, dt: float
               ) -> RhythmicState:
        """Advance by one step on an outer oscillator, such as one node of a network.

        Parameters
        ----------
        state : RhythmicState
            State at the start; its own x and amplitude are replaced.
        x : ndarray (3, 2)
            Outer oscillator at the start, the middle and the end of the step.
        command : RhythmicInput
            Centre and τ; its amplitude is the outer oscillator's affair.
        dt : float
            Length of the step in real time [s].

        Returns
        -------
        RhythmicState
        """
        grid = self._grid(state, command, dt, 5)
        return self._moved(state, command, x, float(np.hypot(*x[-1])), grid)

    def _moved(self, state: RhythmicState, command: RhythmicInput, x: Array, amplitude: float,
               grid: StepGrid) -> RhythmicState:
        position, velocity, centre = self._transformed(state, command, x, grid.halved())
        return RhythmicState(position, velocity, x[-1], centre, amplitude, float(grid.tau[-1]))


def hopf_flow(x: Array, omega: float, rho: float, radii: Array, grid: StepGrid) -> Array:
    """States at the start, middle and end of a step of an Andronov-Hopf oscillator whose radius
    follows a reference.

    In polar coordinates the angle turns at ω and the squared radius obeys a logistic equation
    (Bernoulli), which is linear in 1/R². So the flow of
    :class:`~dmp_cpg_ros.core.canonical.hopf.AndronovHopf` has no stability limit, however large
    ρr² is. Exact in the angle; exact in the radius for constant r, else of fourth order in the
    length of the step.

    Parameters
    ----------
    x : ndarray (2,)
        State at the start.
    omega, rho : float
        ω [rad/s] and ρ [1/s].
    radii : ndarray (5,)
        r at the nodes.
    grid : StepGrid
        With five nodes.

    Returns
    -------
    ndarray (3, 2)
    """
    squared = float(x @ x)
    growth = np.ones(3)
    if squared > 0.0:
        density, half = grid.density, 0.5 * grid.length
        middle = _squared_radius(squared, rho, radii[:3], density[:3], half)
        end = _squared_radius(middle, rho, radii[2:], density[2:], half)
        growth[1:] = np.sqrt(np.array([middle, end]) / squared)
    angle = omega * grid.scaled[::2]
    turned = x @ phase_generator().T
    return growth[:, None] * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * turned)


def _squared_radius(squared: float, rho: float, radii: Array, density: Array, length: float
                    ) -> float:
    """Squared radius after a step: 1/R² = e^{−P}/R₀² + ∫ e^{p − P}/r² dp, p = 2ρ ∫ r² ds.

    P is p at the end. 1/r² is replaced by the quadratic in p through three nodes, and the integral
    is then taken exactly; where r changes so fast that this is not between the bounds of 1/r², the
    nearer bound is.
    """
    rate = 2.0 * rho * radii**2 * density  # dp/du at the nodes
    p_middle = length * float(rate @ (5.0, 8.0, -1.0)) / 24.0
    p_end = length * float(rate @ (1.0, 4.0, 1.0)) / 6.0
    values = 1.0 / radii**2
    one = -np.expm1(-p_end)  # ∫ e^{p − P} dp
    if not 0.0 < p_middle < p_end:
        return float(1.0 / (np.exp(-p_end) / squared + values[1] * one))
    # Newton's divided differences
    slope = (values[1] - values[0]) / p_middle
    bend = ((values[2] - values[1]) / (p_end - p_middle) - slope) / p_end
    first = p_end - one  # ∫ e^{p − P} p dp
    second = p_end**2 - 2.0 * first  # ∫ e^{p − P} p² dp
    integral = values[0] * one + slope * first + bend * (second - p_middle * first)
    integral = min(max(integral, values.min() * one), values.max() * one)
    return float(1.0 / (np.exp(-p_end) / squared + integral))
