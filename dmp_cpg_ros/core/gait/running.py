# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The canonical block while it runs: oscillators, gait in force, cadence, contact feedback.

The state stays and nothing jumps when gait or parameters change. Couplings and oscillators take
new parameters at once: they enter ẋ and leave x as it is. The factor on the cadence moves at
``CADENCE_RATE`` from one value to the other, never beyond. When the gait changes:

- While it walks freely, a change begins at once and takes its cycles; into a slower gait, once the
  reference has nearly come down to the highest speed of that gait.
- While gaits change, another change waits until the present one has ended; of several that wait
  the last one is taken.
- While a stop is under way, a change in progress pauses and a new one waits: what was predicted
  and bounded for the stop holds for the blend as it stands.
- At rest all feet are on the ground and no leg swings, so the requested gait takes effect at
  once: the oscillators are turned to their places in it and to its equilibrium, and the legs,
  whose swing height and speed are zero, stay where they are. Where votes alone hold the gait and
  could not hold the new one, the change waits until the gait runs or the service stops it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import copysign

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import (
    Inhibition,
    InhibitionParameters,
    initial_inhibition,
)
from dmp_cpg_ros.core.canonical.phase import turned
from dmp_cpg_ros.core.gait import contact_feedback as contacts
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters, chosen_gait, limiting_gaits
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import AT_REST, CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.transition import (
    BlendedGait,
    GaitChangeParameters,
    GaitInForce,
    changing_speed,
)
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import made_often, replace_unchecked


def limits_on_the_way(parameters: GaitChoiceParameters, name: str, named: Callable[[str], Gait],
                      wanted: float, acting: float | None = None
                      ) -> tuple[tuple[Gait, ...], tuple[Gait, ...], float]:
    """Gaits whose limits commands are to keep while the cadence moves; between two cadences none
    is lower than at both. Parameters are those of :func:`limiting_gaits`, with the factor on the
    cadence that is ``wanted`` and the one that is ``acting``.

    Returns :func:`limiting_gaits` at the first and at the second, none where it is not given or
    has arrived; and the time until it arrives [s].
    """
    gaits = limiting_gaits(parameters, name, named, wanted)
    if acting is None or acting == wanted:
        return gaits, (), 0.0
    return (gaits, limiting_gaits(parameters, name, named, acting),
            abs(acting - wanted) / CADENCE_RATE)


CADENCE_RATE = 0.5
"""Rate at which the factor on the cadence moves to a new value [1/s].

A foot in stance stands where its phase and the cadence put it: v Δc/f from its foothold. A jump of
the cadence would be a jump of the feet.
"""

HASTE = 1.1
"""Share of the highest speed for a change of gait at which it begins. Commands are within that
already, so the reference comes down to it; the blend's own limit is for what is left.
"""


def approached(cadence_scale: float, wanted: float, dt: float) -> float:
    """Factor on the cadence a time dt [s] later, on its way to the one that is wanted."""
    most = CADENCE_RATE * dt
    if abs(wanted - cadence_scale) <= most:
        return wanted
    return cadence_scale + (most if wanted > cadence_scale else -most)


@made_often
@dataclass(frozen=True)
class CanonicalState:
    """State of the canonical block after a tick.

    Attributes
    ----------
    gait : Gait or BlendedGait
        In force: the phases of x are to be read in it.
    wanted : Gait
        The gait that was asked for last.
    cadence_scale : float
        Factor on the cadence that acts, but for the quickness of a pushed robot; that of the
        parameters once it has arrived.
    x, x_dot : ndarray (4, 2)
        States and rates of the oscillators.
    contact : ContactState
        Memory of the contact feedback.
    """

    gait: GaitInForce
    wanted: Gait
    cadence_scale: float
    x: Array
    x_dot: Array
    contact: contacts.ContactState


