# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Worlds: the ground is where its height says, and the robot knows how high it stands over it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.metrics.robot import fell
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.robot_model.grounds import PATCH, Blocks, LowFriction, Slope, Steps, World
from dmp_cpg_ros.core.robot_model.rough_grounds import Gaps, Hills, RoughSlope
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.core.robot_model.world import WORLDS, WorldParameters, world_overrides
from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.robot.camera import Camera
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import recording_of
from dmp_cpg_ros.suite import load_suite

ZERO = np.zeros(12)
WORLDS_TO_TRY = (
    World(), LowFriction(), Slope(degrees=12.0), Slope(degrees=-12.0),
    Blocks(height=0.06, seed=3), Blocks(height=0.06, size=0.33), Steps(height=0.08),
    Steps(height=0.05, depth=0.3, count=3, platform=1.0), RoughSlope(degrees=12.0, height=0.04),
    RoughSlope(degrees=-15.0, height=0.06, seed=3), Gaps(count=3), Hills(degrees=15.0, seed=2))


@pytest.fixture(scope='module', params=WORLDS_TO_TRY, ids=str)
def robot(request):
    return MujocoRobot(world=request.param)


def test_rays_from_above_meet_the_ground_where_its_height_says(robot):
    robot.reset()
    rng, hit = np.random.default_rng(1), np.zeros(1, dtype=np.int32)
    for x, y in zip(rng.uniform(-2.0, 14.0, 300), rng.uniform(-4.0, 4.0, 300), strict=True):
        if abs(x) < 0.5 and abs(y) < 0.5:
            continue
        down = mujoco.mj_ray(robot.model, robot.data, np.array((x, y, 9.0)),
                             np.array((0.0, 0.0, -1.0)), None, 1, -1, hit)
        assert 9.0 - down == pytest.approx(float(robot.world.height_at(x, y)), abs=1e-6), (x, y)


def test_the_start_is_flat_and_the_robot_stands_on_it_as_on_the_floor(robot):
    x, y = np.meshgrid(np.linspace(-1.0, PATCH - 1e-9, 40), np.linspace(-1.0, 1.0, 40))
    assert not robot.world.height_at(x, y).any()
    state = robot.reset()
    flat = MujocoRobot().reset()
    np.testing.assert_array_equal(state.joint_position, flat.joint_position)
    np.testing.assert_array_equal(state.base_position_in_world, flat.base_position_in_world)
    assert state.foot_force.sum() == pytest.approx(robot.description.mass * 9.81, rel=0.3)


def put(robot, x, height, tilt=0.0):
    """Put the base over a place, at a height over the ground there, pitched; one tick later."""
    robot.reset()
    ground = float(robot.world.height_at(x, 0.0))
    robot.data.qpos[:3] = (x, 0.0, ground + height)
    robot.data.qpos[3:7] = (np.cos(tilt / 2), 0.0, np.sin(tilt / 2), 0.0)
    mujoco.mj_forward(robot.model, robot.data)


@pytest.mark.parametrize('degrees', [14.0, -14.0])
def test_on_a_slope_height_is_measured_from_the_ground(degrees):
    robot = MujocoRobot(world=Slope(degrees=degrees))
    standing = robot.description.stance_height
    put(robot, 5.0, 1.05 * standing, -np.deg2rad(degrees))
    assert robot.height_over_ground == pytest.approx(1.05 * standing, abs=1e-9)
    assert not robot.fallen
    put(robot, 5.0, 0.4 * standing, -np.deg2rad(degrees))
    assert robot.fallen
    put(robot, 5.0, 2.0 * standing, np.deg2rad(70.0))
    assert robot.fallen


def test_a_walk_down_a_slope_is_no_fall_in_the_metrics_and_lying_there_is_one():
    world = Slope(degrees=-14.0)
    robot = MujocoRobot(world=world)
    start, height = robot.reset(), robot.description.stance_height

    def recorded(over_ground):
        states = []
        for k in range(100):
            x = 0.07 * k
            place = np.array((x, 0.0, float(world.height_at(x, 0.0)) + over_ground))
            states.append(dataclasses.replace(start, time_ns=4_000_000 * k,
                                              base_position_in_world=place))
        return recording_of(states)

    on_flat = RunContext(robot=robot.description)
    context = RunContext(robot=robot.description, world=world)
    assert fell(recorded(height), context) is False
    assert fell(recorded(0.4 * height), context) is True
    assert fell(recorded(height), on_flat) is True


