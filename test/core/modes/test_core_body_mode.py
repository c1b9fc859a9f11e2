# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The body's mode: what may follow what, when it has fallen, and what travels to the legs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from core_examples import TICK, TICK_NS, quadruped, standing_state

from dmp_cpg_ros.core.balance.body_command import MODES, MOVING, BodyCommand
from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.modes.falls import (
    BodyCondition,
    BodySense,
    FallDetector,
    FallParameters,
    FallState,
)
from dmp_cpg_ros.core.modes.leg_control import LegMotion
from dmp_cpg_ros.core.modes.manager import ModeManager, ModeParameters, ModeState
from dmp_cpg_ros.core.modes.motion_library import MOVEMENT_NAMES, Movements
from dmp_cpg_ros.core.modes.requests import REQUESTS, request
from dmp_cpg_ros.core.primitives.spring_damper import SpringState
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.transformation.leg import LegParameters, LegPrimitive, LegState
from dmp_cpg_ros.layouts import MODE_ROWS, MOVEMENT_ROWS, command_rows, read_command_rows

ROBOT = quadruped()
HEIGHT = ROBOT.stance_height
UPRIGHT = BodyCondition((0.0, 0.0, -1.0), 0.0, HEIGHT, 1.0)
FOLDED = replace(UPRIGHT, height=0.05, support=0.0)
LEFT = BodyCondition((0.0, 1.0, 0.0), math.pi / 2.0, 0.1, 0.0)
BACK = BodyCondition((0.0, -0.1, 0.995), 3.0, 0.1, 0.0)


class Machine:
    """A state machine tick by tick, under conditions of the test's choice."""

    def __init__(self, start_mode: str = 'standing', **changes: object) -> None:
        self.modes = ModeManager(ROBOT, ModeParameters(start_mode=start_mode, **changes))
        self.state: ModeState = self.modes.initial_state()
        self.time_ns = 0
        self.seen = [self.state.mode]

    def go(self, seconds: float, condition: BodyCondition = UPRIGHT,
           at_rest: bool = True) -> Machine:
        for _ in range(max(1, round(seconds / TICK))):
            self.state = self.modes.advance(self.state, condition, self.time_ns, at_rest)
            self.time_ns += TICK_NS
            if self.state.mode != self.seen[-1]:
                self.seen.append(self.state.mode)
        return self

    def ask(self, what: str) -> tuple[bool, str]:
        self.state, answer = request(self.modes, self.state, what)
        return answer.accepted, answer.text


@pytest.mark.parametrize('mode', ['standing', 'lying', 'damped'])
@pytest.mark.parametrize('tilt', [0.0, 0.45, 0.55, 0.9, 1.5])
def test_whatever_lies_gets_up_by_one_of_the_services(mode: str, tilt: float) -> None:
    down = BodyCondition((0.0, math.sin(tilt), -math.cos(tilt)), tilt, 0.05, 0.0)
    machine = Machine(mode)
    if mode == 'standing':
        machine.go(0.1).ask('lie_down')
    machine.go(20.0, down)
    assert machine.state.mode == ('lying' if tilt < 0.5 and mode != 'damped' else 'damped')
    assert machine.ask('stand_up')[0] or machine.ask('recover')[0]


@pytest.mark.parametrize('command', [
    *(BodyCommand(mode) for mode in MODES if mode not in MOVING),
    *(BodyCommand(mode, name, x, -x) for mode in MOVING for name in ('rise', 'push_left')
      for x in (1.0, 1.0 / 3.0, 1e-300)),
])
def test_the_rows_of_a_command_read_back_bit_for_bit(command: BodyCommand) -> None:
    assert read_command_rows(*command_rows(command)) == command


@pytest.mark.parametrize(('rows', 'text'), [
    ({}, 'must be 1'), ({'mode/standing': 1.0, 'mode/lying': 1.0}, 'must be 1'),
    ({'mode/standing': 0.5}, 'must be 1'), ({'mode/rising': 1.0}, 'with 0 movements'),
    ({'mode/standing': 1.0, 'movement/rise': 0.5}, 'with 1 movements'),
    ({'mode/rising': 1.0, 'movement/rise': 0.5, 'movement/lower': 0.5}, 'with 2 movements'),
    ({'mode/rising': 1.0, 'movement/rise': 1.5}, 'phase 1.5'),
    ({'mode/rising': 1.0, 'movement/rise': float('nan')}, 'phase nan'),
])
def test_other_rows_are_refused_with_what_is_valid(rows: dict[str, float], text: str) -> None:
    position = [rows.get(name, 0.0) for name in (*MODE_ROWS, *MOVEMENT_ROWS)]
    with pytest.raises(DataError, match=text):
        read_command_rows(position, [0.0] * len(position))


