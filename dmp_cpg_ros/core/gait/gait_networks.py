# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Changing the gait: when a change that is wanted begins, and the networks of all gaits.

- While the gait walks freely, a change begins at once and takes its cycles; into a slower gait,
  once the reference has nearly come down to the highest speed of that gait.
- While gaits change, another change waits until the present one has ended; of several that wait
  the last one is taken.
- While a stop is under way, a change in progress pauses and a new one waits: what was predicted
  and bounded for the stop holds for the blend as it stands.
- At rest all feet are on the ground and no leg swings, so the gait that is wanted takes force at
  once: the oscillators are turned to their places in it and to its equilibrium, and the legs,
  whose swing height and speed are zero, stay where they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import turned
from dmp_cpg_ros.core.gait.gait import BodyScale, Gait
from dmp_cpg_ros.core.gait.gait_reader import GaitReader
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork, network_system
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitChangeParameters, GaitInForce
from dmp_cpg_ros.core.gait.transition_network import TransitionNetwork
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]

HASTE = 1.1
"""Share of a gait's highest speed at which a change into it begins. Commands are within the limit
of the gait that is wanted already, so the reference comes down to it; the blend's own limit is for
what is left.
"""


class GaitNetworks:
    """Networks of all gaits of one robot with the same oscillators and coupling.

    Parameters
    ----------
    parameters : CanonicalParameters
        Oscillators and coupling.
    scale : BodyScale
        The robot's lengths.
    change : GaitChangeParameters
        How gaits change.
    reader : GaitReader
        The gaits that are known, and the ways between them.
    """

    def __init__(self, parameters: CanonicalParameters, scale: BodyScale,
                 change: GaitChangeParameters, reader: GaitReader) -> None:
        """Build the network without offsets; the others are built when they are needed."""
        self.parameters, self.scale, self.change = parameters, scale, change
        self.reader = reader
        self._locked = network_system(parameters, np.zeros(len(LEGS)))
        self._networks: dict[str, GaitNetwork] = {}

    def of(self, gait: GaitInForce) -> GaitNetwork:
        """Network of a gait or of a blend, at the cadence that it has."""
        if isinstance(gait, BlendedGait):
            return TransitionNetwork(self.parameters, gait, self.scale, self._locked, self.of,
                                     self.change.gait_change_rate)
        found = self._networks.get(gait.name)
        if found is None:
            found = GaitNetwork(self.parameters, self.reader.named(gait.name), self.scale)
            self._networks[gait.name] = found
        return found.with_cadence_of(gait)

    def follow(self, network: GaitNetwork, x: Array, r: Array, wanted: Gait,
               inhibition: Inhibition) -> tuple[GaitNetwork, Array]:
        """Begin the change to a gait that is wanted, when it is time for it.

        Parameters
        ----------
        network : GaitNetwork
            In force.
        x : ndarray (4, 2)
            States.
        r : ndarray (3,)
            Reference.
        wanted : Gait
            What is wanted, perhaps what is in force.
        inhibition : Inhibition
            That acts at this tick.

        Returns
        -------
        network : GaitNetwork
            In force from now on.
        x : ndarray (4, 2)
            States; turned when the gait changed at rest.
        """
        gait = network.gait
        if gait.name == wanted.name:
            return network, x
        if inhibition.at_rest:
            new = self.of(wanted.scaled(gait.cadence_scale))
            return new, new.settled(turned(x, wanted.phases - gait.phases), r, inhibition)
        if inhibition.requested or isinstance(gait, BlendedGait):
            return network, x
        if self.scale.foot_speed(*r.tolist()) > HASTE * self.scale.speed(wanted.highest_speed):
            return network, x
        transition = self.reader.transition(self.reader.named(gait.name), wanted)
        return self.of(transition.at(0.0, 0.0).scaled(gait.cadence_scale)), x
