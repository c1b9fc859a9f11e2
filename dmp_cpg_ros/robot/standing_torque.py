# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint torques that hold a robot which stands still on its four feet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.robot.joint_actuators import Places
from dmp_cpg_ros.robot.leg_reader import foot_position
from dmp_cpg_ros.robot.model_reader import ModelIds
from dmp_cpg_ros.robot.mujoco_import import mujoco


def standing_torque(model: mujoco.MjModel, data: mujoco.MjData, ids: ModelIds,
                    dof: Places) -> NDArray[np.float64]:
    """Return the torques of statics, τ = h(q) − Σ J_iᵀ f_i, with vertical foot forces f_i.

    The forces carry the weight and have no moment about the centre of mass; of all such forces
    those of least norm are taken.

    Parameters
    ----------
    model, data
        MuJoCo's, after mj_forward, at rest.
    ids : ModelIds
        Base and feet.
    dof : ndarray (12,) or slice
        Degrees of freedom of the joints.

    Returns
    -------
    ndarray (12,)
        [N m].
    """
    places = [foot_position(data, foot) for foot in ids.feet]
    com = data.subtree_com[ids.base]
    weight = -model.body_subtreemass[ids.base] * model.opt.gravity[2]
    arms = np.array(places) - com
    balance = np.array([np.ones(4), arms[:, 0], arms[:, 1]])
    force = np.linalg.lstsq(balance, np.array([weight, 0.0, 0.0]), rcond=None)[0]
    torque: NDArray[np.float64] = data.qfrc_bias.copy()
    J = np.zeros((3, model.nv))
    for foot, place, f in zip(ids.feet, places, force, strict=True):
        mujoco.mj_jac(model, data, J, None, place, foot.body)
        torque -= J[2] * f
    at_joints: NDArray[np.float64] = torque[dof]
    return at_joints