def test_the_table_of_movements_has_their_names() -> None:
    assert [Movements(ROBOT).named(name).name for name in MOVEMENT_NAMES] == list(MOVEMENT_NAMES)


def test_up_and_down_again() -> None:
    machine = Machine('lying').go(0.1, FOLDED)
    accepted, text = machine.ask('stand_up')
    duration = machine.modes.movements.duration(('rise',))
    assert accepted and f'{duration:.2f} s' in text
    assert machine.go(duration + 3 * TICK, UPRIGHT).state.mode == 'standing'
    assert machine.ask('lie_down')[0]
    assert machine.go(1.0, at_rest=False).state.mode == 'stopping'
    assert machine.go(duration + 3 * TICK, FOLDED).state.mode == 'lying'
    assert machine.seen == ['lying', 'rising', 'standing', 'stopping', 'lowering', 'lying']


def test_the_phase_of_a_movement_falls_from_one_by_the_canonical_system() -> None:
    machine = Machine('lying').go(0.1, FOLDED)
    machine.ask('stand_up')
    phases = []
    for _ in range(100):
        machine.go(TICK)
        phases.append(machine.modes.command(machine.state).x)
    assert phases[0] == 1.0
    ratios = np.array(phases[1:]) / np.array(phases[:-1])
    np.testing.assert_allclose(ratios, ratios[0], rtol=1e-12)
    assert ratios[0] < 1.0


@pytest.mark.parametrize(('mode', 'condition', 'what', 'accepted'), [
    ('standing', UPRIGHT, 'stand_up', True),
    ('standing', UPRIGHT, 'recover', False),
    ('lying', FOLDED, 'lie_down', True),
    ('lying', FOLDED, 'recover', False),
    ('damped', LEFT, 'stand_up', False),
    ('damped', BACK, 'lie_down', False),
    ('damped', FOLDED, 'stand_up', True),
    ('damped', FOLDED, 'lie_down', True),
    ('damped', BACK, 'recover', True),
])
def test_what_cannot_be_is_refused_with_the_reason(
        mode: str, condition: BodyCondition, what: str, accepted: bool) -> None:
    machine = Machine(mode)
    machine.state = machine.modes.advance(machine.state, condition, 0, True)
    before = machine.state.mode
    done, text = machine.ask(what)
    assert done == accepted and len(text) > 10
    if not accepted:
        assert machine.state.mode == before
        assert 'recover' in text or 'stand_up' in text


def test_nothing_is_accepted_before_the_robot_has_said_anything() -> None:
    for what in REQUESTS:
        accepted, text = Machine().ask(what)
        assert not accepted and 'mujoco_robot' in text


def test_an_unknown_request_is_an_error() -> None:
    with pytest.raises(ParameterError, match='stand_up, lie_down, recover'):
        Machine().go(TICK).ask('jump')


def test_recovering_refuses_everything_else_and_ends_on_the_feet() -> None:
    machine = Machine('damped').go(0.1, BACK)
    assert machine.ask('recover')[0]
    machine.go(0.1, BACK)
    for what in ('stand_up', 'lie_down'):
        accepted, text = machine.ask(what)
        assert not accepted and 'recovering' in text
    assert machine.ask('recover')[0]
    machine.go(1.0, BACK).go(1.0, LEFT).go(2.0, FOLDED).go(5.0, UPRIGHT)
    assert machine.seen == ['damped', 'recovering', 'rising', 'standing']
    assert machine.state.tries == 1


def test_it_gives_up_after_its_tries_and_says_so() -> None:
    machine = Machine('damped', recovery_tries=2).go(0.1, BACK)
    machine.ask('recover')
    machine.go(30.0, BACK)
    assert machine.seen == ['damped', 'recovering', 'damped']
    assert '2 tries' in machine.state.reason


def test_a_robot_that_does_not_rise_is_damped() -> None:
    machine = Machine('lying').go(0.1, FOLDED)
    machine.ask('stand_up')
    machine.go(5.0, FOLDED)
    assert machine.state.mode == 'damped' and 'did not rise' in machine.state.reason


def test_who_calls_lying_down_off_is_told_that_the_gait_may_go_on() -> None:
    """As the stop is one that came by itself, a command starts it again: it was said to stay
    inhibited.
    """
    machine = Machine().go(0.1)
    machine.ask('lie_down')
    machine.go(0.1, at_rest=False)
    accepted, told = machine.ask('stand_up')
    assert accepted and 'goes on at a command' in told


def test_lying_down_is_given_up_when_the_gait_never_rests() -> None:
    machine = Machine().go(0.1)
    machine.ask('lie_down')
    machine.go(20.0, at_rest=False)
    assert machine.seen == ['standing', 'stopping', 'standing']
    assert 'given up' in machine.state.reason