class RunningGait:
    """The canonical block; state in, state out.

    Parameters
    ----------
    parameters : CanonicalParameters
        Oscillators, coupling, cadence, contact feedback.
    scale : BodyScale
        The robot's lengths.
    gaits : KnownGaits
        The gaits that are known, and the ways between them.
    change : GaitChangeParameters, optional
        How gaits change.
    choice : GaitChoiceParameters, optional
        Automatic choice of the gait; off without.
    quarter : float, optional
        Force on each foot of the standing robot, for contact feedback [N].
    """

    def __init__(self, parameters: CanonicalParameters, scale: BodyScale, gaits: KnownGaits,
                 change: GaitChangeParameters | None = None,
                 choice: GaitChoiceParameters | None = None,
                 quarter: float = float('nan')) -> None:
        """Keep the parts; networks are built when they are needed."""
        self.parameters, self.scale, self.gaits, self.quarter = parameters, scale, gaits, quarter
        self.choice = choice or GaitChoiceParameters()
        self._network = GaitNetwork(
            parameters, next(iter(gaits.gaits.values())), scale,
            (change or GaitChangeParameters()).gait_change_rate)

    def with_parameters(self, parameters: CanonicalParameters, change: GaitChangeParameters,
                        choice: GaitChoiceParameters) -> RunningGait:
        """Return the block with other parameters; from the next step on they act."""
        return RunningGait(parameters, self.scale, self.gaits, change, choice, self.quarter)

    def network(self, gait: GaitInForce) -> GaitNetwork:
        """Oscillators of a gait or of a blend, at the cadence that it has."""
        self._network = self._network.of(gait)
        return self._network

    def initial_state(self, gait: Gait, inhibition: InhibitionParameters) -> CanonicalState:
        """At rest under inhibition where it starts inhibited, or with all legs in their places.

        Parameters
        ----------
        gait : Gait
            At the start, before ``cadence_scale``.
        inhibition : InhibitionParameters
            Whether the gait starts inhibited, and by what.
        """
        factor, acting = self.parameters.cadence_scale, initial_inhibition(
            inhibition, self.parameters.first_leg)
        network = self.network(gait.scaled(factor))
        x = network.rest_state(acting) if inhibition.start_inhibited else network.locked_state()
        return CanonicalState(network.gait, gait, factor, x, np.zeros_like(x),
                              contacts.initial_contact_state())

    @cached_property
    def _choices(self) -> tuple[Gait, ...]:
        """Gaits that are chosen among, with their limits."""
        return limiting_gaits(self.choice, '', self.gaits.named, self.parameters.cadence_scale)

    def cadence_rate(self, state: CanonicalState) -> float:
        """Rate of the factor on the cadence [1/s]."""
        way = self.parameters.cadence_scale - state.cadence_scale
        return copysign(CADENCE_RATE, way) if way else 0.0

    def want(self, state: CanonicalState, name: str) -> CanonicalState:
        """Ask for a gait; raises ParameterError with the valid names."""
        return replace_unchecked(state, wanted=self.gaits.named(name))

    def step(self, state: CanonicalState, r: Array, inhibition: Inhibition, dt: float,
             foot_force: Array | None = None,
             limits: contacts.ContactLimits | None = None) -> CanonicalState:
        """Advance by one tick.

        Parameters
        ----------
        state : CanonicalState
            After the tick before.
        r : ndarray (3,)
            Reference of this tick.
        inhibition : Inhibition
            That acts.
        dt : float
            Time since the tick before [s]; 0 at the first.
        foot_force : ndarray (4,), optional
            Normal forces of the feet, where they are fed back [N].
        limits : ContactLimits, optional
            What contact feedback may do; nothing without.

        Returns
        -------
        CanonicalState
        """
        wanted = state.wanted
        if self.choice.auto_gait:
            wanted = self.gaits.named(chosen_gait(
                self.choice, wanted.name, r, self.scale, self._choices))
        gait, cadence_scale = self._at_cadence(state, inhibition.quickness, dt)
        turns = inhibition.opposite and float(np.abs(state.x_dot).max()) <= AT_REST
        network, x = self._begin_change(
            self.network(gait), -state.x if turns else state.x, r, wanted, inhibition)
        contact = state.contact
        feedback: Array | float = 0.0
        if self.parameters.contact_feedback and foot_force is not None:
            contact, feedback = contacts.contact_feedback(
                contact, foot_force, self.quarter, limits, network, x, r, inhibition, dt)
        if dt > 0.0:
            network, x = network.advance(x, r, inhibition, dt, feedback)
        self._network = network
        x_dot = network.rate(x, r, inhibition, feedback)
        return CanonicalState(network.gait, wanted, cadence_scale, x, x_dot, contact)

    def _at_cadence(self, state: CanonicalState, quickness: float, dt: float
                    ) -> tuple[GaitInForce, float]:
        """Gait in force at a cadence nearer to that of the parameters, times the quickness."""
        factor = approached(state.cadence_scale, self.parameters.cadence_scale, dt)
        if factor * quickness == state.gait.cadence_scale:
            return state.gait, factor
        return self.gaits.at_cadence(state.gait, factor * quickness), factor

    def _begin_change(self, network: GaitNetwork, x: Array, r: Array, wanted: Gait,
                      inhibition: Inhibition) -> tuple[GaitNetwork, Array]:
        """Begin the change to the gait that is wanted, when it is time for it; the states are
        turned when the gait changes at rest.
        """
        gait = network.gait
        if gait.name == wanted.name:
            return network, x
        if inhibition.at_rest:
            new = self.network(wanted.scaled(gait.cadence_scale))
            rest = new.settled(turned(x, wanted.phases - gait.phases), r, inhibition)
            return (network, x) if rest is None else (new, rest)
        if inhibition.requested or isinstance(gait, BlendedGait):
            return network, x
        v_x, v_y, gamma = r.tolist()
        speed = wanted.limiting_speed((v_x, v_y, gamma), self.scale)
        most = (wanted.highest(self.scale) if self.choice.auto_gait
                else changing_speed(gait, wanted, self.scale))
        if speed > HASTE * self.scale.speed(most):
            return network, x
        transition = self.gaits.transition(self.gaits.named(gait.name), wanted)
        return self.network(transition.at(0.0, 0.0).scaled(gait.cadence_scale)), x
