# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the legs come to rest, and that all feet are then on the ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.finding import PROVED
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.supervisor import REST_ACTIVITY
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.leg import LegParameters

Array = NDArray[np.float64]

GROUND = 0.01
"""Height of a foot that counts as on the ground, as a fraction of the standing height."""

SMALLEST_RADIUS = 0.5
"""Radius that every oscillator must keep at rest for its phase to be sound, as a fraction of r."""


def rest_inequalities(network: GaitNetwork, leg: LegParameters,
                      rest: InhibitedEquilibrium | None) -> list[Inequality]:
    """Inequalities (f): feet on the ground and sound phases at the inhibited equilibrium.

    The clearance of a swing is scaled by an activity that vanishes with the phase's speed. At rest
    it is below ``REST_ACTIVITY``, so that a foot whose leg came to rest within its swing hangs
    over the ground by that share of its path's height at most, and sinks on.

    Parameters
    ----------
    network : GaitNetwork
        Gait and oscillators.
    leg : LegParameters
        For the clearance.
    rest : InhibitedEquilibrium or None
        Equilibrium at zero reference; None when there is none.

    Returns
    -------
    list of Inequality
    """
    height = float('inf') if rest is None else max(_heights(network, leg, rest))
    radius = 0.0 if rest is None else float(rest.radius.min()) / network.parameters.radius
    ahead = 'there is no equilibrium' if rest is None else (
        'legs rest ' + ', '.join(f'{np.degrees(a):.1f}' for a in rest.phase_ahead)
        + ' degrees ahead of their places')
    return [
        Inequality('rest_posture', height, GROUND, '', 'highest foot', 'on the ground', PROVED,
                   f'as fractions of the standing height, when rest is declared; {ahead}'),
        Inequality('rest_radius', SMALLEST_RADIUS, radius, '', 'sound radius',
                   'smallest |x_i|/r at rest', PROVED,
                   'every oscillator at rest is far from the origin, so that its phase is sound')]


def _heights(network: GaitNetwork, leg: LegParameters, rest: InhibitedEquilibrium) -> list[float]:
    """Heights of the feet at rest, as fractions of the standing height."""
    duty = network.gait.duty(0.0, network.scale)
    path = FootPath((0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, duty, leg.clearance * REST_ACTIVITY)
    positions = network.gait.cycle_position(phase(rest.state))
    return [float(path.at(float(position))[0][2]) for position in positions]
