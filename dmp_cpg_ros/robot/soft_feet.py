# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""On what radius feet roll, found in a robot's model.

Some models have soft feet (centimetres), or a shank that touches beside its foot; they roll on a
smaller radius than the foot's sphere says. Where the body's way is told from the joints, that
shows as a wrong speed. The base is lowered until inverse dynamics at rest finds contact forces
that carry a load.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.roots import last_that_holds
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.robot.model_parts import ModelIds, foot_position, place_robot
from dmp_cpg_ros.robot.mujoco_import import mujoco

BISECTIONS = 30
"""Of the searches."""

LOADS = (1.0, 2.0)
"""Weights on four feet that stand: with the second each carries what it does in a trot."""

STANCE = (-0.25, -0.125, 0.0, 0.125, 0.25)
"""Places of the feet ahead of the hips, in standing heights, over which the mean is taken: a shank
that leans otherwise may touch with another part.
"""

HARD = 0.05
"""Feet whose radii differ by less than this share count as hard: shanks roll them at up to a tenth
of the speed, of which it is half a percent.
"""

TOUCHING = 1e-6
"""How much lower than just carrying a base is put to read where it touches [m]."""


def standing_radius(model: mujoco.MjModel, data: mujoco.MjData, ids: ModelIds) -> float | None:
    """Distance from the feet's centres to where they touch while the robot stands on them.

    MuJoCo's contact point, at which friction acts, is half as deep in the ground as the foot.

    Parameters
    ----------
    model, data
        MuJoCo's, the joints in the home pose; the base is moved.
    ids : ModelIds
        Base and feet.

    Returns
    -------
    float or None
        [m]; None where the feet have no contact sphere, or sink in to their centres.
    """
    radius = float(np.mean([foot.radius for foot in ids.feet]))
    centre = None if radius == 0.0 else _carrying(model, data, ids, 1.0, radius)
    return None if centre is None else 0.5 * (radius + centre)


def with_rolling_radii(description: RobotDescription, model: mujoco.MjModel, ids: ModelIds
                       ) -> tuple[LegGeometry, ...]:
    """Legs of a robot with the radii of its soft feet under ``LOADS``.

    Parameters
    ----------
    description : RobotDescription
        Of the robot, with the radius of its standing feet.
    model
        MuJoCo's.
    ids : ModelIds
        Base, joints and feet.

    Returns
    -------
    tuple of LegGeometry
        The same where the feet are ``HARD``, or cannot be asked.
    """
    standing = float(np.mean([leg.foot_radius for leg in description.legs]))
    radii = [_levers(description, model, ids, load) for load in LOADS]
    if not np.isfinite(radii).all() or np.abs(np.subtract(radii, standing)).max() < (
            HARD * standing):
        return description.legs
    return tuple(replace(leg, rolling_radius=(radii[0], radii[1])) for leg in description.legs)


def _levers(description: RobotDescription, model: mujoco.MjModel, ids: ModelIds, load: float
            ) -> float:
    """Mean height of the feet's centres over where they touch, over a stance [m]; NaN where they
    do not carry.
    """
    data, levers = mujoco.MjData(model), []
    top = max(foot.radius for foot in ids.feet) + TOUCHING
    for share in STANCE:
        joints = [_reaching(leg, share * description.stance_height, description.stance_height)
                  for leg in description.legs]
        place_robot(model, data, ids, np.zeros(3), (1, 0, 0, 0), np.concatenate(joints))
        centre = _carrying(model, data, ids, load, 2.0 * top, -top)
        if centre is None:
            return float('nan')
        _force(model, data, ids, centre - TOUCHING)
        levers.append(_lever(model, data, ids))
    return float(np.mean(levers))


def _reaching(leg: LegGeometry, ahead: float, height: float) -> Array:
    """Angles of a leg whose foot stands ahead of its hip [m], below a base at a height [m]."""
    kinematics, foot = LegKinematics(leg), leg.hip_in_base + leg.hip_offset
    foot[0] += ahead
    foot[1] = leg.hip_in_base[1] + kinematics.lateral_offset
    foot[2] = leg.foot_radius - height
    return kinematics.inverse(foot)


def _carrying(model: mujoco.MjModel, data: mujoco.MjData, ids: ModelIds, load: float, top: float,
              bottom: float = 0.0) -> float | None:
    """Height of the feet's centres at which they just carry weights [m]; None if it is not
    between two others.
    """
    weight = -load * float(
        model.body_subtreemass[model.body_rootid[ids.base]] * model.opt.gravity[2])
    data.qvel[:] = data.qacc[:] = 0.0

    def carried(centre: float) -> bool:
        return _force(model, data, ids, centre) > weight

    if not carried(bottom) or carried(top):
        return None
    return last_that_holds(lambda centre: not carried(centre), top, bottom, BISECTIONS)


def _force(model: mujoco.MjModel, data: mujoco.MjData, ids: ModelIds, centre: float) -> float:
    """Normal force on a robot at rest whose feet's centres are at a height [m], in all [N]."""
    mujoco.mj_kinematics(model, data)
    heights = [float(foot_position(data, foot)[2]) for foot in ids.feet]
    data.qpos[ids.base_qpos + 2] += centre - np.mean(heights)
    mujoco.mj_inverse(model, data)
    return sum((force for force, _ in _contacts(model, data)), 0.0)


def _lever(model: mujoco.MjModel, data: mujoco.MjData, ids: ModelIds) -> float:
    """Mean height of the feet's centres over their contacts, by force [m]."""
    centres = np.array([foot_position(data, foot) for foot in ids.feet])
    carried = [(force, float(centres[np.argmin(np.linalg.norm(centres - at, axis=1)), 2] - at[2]))
               for force, at in _contacts(model, data)]
    total = sum(force for force, _ in carried)
    return sum(force * height for force, height in carried) / total if total else float('nan')


def _contacts(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[float, Array]]:
    """Normal forces [N] and places (3,) [m] of all contacts."""
    wrench, contacts = np.zeros(6), []
    for i in range(data.ncon):
        mujoco.mj_contactForce(model, data, i, wrench)
        contacts.append((float(wrench[0]), data.contact[i].pos.copy()))
    return contacts
