# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint torques in MuJoCo: through the model's motors, else as generalised forces."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.robot.leg_reader import actuator_of, is_motor, motor_ratio
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
        actuators = [actuator_of(model, int(joint)) for joint in joints]
        motors = [a for a in actuators if a is not None and is_motor(model, a)
                  and motor_ratio(model, a) != 0.0]
        self._through_motors = len(motors) == len(joints)
        if self._through_motors:
            self._index = as_slice(np.array(motors))
            self._per_torque = 1.0 / np.array([motor_ratio(model, a) for a in motors])
            return
        self._index = as_slice(model.jnt_dofadr[joints])
        for actuator in actuators:
            if actuator is not None:
                model.actuator_gainprm[actuator] = 0.0
                model.actuator_biasprm[actuator] = 0.0

    def apply(self, data: mujoco.MjData, torque: NDArray[np.float64]) -> None:
        """Set the torques (12,) [N m] of the coming physics step."""
        if self._through_motors:
            data.ctrl[self._index] = torque * self._per_torque
        else:
            data.qfrc_applied[self._index] = torque
