# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Motors behind a low-level interface: their law, what they refuse, and what silence does."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip('mujoco')

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.modes.motion_library import lying_posture
from dmp_cpg_ros.core.robot_model.state import JointTargets
from dmp_cpg_ros.robot.absent_legs import CARRIED_NS
from dmp_cpg_ros.robot.drive_watch import DriveWatch
from dmp_cpg_ros.robot.low_level import (
    COMMANDED,
    PERIOD_NS,
    POWER,
    LowLevelRobot,
    MotorCommand,
)
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_suite

DESCRIPTION = load_description()
KP, KD = np.tile(DESCRIPTION.kp, 4), np.tile(DESCRIPTION.kd, 4)


def commanded(robot: LowLevelRobot, **command: object) -> None:
    for name, values in command.items():
        robot.take(name, np.broadcast_to(values, 12))


def test_the_law_of_a_motor_is_the_one_that_is_documented() -> None:
    rng = np.random.default_rng(1)
    q_d, dq_d, tau, kp, kd, q, dq = rng.normal(size=(7, 12))
    told = MotorCommand(q_d, dq_d, tau, kp, kd).torque(q, dq)
    assert told == pytest.approx([tau[i] + kp[i] * (q_d[i] - q[i]) + kd[i] * (dq_d[i] - dq[i])
                                  for i in range(12)])


def test_the_interfaces_are_those_that_the_driver_commands() -> None:
    pytest.importorskip('rclpy')
    from dmp_cpg_ros.nodes.messages import interfaces

    assert (COMMANDED, POWER) == (interfaces.COMMAND_INTERFACES, interfaces.POWER)


def test_nothing_moves_it_until_every_interface_has_been_commanded() -> None:
    robot = LowLevelRobot()
    commanded(robot, position=robot.state.joint_position + 0.5, velocity=0.0, effort=0.0, kp=KP)
    assert robot.damped
    begin = robot.state.joint_position
    for _ in range(50):
        robot.step()
    assert np.abs(robot.state.joint_position - begin).max() < 0.05
    commanded(robot, position=begin + 0.2, velocity=0.0, effort=0.0, kp=KP, kd=KD)
    assert not robot.damped and robot.timeouts == 0
    robot.step()
    assert np.abs(robot.state.joint_effort).max() > 1.0


@pytest.mark.parametrize('silent', COMMANDED)
def test_the_silence_of_one_interface_damps_all_motors_until_it_is_heard_again(
        silent: str) -> None:
    robot, timeout_ns = LowLevelRobot(timeout_ns=10 * PERIOD_NS), 10 * PERIOD_NS
    rest = lying_posture(DESCRIPTION)
    told = {'position': rest, 'velocity': 0.0, 'effort': 0.0, 'kp': KP, 'kd': KD}
    commanded(robot, **told)
    last, stopped = robot.state.time_ns, {**told}
    del stopped[silent]
    while robot.state.time_ns - last <= timeout_ns:
        assert not robot.damped
        robot.step()
        commanded(robot, **stopped)
    assert robot.damped
    for _ in range(5):
        robot.step()
        assert (robot.state.joint_effort * robot.state.joint_velocity).max() < 0.05
    assert robot.timeouts == 1
    commanded(robot, **told)
    robot.step()
    assert not robot.damped and robot.timeouts == 1


@pytest.mark.parametrize(('name', 'values', 'said'), [
    ('position', np.full(12, np.nan), 'finite'), ('velocity', np.full(12, np.inf), 'finite'),
    ('effort', np.full(12, 1e7), 'at most'), ('effort', np.zeros(11), '11 numbers for 12'),
    ('kp', np.full(12, -1.0), 'negative'), ('kd', np.full(12, -1e-3), 'negative'),
    ('kp', np.zeros(13), '13 numbers for 12'), ('torque', np.zeros(12), 'valid are')])
def test_what_is_no_command_is_refused_and_changes_nothing(
        name: str, values: np.ndarray, said: str) -> None:
    robot = LowLevelRobot()
    commanded(robot, position=0.1, velocity=0.0, effort=0.0, kp=KP, kd=KD)
    before = {key: value.copy() for key, value in robot.command.items()}
    with pytest.raises(DataError, match=said):
        robot.take(name, values)
    assert all((robot.command[key] == value).all() for key, value in before.items())


