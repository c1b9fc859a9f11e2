# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A network whose gait and parameters change while it runs: the state stays, nothing jumps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters, chosen_gait
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.gait_networks import GaitNetworks
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitChangeParameters

Array = NDArray[np.float64]

CADENCE_RATE = 0.5
"""Rate at which the factor on the cadence moves to a new value [1/s].

A foot in stance stands where its phase and the cadence put it: v Δc/f from its foothold. A jump of
the cadence would be a jump of the feet.
"""


def approached(cadence_scale: float, wanted: float, dt: float) -> float:
    """Factor on the cadence a time dt [s] later, on its way to the one that is wanted."""
    most = CADENCE_RATE * dt
    if abs(wanted - cadence_scale) <= most:
        return wanted
    return cadence_scale + (most if wanted > cadence_scale else -most)


class RunningNetwork:
    """The network that acts, and its way to the gait and parameters that were asked for last.

    Couplings and oscillators take new parameters at once: they enter ẋ and leave x as it is. The
    factor on the cadence moves at ``CADENCE_RATE`` from one value to the other, never beyond. A
    gait changes as :class:`~dmp_cpg_ros.core.gait.gait_networks.GaitNetworks` says.

    Parameters
    ----------
    networks : GaitNetworks
        Networks of all gaits with the parameters at the start.
    gait : Gait
        At the start, before ``cadence_scale``.
    choice : GaitChoiceParameters, optional
        Automatic choice of the gait; off without.

    Attributes
    ----------
    network : GaitNetwork
        The network that acts.
    cadence_scale : float
        Factor that acts; that of the parameters once it has arrived.
    wanted : Gait
        The gait that was asked for last.
    """

    def __init__(self, networks: GaitNetworks, gait: Gait,
                 choice: GaitChoiceParameters | None = None) -> None:
        """Start at the parameters."""
        self.networks, self.wanted = networks, gait
        self.choice = choice or GaitChoiceParameters()
        self.cadence_scale = networks.parameters.cadence_scale
        self.network: GaitNetwork = networks.of(gait.scaled(self.cadence_scale))

    @property
    def word(self) -> str:
        """Gait that acts, as it travels with the phases."""
        return self.network.gait.word

    @property
    def leading_to(self) -> Gait:
        """The gait that acts, or the one that the present change leads to."""
        gait = self.network.gait
        return gait.transition.after if isinstance(gait, BlendedGait) else gait

    def change(self, parameters: CanonicalParameters,
               change: GaitChangeParameters | None = None) -> None:
        """Take new parameters; from the next step on they act."""
        old = self.networks
        self.networks = GaitNetworks(parameters, old.scale, change or old.change, old.reader)
        self.network = self.networks.of(self.network.gait)

    def want(self, name: str) -> None:
        """Ask for a gait; raises ParameterError with the valid names."""
        self.wanted = self.networks.reader.named(name)

    def begin_tick(self, x: Array, r: Array, inhibition: Inhibition, dt: float) -> Array:
        """Let gait and cadence approach what is asked for.

        Parameters
        ----------
        x : ndarray (4, 2)
            States at the tick before.
        r : ndarray (3,)
            Reference.
        inhibition : Inhibition
            That acts.
        dt : float
            Time since the tick before [s]; 0 at the first.

        Returns
        -------
        ndarray (4, 2)
            The states; turned when the gait changed at rest.
        """
        name = chosen_gait(self.choice, self.wanted.name, r, self.networks.scale)
        if name != self.wanted.name:
            self.want(name)
        self._approach_cadence(dt)
        self.network, x = self.networks.follow(self.network, x, r, self.wanted, inhibition)
        return x

    def advance(self, x: Array, r: Array, inhibition: Inhibition, dt: float,
                feedback: Array | float = 0.0) -> Array:
        """Advance the states, and the network while gaits change.

        Parameters
        ----------
        x, r, inhibition, dt
            As for :meth:`begin_tick`, with the states that it returned.
        feedback : ndarray (4,) or float
            Added to the frequencies [rad/s].

        Returns
        -------
        ndarray (4, 2)
            States now, in the gait of :attr:`network`.
        """
        if dt > 0.0:
            self.network, x = self.network.advance(x, r, inhibition, dt, feedback)
        return x

    def _approach_cadence(self, dt: float) -> None:
        wanted = self.networks.parameters.cadence_scale
        if self.cadence_scale != wanted:
            self.cadence_scale = approached(self.cadence_scale, wanted, dt)
            gait = self.networks.reader.at_cadence(self.network.gait, self.cadence_scale)
            self.network = self.network.with_cadence_of(gait)
