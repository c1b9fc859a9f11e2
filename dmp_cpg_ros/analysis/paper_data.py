# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The simulations behind the paper's figures that need no robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.graph import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.paper.coupling import EdgeCoupling
from dmp_cpg_ros.paper.network import OscillatorNetwork
from dmp_cpg_ros.paper.oscillators import HopfOscillators, VanDerPolOscillators

Array = NDArray[np.float64]

VAN_DER_POL_OMEGA = (0.8, 1.0, 1.25, 1.5)
VAN_DER_POL_MU = (0.5, 1.0, 1.5, 2.0)
"""Frequencies [rad/s] and nonlinearities [1/s] of figure vdp; the paper does not print its own."""

VAN_DER_POL_GAIN = np.diag((4.0, 4.0))
"""K_ij of figure vdp, as in its caption [1/s]."""

LOCAL_OMEGA, LOCAL_RHO, LOCAL_GAIN, LOCAL_REGION = 3.0, 2.0, 30.0, 0.3
"""ω [rad/s], ρ [1/s], k_inh [1/s] and r0 of figure localDynamics; only r0 is the paper's."""


@dataclass(frozen=True)
class VanDerPolData:
    """Heterogeneous Van der Pol oscillators without and with coupling.

    Attributes
    ----------
    time : ndarray (n,)
        [s]
    uncoupled, coupled : ndarray (n, N, 2)
        States.
    """

    time: Array
    uncoupled: Array
    coupled: Array


@dataclass(frozen=True)
class LocalDynamics:
    """One Andronov-Hopf oscillator without or with switched inhibition.

    Attributes
    ----------
    trajectories : ndarray (m, n, 2)
        Trajectories from m initial states.
    grid : ndarray (k,)
        Where the field is given, along both axes.
    field : ndarray (k, k, 2)
        ẋ at (x₁, x₂) = (grid[j], grid[i]) [1/s].
    target : ndarray (2,)
        x_d.
    region_radius : float
        r0 of the region C, zero without inhibition.
    """

    trajectories: Array
    grid: Array
    field: Array
    target: Array
    region_radius: float


def van_der_pol_data(duration: float = 60.0, dt: float = 0.01) -> VanDerPolData:
    """Simulate the Van der Pol oscillators of figure vdp for a duration [s] with a step [s]."""
    size = len(VAN_DER_POL_OMEGA)
    family = VanDerPolOscillators(size, VAN_DER_POL_OMEGA, VAN_DER_POL_MU)
    coupling = EdgeCoupling(
        graph_from_edges(size, topology('all_to_all', size), VAN_DER_POL_GAIN))
    start = np.array([[2.0, 0.0], [-2.0, 0.0], [0.5, -1.5], [-0.5, 2.5]])
    steps = round(duration / dt)
    runs = [_simulated(OscillatorNetwork(family, of), start, steps, dt) for of in (None, coupling)]
    return VanDerPolData(np.arange(steps + 1, dtype=float) * dt, *runs)


def local_dynamics(inhibited: bool, duration: float = 6.0, dt: float = 0.005) -> LocalDynamics:
    """Simulate the oscillator of figure localDynamics, each trajectory on its own."""
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False) + 0.3
    start = np.concatenate([state_at(angles, 1.55), state_at(angles[::2], 0.08)])
    steps, count = round(duration / dt), len(start)
    # Not one stop of a network, where inhibited nodes act together: each state is on its own.
    inhibition = Inhibition(False, np.full(count, LOCAL_GAIN * inhibited), LOCAL_REGION)
    target = state_at(np.zeros(count))
    of = OscillatorNetwork(HopfOscillators(count, LOCAL_OMEGA, LOCAL_RHO), target=target)
    trajectories = _simulated(of, start, steps, dt, inhibition).swapaxes(0, 1)
    grid = np.linspace(-1.6, 1.6, 161)
    states = np.stack(np.meshgrid(grid, grid), axis=-1)
    flat = states.reshape(-1, 2)
    everywhere = OscillatorNetwork(HopfOscillators(len(flat), LOCAL_OMEGA, LOCAL_RHO),
                                   target=state_at(np.zeros(len(flat))))
    gains = Inhibition(False, np.full(len(flat), LOCAL_GAIN * inhibited), LOCAL_REGION)
    field = everywhere.field(flat, gains.acting_gains(flat, everywhere.target))
    return LocalDynamics(trajectories, grid, field.reshape(states.shape), target[0],
                         LOCAL_REGION * inhibited)


def _simulated(of: OscillatorNetwork, x: Array, steps: int, dt: float,
               inhibition: Inhibition | None = None) -> Array:
    rows = [x]
    for _ in range(steps):
        gains = None if inhibition is None else inhibition.acting_gains(x, of.target)
        x = of.step(x, dt, gains)
        rows.append(x)
    return np.array(rows)
