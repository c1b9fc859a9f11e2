# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the controllers take for true where nothing is felt: the plan, but no ground in a gap.

A leg whose joints are not known is on its path: on a flat floor the joints follow their targets
within hundredths of a radian, while angles that were true once are wrong after a tenth of a
second. A robot that feels neither joints nor its IMU moves as the reference has it.

A foot that is to stand and hangs in a gap bears nothing, whatever its joints are told. Where its
share of the wrench is missing, the body sinks and rolls onto it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dmp_cpg_ros.core.balance.virtual_model import EQUAL, distribute
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.transformation.foot_path import FootPath


def as_planned(state: RobotState, legs: Sequence[LegKinematics], footholds: Sequence[Triple],
               reference: Triple, omegas: Sequence[float], duty: float,
               positions: Sequence[float]) -> RobotState:
    """State with the plan in place of what is not felt.

    Parameters
    ----------
    state : RobotState
        With ``felt_legs``.
    legs : sequence of LegKinematics
        Of the four legs.
    footholds : sequence of four tuples of float
        At mid-stance, in ``base_link`` [m].
    reference : tuple of float
        v_x, v_y [m/s], γ [rad/s].
    omegas : sequence of four floats
        Rates of the legs' cycles [rad/s].
    duty : float
        Share of stance.
    positions : sequence of four floats
        In the cycle, 0 at mid-swing, ±1/2 at mid-stance.

    Returns
    -------
    RobotState
        Joints of unfelt legs on the feet's paths, swings left level; velocity and turn rate of the
        reference where nothing at all is felt.
    """
    angles = state.joint_position.copy()
    for i, felt in enumerate(state.felt_legs or ()):
        if not felt:
            path = FootPath(footholds[i], *reference, omegas[i], duty, 0.0)
            angles[3 * i:3 * i + 3] = legs[i].angles(path.at(positions[i])[0])
    if not state.feels_nothing:
        return replace_unchecked(state, joint_position=angles)
    v_x, v_y, gamma = reference
    return replace_unchecked(
        state, joint_position=angles, base_velocity_in_base=np.array((v_x, v_y, 0.0)),
        base_rate_in_base=np.array((0.0, 0.0, gamma)))


def borne_by_others(force: Triple, moment: Triple, feet: Sequence[Triple], load: Sequence[float],
                    empty: Sequence[bool], friction: float, largest: float,
                    importance: Triple = EQUAL) -> list[Triple]:
    """Forces of the ground on the feet [N]; arguments and forces are those of
    :func:`~dmp_cpg_ros.core.balance.virtual_model.distribute`, but feet that are not ``empty``
    make the wrench alone. A foot in a gap presses on as if it bore: so it finds ground that is
    only lower.
    """
    forces = distribute(force, moment, feet, load, friction, largest, importance)
    if not any(empty):
        return forces
    bears = [0.0 if hangs else share for share, hangs in zip(load, empty, strict=True)]
    alone = distribute(force, moment, feet, bears, friction, largest, importance)
    return [presses if hangs else bearing for presses, bearing, hangs in zip(
        forces, alone, empty, strict=True)]
