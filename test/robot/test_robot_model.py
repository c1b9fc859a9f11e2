# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Our own MJCF against the published numbers that it is made from."""

from __future__ import annotations

import os

import numpy as np
import pytest

from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_parts import find_ids
from dmp_cpg_ros.robot.model_reader import load_description, pose, read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import load_robot_file, own_robot_file
from dmp_cpg_ros.robot.soft_feet import standing_radius
from dmp_cpg_ros.robot.start_pose import home_joint_position

# Cheetah-Software, MiniCheetah.h, left legs: mass [kg], centre of mass [m], inertia [1e-6 kg m^2].
PUBLISHED = {
    'body': (3.3, (0, 0, 0), np.diag((11253, 36203, 42673))),
    'abduction': (0.54, (0, 0.036, 0),
                  np.array(((381, 58, 0.45), (58, 560, 0.95), (0.45, 0.95, 444)))),
    # The thigh's published product I_xy = 245 would break the triangle inequality; see the MJCF.
    'thigh': (0.634, (0, 0.016, -0.02), np.array(((1983, 0, 13), (0, 2103, 1.5), (13, 1.5, 408)))),
    'shank': (0.064, (0, 0, -0.061), np.diag((245, 248, 6))),
}
ROTOR_MASS = 0.055
ROTOR_X, ROTOR_Y = np.diag((63.0, 33.0, 33.0)), np.diag((33.0, 63.0, 33.0))
MIRROR = np.diag((1.0, -1.0, 1.0))


@pytest.fixture(scope='module')
def model():
    return load_model(own_robot_file().model, 'base_link')


def composed(parts):
    """Mass, centre of mass and inertia [kg m^2] of rigidly joined parts."""
    mass = sum(m for m, _, _ in parts)
    com = sum(m * np.array(place, float) for m, place, _ in parts) / mass
    inertia = np.zeros((3, 3))
    for m, place, about_own_com in parts:
        arm = np.array(place) - com
        inertia += about_own_com * 1e-6 + m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, com, inertia


def expected_link(link):
    rotors = {
        'body': [(ROTOR_MASS, (x, y, 0), ROTOR_X)
                 for x in (0.125, -0.125) for y in (0.049, -0.049)],
        'abduction': [(ROTOR_MASS, (0, 0.04, 0), ROTOR_Y)],
        'thigh': [(ROTOR_MASS, (0, 0, 0), ROTOR_Y)],
        'shank': [],
    }[link]
    return composed([PUBLISHED[link], *rotors])


def link_of_model(model, name):
    body = model.body(name).id
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, model.body_iquat[body])
    R = R.reshape(3, 3)
    return model.body_mass[body], model.body_ipos[body], (R * model.body_inertia[body]) @ R.T


@pytest.mark.parametrize('leg', LEGS)
@pytest.mark.parametrize(('link', 'suffix'), [
    ('abduction', 'abduction_link'), ('thigh', 'thigh'), ('shank', 'shank')])
def test_link_inertias_are_the_published_ones_mirrored_on_the_right(model, leg, link, suffix):
    mass, com, inertia = expected_link(link)
    side = np.eye(3) if leg.endswith('l') else MIRROR
    found_mass, found_com, found_inertia = link_of_model(model, f'{leg}_{suffix}')
    assert found_mass == pytest.approx(mass, rel=1e-4)
    np.testing.assert_allclose(found_com, side @ com, atol=1e-6)
    np.testing.assert_allclose(found_inertia, side @ inertia @ side, atol=2e-8)


def test_body_inertia_is_the_published_one_with_its_rotors(model):
    mass, com, inertia = expected_link('body')
    found_mass, found_com, found_inertia = link_of_model(model, 'base_link')
    assert found_mass == pytest.approx(mass)
    np.testing.assert_allclose(found_com, com, atol=1e-9)
    np.testing.assert_allclose(found_inertia, inertia, atol=1e-7)


def test_total_mass_is_about_nine_kilograms(model):
    assert load_description().mass == pytest.approx(9.0, abs=0.2)


def test_shapes_add_no_mass(model):
    """A geom's mass never counts beside an explicit inertial; the file says so too."""
    spec = mujoco.MjSpec.from_file(str(own_robot_file().model))
    assert all(geom.mass == 0.0 for body in spec.bodies[1:] for geom in body.geoms)


def test_armature_is_the_rotor_inertia_through_the_gear(model):
    for leg in load_description().legs:
        gears = np.array((6.0, 6.0, 9.33))
        np.testing.assert_allclose(leg.rotor_inertia, 63e-6 * gears**2, rtol=1e-5)


