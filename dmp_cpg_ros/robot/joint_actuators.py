# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint torques in MuJoCo: how they are applied, and those that hold a standing robot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.robot.leg_reader import ModelIds, actuator_of, foot_position, motor_ratio
from dmp_cpg_ros.robot.mujoco_import import mujoco

Places = slice | NDArray[np.integer[Any]]
"""Where some values are in an array."""


def as_slice(places: NDArray[np.integer[Any]]) -> Places:
    """Slice of consecutive places, which reads and writes at a fraction of the price of a list of
    them; of others the list itself.
    """
    first = int(places[0])
    consecutive = np.array_equal(places, np.arange(first, first + len(places)))
    return slice(first, first + len(places)) if consecutive else places


class JointActuators:
    """Applies torques to twelve joints.

    When every joint has a plain motor the motors get the torques. Otherwise all torques are
    applied to the joints themselves, and the model's own actuators of these joints (position
    servos, say) are switched off in ``model``.
    """

    def __init__(self, model: mujoco.MjModel, joints: NDArray[np.int64]) -> None:
        found = (actuator_of(model, int(joint)) for joint in joints)
        actuators = [actuator for actuator in found if actuator is not None]
        ratios = np.array([motor_ratio(model, actuator) for actuator in actuators])
        self._through_motors = len(actuators) == len(joints) and bool(ratios.all())
        if self._through_motors:
            self._index, self._per_torque = as_slice(np.array(actuators)), 1.0 / ratios
            return
        self._index = as_slice(model.jnt_dofadr[joints])
        model.actuator_gainprm[actuators] = model.actuator_biasprm[actuators] = 0.0

    def apply(self, data: mujoco.MjData, torque: NDArray[np.float64]) -> None:
        """Set the torques (12,) [N m] of the coming physics step."""
        if self._through_motors:
            data.ctrl[self._index] = torque * self._per_torque
        else:
            data.qfrc_applied[self._index] = torque


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
    places = np.array([foot_position(data, foot) for foot in ids.feet])
    arms = places - data.subtree_com[ids.base]
    weight = -model.body_subtreemass[ids.base] * model.opt.gravity[2]
    balance = np.array([np.ones(4), arms[:, 0], arms[:, 1]])
    force = np.linalg.lstsq(balance, np.array([weight, 0.0, 0.0]), rcond=None)[0]
    torque: NDArray[np.float64] = data.qfrc_bias.copy()
    J = np.zeros((3, model.nv))
    for foot, place, f in zip(ids.feet, places, force, strict=True):
        mujoco.mj_jac(model, data, J, None, place, foot.body)
        torque -= J[2] * f
    return torque[dof]
