# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The coupled oscillators of a gait or of a blend of two: what runs, and what predictions are made
with.

A blend is stepped in the locked coordinates y_i = R(φ_i)ᵀ x_i, in which neither the coupling nor
the inhibition depends on the offsets (proof in :mod:`~dmp_cpg_ros.core.gait.transition`): turned
back by the old offsets, advanced by one step of the network without offsets, turned forth by the
new ones. That is ω_i = ω + φ̇_i fed forward exactly, also over a time step. Where the offsets stand
still, nothing is turned and the network has the offsets of the gait.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import atan2, ceil, cos, pi, sin

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import (
    TOPOLOGIES,
    CouplingGraph,
    degrees,
    graph_from_edges,
    topology,
)
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf, Oscillators
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import scalar_phase, state_at, turned
from dmp_cpg_ros.core.canonical.system import MOST_KEPT, CanonicalSystem
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters, GaitInForce
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.robot_model.state import LEGS

LONGEST_STEP = 0.005
"""Longest time step of the oscillators [s]."""

SLOWEST = 0.7
"""Least factor on a gait's cadence."""

AT_REST = 0.05
"""Rates |ẋ| up to which oscillators rest and may be turned [1/s]."""


@dataclass(frozen=True)
class CanonicalParameters(Parameters):
    """Parameters of the coupled canonical oscillators."""

    rho: float = parameter(8.0, 'attraction rho to the limit cycle', 0.1, 1e3, unit='1/s')
    radius: float = parameter(1.0, 'radius r of the limit cycle', 0.01, 100.0)
    coupling_gain: float = parameter(100.0, 'gain k of every coupling', 0.01, 1e4, unit='1/s')
    coupling_graph: str = parameter(
        'all_to_all', 'coupling graph of the legs',
        choices=TOPOLOGIES)
    cadence_scale: float = parameter(
        1.0, "factor on the gait's cadence at every speed; slower robots tip over between steps",
        SLOWEST, 4.0)
    contact_feedback: bool = parameter(
        False, 'whether early and late touchdown shift the phase of the legs')
    contact_gain: float = parameter(
        20.0, 'frequency offset per phase by which a touchdown is early or late', 0.0, 1e3,
        unit='1/s')
    contact_hold: float = parameter(
        0.5, 'largest decrease of the cadence by late feet, as a fraction of the cadence',
        0.0, 0.9)
    margin_share: float = parameter(
        0.5, 'fraction of the margin for unequal leg frequencies that contact feedback may use',
        0.0, 0.95)

    @property
    def oscillators(self) -> Oscillators:
        """Family of the uncoupled oscillators; that of a derived class may be another one."""
        return AndronovHopf(self.rho, self.radius)

    @property
    def first_leg(self) -> int:
        """The first of the legs on which most others act: what one alone can hold, it can."""
        number = degrees(self.coupling_graph, len(LEGS))
        return number.index(max(number))


def network_system(parameters: CanonicalParameters, phases: Array) -> CanonicalSystem:
    """Coupled oscillators that lock at given phases; inhibition pulls each leg to its place when
    fl has phase 0.

    Parameters
    ----------
    parameters : CanonicalParameters
        Oscillators and coupling.
    phases : ndarray (4,)
        Locked phases relative to fl [rad].
    """
    return _network_system(at_own_cadence(parameters), phases.tobytes())


@lru_cache(MOST_KEPT)
def at_own_cadence(parameters: CanonicalParameters) -> CanonicalParameters:
    """Parameters without a factor on the cadence, which is in nothing but the frequency."""
    return replace(parameters, cadence_scale=1.0)


@lru_cache(MOST_KEPT)
def _network_system(p: CanonicalParameters, phases: bytes) -> CanonicalSystem:
    graph = _named_graph(p.coupling_graph, p.coupling_gain, phases)
    return CanonicalSystem(graph, p.oscillators, state_at(graph.phases, p.radius))


@lru_cache(MOST_KEPT)
def _named_graph(name: str, gain: float, phases: bytes) -> CouplingGraph:
    """Couplings, which other oscillators share, with all that is known of them."""
    return graph_from_edges(len(LEGS), topology(name, len(LEGS)), gain, np.frombuffer(phases))


