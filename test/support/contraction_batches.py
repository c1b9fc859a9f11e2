# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many networks at once: the time step of the canonical system, stacked over settings."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.canonical.graph import CouplingGraph, graph_from_edges, topology
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.maths.exponential import ExponentialStep

GRAPHS = ('all_to_all', 'ring', 'path', 'star', 'directed_ring', 'directed')


@dataclass(frozen=True)
class Setting:
    """One network with its inhibition."""

    system: CanonicalSystem
    omega: np.ndarray
    gains: np.ndarray
    region_radius: float
    name: str

    @property
    def node(self) -> int:
        """The inhibited oscillator."""
        return int(np.argmax(self.gains))


class Batch:
    """Steps all settings at once; inhibition is switched by region where it is armed."""

    def __init__(self, settings: list[Setting], dt: float) -> None:
        self.settings, self.dt = settings, dt
        self.omega = np.stack([s.omega for s in settings])
        self.gains = np.stack([s.gains for s in settings])
        self.target = np.stack([s.system.target for s in settings])
        self.region = np.array([s.region_radius for s in settings])[:, None]
        self.rho = np.stack([s.system.rho for s in settings])
        self.linear = self.rho * np.stack([s.system.radius for s in settings])**2 - 1j * self.omega
        free = [_matrices(s.system, np.zeros_like(s.gains), dt) for s in settings]
        held = [_matrices(s.system, s.gains, dt) for s in settings]
        self._stacks = [np.stack([np.stack(pair) for pair in zip(a, b, strict=True)])
                        for a, b in zip(zip(*free, strict=True), zip(*held, strict=True),
                                        strict=True)]                        # (settings, 2, …)

    def subset(self, keep: np.ndarray) -> Batch:
        """The same batch with only the settings whose mask (settings,) is true."""
        part = copy(self)
        part.settings = [s for s, kept in zip(self.settings, keep, strict=True) if kept]
        for name in ('omega', 'gains', 'target', 'region', 'rho', 'linear'):
            setattr(part, name, getattr(self, name)[keep])
        part._stacks = [stack[keep] for stack in self._stacks]
        return part

    def inside(self, x: np.ndarray) -> np.ndarray:
        """Which settings have their inhibited oscillators in C, (settings,)."""
        close = np.linalg.norm(x - self.target, axis=2) <= self.region
        return np.all(close | (self.gains == 0.0), axis=1)

    def step(self, x: np.ndarray, armed: bool = True) -> np.ndarray:
        """One step of all states (settings, N, 2)."""
        rows = np.arange(len(x))
        acting = (self.inside(x) & armed).astype(int)
        half, end, final, c_half, c = (stack[rows, acting] for stack in self._stacks)
        flat = x.reshape(len(x), -1)
        n0 = self._nonlinear(flat)
        n_half = self._nonlinear(_times(half, flat, n0) + c_half)
        n_end = self._nonlinear(_times(end, flat, n0, n_half) + c)
        return (_times(final, flat, n0, n_half, n_end) + c).reshape(x.shape)

    def _nonlinear(self, flat: np.ndarray) -> np.ndarray:
        z = np.ascontiguousarray(flat).view(complex)
        return ((self.linear - self.rho * (z.real**2 + z.imag**2)) * z).view(float)

    def speed(self, x: np.ndarray, armed: bool = True) -> np.ndarray:
        """Largest |ẋ_i| of each setting, by its own vector field."""
        acting = self.inside(x) & armed
        return np.array([np.linalg.norm(s.system.field(x[k], s.omega, s.gains * acting[k]),
                                        axis=1).max() for k, s in enumerate(self.settings)])


def locked(setting: Setting, phi: float, radius: float = 1.0) -> np.ndarray:
    """All oscillators in their places at phase φ, radii as a share of r."""
    return state_at(phi + setting.system.graph.phases, radius * setting.system.radius)


def random_graph(name: str, size: int, gain: float, rng: np.random.Generator) -> CouplingGraph:
    """A named graph with random phase offsets; ``directed`` draws one in which 0 reaches all."""
    phases = rng.uniform(-np.pi, np.pi, size)
    if name != 'directed':
        return graph_from_edges(size, topology(name, size), gain, phases)
    edges = {(i, int(rng.integers(i))) for i in range(1, size)}
    edges |= {(int(i), int(j)) for i, j in rng.integers(size, size=(size, 2)) if i != j}
    return graph_from_edges(size, tuple(sorted(edges)), gain, phases)


def random_setting(rng: np.random.Generator, size: int = 4) -> Setting:
    """A network with gains that may or may not do."""
    name = GRAPHS[rng.integers(len(GRAPHS))]
    rho, radius = np.exp(rng.uniform(np.log(1.0), np.log(25.0))), rng.uniform(0.5, 2.0)
    omega = rng.uniform(2.0, 25.0)
    gain = np.exp(rng.uniform(np.log(3.0), np.log(400.0)))
    graph = random_graph(name, size, gain, rng)
    oscillator = AndronovHopf(rho / radius**2, radius)
    system = CanonicalSystem(graph, oscillator, state_at(graph.phases, radius))
    region = rng.uniform(0.1, 0.6) * radius
    gains = np.zeros(size)
    node = 0 if name == 'directed' else int(rng.integers(size))
    gains[node] = size * omega * radius / region * rng.uniform(0.5, 3.0)
    return Setting(system, np.full(size, omega), gains, region, name)


def _matrices(system: CanonicalSystem, gains: np.ndarray, dt: float) -> tuple[np.ndarray, ...]:
    step = ExponentialStep(*system.linear_part(gains), dt)
    return step._to_half, step._to_end, step._final, step._c_half, step._c


def _times(matrix: np.ndarray, *parts: np.ndarray) -> np.ndarray:
    return np.matmul(matrix, np.concatenate(parts, axis=1)[:, :, None])[:, :, 0]
