# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sparse inhibition: the switched dynamic g(x_i) = α_i (x_{i,d} − x_i) and what its parameters
are (paper, Section 5).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.robot_model.state import LEGS

AUTO = 'auto'
"""In place of legs: at each stop the one whose oscillator is the first to come to [1, 0]."""


@dataclass(frozen=True)
class InhibitionParameters(Parameters):
    """Parameters of the inhibition g(x_i): gain, region, legs, and when it is armed."""

    inhibition_gain: float = parameter(400.0, 'gain k_inh of the inhibition', 0.0, 1e5, unit='1/s')
    region_radius: float = parameter(
        0.3, 'radius r0 of the region C in which inhibition is switched on', 1e-3, 2.0)
    inhibited_legs: tuple[str, ...] = parameter(
        ('fl',), 'legs whose oscillators are inhibited; auto: at each stop the leg that is the '
        'first to come to its phase 0', choices=(*LEGS, AUTO))
    capture_speed: float = parameter(
        0.1, 'reference foot speed below which inhibition is armed; without push_recovery never '
        'above 0.2 sqrt(g l)', 0.0, 10.0, unit='m/s')
    start_inhibited: bool = parameter(
        True, 'whether the gait starts at rest and waits to be resumed')
    auto_inhibit: bool = parameter(
        True, 'whether a zero command stops the gait and a new command resumes it')
    auto_delay: float = parameter(
        1.0, 'time of zero command after which auto_inhibit stops the gait', 0.0, 60.0, unit='s')
    push_recovery: bool = parameter(
        True, 'whether a push that standing legs cannot bear releases the gait from a stop until '
        'the robot stands again')
    caution: bool = parameter(
        True, 'whether a walking robot that is disturbed follows less of its command')
    block_stop: bool = parameter(
        True, 'whether a robot that makes no way although it walks waits for its feet, and stops')
    step_timing: bool = parameter(
        True, 'whether a robot that is pushed steps faster until it has its balance again')

    def __post_init__(self) -> None:
        """Validate; at least one leg, none twice."""
        super().__post_init__()
        legs = self.inhibited_legs
        if not legs or len(set(legs)) != len(legs) or (self.auto and len(legs) > 1):
            raise ParameterError(
                f'inhibited_legs = {list(legs)} must name one or more of '
                f'{", ".join(LEGS)}, none twice, or be [{AUTO}]')

    @property
    def auto(self) -> bool:
        """Whether the leg is chosen at each stop."""
        return AUTO in self.inhibited_legs

    @cached_property
    def armed_gains(self) -> Array:
        """Gains α_i of the four legs when inhibition is armed, ndarray (4,) [1/s]; with ``auto``
        none, see :meth:`gains_on`.
        """
        return np.array(
            [self.inhibition_gain if leg in self.inhibited_legs else 0.0 for leg in LEGS])

    def gains_on(self, leg: int) -> Array:
        """Gains when inhibition is armed and, with ``auto``, a leg is chosen, ndarray (4,)
        [1/s].
        """
        if not self.auto:
            return self.armed_gains
        return np.where(np.arange(len(LEGS)) == leg, self.inhibition_gain, 0.0)


@made_often
@dataclass(frozen=True)
class Inhibition:
    """The inhibition that acts on the canonical system during one tick.

    Attributes
    ----------
    requested : bool
        Whether the gait is to stop; the reference is brought to zero.
    gains : ndarray (N,)
        Armed gains α_i ≥ 0, zero where not armed [1/s].
    region_radius : float
        r0 of the regions C_i = {|x_{i,d} − x_i| ≤ r0}.
    at_rest : bool
        Whether oscillators, reference and swings have come to rest.
    automatic : bool
        Whether a command ends the stop, and not only the service.
    opposite : bool
        Whether oscillators at rest are turned by half a cycle before they run: on the spot the two
        sides of the body swap, and no leg moves.
    rest_phase : float
        Phase of fl at rest [rad]: every x_{i,d} is the place of leg i then. The field is the same
        in all directions, so that what holds for one phase holds for each.
    share : float
        Share of the command that the reference follows, in (0, 1].
    quickness : float
        Factor on the cadence, at least 1.
    """

    requested: bool
    gains: Array
    region_radius: float
    at_rest: bool = False
    automatic: bool = True
    opposite: bool = False
    rest_phase: float = 0.0
    share: float = 1.0
    quickness: float = 1.0

    def differs(self, other: Inhibition) -> bool:
        """Whether another one stops the gait in another way, or not: share and quickness, which
        change all the time, are left aside.
        """
        return self is not other and (
            (self.requested, self.at_rest, self.automatic, self.opposite)
            != (other.requested, other.at_rest, other.automatic, other.opposite)
            or not self.holds_as(other))

    def holds_as(self, other: Inhibition) -> bool:
        """Whether another one holds the same legs in the same places."""
        return ((self.region_radius, self.rest_phase, self.gains.tobytes())
                == (other.region_radius, other.rest_phase, other.gains.tobytes()))

    def acting_gains(self, x: Array, target: Array) -> Array:
        """Gains that act at a state: α_i inside C_i and zero outside.

        In a stop the nodes of the largest gain act together or not at all: one of several that is
        caught alone need not be able to hold the others. (In the paper each is switched by its own
        region; for one node that is the same.)

        Parameters
        ----------
        x, target : ndarray (N, 2)
            States x_i and x_{i,d}.

        Returns
        -------
        ndarray (N,)
        """
        if not any(self.gains.tolist()):
            return self.gains
        error = x - target
        inside = error[:, 0] * error[:, 0] + error[:, 1] * error[:, 1] <= self.region_radius**2
        if self.requested:
            strongest = self.gains == self.gains.max()
            if not inside[strongest].all():
                inside = inside & ~strongest
        return np.where(inside, self.gains, 0.0)


def joined_gains(gains: Array, others: Array, held: bool) -> Array:
    """The larger of two gains on each node, ndarray (N,) [1/s].

    Nodes of the largest gain act together or not at all, so that no other may become one of those
    that hold the network now: it need not be in its region.

    Parameters
    ----------
    gains, others : ndarray (N,)
        Gains that act, and those that join them [1/s].
    held : bool
        Whether the first hold the network.
    """
    joined, holding = np.maximum(gains, others), gains == gains.max()
    if held and gains.any():
        largest = joined == joined.max()
        if (largest & holding).any():  # else those that join act together, and not with these
            joined = np.where(largest & ~holding, np.nextafter(joined.max(), 0.0), joined)
    return joined


def initial_inhibition(parameters: InhibitionParameters, leg: int = 0) -> Inhibition:
    """Inhibition before the first request: armed when the gait starts at rest, on a leg where it
    is chosen.
    """
    stopped = parameters.start_inhibited
    return Inhibition(
        stopped, parameters.gains_on(leg) * float(stopped), parameters.region_radius, stopped)
