# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How far feet give way under the robot's weight.

Some models have soft feet (centimetres), which roll on a smaller radius than their shape says;
where the body's way is told from the joints, that shows as a wrong speed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.robot.leg_reader import Foot, foot_position
from dmp_cpg_ros.robot.mujoco_import import mujoco

BISECTIONS = 30


def rolling_radius(model: mujoco.MjModel, data: mujoco.MjData, base_qpos: int,
                  feet: tuple[Foot, ...]) -> float | None:
    """Distance from the feet's centres to where they touch while the robot stands on them.

    The base is lowered until inverse dynamics at rest finds contact forces that carry the weight.
    MuJoCo's contact point, at which friction acts, is half as deep in the ground as the foot.

    Parameters
    ----------
    model, data
        MuJoCo's, the joints in the home pose; the base is moved.
    base_qpos : int
        Where the base's position is in ``qpos``.
    feet : tuple of Foot
        The feet.

    Returns
    -------
    float or None
        [m]; None where the feet have no contact sphere, or sink in to their centres.
    """
    radius = float(np.mean([foot.radius for foot in feet]))
    if radius == 0.0:
        return None
    body = int(model.body_rootid[feet[0].body])
    weight = -float(model.body_subtreemass[body] * model.opt.gravity[2])
    data.qvel[:], data.qacc[:] = 0.0, 0.0

    def carried(centre: float) -> float:
        mujoco.mj_kinematics(model, data)
        heights = [float(foot_position(data, foot)[2]) for foot in feet]
        data.qpos[base_qpos + 2] += centre - np.mean(heights)
        mujoco.mj_inverse(model, data)
        return _normal_force(model, data)

    low, high = 0.0, radius
    if not carried(low) > weight > carried(high):
        return None
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if carried(middle) > weight else (low, middle)
    return 0.5 * (radius + high)


def _normal_force(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Sum of the normal forces of all contacts [N]."""
    wrench: NDArray[np.float64] = np.zeros(6)
    total = 0.0
    for i in range(data.ncon):
        mujoco.mj_contactForce(model, data, i, wrench)
        total += float(wrench[0])
    return total
