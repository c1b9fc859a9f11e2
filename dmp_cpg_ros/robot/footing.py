# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Planes under the feet on ground that rises and falls.

MuJoCo's height field is a heap of upright prisms, and the walls between them count as ground: a
foot whose centre sinks in below the surface, as it does on the floor when it comes down at 3 m/s,
is held between two of them by ten times the robot's weight. So feet stand on planes that touch
the surface below them, with contacts as on the floor; all else stands on the height field.
"""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.grounds import Surface
from dmp_cpg_ros.robot.model_loader import FOOTINGS, TERRAIN
from dmp_cpg_ros.robot.model_parts import ModelIds, foot_position
from dmp_cpg_ros.robot.mujoco_import import mujoco

BESIDE = 0.01
"""Distance of the places from which the slope of the ground is told [m]: over an edge it turns."""

DOWN = -1e3
"""Height of the planes of feet that are not over the surface [m]."""

_AROUND = BESIDE * np.array(((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)))


class Footing:
    """What the four feet stand on.

    Parameters
    ----------
    model : mujoco.MjModel
        Of a world with a surface; what may touch what is changed.
    ids : ModelIds
        Its feet.
    surface : Surface
        The ground.
    """

    def __init__(self, model: mujoco.MjModel, ids: ModelIds, surface: Surface) -> None:
        self._feet, self._surface = ids.feet, surface
        self._mocap = model.body_mocapid[[model.body(name).id for name in FOOTINGS]]
        _share(model, ids)

    def follow(self, data: mujoco.MjData) -> None:
        """Put the planes below the feet where they are, after mj_kinematics."""
        places = np.array([foot_position(data, foot) for foot in self._feet])
        x, y = (places[:, None, :2] + _AROUND).transpose(2, 1, 0)
        here, ahead, behind, left, right = self._surface.at(x, y, np.nan)
        normal = np.array((behind - ahead, right - left, np.full(len(here), 2.0 * BESIDE))).T
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        over = np.isfinite(normal).all(axis=1)
        for i, at in enumerate(self._mocap.tolist()):
            data.mocap_pos[at] = (*places[i, :2], here[i] if over[i] else DOWN)
            data.mocap_quat[at] = _upright_along(normal[i]) if over[i] else (1.0, 0.0, 0.0, 0.0)


def _upright_along(normal: Array) -> Array:
    """Quaternion (w, x, y, z) of the shortest turn from z to a normal above the horizon."""
    turn = np.array((1.0 + normal[2], -normal[1], normal[0], 0.0))
    return turn / np.linalg.norm(turn)


def _share(model: mujoco.MjModel, ids: ModelIds) -> None:
    """Let each foot touch its own plane instead of the height field, if five bits are free."""
    terrain, con, aff = model.geom(TERRAIN).id, model.geom_contype, model.geom_conaffinity
    robot = model.body_rootid[model.geom_bodyid] == model.body_rootid[ids.base]
    used = int(np.bitwise_or.reduce(con[robot] | aff[robot]))
    free = [1 << bit for bit in range(31) if not used >> bit & 1]
    if len(free) < 5:
        return
    on_it = robot & ((con & aff[terrain] | con[terrain] & aff) != 0)
    for foot, name, bit in zip(ids.feet, FOOTINGS, free, strict=False):
        aff[model.geom(name).id] = bit
        of_foot = [geom for geom in foot.geoms if on_it[geom]]
        con[of_foot] |= bit
        on_it[of_foot] = False
    con[on_it] |= free[4]
    con[terrain], aff[terrain] = 0, free[4]
    for body in range(model.nbody):
        of_body = model.geom_bodyid == body
        model.body_contype[body] = np.bitwise_or.reduce(con[of_body], initial=0)
        model.body_conaffinity[body] = np.bitwise_or.reduce(aff[of_body], initial=0)
