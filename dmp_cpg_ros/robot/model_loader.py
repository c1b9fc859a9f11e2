# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From an MJCF file to a compiled model that stands on a floor and steps often enough."""

from __future__ import annotations

from pathlib import Path

from dmp_cpg_ros.core.errors import MissingFileError, ParameterError
from dmp_cpg_ros.robot.mujoco_import import mujoco

LONGEST_PHYSICS_STEP = 0.001  # [s] the joint drive runs at 1 kHz or faster


def load_model(path: Path) -> mujoco.MjModel:
    """Compile a model for use as a robot.

    A floor is added when the model has neither plane nor height field outside its robot, and a physics
    step longer than 1 ms is shortened to 1 ms, the rate of the joint drive.

    Parameters
    ----------
    path : Path
        MJCF file.

    Raises
    ------
    MissingFileError
        If there is no such file.
    ParameterError
        If MuJoCo cannot compile it.
    """
    if not path.is_file():
        raise MissingFileError(f"model '{path}' does not exist")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        if not _has_ground(spec):
            _add_floor(spec)
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ParameterError(f"model '{path}' cannot be compiled: {error}") from error
    model.opt.timestep = min(model.opt.timestep, LONGEST_PHYSICS_STEP)
    return model


def _has_ground(spec: mujoco.MjSpec) -> bool:
    ground = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    return any(geom.type in ground for geom in spec.worldbody.geoms)


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.worldbody.add_geom(name='added_floor', type=mujoco.mjtGeom.mjGEOM_PLANE,
                            size=[0.0, 0.0, 0.25], rgba=[0.75, 0.78, 0.80, 1.0])
    spec.worldbody.add_light(pos=[0.0, 0.0, 4.0], dir=[0.2, 0.2, -1.0],
                             type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
