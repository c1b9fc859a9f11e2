# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The transformation system of the experiment (paper, Section 5), for the joints of one leg.

    θ̈ = k (g_θ(x, r) − θ) + b (g_θ̇(x, r) − θ̇),    τ = J θ̈ + τ_fb

Two readings: *kinematic*, in which θ is this system's own state and the joint is told to follow
it, and *torque*, in which θ is measured and only the torque goes out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.maths.exponential import phi_functions

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TransformationState:
    """State of the kinematic reading.

    Attributes
    ----------
    position, velocity : ndarray (n,)
        θ [rad] and θ̇ [rad/s].
    """

    position: Array
    velocity: Array


class TransformationSystem:
    """Spring-damper attraction to goals; contracting for k > 0, b > 0.

    Parameters
    ----------
    stiffness, damping : float
        k [1/s^2] and b [1/s].
    inertia : ndarray (n,)
        J of each joint [kg m^2].
    """

    def __init__(self, stiffness: float, damping: float, inertia: Array) -> None:
        """Keep the gains."""
        self.stiffness, self.damping, self.inertia = stiffness, damping, inertia
        self._transitions: dict[float, tuple[float, float, float, float]] = {}

    def acceleration(
        self, position: Array, velocity: Array, goal: Array, goal_velocity: Array
    ) -> Array:
        """θ̈ [rad/s^2] at a state, ndarray (n,)."""
        return self.stiffness * (goal - position) + self.damping * (goal_velocity - velocity)

    def step(
        self, state: TransformationState, goal: Array, goal_velocity: Array, dt: float
    ) -> TransformationState:
        """Advance the kinematic reading to the time at which the goals hold.

        Exact for goals that move at ``goal_velocity`` during the step.

        Parameters
        ----------
        state : TransformationState
            State one step before.
        goal, goal_velocity : ndarray (n,)
            Goals at the end of the step [rad], [rad/s].
        dt : float
            [s]

        Returns
        -------
        TransformationState
        """
        transition = self._transitions.get(dt)
        if transition is None:
            system = np.array([[0.0, 1.0], [-self.stiffness, -self.damping]])
            a, b, c, d = phi_functions(system * dt, 1)[0].ravel().tolist()
            transition = self._transitions[dt] = (a, b, c, d)
        a, b, c, d = transition
        position, velocity = [], []
        for theta, theta_dot, at, rate in zip(
            state.position.tolist(), state.velocity.tolist(), goal.tolist(),
            goal_velocity.tolist(), strict=True,
        ):  # fmt: skip
            error, error_rate = theta - (at - rate * dt), theta_dot - rate
            position.append(at + a * error + b * error_rate)
            velocity.append(rate + c * error + d * error_rate)
        return TransformationState(np.array(position), np.array(velocity))

    def torque(self, acceleration: Array, feedback: Array) -> Array:
        """τ = J θ̈ + τ_fb [N m], ndarray (n,)."""
        return self.inertia * acceleration + feedback
