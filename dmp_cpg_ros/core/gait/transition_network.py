# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The four coupled oscillators while the phase offsets move.

The state is advanced in the locked coordinates y_i = R(φ_i)ᵀ x_i, in which neither the coupling
nor the inhibition depends on the offsets (proof in :mod:`~dmp_cpg_ros.core.gait.transition`):
turned back by the old offsets, advanced by one step of the network without offsets, turned forth
by the new ones. That is ω_i = ω + φ̇_i fed forward exactly, also over a time step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from math import ceil, exp

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import turned
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.gait.gait import BodyScale
from dmp_cpg_ros.core.gait.network import (
    LONGEST_STEP,
    CanonicalParameters,
    GaitNetwork,
)
from dmp_cpg_ros.core.gait.transition import SETTLING_RATE, STANDING, BlendedGait, GaitInForce

Array = NDArray[np.float64]


class TransitionNetwork(GaitNetwork):
    """Canonical system of a blend; :meth:`advance` returns the network of the next blend.

    Parameters
    ----------
    parameters : CanonicalParameters
        Oscillators and coupling.
    gait : BlendedGait
        The blend in force.
    scale : BodyScale
        The robot's lengths.
    locked : CanonicalSystem
        The same oscillators without offsets; shared by all blends, with its time steps.
    network_of : callable (gait) → GaitNetwork
        Network of a gait, for the end of the transition.
    change_rate : float
        Largest change of a leg's frequency, as a fraction.
    """

    def __init__(self, parameters: CanonicalParameters, gait: BlendedGait, scale: BodyScale,
                 locked: CanonicalSystem, network_of: Callable[[GaitInForce], GaitNetwork],
                 change_rate: float) -> None:
        """Keep the parts."""
        self.parameters, self.gait, self.scale = parameters, gait, scale
        self._locked, self._network_of, self._change_rate = locked, network_of, change_rate

    @property
    def _blend(self) -> BlendedGait:
        assert isinstance(self.gait, BlendedGait)
        return self.gait

    @cached_property
    def target(self) -> Array:
        """x_d of every leg, ndarray (4, 2)."""
        return turned(self._locked.target, self.gait.phases)

    def advance(self, x: Array, r: Array, inhibition: Inhibition, dt: float,
                feedback: Array | float = 0.0) -> tuple[GaitNetwork, Array]:
        """Advance the states and the blend; at the end the new gait's network takes over."""
        parts = max(1, ceil(dt / LONGEST_STEP - 1e-9))
        network: GaitNetwork = self
        for _ in range(parts):
            if isinstance(network, TransitionNetwork):
                network, x = network._part(x, r, inhibition, dt / parts, feedback)
            else:
                x = network.step(x, r, inhibition, dt / parts, feedback)
        return network, x

    def step(self, x: Array, r: Array, inhibition: Inhibition, dt: float,
             feedback: Array | float = 0.0) -> Array:
        """Advance the states (4, 2) as :meth:`advance`."""
        return self.advance(x, r, inhibition, dt, feedback)[1]

    def rate(self, x: Array, r: Array, inhibition: Inhibition, feedback: Array | float = 0.0
             ) -> Array:
        """Rate of the states, ẋ (4, 2) [1/s]: that of the held blend and what the offsets add."""
        blend, transition = self._blend, self._blend.transition
        y = turned(x, -blend.phases)
        omega = self.omega(r) + blend.turning * transition.common_arc
        own = omega + blend.turning * transition.offset_arcs + feedback
        field = self._locked.field(y, own, inhibition.acting_gains(y, self._locked.target))
        return turned(field, blend.phases)

    def _part(self, x: Array, r: Array, inhibition: Inhibition, dt: float,
              feedback: Array | float) -> tuple[GaitNetwork, Array]:
        following = self._following(r, inhibition, dt)
        gait, omega = following.gait, self.omega(r)
        weight = gait.weight if isinstance(gait, BlendedGait) else 1.0
        gained = 2.0 * np.pi * self._blend.transition.common_arc * (weight - self._blend.weight)
        y = turned(x, -self.gait.phases)
        gains = inhibition.acting_gains(y, self._locked.target)
        y = self._locked.step(y, omega + gained / dt + feedback, gains, dt)
        return following, turned(y, gait.phases)

    def _following(self, r: Array, inhibition: Inhibition, dt: float) -> GaitNetwork:
        """Network one step later: the share goes on, or pauses while a stop is requested."""
        blend = self._blend
        cycles = blend.transition.cycles(self._change_rate)
        wanted = 0.0 if inhibition.requested else self.omega(r) / (2.0 * np.pi * cycles)
        rate = wanted + (blend.rate - wanted) * exp(-SETTLING_RATE * dt)
        if inhibition.requested and rate * 2.0 * np.pi * cycles < STANDING * self.omega(r):
            rate = 0.0
        share = blend.share + rate * dt
        if share >= 1.0:
            return self._network_of(blend.transition.after.scaled(blend.cadence_scale))
        return TransitionNetwork(
            self.parameters, replace(blend, share=share, rate=rate), self.scale, self._locked,
            self._network_of, self._change_rate)
