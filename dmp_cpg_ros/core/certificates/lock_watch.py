# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Monitor of the phase lock: phase errors of the running oscillators against their bound.

In the places' own frames, z_i = R(−φ_i) x_i, the disagreement ε = (Σ ξ_i |z_i − z̄|²)^½ of a free
network obeys ε̇ ≤ −λε + δr (Theorem 4 with the disturbance of Section 3.4): λ is the margin of the
synchronisation condition, δ what the legs' frequencies may differ by and the rate at which a
changing gait moves the places. From a start, or from release, ε stays under the solution of that
inequality, and phases differ by what ε and the radius |z̄| allow. Beyond it something acts on the
oscillators that is not in the model.
"""

from __future__ import annotations

from cmath import phase as angle
from dataclasses import dataclass
from itertools import combinations
from math import exp, inf, pi

import numpy as np

from dmp_cpg_ros.core.certificates.network import EXPECTED_MISMATCH, free_synchronisation
from dmp_cpg_ros.core.contraction.heterogeneity import disagreement, phase_spread
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.inhibition.entry import locked
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked

LOCKED, DISTURBED, LOST = 0, 1, 2
"""Within the bound; beyond it and coming back as it must; beyond it and not coming back."""

_ROUNDING = 1e-6


@dataclass(frozen=True)
class PhaseLock:
    """What the watch found at one tick.

    Attributes
    ----------
    error : float
        Largest difference of two legs' phases from their places [rad].
    bound : float
        What it must not exceed [rad]; π where nothing is certified or inhibition acts.
    level : int
        ``LOCKED``, ``DISTURBED`` or ``LOST``.
    envelope : float
        Bound on ε from here on.
    places : ndarray (4,)
        Phases of the places [rad].
    """

    error: float
    bound: float
    level: int
    envelope: float
    places: Array

    @property
    def alarm(self) -> str:
        """What there is to say, starting with ``alarm``; empty while all is well."""
        if self.level == LOCKED:
            return ''
        back = ('; it comes back at the certified rate' if self.level == DISTURBED else
                ' and does not come back at the certified rate')
        return (f'alarm: phase-lock error {self.error:.3g} rad is beyond its bound '
                f'{self.bound:.3g} rad{back}')


class PhaseLockWatch:
    """Watches a network from tick to tick; the findings stay with the caller."""

    def __init__(self) -> None:
        """Start with no network."""
        self._parameters: CanonicalParameters | None = None

    def step(self, before: PhaseLock | None, network: GaitNetwork, r: Array, x: Array, free: bool,
             dt: float, contact: float = 0.0) -> PhaseLock:
        """Look at the state after a tick.

        Parameters
        ----------
        before : PhaseLock or None
            Finding of the tick before; None at a start.
        network : GaitNetwork
            The network that acted.
        r : ndarray (3,)
            Reference.
        x : ndarray (4, 2)
            Canonical states.
        free : bool
            Whether no inhibition acted.
        dt : float
            Time since the tick before [s].
        contact : float
            How unequal contact feedback may make the legs' frequencies [rad/s].

        Returns
        -------
        PhaseLock
        """
        p, places = network.parameters, network.gait.phases
        if p is not self._parameters and p != self._parameters:
            self._found = free_synchronisation(network)  # to which places make no difference
        self._parameters, found = p, self._found
        at = locked(network, x)
        z: list[complex] = at.tolist()
        error = max(abs(angle(one * other.conjugate())) for one, other in combinations(z, 2))
        if found.weights is None or not found.synchronises:
            return PhaseLock(error, pi, LOCKED, inf, places)
        mean, epsilon, pair, single = disagreement(found.weights, at)
        if before is None or not free:
            return PhaseLock(error, pi, LOCKED, epsilon, places)
        size = max(p.radius, *map(abs, z))
        steady = (EXPECTED_MISMATCH * network.omega(r) + contact) * size / found.rate
        moved = _moved(places - before.places) * size
        fade = exp(-found.rate * dt)
        envelope = max(steady, before.envelope * fade + (1.0 - fade) * steady) + moved
        if before.envelope == inf:
            envelope = max(steady, epsilon)
        bound, lasting = (phase_spread(apart * pair, abs(mean) - apart * single)
                          for apart in (max(envelope, steady), steady))
        return _judged(
            before, PhaseLock(error, bound, LOCKED, envelope, places), epsilon, lasting)


def _judged(before: PhaseLock, now: PhaseLock, epsilon: float, steady: float) -> PhaseLock:
    """Decide the level: an alarm stays until the error is within the steady bound again."""
    beyond = now.error > now.bound + _ROUNDING
    if before.level == LOCKED:
        return replace_unchecked(now, level=DISTURBED, envelope=epsilon) if beyond else now
    if now.error <= steady:
        return now
    level = LOST if before.level == LOST or beyond else DISTURBED
    return replace_unchecked(now, bound=steady, level=level)


def _moved(change: Array) -> float:
    """Largest change of a place without what the changes have in common, on the circle."""
    if not change.any():
        return 0.0
    turned = np.exp(1j * change)
    return float(np.abs(np.angle(turned * np.conj(turned.mean()))).max())
