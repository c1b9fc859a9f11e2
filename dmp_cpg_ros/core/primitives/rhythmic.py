# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rhythmic primitives: Andronov-Hopf phase, von Mises bases, vector weights (Section 2.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import phase, state_at
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths.first_order import FirstOrderFilter
from dmp_cpg_ros.core.primitives.basis import VonMisesBases
from dmp_cpg_ros.core.primitives.demonstration import Trajectory, vector
from dmp_cpg_ros.core.primitives.hopf_flow import hopf_flow
from dmp_cpg_ros.core.primitives.responses import periodic_responses
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.primitives.states import RhythmicInput, RhythmicState
from dmp_cpg_ros.core.primitives.time_scaling import Form, StepGrid, TimeScaling

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RhythmicPrimitive:
    """f(x) = Σ Φ_i(φ(x)) w_iᵀ x / Σ Φ_i(φ(x)) on an Andronov-Hopf oscillator of radius r.

    Since f is of degree one in x, the amplitude of the movement is proportional to r.

    Attributes
    ----------
    weights : ndarray (m, n, 2)
        w_i for m bases and n degrees of freedom.
    bases : VonMisesBases
        The m basis functions.
    omega : float
        ω > 0 at τ = 1 [rad/s].
    rho : float
        Attraction to the limit cycle ρ > 0 [1/s at radius 1].
    transformation : SpringDamper
        k, b and the reading of τ.
    centre : ndarray (n,)
        Centre of the demonstration.
    centre_rate, amplitude_rate, tau_rate : float
        Rates of the filters on g, r and τ [1/s].
    names : tuple of str
        Names of the degrees of freedom; empty when they have none.

    Raises
    ------
    ParameterError
        If shapes do not match or a number is out of range.
    """

    weights: Array
    bases: VonMisesBases
    omega: float
    rho: float
    transformation: SpringDamper
    centre: Array
    centre_rate: float = 10.0
    amplitude_rate: float = 10.0
    tau_rate: float = 10.0
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Validate; scalars of the transformation are spread over the degrees of freedom."""
        weights = np.array(self.weights, dtype=float)
        if weights.ndim != 3 or len(weights) != self.bases.count or weights.shape[2] != 2:
            raise ParameterError(
                f'weights must have shape ({self.bases.count}, n, 2), not {weights.shape}'
            )
        if not np.all(np.isfinite(weights)):
            raise ParameterError('weights must be finite')
        dofs = weights.shape[1]
        object.__setattr__(self, 'weights', weights)
        object.__setattr__(self, 'centre', vector(self.centre, dofs, 'centre'))
        object.__setattr__(self, 'transformation', self.transformation.spread(dofs))
        if not (np.isfinite(self.omega) and self.omega > 0.0):
            raise ParameterError(f'omega = {self.omega!r} rad/s must be a positive finite number')
        if self.names and len(self.names) != dofs:
            raise ParameterError(f'{len(self.names)} names do not match {dofs} degrees of freedom')
        AndronovHopf(self.rho)
        self._filters  # noqa: B018  (checks the rates)

    def part(self, dofs: slice) -> RhythmicPrimitive:
        """Return the primitive of some of the degrees of freedom."""
        spring = self.transformation
        return replace(
            self, weights=self.weights[:, dofs], centre=self.centre[dofs], names=self.names[dofs],
            transformation=replace(
                spring, stiffness=spring.stiffness[dofs], damping=spring.damping[dofs]))

    @classmethod
    def joined(
        cls, parts: Sequence[RhythmicPrimitive], names: tuple[str, ...] = ()
    ) -> RhythmicPrimitive:
        """Primitive of the degrees of freedom of several that share bases and oscillator."""
        springs = [part.transformation for part in parts]
        return replace(
            parts[0], weights=np.concatenate([part.weights for part in parts], axis=1),
            centre=np.concatenate([part.centre for part in parts]), names=names,
            transformation=replace(
                springs[0], stiffness=np.concatenate([spring.stiffness for spring in springs]),
                damping=np.concatenate([spring.damping for spring in springs])))

    @cached_property
    def _filters(self) -> tuple[FirstOrderFilter, FirstOrderFilter, TimeScaling]:
        return (
            FirstOrderFilter(self.centre_rate),
            FirstOrderFilter(self.amplitude_rate),
            TimeScaling(self.tau_rate),
        )

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return int(self.weights.shape[1])

    @property
    def form(self) -> Form:
        """Reading of τ."""
        return self.transformation.form

    @property
    def period(self) -> float:
        """Period at τ = 1 [s]."""
        return 2.0 * np.pi / self.omega

    def forcing(self, x: ArrayLike) -> Array:
        """Forcing function f(x).

        Parameters
        ----------
        x : array_like (..., 2)
            States of the oscillator.

        Returns
        -------
        ndarray (..., n)
        """
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
        positions, velocities = np.empty((len(phi), self.dofs)), np.empty((len(phi), self.dofs))
        for k, b, members in self.transformation.groups():

            def force(angle: Array, members: NDArray[np.int_] = members) -> Array:
                return stretch * self.forcing(state_at(angle))[:, members]

            part = periodic_responses(
                stretch * k, b, self.omega, force, phi, 4 * self.bases.count + 32
            )
            positions[:, members], velocities[:, members] = part[0], part[1] / tau
        return positions, velocities

    def initial_state(
        self, phi: float = 0.0, command: RhythmicInput | None = None
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
        self._check(command)
        positions, velocities = self.on_cycle(phi, command.tau)
        centre = vector(command.centre, self.dofs, 'centre')
        return RhythmicState(
            centre + command.amplitude * positions[0],
            command.amplitude * velocities[0],
            state_at(phi, command.amplitude),
            centre,
            float(command.amplitude),
            float(command.tau),
        )

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
        self._check(command)
        grid = self._filters[2].grid(state.tau, command.tau, dt, 5, self.form)
        radii = self._filters[1].at(state.amplitude, command.amplitude, grid.elapsed)
        x = hopf_flow(state.x, self.omega, self.rho, radii, grid.scaled, grid.density, grid.length)
        return self._transform(state, command, x, float(radii[-1]), grid)

    def follow(
        self, state: RhythmicState, x: Array, command: RhythmicInput, dt: float
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
        grid = self._filters[2].grid(state.tau, command.tau, dt, 5, self.form)
        return self._transform(state, command, x, float(np.hypot(*x[-1])), grid)

    def _transform(
        self,
        state: RhythmicState,
        command: RhythmicInput,
        x: Array,
        amplitude: float,
        grid: StepGrid,
    ) -> RhythmicState:
        nodes = StepGrid(
            grid.elapsed[::2], grid.scaled[::2], grid.tau[::2], grid.length, grid.density[::2]
        )
        centre = vector(command.centre, self.dofs, 'centre')
        centres = self._filters[0].at(state.centre, centre, nodes.elapsed)
        position, velocity = self.transformation.step(
            state.position, state.velocity, centres, self.forcing(x), nodes
        )
        return RhythmicState(
            position, velocity, x[-1], centres[-1], amplitude, float(nodes.tau[-1])
        )

    def acceleration(self, state: RhythmicState, command: RhythmicInput) -> Array:
        """Acceleration ÿ in a state.

        Parameters
        ----------
        state : RhythmicState
        command : RhythmicInput
            Its τ_ext gives τ̇.

        Returns
        -------
        ndarray (n,)
        """
        return self.transformation.acceleration(
            state.position,
            state.velocity,
            state.centre,
            self.forcing(state.x),
            state.tau,
            self.tau_rate * (command.tau - state.tau),
        )

    def rollout(
        self,
        times: ArrayLike,
        command: RhythmicInput | None = None,
        state: RhythmicState | None = None,
    ) -> Trajectory:
        """Run the primitive with a constant input.

        Parameters
        ----------
        times : array_like (m,)
            Increasing times; the state holds at the first [s].
        command : RhythmicInput, optional
            The demonstration's centre, amplitude and speed without.
        state : RhythmicState, optional
            Initial state; on the limit cycle of the command at phase 0 without.

        Returns
        -------
        Trajectory
        """
        command = command or self.default_input()
        states = [state or self.initial_state(0.0, command)]
        times = np.asarray(times, dtype=float)
        for dt in np.diff(times):
            states.append(self.step(states[-1], command, float(dt)))
        return Trajectory(
            times,
            np.array([s.position for s in states]),
            np.array([s.velocity for s in states]),
            np.array([self.acceleration(s, command) for s in states]),
        )

    def _check(self, command: RhythmicInput) -> None:
        for name, value in (('amplitude', command.amplitude), ('tau', command.tau)):
            if not (np.isfinite(value) and value > 0.0):
                raise ParameterError(f'{name} = {value!r} must be a positive finite number')
