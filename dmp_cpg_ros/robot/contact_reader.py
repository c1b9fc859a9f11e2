# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Contact forces between the robot's parts and the ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.robot.leg_reader import ModelIds, foot_position
from dmp_cpg_ros.robot.mujoco_import import mujoco

_FOOT, _SHANK, _BASE, _OUTSIDE, _OTHER = range(5)

NEAR_FOOT = 1.5  # foot radii from the foot's centre within which the lower leg's shell is its foot


class ContactReader:
    """Reads contacts between the robot and its surroundings from MuJoCo's data."""

    def __init__(self, model: mujoco.MjModel, ids: ModelIds) -> None:
        self._model, self._feet, self._wrench = model, ids.feet, np.zeros(6)
        kind, leg = np.full(model.ngeom, _OTHER), np.zeros(model.ngeom, dtype=int)
        kind[model.body_rootid[model.geom_bodyid] != model.body_rootid[ids.base]] = _OUTSIDE
        kind[model.geom_bodyid == ids.base] = _BASE
        shanks = model.jnt_bodyid[ids.joints[2::3]]
        for i, (foot, shank) in enumerate(zip(ids.feet, shanks, strict=True)):
            lower_leg = np.isin(model.geom_bodyid, (shank, foot.body))
            kind[lower_leg], leg[lower_leg] = _SHANK, i
            kind[list(foot.geoms)] = _FOOT
        self._kind, self._leg = kind.tolist(), leg.tolist()

    def foot_force(self, data: mujoco.MjData) -> NDArray[np.float64]:
        """Return the normal force of each foot (4,), summed over its contacts [N].

        Some models wrap the lower leg in a mesh that reaches around the foot; what touches so near
        the foot's centre counts as the foot.
        """
        force = [0.0, 0.0, 0.0, 0.0]
        for i, (geom, other) in enumerate(data.contact.geom.tolist()):
            if self._kind[geom] == _OUTSIDE:
                geom, other = other, geom
            if self._kind[other] != _OUTSIDE or self._kind[geom] not in (_FOOT, _SHANK):
                continue
            leg = self._leg[geom]
            if self._kind[geom] == _FOOT or np.linalg.norm(
                    data.contact.pos[i] - foot_position(data, self._feet[leg])
                    ) < NEAR_FOOT * self._feet[leg].radius:
                mujoco.mj_contactForce(self._model, data, i, self._wrench)
                force[leg] += float(self._wrench[0])
        return np.array(force)

    def base_touches(self, data: mujoco.MjData) -> bool:
        """Return whether the base body touches the surroundings."""
        return any({self._kind[first], self._kind[second]} == {_BASE, _OUTSIDE}
                   for first, second in data.contact.geom.tolist())
