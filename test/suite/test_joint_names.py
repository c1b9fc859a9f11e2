# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot file names the joints as the real robot does: messages, URDF and analysis follow."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml
from checkout import ROOT

pytest.importorskip('rclpy')

import ros_processes
from ros_processes import SHARED_HZ, Processes
from rosbags.highlevel import AnyReader

from dmp_cpg_ros.analysis.bag import payload_digests
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS
from dmp_cpg_ros.robot.robot_file import load_robot_file
from dmp_cpg_ros.robot.urdf import urdf

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain

SCENARIO = """\
name: named
duration: 1.2
parameters: {physics: perfect_tracking}
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.3}}
"""

UNITREE = {leg: [f'{leg.upper()}_{joint}_joint' for joint in ('hip', 'thigh', 'calf')]
           for leg in LEGS}


def robot_file(folder: Path, names: Any) -> Path:
    """The package's own robot with other names."""
    content = yaml.safe_load((ROOT / 'config' / 'robots' / 'mini_quadruped.yaml').read_text())
    path = folder / 'robot.yaml'
    path.write_text(yaml.safe_dump({**content, 'joint_names': names}), encoding='utf-8')
    return path


def test_the_usual_names_are_those_of_the_contract() -> None:
    assert load_robot_file(None).joint_names == JOINT_NAMES
    assert 'usual=' not in urdf(None)


def test_the_urdf_has_the_names_and_says_which_joints_they_are(tmp_path: Path) -> None:
    file = load_robot_file(robot_file(tmp_path, UNITREE))
    tree = ElementTree.fromstring(urdf(file))
    moving = [joint.get('name') for joint in tree.findall('joint') if joint.get('type') != 'fixed']
    assert sorted(moving) == sorted(name for names in UNITREE.values() for name in names)
    said = {e.get('usual'): e.get('name') for e in tree if e.get('usual')}
    assert said == dict(zip(JOINT_NAMES, file.joint_names, strict=True))
    usual = ElementTree.fromstring(urdf(None))
    for joint, same in zip(tree.findall('joint'), usual.findall('joint'), strict=True):
        assert [ElementTree.tostring(e) for e in joint] == [ElementTree.tostring(e) for e in same]


@pytest.mark.parametrize(('changes', 'message'), [
    ({'fl': ['a', 'b']}, 'fl must list three entries'),
    ({'fl': ['a', 'b', 'a']}, "'a' names fl_abduction and fl_knee"),
    ({'rr': list(UNITREE['fl'])}, "'FL_hip_joint' names fl_abduction and rr_abduction"),
    ({'fl': ['fl_hip', 'b', 'c']}, "'fl_hip' for fl_abduction is the usual name of another joint"),
    ({'fl': ['a b', 'b', 'c']}, "'a b' must begin with a letter"),
    ({'fl': [1, 'b', 'c']}, 'fl must be a name, not 1'),
    ({'middle': ['a', 'b', 'c']}, "'middle'"),
])
def test_names_that_cannot_be_are_refused(tmp_path: Path, changes: dict[str, Any], message: str
                                          ) -> None:
    with pytest.raises(ParameterError, match=re.escape(message)) as caught:
        load_robot_file(robot_file(tmp_path, {**UNITREE, **changes}))
    assert 'joint_names' in str(caught.value)
    names = {leg: UNITREE[leg] for leg in LEGS[:3]}
    with pytest.raises(ParameterError, match='rr'):
        load_robot_file(robot_file(tmp_path, names))


def test_a_run_with_other_names_is_the_same_run(processes: Processes, tmp_path: Path) -> None:
    file = robot_file(tmp_path, UNITREE)
    for out, options in (('usual', []), ('named', ['--robot', str(file)])):
        processes.walked(SCENARIO, tmp_path / out, '--lock-step', '--composed', '--rate',
                         str(SHARED_HZ), *options)
    usual, named = (load_recording(tmp_path / out) for out in ('usual', 'named'))
    assert len(named.joints.time) > SHARED_HZ
    for series in ('joints', 'targets'):
        for field in ('time', 'position', 'velocity', 'effort'):
            one, other = (getattr(getattr(run, series), field) for run in (usual, named))
            assert one.tobytes() == other.tobytes(), (series, field)
    with AnyReader([tmp_path / 'named' / 'bag']) as reader:
        for topic in ('/joint_states', '/joint_targets'):
            known = {name for connection, _, raw in reader.messages(
                [c for c in reader.connections if c.topic == topic])
                for name in reader.deserialize(raw, connection.msgtype).name}
            assert known == {name for names in UNITREE.values() for name in names}
    digests = payload_digests(tmp_path / 'named')
    assert {f'joint_targets/{leg.upper()}_hip_joint' for leg in LEGS} <= set(digests)
    assert digests['canonical_state'] == payload_digests(tmp_path / 'usual')['canonical_state']