def test_torque_and_speed_limits_are_the_actuators_through_the_knees_belt(model):
    belt = np.array((1.0, 1.0, 9.33 / 6.0))
    for leg in load_description().legs:
        np.testing.assert_allclose(leg.torque_limit, 17.0 * belt, rtol=1e-6)
        np.testing.assert_allclose(leg.velocity_limit, 40.0 / belt, rtol=1e-3)


def random_joints(model, rng):
    ids = find_ids(model, own_robot_file())
    low, high = model.jnt_range[ids.joints].T
    return ids, rng.uniform(low, high)


def mass_matrix(model, data):
    mujoco.mj_forward(model, data)
    columns = []
    for unit in np.eye(model.nv):
        columns.append(np.zeros(model.nv))
        mujoco.mj_mulM(model, data, columns[-1], unit)
    return np.column_stack(columns)


def test_mass_matrix_is_positive_definite_everywhere(model):
    rng = np.random.default_rng(1)
    for _ in range(20):
        ids, joints = random_joints(model, rng)
        data = pose(model, ids, joints)
        M = mass_matrix(model, data)
        np.testing.assert_allclose(M, M.T)
        assert np.linalg.eigvalsh(M).min() > 1e-4


def mirrored(values):
    """Swap left and right legs and turn abduction round."""
    legs = np.asarray(values).reshape(4, 3)[[1, 0, 3, 2]]
    return (legs * (-1.0, 1.0, 1.0)).ravel()


def test_mass_matrix_is_symmetric_between_left_and_right(model):
    rng = np.random.default_rng(2)
    # Reflection of y: of the base's velocity (x, y, z, then rates), then of the joints.
    base = np.diag((1.0, -1.0, 1.0, -1.0, 1.0, -1.0))
    legs = np.array([mirrored(row) for row in np.eye(12)]).T
    S = np.block([[base, np.zeros((6, 12))], [np.zeros((12, 6)), legs]])
    for _ in range(5):
        ids, joints = random_joints(model, rng)
        here, there = (mass_matrix(model, pose(model, ids, position))
                       for position in (joints, mirrored(joints)))
        np.testing.assert_allclose(S @ here @ S, there, atol=1e-8)


def test_home_keyframe_stands_on_feet_below_the_hips(model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key('home').id)
    mujoco.mj_kinematics(model, data)
    for leg in LEGS:
        foot, hip = data.geom(f'{leg}_foot').xpos, data.joint(f'{leg}_hip').xanchor
        np.testing.assert_allclose(foot[:2], hip[:2], atol=1e-6)
        assert foot[2] == pytest.approx(model.geom(f'{leg}_foot').size[0], abs=1e-6)
    assert data.body('base_link').xpos[2] == pytest.approx(0.28, abs=0.01)


def test_joints_and_motors_bear_our_names_in_our_order(model):
    assert tuple(model.joint(i).name for i in range(1, model.njnt)) == JOINT_NAMES
    assert tuple(model.actuator(i).name for i in range(model.nu)) == JOINT_NAMES


def test_a_model_for_accelerators_is_solved_as_any_other(model, tmp_path):
    text = own_robot_file().model.read_text()
    quick = tmp_path / 'quick.xml'
    quick.write_text(text.replace('<option ', '<option iterations="1" ls_iterations="5" ', 1))
    loaded, data = load_model(quick, 'base_link'), []
    for each in (model, loaded):
        state = mujoco.MjData(each)
        mujoco.mj_resetDataKeyframe(each, state, 0)
        state.qvel[:2] = 0.3, 0.1  # feet that bear against sliding
        mujoco.mj_step(each, state, 200)
        data.append(state.qpos.copy())
    np.testing.assert_array_equal(*data)


@pytest.mark.parametrize('names', [
    '<compiler meshdir="parts"/><asset><mesh name="m" file="queue.stl"/></asset>'
    '<worldbody><geom type="mesh" mesh="m"/></worldbody>',
    '<asset><texture type="2d" name="t" file="parts/queue.png"/></asset>',
    '<include file="parts/queue.xml"/>', '<include file="other.xml"/>'])