def test_lying_down_can_be_called_off() -> None:
    machine = Machine().go(0.1, at_rest=False)
    machine.ask('lie_down')
    assert machine.go(0.1, at_rest=False).state.mode == 'stopping'
    assert machine.ask('stand_up')[0]
    assert machine.go(1.0).state.mode == 'standing'


@pytest.mark.parametrize('mode', ['standing', 'lying'])
def test_a_tilt_is_a_fall_in_every_mode_that_is_not_already_one(mode: str) -> None:
    machine = Machine(mode).go(0.5, UPRIGHT if mode == 'standing' else FOLDED).go(0.5, LEFT)
    assert machine.state.mode == 'damped' and 'tilted' in machine.state.reason


@pytest.mark.parametrize(('condition', 'word'), [
    (replace(UPRIGHT, height=0.3 * HEIGHT), 'over its feet'),
    (replace(UPRIGHT, support=0.0), 'no ground'),
])
def test_low_or_without_ground_is_a_fall_of_a_robot_that_should_stand(
        condition: BodyCondition, word: str) -> None:
    machine = Machine().go(0.5).go(1.0, condition)
    assert machine.state.mode == 'damped' and word in machine.state.reason
    assert Machine('lying').go(2.0, condition).state.mode == 'lying'


def test_a_moment_is_no_fall() -> None:
    parameters = FallParameters()
    machine = Machine().go(0.5)
    for _ in range(5):
        machine.go(0.8 * parameters.fall_delay, LEFT).go(0.1)
        machine.go(0.8 * parameters.fall_support_delay, replace(UPRIGHT, support=0.0)).go(0.1)
    assert machine.state.mode == 'standing'


def test_the_detector_keeps_its_delays() -> None:
    detector = FallDetector(FallParameters(fall_delay=0.2), HEIGHT)
    state, sign, k = FallState(), '', 0
    while not sign:
        state, sign = detector.step(state, LEFT, k * TICK_NS, True)
        k += 1
    assert (k - 1) * TICK == pytest.approx(0.2)


@pytest.mark.parametrize(('load', 'fallen'), [
    ((0.0, 0.0), True), ((0.3, 5.0), True), ((0.4, 0.2), True), ((0.0, 0.9), False),
    ((0.7, 0.0), False), ((1.0, -2.0), False)])
def test_without_imu_a_robot_falls_whose_feet_do_not_carry_it(
        load: tuple[float, float], fallen: bool) -> None:
    blind = replace(UPRIGHT, load=load)
    for machine in (Machine().go(0.5), Machine('lying', fall_support=0.08)):
        stands = machine.state.mode == 'standing'
        machine.go(1.0, blind)
        assert (machine.state.mode == 'damped') == (fallen and stands)
    assert Machine(fall_support=0.0).go(2.0, blind).state.mode == 'standing'


def test_flight_without_imu_is_no_fall_but_an_imu_now_and_then_does_not_hide_one() -> None:
    weightless, landed = replace(UPRIGHT, load=(0.0, 0.0)), replace(UPRIGHT, load=(1.6, 1.6))
    machine = Machine().go(0.5)
    for _ in range(10):
        machine.go(0.15, weightless).go(0.25, landed)
    assert machine.state.mode == 'standing'
    for _ in range(25):
        machine.go(0.036, weightless).go(TICK)
    assert machine.state.mode == 'damped' and 'no IMU' in machine.state.reason


def test_what_was_carried_without_imu_is_forgotten_once_it_is_believed() -> None:
    machine = Machine().go(0.5).go(0.15, replace(UPRIGHT, load=(0.0, 0.0)))
    assert machine.state.fall.load[0] < 1.0
    assert machine.go(3.0).state.fall == FallState()


def test_load_is_what_feet_and_torques_tell_where_there_is_no_imu() -> None:
    sound, nothing = standing_state(ROBOT), np.full(3, np.nan)
    weight = ROBOT.mass * GRAVITY
    sense, quarters = BodySense(ROBOT), np.full(4, 0.25 * weight)
    assert sense.condition(sound).load is None
    blind = replace(sound, gyro_in_base=nothing, foot_force=quarters,
                    joint_effort=sense.carrying_torque(sound, 0.9))
    assert sense.condition(blind).load == pytest.approx((1.0, 0.9), rel=0.02)
    one = replace(blind, foot_force=np.array((np.nan, 0.0, 0.0, 0.0)))
    assert sense.condition(one).load == pytest.approx((0.25, 0.9), rel=0.02)
    assert sense.condition(replace(blind, felt_legs=(False,) * 4)).load is None
    assert sense.condition(replace(blind, felt_legs=(True, *(False,) * 3))).load is not None