class GaitNetwork:
    """Canonical system of a gait, or of a blend, with its frequency taken from the reference.

    Parameters
    ----------
    parameters : CanonicalParameters
        Oscillators and coupling.
    gait : Gait
        Phase offsets and cadence, before ``cadence_scale``.
    scale : BodyScale
        The robot's lengths.
    change_rate : float
        Largest change of a leg's frequency while gaits change, as a fraction.

    Attributes
    ----------
    gait : Gait or BlendedGait
        With the cadence that acts: everything that asks a gait for ω must ask this one.
    """

    def __init__(self, parameters: CanonicalParameters, gait: GaitInForce, scale: BodyScale,
                 change_rate: float = GaitChangeParameters.gait_change_rate) -> None:
        """Keep the parts."""
        self.parameters, self.scale, self.change_rate = parameters, scale, change_rate
        self.gait: GaitInForce = gait.scaled(parameters.cadence_scale)
        self._systems: dict[bytes, CanonicalSystem] = {}
        self._asked: tuple[list[float], float] | None = None

    def of(self, gait: GaitInForce) -> GaitNetwork:
        """Return the same oscillators in a gait or blend, at the cadence that it has; what was
        computed for its offsets is shared.
        """
        if gait is self.gait:
            return self
        other = copy(self)
        other.gait, other._asked = gait, None
        for name in ('system', 'target'):
            other.__dict__.pop(name, None)
        return other

    def with_parameters(self, parameters: CanonicalParameters) -> GaitNetwork:
        """Return other oscillators in the gait that acts, at its cadence."""
        return GaitNetwork(parameters, self.gait, self.scale, self.change_rate).of(self.gait)

    @cached_property
    def system(self) -> CanonicalSystem:
        """The coupled system with the gait's offsets."""
        return self._system(self.gait.phases)

    def _system(self, phases: Array) -> CanonicalSystem:
        key, known = phases.tobytes(), self._systems
        if key not in known:
            if len(known) > MOST_KEPT:
                known.clear()
            known[key] = network_system(self.parameters, phases)
        return known[key]

    def _frame(self, rest_phase: float) -> tuple[CanonicalSystem, Array | None]:
        """System that is stepped, and the offsets by which its states are turned."""
        moving = self.gait.moving_phases
        if moving is not None:
            return self._system(np.full(len(LEGS), rest_phase)), moving
        return self._system(self.gait.phases + rest_phase) if rest_phase else self.system, None

    @cached_property
    def target(self) -> Array:
        """x_d of every leg for rest at phase 0, ndarray (4, 2)."""
        return self.target_at(0.0)

    def target_at(self, rest_phase: float) -> Array:
        """x_d of every leg when fl is to rest at a phase [rad], ndarray (4, 2)."""
        system, moving = self._frame(rest_phase)
        return _turned(system.target, moving)

    def acting_gains(self, inhibition: Inhibition, x: Array) -> Array:
        """Gains that act at states (4, 2), ndarray (4,) [1/s]."""
        return inhibition.acting_gains(x, self.target_at(inhibition.rest_phase))

    @property
    def highest_speed(self) -> float:
        """Foot speed at which the gait in force is held [m/s]."""
        return self.scale.speed(self.gait.highest(self.scale))

    def omega(self, r: Array) -> float:
        """Angular frequency ω [rad/s] at a reference r = (v_x, v_y, γ), ndarray (3,); the last
        answer is kept, for a tick asks several times.
        """
        asked = r.tolist()
        if self._asked is None or self._asked[0] != asked:
            self._asked = asked, self.gait.omega(self.scale.foot_speed(*asked), self.scale)
        return self._asked[1]

    def advance(self, x: Array, r: Array, inhibition: Inhibition, dt: float,
                feedback: Array | float = 0.0) -> tuple[GaitNetwork, Array]:
        """Advance the states and, while gaits change, the blend.

        After a gap in the robot's states the time is made up in parts of at most
        ``LONGEST_STEP``.

        Parameters
        ----------
        x : ndarray (4, 2)
            States.
        r : ndarray (3,)
            Reference.
        inhibition : Inhibition
            Switched by region.
        dt : float
            [s]
        feedback : ndarray (4,) or float
            Added to the legs' ω [rad/s].

        Returns
        -------
        network : GaitNetwork
            In force after the step.
        x : ndarray (4, 2)
        """
        network, parts = self, max(1, ceil(dt / LONGEST_STEP - 1e-9))
        for _ in range(parts):
            network, x = network._part(x, r, inhibition, dt / parts, feedback)
        return network, x

    def _part(self, x: Array, r: Array, inhibition: Inhibition, dt: float,
              feedback: Array | float) -> tuple[GaitNetwork, Array]:
        omega, (system, moving) = self.omega(r), self._frame(inhibition.rest_phase)
        gait, gained = self.gait.following(omega, self.change_rate, inhibition.requested, dt)
        y = _turned(x, None if moving is None else -moving)
        gains = inhibition.acting_gains(y, system.target)
        y = system.step(y, omega + gained / dt + feedback, gains, dt)
        return self.of(gait), _turned(y, None if moving is None else gait.phases)

    def step(self, x: Array, r: Array, inhibition: Inhibition, dt: float,
             feedback: Array | float = 0.0) -> Array:
        """Advance the states (4, 2) as :meth:`advance`."""
        return self.advance(x, r, inhibition, dt, feedback)[1]

    def rate(self, x: Array, r: Array, inhibition: Inhibition,
             feedback: Array | float = 0.0) -> Array:
        """Rate of the states, ẋ (4, 2) [1/s], with feedback as in :meth:`advance`: that of the
        held blend and what moves its offsets.
        """
        system, moving = self._frame(inhibition.rest_phase)
        y = _turned(x, None if moving is None else -moving)
        omega = self.gait.oscillator_omegas(self.omega(r)) + feedback
        field = system.field(y, omega, inhibition.acting_gains(y, system.target))
        return _turned(field, moving)

    def locked_state(self, phi: float = 0.0) -> Array:
        """States (4, 2) on the limit cycle with fl at phase φ [rad] and all legs in their
        places.
        """
        return state_at(phi + self.gait.phases, self.parameters.radius)

    def rest_state(self, inhibition: Inhibition, tick: float = 0.004,
                   duration: float = 8.0) -> Array:
        """Equilibrium (4, 2) that is reached from the locked state under inhibition at zero
        reference; a last digit that goes back and forth is followed to the end.
        """
        x, r, steps = self.locked_state(), np.zeros(3), round(duration / tick)
        way, met = [x], {x.tobytes(): 0}
        for number in range(1, steps + 1):
            x = self.step(x, r, inhibition, tick)
            first = met.setdefault(x.tobytes(), number)
            if first < number:
                return way[first + (steps - first) % (number - first)]
            way.append(x)
        return x

    def settled(self, x: Array, r: Array, inhibition: Inhibition) -> Array | None:
        """Equilibrium (4, 2) near a state under inhibition, by Newton's iteration; None where it
        finds none, or the gains that act do not hold the legs in their regions C_i.

        Parameters
        ----------
        x : ndarray (4, 2)
            State near it.
        r : ndarray (3,)
            Reference, about zero.
        inhibition : Inhibition
            Of which acts what acts at x.
        """
        system, _ = self._frame(inhibition.rest_phase)
        omega, gains = self.omega(r), inhibition.acting_gains(x, system.target)
        try:
            for _ in range(6):
                x = system.newton_step(x, omega, gains, system.field(x, omega, gains))
        except np.linalg.LinAlgError:
            return None
        held = np.array_equal(inhibition.acting_gains(x, system.target), gains)
        return x if held and np.abs(self.rate(x, r, inhibition)).max() <= AT_REST else None

    def phase_errors(self, x: Array) -> list[float]:
        """Deviation of each leg's phase from its place, relative to the circular mean [rad]."""
        places = self.gait.phases.tolist()
        relative = [scalar_phase(x_1, x_2) - places[i] for i, (x_1, x_2) in enumerate(x.tolist())]
        mean = atan2(sum(map(sin, relative)), sum(map(cos, relative)))
        return [(angle - mean + pi) % (2.0 * pi) - pi for angle in relative]


def _turned(x: Array, phases: Array | None) -> Array:
    return x if phases is None else turned(x, phases)