def test_a_model_that_would_be_read_for_ever_is_refused(tmp_path, names):
    (tmp_path / 'parts').mkdir()
    for ending in ('stl', 'png', 'xml'):
        os.mkfifo(tmp_path / 'parts' / f'queue.{ending}')
    (tmp_path / 'other.xml').write_text('<mujoco><asset><hfield name="h" size="1 1 1 1" '
                                        'file="parts/queue.png"/></asset></mujoco>')
    (tmp_path / 'model.xml').write_text(f'<mujoco>{names}</mujoco>')
    with pytest.raises(ParameterError, match='names .*, which is a pipe, not a file'):
        load_model(tmp_path / 'model.xml', 'trunk')


def test_the_inertia_that_a_swing_moves_is_that_of_the_leg_about_its_hip():
    """By the kinetic energy of a robot that turns one hip and nothing else."""
    description = load_description(own_robot_file())
    model = load_model(own_robot_file().model, 'base_link')
    data = pose(model, find_ids(model, load_robot_file(own_robot_file())),
                home_joint_position(description))
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    for i, leg in enumerate(description.legs):
        data.qvel[:] = 0.0
        data.qvel[6 + 3 * i + 1] = 2.0
        mujoco.mj_forward(model, data)
        # that of a stance in which feet are not rolled over yet
        assert leg.swing_inertia == pytest.approx(2.0 * data.energy[1] / 2.0**2, rel=2e-3)
        assert leg.swing_inertia > leg.rotor_inertia[1]


def test_soft_feet_roll_on_a_smaller_radius_under_more_weight():
    file = load_robot_file(own_robot_file())
    model = load_model(file.model, file.base)
    ids = find_ids(model, file)
    hard = read_description(model, file)
    assert all(leg.rolling_radius is None for leg in hard.legs)
    for foot in ids.feet:
        for geom in foot.geoms:
            model.geom_solref[geom], model.geom_priority[geom] = (0.04, 1.0), 1
    soft = read_description(model, file)
    standing, trotting = soft.legs[0].rolling_radius
    assert standing == pytest.approx(soft.legs[0].foot_radius, abs=1e-5)
    assert trotting < 0.95 * standing < standing < hard.legs[0].foot_radius
    assert soft.legs[0].walking_radius == trotting
    data = pose(model, ids, home_joint_position(soft))
    model.body_subtreemass *= 2.0
    assert standing_radius(model, data, ids) == pytest.approx(trotting, abs=1e-5)


def test_a_model_that_has_changed_since_it_was_read_is_read_again(tmp_path):
    """Also where only a file of it has changed."""
    text = own_robot_file().model.read_text(encoding='utf-8')
    begin, end = text.index('<mujoco'), text.rindex('</mujoco>')
    inside = text[text.index('>', begin) + 1:end]
    model, part, file = (tmp_path / name for name in ('robot.xml', 'part.xml', 'robot.yaml'))
    usual = find_config('mini_quadruped', ROBOTS).read_text(encoding='utf-8')
    file.write_text(usual.replace('mini_quadruped.xml', 'robot.xml'), encoding='utf-8')
    heavier = 'mass="3.52"', 'mass="4.52"'
    assert heavier[0] in inside
    for whole in (True, False):
        masses = []
        for content in (inside, inside.replace(*heavier)):
            part.write_text(f'<mujoco>{content}</mujoco>', encoding='utf-8')
            model.write_text(f'<mujoco>{content}</mujoco>' if whole else
                             '<mujoco><include file="part.xml"/></mujoco>', encoding='utf-8')
            masses.append(load_description(file).mass)
            assert load_description(file).mass == masses[-1]
        assert masses[1] - masses[0] == pytest.approx(1.0)


def test_legs_are_as_wide_as_the_shapes_with_which_they_can_touch():
    """The package's own robot has legs that pass through each other; then its fore legs touch the
    hind ones, but one of the left side is told not to.
    """
    file = load_robot_file(own_robot_file())
    model = load_model(file.model, file.base)
    ids = find_ids(model, file)
    assert all(leg.width == 0.0 for leg in read_description(model, file).legs)
    shanks = model.jnt_bodyid[ids.joints[2::3]]
    model.geom_conaffinity[np.isin(model.geom_bodyid, [*shanks, *(f.body for f in ids.feet)])] = 1
    widths = [leg.width for leg in read_description(model, file).legs]
    assert widths == pytest.approx([2.0 * max(foot.radius for foot in ids.feet)] * 4, rel=0.3)
    for foot in ids.feet:
        model.geom_contype[list(foot.geoms)] = model.geom_conaffinity[list(foot.geoms)] = 0
    thinner = [leg.width for leg in read_description(model, file).legs]
    assert all(thin <= wide for thin, wide in zip(thinner, widths, strict=True))