def test_a_fall_is_found_on_a_clock_that_is_set_back() -> None:
    machine = Machine()
    machine.time_ns = 1_000_000_000_000
    machine.go(0.08, LEFT).time_ns = 500_000_000_000
    machine.go(0.04, LEFT)  # together longer than the delay
    assert machine.state.mode == 'damped'


def test_a_movement_goes_on_where_it_is_when_the_clock_is_set_back() -> None:
    machine = Machine('lying').go(0.1, FOLDED)
    machine.time_ns = 1_000_000_000_000
    machine.go(TICK, FOLDED).ask('stand_up')
    phase = machine.modes.command(machine.go(0.3, FOLDED).state).x
    machine.time_ns = 500_000_000_000
    machine.go(TICK, FOLDED)
    assert machine.modes.command(machine.state).x == phase < 1.0
    machine.time_ns = 0
    assert machine.go(5.0).state.mode == 'standing'


def rolled(state: RobotState, angle: float) -> RobotState:
    return replace(state, base_quaternion=np.array(
        (math.sin(0.5 * angle), 0.0, 0.0, math.cos(0.5 * angle))))


@pytest.mark.parametrize('angle', [-3.0, -1.0, 0.0, 0.4, 2.0])
def test_tilt_and_down_are_those_of_the_orientation(angle: float) -> None:
    condition = BodySense(ROBOT).condition(rolled(standing_state(ROBOT), angle))
    assert condition.tilt == pytest.approx(abs(angle), abs=1e-6)
    np.testing.assert_allclose(
        condition.down_in_base, (0.0, -math.sin(angle), -math.cos(angle)), atol=1e-12)


@pytest.mark.parametrize('contacts', [0.0, np.nan])
def test_height_is_over_the_lowest_sole_and_support_is_what_the_torques_press(
        contacts: float) -> None:
    sense = BodySense(ROBOT)
    state = replace(standing_state(ROBOT), foot_force=np.full(4, contacts))
    for share in (0.0, 0.4, 1.0):
        carried = replace(state, joint_effort=sense.carrying_torque(state, share))
        condition = sense.condition(carried)
        assert condition.height == pytest.approx(HEIGHT, abs=1e-9)
        assert condition.support == pytest.approx(share, rel=0.02, abs=1e-9)


def test_the_carrying_torque_balances_weight_without_a_moment() -> None:
    state = rolled(standing_state(ROBOT), 0.2)
    torque = BodySense(ROBOT).carrying_torque(state, 1.0)
    up = np.array((0.0, math.sin(0.2), math.cos(0.2)))
    force, moment = np.zeros(3), np.zeros(3)
    for i, leg in enumerate(map(LegKinematics, ROBOT.legs)):
        q = state.joint_position[3 * i:3 * i + 3]
        f = -np.linalg.solve(leg.jacobian_in_base(q).T, torque[3 * i:3 * i + 3])
        force += f
        moment += np.cross(leg.foot_in_base(q) - ROBOT.com_in_base, f)
    np.testing.assert_allclose(force, ROBOT.mass * GRAVITY * up, rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(moment, 0.0, atol=1e-4)


@pytest.mark.parametrize('share', [0.1, 0.5, 0.9])
def test_a_leg_that_begins_unfelt_in_a_movement_begins_where_the_movement_has_it(share: float
                                                                                 ) -> None:
    """Its joints were felt last while the robot stood, and it lies or rises since."""
    machine = Machine('lying').go(0.1, FOLDED)
    path = machine.modes.movements.named('rise').path
    stale = replace(standing_state(ROBOT), felt_legs=(True, True, True, False))
    told = machine.modes.feedback(machine.state, stale).measured
    assert np.allclose(told[9:], path[0, 9:], atol=1e-9)
    assert (told[:9] == stale.joint_position[:9]).all()
    assert machine.ask('stand_up')[0]
    machine.go(share * machine.modes.movements.named('rise').duration, FOLDED)
    feedback = machine.modes.feedback(machine.state, stale)
    anew = LegMotion(slice(9, 12), machine.modes.movements, LegPrimitive(
        'rr', ROBOT, LegParameters()).transformation)
    _, leg, goal, _ = anew.step(None, LegState(SpringState((0.0,) * 3, (0.0,) * 3), 0.0),
                                feedback.command, feedback.measured[9:], 0.0)
    here = path[round(share * (len(path) - 1)), 9:]
    assert np.abs(leg.joints.position - here).max() < 0.05
    assert np.abs(goal - here).max() < 0.05 < np.abs(stale.joint_position[9:] - path[0, 9:]).max()


def test_what_is_not_felt_of_a_robot_that_has_fallen_is_what_was_felt_last() -> None:
    fallen = Machine('damped').go(0.1, LEFT)
    stale = replace(standing_state(ROBOT), felt_legs=(False, True, True, True))
    told = fallen.modes.feedback(fallen.state, stale).measured
    assert (told == stale.joint_position).all()
