# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A network whose parameters change while it runs: the state stays, nothing jumps."""

from __future__ import annotations

from dmp_cpg_ros.core.gait import BodyScale, Gait
from dmp_cpg_ros.core.gait_network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait_word import gait_word

CADENCE_RATE = 0.5
"""Rate at which the factor on the cadence moves to a new value [1/s].

A foot in stance stands where its phase and the cadence put it: v Δc/f from its foothold. A jump of
the cadence would be a jump of the feet.
"""


class RunningNetwork:
    """The network that acts, and its way to the parameters that were asked for last.

    Couplings and oscillators take new parameters at once: they enter ẋ and leave x as it is. The
    factor on the cadence moves at ``CADENCE_RATE`` from one value to the other, never beyond.

    Parameters
    ----------
    parameters : CanonicalParameters
        At the start.
    gait : Gait
        Phase offsets and cadence, before ``cadence_scale``.
    scale : BodyScale
        The robot's lengths.

    Attributes
    ----------
    network : GaitNetwork
        The network that acts.
    cadence_scale : float
        Factor that acts; that of the parameters once it has arrived.
    """

    def __init__(self, parameters: CanonicalParameters, gait: Gait, scale: BodyScale) -> None:
        """Start at the parameters."""
        self._gait = gait
        self.network = GaitNetwork(parameters, gait, scale)
        self.cadence_scale = parameters.cadence_scale

    @property
    def word(self) -> str:
        """Gait that acts, as it travels with the phases."""
        return gait_word(self._gait.name, self.cadence_scale)

    def change(self, parameters: CanonicalParameters) -> None:
        """Take new parameters; from the next step on they act."""
        network = GaitNetwork(parameters, self._gait, self.network.scale)
        if parameters.cadence_scale != self.cadence_scale:
            network = network.with_cadence_of(self.network.gait)
        self.network = network

    def advance(self, dt: float) -> GaitNetwork:
        """Let the cadence approach its factor for a time [s]; returns the network that acts."""
        wanted = self.network.parameters.cadence_scale
        if self.cadence_scale != wanted:
            most = CADENCE_RATE * dt
            change = min(max(wanted - self.cadence_scale, -most), most)
            arrived = abs(wanted - self.cadence_scale) <= most
            self.cadence_scale = wanted if arrived else self.cadence_scale + change
            self.network = self.network.with_cadence_of(self._gait.scaled(self.cadence_scale))
        return self.network
