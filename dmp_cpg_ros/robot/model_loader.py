# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From an MJCF file to a compiled model that stands on a floor and steps often enough, with a
world of :mod:`dmp_cpg_ros.core.robot_model.world` under it.
"""

from __future__ import annotations

import logging
import warnings
from pathlib import Path

import numpy as np

from dmp_cpg_ros.core.errors import MissingFileError, ParameterError
from dmp_cpg_ros.core.robot_model.grounds import Surface, World
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.files import readable
from dmp_cpg_ros.robot.model_text import check_text
from dmp_cpg_ros.robot.mujoco_import import mujoco

_log = logging.getLogger(__name__)

LONGEST_PHYSICS_STEP = 0.001  # [s] the joint drive runs at 1 kHz or faster

USUAL_IMPRATIO = 100.0
"""Of a model that says nothing, with elliptic cones. MuJoCo's defaults (pyramids and 1) let
standing feet creep under their load, and leg odometry takes them for still (MuJoCo's
documentation, "Preventing slip"; MuJoCo Menagerie's quadrupeds have this value)."""

LEAST_ITERATIONS, LEAST_SEARCHES = 100, 50
"""Of MuJoCo's solver, its defaults: it ends sooner where it has converged. Models that are made
for accelerators have one and five, with which elliptic cones let feet slide.
"""

_PLANE = mujoco.mjtGeom.mjGEOM_PLANE
_SKY = mujoco.mjtTexture.mjTEXTURE_SKYBOX
_LOW, _HIGH = np.array((0.52, 0.56, 0.52, 1.0)), np.array((0.80, 0.76, 0.66, 1.0))
_EVERY = 0x7FFFFFFF
_CONTACT = ('friction', 'solref', 'solimp', 'condim', 'contype', 'conaffinity', 'priority',
            'solmix', 'margin', 'gap')

TERRAIN = 'terrain'
"""Height field of a world with a surface."""

FOOTINGS = tuple(f'{TERRAIN}_below_{leg}' for leg in LEGS)
"""Bodies with planes that are not seen and touch nothing until feet are put on them."""


def load_model(path: Path, base: str, world: World | None = None) -> mujoco.MjModel:
    """Compile a model for use as a robot.

    A floor is added when the world body has neither plane nor height field, a light that follows
    the base when there is no light at all, and a sky when there is none. A physics step longer
    than 1 ms is shortened to 1 ms, the rate of the joint drive. Friction cones and ``impratio``
    that are both MuJoCo's defaults become elliptic and ``USUAL_IMPRATIO``. The solver has
    ``LEAST_ITERATIONS`` at least.

    Parameters
    ----------
    path : Path
        MJCF file.
    base : str
        Body that the light follows.
    world : World, optional
        What it walks on; without, the model's own floor.

    Raises
    ------
    MissingFileError
        If there is no such file.
    ParameterError
        If MuJoCo cannot compile it, or as :func:`~dmp_cpg_ros.robot.model_text.check_text`.
    """
    if not readable(path).exists():
        raise MissingFileError(f"model '{path}' does not exist")
    check_text(path)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        if not any(geom.type in (_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
                   for geom in spec.worldbody.geoms):
            _add_floor(spec)
        if world is not None:
            _add_world(spec, world)
        if not spec.lights and (body := spec.body(base)) is not None:
            body.add_light(name='added_light', mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM,
                           type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, pos=[-0.5, -0.4, 2.5],
                           dir=[0.2, 0.16, -1.0])
        if not any(texture.type == _SKY for texture in spec.textures):
            spec.add_texture(name='added_sky', type=_SKY, width=256, height=1536,
                             builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
                             rgb1=[0.36, 0.56, 0.80], rgb2=[0.86, 0.92, 0.97])
        with warnings.catch_warnings(record=True) as told:
            model = spec.compile()
        for warning in told:
            _log.warning("model '%s': %s", path, warning.message)
    except (ValueError, mujoco.FatalError) as error:
        raise ParameterError(f"model '{path}' cannot be compiled: {error}") from error
    if world is not None and world.friction > 0.0:  # MuJoCo takes the larger of two geoms'
        model.geom_friction[:, 0] = model.pair_friction[:, :2] = world.friction
    model.opt.timestep = min(model.opt.timestep, LONGEST_PHYSICS_STEP)
    if model.opt.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL and model.opt.impratio == 1.0:
        model.opt.cone, model.opt.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, USUAL_IMPRATIO
    model.opt.iterations = max(model.opt.iterations, LEAST_ITERATIONS)
    model.opt.ls_iterations = max(model.opt.ls_iterations, LEAST_SEARCHES)
    return model


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.add_texture(name='added_floor', type=mujoco.mjtTexture.mjTEXTURE_2D,
                     builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER, rgb1=[0.80, 0.82, 0.84],
                     rgb2=[0.70, 0.73, 0.76], width=512, height=512)
    material = spec.add_material(name='added_floor', texrepeat=[2, 2], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = 'added_floor'
    # Every bit: what the model's defaults say is for its own shapes, and may be that none touch.
    spec.worldbody.add_geom(name='added_floor', type=_PLANE, size=[0.0, 0.0, 0.25],
                            material='added_floor', contype=_EVERY, conaffinity=_EVERY)


def _add_world(spec: mujoco.MjSpec, world: World) -> None:
    """Move the floor to its height, and add what stands on it with the floor's contacts."""
    floor = next((geom for geom in spec.worldbody.geoms if geom.type == _PLANE), None)
    if floor is not None:
        floor.pos = [floor.pos[0], floor.pos[1], floor.pos[2] + world.floor]
    surface = world.surface()
    if surface is not None:
        _add_surface(spec, surface, floor)
    boxes = world.boxes()
    tops = np.array([box.centre[2] + box.half_size[2] for box in boxes])
    for i, box in enumerate(boxes):
        share, half = (tops[i] - tops.min()) / max(np.ptp(tops), 1e-9), 0.5 * box.pitch
        geom = spec.worldbody.add_geom(
            name=f'terrain_{i}', type=mujoco.mjtGeom.mjGEOM_BOX, pos=list(box.centre),
            size=list(box.half_size), quat=[np.cos(half), 0.0, np.sin(half), 0.0],
            rgba=_LOW + share * (_HIGH - _LOW))
        for part in _CONTACT if floor is not None else ():
            setattr(geom, part, getattr(floor, part))


def _add_surface(spec: mujoco.MjSpec, surface: Surface, floor: mujoco.MjsGeom | None) -> None:
    """Add ground that is not made of boxes."""
    (x_0, x_1), (y_0, y_1), height = surface
    low, high = float(height.min()), float(height.max())
    # MuJoCo scales what is given to [0, 1]
    spec.add_hfield(name=TERRAIN, nrow=height.shape[0], ncol=height.shape[1],
                    size=[0.5 * (x_1 - x_0), 0.5 * (y_1 - y_0), high - low, 0.1],
                    userdata=((height - low) / (high - low)).ravel().tolist())
    added = [spec.worldbody.add_geom(
        name=TERRAIN, type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname=TERRAIN, rgba=_LOW,
        pos=[0.5 * (x_0 + x_1), 0.5 * (y_0 + y_1), low])]
    for name in FOOTINGS:
        body = spec.worldbody.add_body(name=name, mocap=True, pos=[0.0, 0.0, low])
        added.append(body.add_geom(name=name, type=_PLANE, size=[0.0, 0.0, 0.25],
                                   rgba=[0.0, 0.0, 0.0, 0.0]))
    for geom in added:
        for part in _CONTACT if floor is not None else ():
            setattr(geom, part, getattr(floor, part))
    for geom in added[1:]:
        geom.contype = geom.conaffinity = 0
