# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How wide the lower legs of a robot's model are, where one can kick another."""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.gait.lags import SIDES
from dmp_cpg_ros.robot.model_parts import ModelIds, touching_geoms
from dmp_cpg_ros.robot.mujoco_import import mujoco


def leg_widths(model: mujoco.MjModel, standing: mujoco.MjData, ids: ModelIds) -> list[float]:
    """Widths of the lower legs across the body, by the shapes that can touch.

    Parameters
    ----------
    model, standing
        MuJoCo's, the robot as it stands.
    ids : ModelIds
        Joints and feet.

    Returns
    -------
    list of four floats
        [m]; 0 for legs that pass through the other one of their side.
    """
    shanks = model.jnt_bodyid[ids.joints[2::3]]
    parts = [touching_geoms(model, {int(shank), foot.body})[0]
             for shank, foot in zip(shanks, ids.feet, strict=True)]
    widths = [0.0] * len(parts)
    for side in SIDES:
        if any(_touch(model, one, other) for one in parts[side[0]] for other in parts[side[1]]):
            for leg in side:
                widths[leg] = _width(model, standing, parts[leg])
    return widths


def _touch(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Whether two shapes can touch each other."""
    bodies = sorted((int(model.geom_bodyid[one]), int(model.geom_bodyid[other])))
    return bool((model.geom_contype[one] & model.geom_conaffinity[other])
                | (model.geom_contype[other] & model.geom_conaffinity[one])) and (
        (bodies[0] << 16) + bodies[1] not in model.exclude_signature)


def _width(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> float:
    """Extent of shapes across the body [m]."""
    left, right = -np.inf, np.inf
    for geom in geoms:
        across = data.geom_xmat[geom].reshape(3, 3)[1]
        middle = data.geom_xpos[geom, 1] + across @ model.geom_aabb[geom, :3]
        half = np.abs(across) @ model.geom_aabb[geom, 3:]
        left, right = max(left, middle + half), min(right, middle - half)
    return float(left - right)
