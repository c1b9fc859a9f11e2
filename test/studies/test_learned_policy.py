# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a policy observes and what becomes of what it says, without its network and with one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from onnx_network import linear_network

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import DmpCpgError, MissingFileError, ParameterError
from dmp_cpg_ros.robot.robot_file import OWN_ROBOT, own_robot_file
from dmp_cpg_ros.robot.start_pose import home_joint_position
from dmp_cpg_ros.studies import duel, learned_policy
from dmp_cpg_ros.studies.learned_policy import (
    TERMS,
    PolicyFile,
    PolicyLoop,
    PolicyRun,
    load_policy,
    network_of,
)

ROBOT = find_config(OWN_ROBOT)
NAMES = [name for leg in own_robot_file().joints for name in leg]
ORDER = np.random.default_rng(4).permutation(12)
SIZE = 3 + 3 + 3 + 12 + 12 + 12 + 3
DEAF = np.zeros((SIZE, 12))


class Says:
    """A network that says what it is told to, and remembers what it observed."""

    def __init__(self) -> None:
        self.action, self.observed = np.zeros(12), []

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        self.observed.append(observation)
        return self.action


@pytest.fixture(scope='module')
def file() -> PolicyFile:
    """A policy that holds the robot's home pose, with its joints in an order of its own."""
    from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
    home = home_joint_position(MujocoRobot().description)
    return PolicyFile('none.onnx', 0.02, tuple(NAMES[k] for k in ORDER), tuple(home[ORDER]), 0.5,
                      60.0, 2.0, tuple(TERMS), (0.1, -0.2, 0.05))


@pytest.fixture
def says(monkeypatch: pytest.MonkeyPatch) -> Says:
    network = Says()
    monkeypatch.setattr(learned_policy, 'network_of', lambda path: network)
    return network


def text_of(file: PolicyFile, **changes: object) -> str:
    """The policy as a description."""
    values = {**vars(file), **changes}
    return ''.join(f'{name}: {list(value) if isinstance(value, tuple) else value}\n'
                   for name, value in values.items() if value is not None)


def test_it_observes_the_parts_in_its_order(file: PolicyFile, says: Says) -> None:
    run = PolicyRun(file, ROBOT)
    rng = np.random.default_rng(0)
    yaw_only = np.array((0.0, 0.0, np.sin(0.4), np.cos(0.4)))
    v, w, q, qd = rng.normal(size=3), rng.normal(size=3), rng.normal(size=12), rng.normal(size=12)
    run.loop.command(0.3, -0.1, 0.7)
    run.loop.tick(replace(run.state, base_velocity_in_base=v, base_rate_in_base=w,
                          base_quaternion=yaw_only, joint_position=q, joint_velocity=qd))
    expected = np.concatenate((
        v + np.cross(w, file.sensor_in_base), w, (0, 0, -1), q[ORDER] - file.pose, qd[ORDER],
        np.zeros(12), (0.3, -0.1, 0.7)))
    np.testing.assert_allclose(says.observed[-1], expected, atol=1e-12)


def test_gravity_is_where_it_is_in_a_tilted_base(file: PolicyFile, says: Says) -> None:
    pitched = np.array((0.0, np.sin(0.25), 0.0, np.cos(0.25)))  # nose down by 0.5 rad
    run = PolicyRun(replace(file, observation=('gravity',)), ROBOT)
    run.loop.tick(replace(run.state, base_quaternion=pitched))
    np.testing.assert_allclose(says.observed[-1], (np.sin(0.5), 0.0, -np.cos(0.5)), atol=1e-12)


def test_what_it_says_moves_the_joint_that_it_means(file: PolicyFile, says: Says) -> None:
    for k in range(12):
        run = PolicyRun(file, ROBOT)
        says.action = np.eye(12)[k]
        targets = run.loop.tick(run.state).targets
        moved = targets.position[ORDER] - file.pose
        np.testing.assert_allclose(moved, file.action_scale * np.eye(12)[k], atol=1e-12)
        assert not targets.velocity.any() and not targets.effort.any()


