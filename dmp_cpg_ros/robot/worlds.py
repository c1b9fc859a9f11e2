# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Puts a world of :mod:`dmp_cpg_ros.core.robot_model.world` under any robot's model."""

from __future__ import annotations

from typing import Any

import numpy as np

from dmp_cpg_ros.core.robot_model.world import Box, World
from dmp_cpg_ros.robot.mujoco_import import mujoco

_LOW, _HIGH = np.array((0.52, 0.56, 0.52, 1.0)), np.array((0.80, 0.76, 0.66, 1.0))


def add_world(spec: mujoco.MjSpec, world: World) -> None:
    """Add what stands on the floor, with the floor's contact properties.

    Parameters
    ----------
    spec : mujoco.MjSpec
        A model with a floor, a plane of the world body; the floor is moved to its height.
    world : World
        The world.
    """
    floor = next((geom for geom in spec.worldbody.geoms
                  if geom.type == mujoco.mjtGeom.mjGEOM_PLANE), None)
    if floor is not None:
        floor.pos = [floor.pos[0], floor.pos[1], floor.pos[2] + world.floor]
    boxes = world.boxes()
    tops = np.array([box.centre[2] + box.half_size[2] for box in boxes])
    for i, box in enumerate(boxes):
        share = (tops[i] - tops.min()) / max(np.ptp(tops), 1e-9)
        _add_box(spec, f'terrain_{i}', box, floor, _LOW + share * (_HIGH - _LOW))


def set_friction(model: mujoco.MjModel, world: World) -> None:
    """Give all contacts the world's sliding friction; MuJoCo takes the larger of two geoms'."""
    if world.friction > 0.0:
        model.geom_friction[:, 0] = world.friction
        model.pair_friction[:, :2] = world.friction


def _add_box(spec: mujoco.MjSpec, name: str, box: Box, floor: Any, colour: Any) -> None:
    half = 0.5 * box.pitch
    geom = spec.worldbody.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=list(box.centre),
        size=list(box.half_size), quat=[np.cos(half), 0.0, np.sin(half), 0.0], rgba=colour)
    if floor is None:
        return
    for part in ('friction', 'solref', 'solimp'):
        setattr(geom, part, list(getattr(floor, part)))
    for part in ('condim', 'contype', 'conaffinity', 'priority', 'solmix', 'margin', 'gap'):
        setattr(geom, part, getattr(floor, part))
