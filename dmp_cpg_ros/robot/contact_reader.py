# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Who touches the ground, and how hard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.robot.model_reader import ModelIds
from dmp_cpg_ros.robot.mujoco_import import mujoco

_OUTSIDE, _BASE, _OTHER = 5, 4, -1  # owners of geoms beside the feet 0..3


class ContactReader:
    """Reads contacts between the robot and its surroundings from MuJoCo's data."""

    def __init__(self, model: mujoco.MjModel, ids: ModelIds) -> None:
        self._model = model
        root = model.body_rootid[ids.base]
        owner = np.full(model.ngeom, _OTHER)
        owner[model.body_rootid[model.geom_bodyid] != root] = _OUTSIDE
        owner[model.geom_bodyid == ids.base] = _BASE
        for i, foot in enumerate(ids.feet):
            owner[list(foot.geoms)] = i
        self._owner: list[int] = owner.tolist()
        self._wrench = np.zeros(6)

    def foot_force(self, data: mujoco.MjData) -> NDArray[np.float64]:
        """Return the normal force of each foot (4,), summed over its contacts [N]."""
        force = [0.0, 0.0, 0.0, 0.0]
        for i, (first, second) in enumerate(data.contact.geom.tolist()):
            one, other = self._owner[first], self._owner[second]
            if other == _OUTSIDE:
                one, other = other, one
            if one == _OUTSIDE and 0 <= other < 4:
                mujoco.mj_contactForce(self._model, data, i, self._wrench)
                force[other] += float(self._wrench[0])
        return np.array(force)

    def base_touches(self, data: mujoco.MjData) -> bool:
        """Return whether the base body touches the surroundings."""
        return any({self._owner[first], self._owner[second]} == {_BASE, _OUTSIDE}
                   for first, second in data.contact.geom.tolist())