def test_torques_keep_to_the_limits_of_the_robot_file() -> None:
    robot = LowLevelRobot()
    commanded(robot, position=0.0, velocity=0.0, effort=1e5, kp=0.0, kd=0.0)
    robot.step()
    limit = np.concatenate([leg.torque_limit for leg in DESCRIPTION.legs])
    assert (np.abs(robot.state.joint_effort) <= limit * (1.0 + 1e-12)).all()
    assert np.abs(robot.state.joint_effort).max() > 0.5 * limit.max()


@pytest.mark.parametrize(('interfaces', 'gains'), [
    (('position',), True), (('position', 'effort'), True), (('effort',), False)])
def test_motors_have_gains_of_their_own_where_they_are_told_none(
        interfaces: tuple[str, ...], gains: bool) -> None:
    robot = LowLevelRobot(interfaces=interfaces)
    assert (robot.command['kp'] == (KP if gains else 0.0)).all()
    assert (robot.command['kd'] == (KD if gains else 0.0)).all()
    with pytest.raises(DataError, match="'kp' is not commanded"):
        robot.take('kp', np.zeros(12))


@pytest.mark.parametrize(('keeps', 'fails'), [(True, False), (False, True)])
def test_motors_that_go_on_with_a_velocity_are_judged_by_one_that_goes_on(
        keeps: bool, fails: bool) -> None:
    """A tick's targets are commanded five times: who thinks that a motor stops at once what it
    is told again would take the torque of a quick swing for that of a leg without power.
    """
    robot, watch = LowLevelRobot(), DriveWatch(DESCRIPTION)
    watch.keeps_velocity = keeps
    begin = robot.state.joint_position
    seen = False
    for k in range(300):
        phase = 8.0 * np.pi * (k - k % 5) * PERIOD_NS * 1e-9
        place, speed = begin + 0.3 * np.sin(phase), 0.3 * 8.0 * np.pi * np.cos(phase)
        told = JointTargets(place, np.full(12, speed), np.zeros(12))
        watch.see(robot.state)
        watch.tell(robot.state.time_ns, told)
        seen |= bool(watch.failing)
        commanded(robot, position=place, velocity=speed, effort=0.0, kp=KP, kd=KD)
        robot.step()
    assert seen == fails
    assert watch._reports


def watched(periods: int, late: int, at_once: int, late_ns: int, dead_from: int = -1
            ) -> tuple[int, set[str]]:
    """Walk on motors whose commands come some periods late, and now and then to several states
    that came at once; returns when something was first said of the drives, and of which leg.
    """
    suite, robot, watch = load_suite(), LowLevelRobot(start_pose='standing'), DriveWatch(
        DESCRIPTION)
    watch.keeps_velocity, watch.late_ns = True, late_ns
    loop, rng = WalkingLoop(DESCRIPTION, suite.gait, suite.parameters), np.random.default_rng(3)
    on_their_way: list[tuple[int, dict[str, object]]] = []
    targets, k = loop.tick(robot.state).targets, 0
    while k < periods:
        states = []
        for _ in range(at_once if rng.random() < 0.3 else 1):
            while on_their_way and on_their_way[0][0] <= k:
                commanded(robot, **on_their_way.pop(0)[1])
            if k == dead_from:
                robot.robot.without_power = ('fr',)
            robot.step()
            states.append(robot.state)
            k += 1
        for state in states:
            watch.see(state)
            if watch.failing or watch.lame:
                return k, {name[:2] for name in (*watch.failing, *watch.lame)}
            if state.time_ns % suite.tick_ns == 0:
                loop.command(0.4)
                targets = loop.tick(state).targets
            watch.tell(state.time_ns, targets)
            on_their_way.append((k + late, {
                'position': targets.position, 'velocity': targets.velocity,
                'effort': targets.effort, 'kp': KP, 'kd': KD}))
    return -1, set()


@pytest.mark.parametrize(('late', 'at_once'), [(0, 1), (1, 1), (6, 1), (1, 5)])
def test_motors_that_act_late_are_not_taken_for_ones_without_power(
        late: int, at_once: int) -> None:
    assert watched(1000, late, at_once, CARRIED_NS) == (-1, set())


def test_one_who_does_not_know_that_they_do_takes_them_for_that() -> None:
    assert watched(1000, 2, 1, 0)[0] > 0


@pytest.mark.parametrize('late', [0, 6])
def test_a_leg_without_power_is_found_among_motors_that_act_late(late: int) -> None:
    when, legs = watched(1100, late, 1, CARRIED_NS, dead_from=1000)
    assert legs == {'fr'} and 1000 < when <= 1050
