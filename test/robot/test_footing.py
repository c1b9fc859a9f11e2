# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feet stand on hills as on a floor that leans, however far they sink in."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.rough_grounds import Hills
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.robot import mujoco_robot
from dmp_cpg_ros.robot.model_loader import FOOTINGS, TERRAIN, load_model
from dmp_cpg_ros.robot.model_parts import foot_position
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot

HILLS = Hills(degrees=15.0, seed=100)
ZERO = np.zeros(12)


def put(robot: MujocoRobot, x: float, y: float, over: float) -> None:
    """Put the robot where its lowest foot's centre is so much over the ground."""
    robot.reset()
    robot.data.qpos[:2] = x, y
    mujoco.mj_kinematics(robot.model, robot.data)
    height = min(float(foot[2] - robot.world.height_at(*foot[:2])) for foot in places(robot))
    robot.data.qpos[2] += over - height
    mujoco.mj_kinematics(robot.model, robot.data)


def places(robot: MujocoRobot) -> list[Array]:
    return [foot_position(robot.data, foot) for foot in robot._ids.feet]


def forces_on_feet(robot: MujocoRobot) -> dict[int, list[tuple[float, Array]]]:
    """Normal forces and normals on each foot, away from the ground."""
    found: dict[int, list[tuple[float, Array]]] = {}
    feet, wrench = [foot.geoms[0] for foot in robot._ids.feet], np.zeros(6)
    for i, contact in enumerate(robot.data.contact):
        for foot, side in zip(contact.geom.tolist(), (-1.0, 1.0), strict=True):
            if foot in feet:
                mujoco.mj_contactForce(robot.model, robot.data, i, wrench)
                found.setdefault(feet.index(foot), []).append(
                    (float(wrench[0]), side * contact.frame[:3].copy()))
    return found


@pytest.mark.parametrize('over', [0.019, 0.005, -0.005, -0.015])
@pytest.mark.parametrize('place', [(2.0, 0.0), (3.21, 1.07), (5.5, -1.33), (0.0, 0.0)])
def test_what_carries_a_foot_pushes_it_out_of_the_ground(place: tuple[float, float], over: float
                                                         ) -> None:
    robot = MujocoRobot(world=HILLS)
    put(robot, *place, over)
    robot.step(JointTargets(robot._state().joint_position, ZERO, ZERO))
    found = forces_on_feet(robot)
    assert found
    for i, forces in found.items():
        x, y, _ = places(robot)[i]
        d = 0.02
        steep = np.array([HILLS.height_at(x - d, y) - HILLS.height_at(x + d, y),
                          HILLS.height_at(x, y - d) - HILLS.height_at(x, y + d), 2.0 * d])
        (_, normal), = forces  # one, and no wall beside it
        assert normal @ steep / np.linalg.norm(steep) > np.cos(np.deg2rad(3.0))


def test_level_part_of_hills_is_a_floor_bit_by_bit() -> None:
    robots = [MujocoRobot(world=world, initial_height=0.35) for world in (World(), HILLS)]
    for _ in range(150):
        flat, hills = (robot.step(JointTargets(robot._start.joint_position, ZERO, ZERO))
                       for robot in robots)
        np.testing.assert_array_equal(flat.base_position_in_world, hills.base_position_in_world)
        np.testing.assert_array_equal(flat.joint_position, hills.joint_position)
        np.testing.assert_array_equal(flat.foot_force, hills.foot_force)
    assert flat.foot_force.sum() == pytest.approx(robots[0].description.mass * 9.81, rel=0.2)


def test_a_foot_beside_the_hills_has_no_plane() -> None:
    robot = MujocoRobot(world=HILLS)
    robot.data.qpos[:3] = 2.0, 3.0, 0.5
    mujoco.mj_kinematics(robot.model, robot.data)
    robot._footing.follow(robot.data)
    heights = [robot.data.mocap_pos[robot.model.body(name).mocapid[0], 2] for name in FOOTINGS]
    for foot, height in zip(places(robot), heights, strict=True):
        assert (height < -100.0) == (foot[1] > 3.0)
    assert min(heights) < -100.0 < max(heights)


def touching(model: Any) -> set[tuple[str, ...]]:
    """Pairs of named geoms that may touch by their bits, one of which is of the ground."""
    con, aff = model.geom_contype, model.geom_conaffinity
    ground = [model.geom(name).id for name in (TERRAIN, *FOOTINGS)]
    return {tuple(sorted((model.geom(a).name, model.geom(b).name)))
            for a in ground for b in range(model.ngeom) if b not in ground and model.geom(b).name
            and (con[a] & aff[b] or con[b] & aff[a])}


def test_each_foot_has_its_plane_and_all_else_the_height_field() -> None:
    found = touching(MujocoRobot(world=HILLS).model)
    feet = {f'{leg}_foot': f'{TERRAIN}_below_{leg}' for leg in ('fl', 'fr', 'rl', 'rr')}
    assert {tuple(sorted(pair)) for pair in feet.items()} <= found
    assert {pair for pair in found if set(pair) & {*feet, *feet.values()}} == {
        tuple(sorted(pair)) for pair in feet.items()}
    assert ('body', TERRAIN) in found


def test_without_free_bits_feet_stay_on_the_height_field(
        monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*given: Any) -> Any:
        model = load_model(*given)
        model.geom_contype[model.geom('body').id] = 0x7FFFFFFF
        return model
    monkeypatch.setattr(mujoco_robot, 'load_model', full)
    found = touching(MujocoRobot(world=HILLS).model)
    assert ('fl_foot', TERRAIN) in found and ('body', TERRAIN) in found
    assert not any(name in pair for pair in found for name in FOOTINGS)