def test_an_output_holds_for_its_period_and_is_then_observed(file: PolicyFile, says: Says) -> None:
    run = PolicyRun(replace(file, observation=('last_action',)), ROBOT)
    count = round(0.02 / run.tick_s)
    for k in range(3 * count):
        says.action = np.full(12, 0.001 * (k + 1))
        run.walk(run.tick_s)
        assert len(says.observed) == k // count + 1
    np.testing.assert_array_equal(
        says.observed, [np.zeros(12), np.full(12, 0.001), np.full(12, 0.001 * (count + 1))])


def test_a_policy_that_says_nothing_stands(file: PolicyFile, says: Says) -> None:
    run = PolicyRun(file, ROBOT)
    assert run.walk(2.0) and run.settle((0.3, 0.0, 0.0))
    assert float(np.hypot(*run.state.base_position_in_world[:2])) < 0.05
    run.stop()
    run.loop.observed(run.state)
    assert tuple(run.loop.observed(run.state)[-3:]) == (0.0, 0.0, 0.0)


def test_what_does_not_fit_is_refused(file: PolicyFile, says: Says) -> None:
    with pytest.raises(ParameterError, match='are not those of the robot'):
        PolicyLoop(replace(file, joints=('nose', *file.joints[1:])), own_robot_file())
    with pytest.raises(ParameterError, match='no whole multiple of the tick'):
        PolicyRun(replace(file, period=0.018), ROBOT)


@pytest.mark.parametrize(('changes', 'words'), [
    ({'observation': ['gravity', 'smell']}, 'observation.*must be one of .*gravity'),
    ({'pose': [0.0] * 11}, 'pose.*12 entries, not 11'),
    ({'period': float('nan')}, 'period'),
    ({'stiffness': 'much'}, "stiffness' must be a number"),
    ({'action_scale': None}, "'action_scale' is missing"),
    ({'network': 'none.onnx'}, 'there is no network .*none.onnx'),
])
def test_a_bad_description_says_what_is_valid(file: PolicyFile, changes: dict[str, object],
                                              words: str, tmp_path) -> None:
    path = tmp_path / 'policy.yaml'
    path.write_text(text_of(file, **changes))
    with pytest.raises((ParameterError, MissingFileError), match=words) as caught:
        load_policy(path)
    assert str(path) in str(caught.value) and '\n' not in str(caught.value)


def test_the_description_of_the_package_can_be_read(tmp_path) -> None:
    network = tmp_path / 'network.onnx'
    network.write_bytes(b'')
    described = load_policy('policies/playground_go1.yaml', network)
    assert described.network == str(network) and described.period_ns == 20_000_000


@pytest.fixture
def networks(tmp_path):
    """Makes files of networks."""
    pytest.importorskip('onnxruntime')

    def make(weights: np.ndarray | bytes, name: str = 'n.onnx') -> str:
        path = tmp_path / name
        path.write_bytes(weights if isinstance(weights, bytes) else linear_network(weights))
        return str(path)

    return make


def test_a_network_is_the_function_that_its_file_holds(networks) -> None:
    weights = np.random.default_rng(1).normal(size=(7, 12))
    observation = np.arange(7.0)
    np.testing.assert_allclose(
        network_of(networks(weights))(observation), observation @ weights, rtol=1e-5)


def test_a_network_that_does_not_fit_is_refused_in_one_line(networks) -> None:
    of_seven, of_two = networks(np.zeros((7, 12)), 'a.onnx'), networks(np.zeros((7, 2)), 'b.onnx')
    for make, words in (
            (lambda: network_of(of_seven)(np.zeros(8)), 'does not take 8 numbers'),
            (lambda: network_of(of_two)(np.zeros(7)), r'must give \(1, 12\)'),
            (lambda: network_of(of_seven)(np.full(7, np.nan)), 'finite'),
            (lambda: network_of(networks(b'no network', 'c.onnx')), 'is no ONNX network')):
        with pytest.raises(DmpCpgError, match=words) as caught:
            make()
        assert '\n' not in str(caught.value)


def test_a_duel_prints_both(networks, file: PolicyFile, tmp_path,
                            capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'policy.yaml'
    path.write_text(text_of(replace(file, network=networks(DEAF))))
    assert duel.main([str(path), str(ROBOT), '--tables', 'standing', '--gaits', 'trot',
                      '--workers', '1']) == 0
    rows = [line.split('|') for line in capsys.readouterr().out.splitlines() if 'no' in line]
    assert [row[1].strip() for row in rows] == ['policy', 'suite']