def test_blocks_are_those_of_their_seed_and_within_their_height():
    first, again, other = Blocks(seed=5), Blocks(seed=5), Blocks(seed=6)
    np.testing.assert_array_equal(first.heights(), again.heights())
    assert (first.heights() != other.heights()).any()
    assert 0.0 <= first.heights().min() < first.heights().max() <= first.height
    assert np.std(first.heights()) > 0.2 * first.height


def test_friction_is_what_the_contacts_have():
    robot = MujocoRobot(world=LowFriction(friction=0.17))
    robot.reset()
    robot.step(JointTargets(robot.reset().joint_position, ZERO, ZERO))
    assert robot.data.ncon >= 4
    np.testing.assert_allclose(robot.data.contact.friction[:, :2], 0.17)
    assert MujocoRobot(world=Blocks(friction=0.4)).model.geom_friction[:, 0] == pytest.approx(0.4)


def test_a_steep_slope_is_slid_down_without_friction_and_stood_on_with_it():
    def slid(friction):
        robot = MujocoRobot(world=Slope(degrees=-20.0, friction=friction))
        home = robot.reset().joint_position
        put(robot, 3.0, robot.description.stance_height + 0.04, np.deg2rad(20.0))
        for _ in range(125):
            state = robot.step(JointTargets(home, ZERO, ZERO))
        return state.base_position_in_world[0] - 3.0

    assert slid(0.05) > 0.2
    assert abs(slid(0.9)) < 0.1


def test_the_camera_shows_the_terrain():
    pictures = []
    for world in (World(), Blocks(height=0.1)):
        with Camera(width=160, height=120, world=world) as camera:
            if camera.reason:
                pytest.skip(camera.reason)
            pictures.append(camera.drawn((2.0, 0.0, 0.4), (0, 0, 0, 1), MujocoRobot().reset()
                                           .joint_position).astype(int))
    assert (np.abs(pictures[0] - pictures[1]).max(axis=2) > 20).mean() > 0.2


@pytest.mark.parametrize('kind', list(WORLDS))
def test_a_scenario_and_the_parameters_choose_the_same_world(kind):
    own = {'slope': {'degrees': -3.0}, 'blocks': {'height': 0.03, 'seed': 2, 'size': 0.25},
           'steps': {'count': 2, 'depth': 0.5, 'platform': 1.5},
           'low_friction': {'friction': 0.2}}.get(kind, {})
    scenario = Scenario.from_mapping(
        {'duration': 1.0, 'events': [], 'world': {'kind': kind, **own}})
    assert load_suite(overrides=scenario.parameters).world == WORLDS[kind](**own)
    assert WorldParameters(world=kind).build() == WORLDS[kind]()


@pytest.mark.parametrize(('values', 'text'), [
    ({'kind': 'swamp'}, 'one of flat, slope, blocks, steps, low_friction'),
    ('blocks', 'must be a mapping with kind'),
    ({'kind': 'blocks', 'degrees': 3.0}, 'valid are friction, height, size, seed'),
    ({'kind': 'slope', 'degrees': 80.0}, r'outside its range \[-40, 40\] deg'),
    ({'kind': 'steps', 'count': 0}, 'outside its range'),
    ({'kind': 'blocks', 'height': float('nan')}, 'outside its range'),
])
def test_a_bad_world_is_named_with_what_is_valid(values, text):
    with pytest.raises(DataError, match=text):
        world_overrides(values, 'scenario')


@pytest.mark.parametrize('overrides', [{'world': 'blocks'}, {'world_friction': 0.2}])
def test_perfect_tracking_has_no_world_but_the_flat_one(overrides):
    with pytest.raises(ParameterError, match='needs physics: mujoco'):
        load_suite(overrides={'physics': 'perfect_tracking', **overrides})
