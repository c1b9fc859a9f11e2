# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Mode manager: standing, lying down, falling and getting up as one finite state machine.

- ``standing``: the gait may run.
- ``stopping``: it is to lie down; the gait is inhibited, and lying down begins once it rests.
- ``lowering``, ``rising``: movements to ``lying`` and back to ``standing``.
- ``damped``: it fell, or lies too tilted to rise; the joints are held by damping alone until
  somebody asks for ``recover``.
- ``recovering``: it rolls onto its belly, as often as it takes, and then rises.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dmp_cpg_ros.core.balance.body_command import BALANCED, WITHOUT_MOVEMENT, BodyCommand
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.phase import phase_rate
from dmp_cpg_ros.core.clock import carried
from dmp_cpg_ros.core.inhibition.supervisor import REST_ACTIVITY, REST_PHASE_RATE
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.modes import falls
from dmp_cpg_ros.core.modes.motion_library import SIDES, Movements, phase_at, unit_movement
from dmp_cpg_ros.core.parameters import parameter
from dmp_cpg_ros.core.reference.operating_range import REST_SPEED
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.transformation.leg import body_scale

UPRIGHT_TILT = 0.5
"""Tilt up to which a robot on the ground can rise without rolling over [rad]."""

ON_ITS_BACK = 0.5
"""Share of gravity along the base's z from which it lies on its back, not on its side."""

RISEN_HEIGHT = 0.8
"""Share of the standing height from which it has risen."""

LAIN_SHARE = 0.05
"""Share of the way from lying to standing up to which it lies."""

RISING_PATIENCE = 6.0
"""Time after the end of rising until it must have risen, in √(l/g)."""

STOPPING_PATIENCE_S = 15.0
"""How long the gait may take to come to rest before lying down is given up [s]."""


@dataclass(frozen=True)
class ModeParameters(falls.FallParameters):
    """How the robot begins, when it has fallen, how often it tries to get up."""

    start_mode: str = parameter(
        'standing', 'mode of the body at the start', choices=('standing', 'lying', 'damped'))
    recovery_tries: int = parameter(5, 'number of attempts to roll onto the belly', 1, 100)


@dataclass(frozen=True)
class ModeState:
    """State of the machine after a tick.

    Attributes
    ----------
    time_ns : int
        Stamp [ns].
    mode : str
        See the module's text.
    movements : tuple of str
        Movements to come, the present one first.
    begun_ns : int
        Stamp at which the present movement (or mode, where there is none) began [ns].
    tries : int
        Attempts to roll over since recovery was asked for.
    reason : str
        Why it is in this mode, for people.
    condition : BodyCondition or None
        As last measured.
    fall : FallState
        Of the detector.
    lowered : bool
        Whether the drives lower the robot by themselves.
    """

    time_ns: int
    mode: str
    movements: tuple[str, ...] = ()
    begun_ns: int = 0
    tries: int = 0
    reason: str = ''
    condition: falls.BodyCondition | None = None
    fall: falls.FallState = falls.NOT_FALLING
    lowered: bool = False


class ModeManager:
    """Finite state machine of one robot's modes; state in, state out.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    parameters : ModeParameters
        Start, fall detection, tries.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(self, description: RobotDescription, parameters: ModeParameters,
                 legs: RobotLegs | None = None) -> None:
        """Derive the movements and their durations."""
        self._sense, self._scale = falls.BodySense(description, legs), body_scale(description)
        self.movements = Movements(description)
        self._stance_height, low = description.stance_height, description.belly_depth
        self._lain_height = low + LAIN_SHARE * (self._stance_height - low)
        self._detector = falls.FallDetector(parameters, description.stance_height)
        self.parameters = parameters

    def initial_state(self) -> ModeState:
        """State at the start."""
        return ModeState(0, self.parameters.start_mode, reason='as started')

    def picked_up(self, state: ModeState, measured: RobotState) -> ModeState:
        """Mode of a robot after a restart in the middle of things, or at a start at which it was
        to stand, unless it was to be damped: what it is found in. One that is neither up nor down
        is lowered.
        """
        condition = self._sense.condition(measured)
        if state.mode == 'damped':
            return state
        if condition.tilt > UPRIGHT_TILT:
            found = 'damped'
        elif condition.height >= RISEN_HEIGHT * self._stance_height:
            found = 'standing'
        elif condition.height > self._lain_height:
            return enter(state, 'lowering', ('fold',), 'found half up')
        else:
            found = 'lying'
        if found == state.mode:
            return state
        return replace(state, mode=found, reason='found like that')

    def command(self, state: ModeState) -> BodyCommand:
        """What the legs have to do at the tick of a state."""
        if not state.movements:
            return WITHOUT_MOVEMENT[state.mode]
        name = state.movements[0]
        x, decay = phase_at(self._share(state)), unit_movement().phase_decay
        return BodyCommand(state.mode, name, x, -decay / self.movements.named(name).duration * x)

    def feedback(self, mode: ModeState, state: RobotState) -> PostureFeedback:
        """What the legs get while the balance controller does not act."""
        state = self._as_moved(mode, state)
        torque = self._sense.carrying_torque(state, self._carried(mode)).tolist()
        return PostureFeedback(torque, ((0.0, 0.0, 0.0),) * 4, ((0.0, 0.0),) * 4, (0.0, 0.0, 0.0),
                               self.command(mode), state.joint_position.tolist())

    def _as_moved(self, mode: ModeState, state: RobotState) -> RobotState:
        """State in which legs that are not felt are where the movement has them: a leg that begins
        anew would begin where its joints were when they were felt last.
        """
        if state.felt_legs is None or mode.mode == 'damped':
            return state
        name, share = (mode.movements[0], self._share(mode)) if mode.movements else ('fold', 1.0)
        planned = self.movements.named(name).posture(share, state.joint_position)
        felt = np.repeat(state.felt_legs, len(planned) // len(state.felt_legs))
        return replace_unchecked(
            state, joint_position=np.where(felt, state.joint_position, planned))

    def _carried(self, state: ModeState) -> float:
        """Share of the weight that the legs are to carry by feed-forward in a movement."""
        if not state.movements:
            return 0.0
        begin, end = self.movements.named(state.movements[0]).support
        share = min(self._share(state), 1.0)
        rest = (1.0 - share) if begin > end else share
        return max(begin, end) * min(rest / 0.3, 1.0)

    def step(self, mode: ModeState, state: RobotState, x: Array, x_dot: Array, r: Array,
             activity: Sequence[float]) -> ModeState:
        """Advance the mode to the tick of a measured state.

        Parameters
        ----------
        mode : ModeState
            After the last tick, requests included.
        state : RobotState
            Measured.
        x, x_dot : ndarray (4, 2)
            Canonical states and rates.
        r : ndarray (3,)
            Reference.
        activity : sequence of four floats
            Swing activity of the legs at the tick before.
        """
        at_rest = (
            mode.mode == 'stopping'
            and self._scale.foot_speed(float(r[0]), float(r[1]), float(r[2])) <= REST_SPEED
            and float(np.abs(phase_rate(x, x_dot)).max()) <= REST_PHASE_RATE
            and max(activity) <= REST_ACTIVITY)
        return self.advance(mode, self._sense.condition(state), state.time_ns, at_rest)

    def advance(self, state: ModeState, condition: falls.BodyCondition, time_ns: int, at_rest: bool
                ) -> ModeState:
        """Advance by one tick to the body's condition at a stamp; `at_rest` says whether phases,
        reference and swings of the gait rest.
        """
        begun, fall, sign = state.begun_ns, state.fall, ''
        if time_ns < state.time_ns:
            begun = carried(begun, state.time_ns, time_ns)
            fall = fall.carried(state.time_ns, time_ns)
        begun = time_ns if begun < 0 else begun
        if state.mode not in ('damped', 'recovering'):
            fall, sign = self._detector.step(fall, condition, time_ns, state.mode in BALANCED)
        state = replace_unchecked(
            state, time_ns=time_ns, condition=condition, begun_ns=begun, fall=fall)
        if sign:
            return _enter_now(state, 'damped', f'fell at {time_ns * 1e-9:.3f} s: {sign}')
        if state.lowered and state.mode in BALANCED and (
                condition.height < RISEN_HEIGHT * self._stance_height):
            return _enter_now(state, 'lowering', 'the drives lower the robot by themselves; see '
                              'who moves the joints', ('fold',))
        if state.mode == 'lying' and condition.tilt > UPRIGHT_TILT:
            return _enter_now(state, 'damped', f'lay tilted by {condition.tilt:.2f} rad at '
                              f'{time_ns * 1e-9:.3f} s, from where it cannot stand up')
        if state.mode == 'stopping':
            return self._stopped(state, at_rest)
        if state.movements and self._elapsed(state) >= self._time_of(state.movements[0]):
            return self._moved(state, condition)
        return state

    def _stopped(self, state: ModeState, at_rest: bool) -> ModeState:
        if at_rest:
            return _enter_now(state, 'lowering', state.reason, ('lower',))
        if self._elapsed(state) > STOPPING_PATIENCE_S:
            return _enter_now(state, 'standing', 'lying down was given up: the gait did not rest '
                              f'within {STOPPING_PATIENCE_S:g} s')
        return state

    def _moved(self, state: ModeState, condition: falls.BodyCondition) -> ModeState:
        """Go on after a movement."""
        if following := state.movements[1:]:
            return _enter_now(state, state.mode, state.reason, following)
        if state.mode == 'lowering':
            return _enter_now(state, 'lying', state.reason)
        if state.mode == 'recovering':
            return self._rolled(state, condition)
        if condition.height >= RISEN_HEIGHT * self._stance_height:
            return _enter_now(state, 'standing', 'risen')
        patience = RISING_PATIENCE * self.movements.time_unit
        if self._elapsed(state) < self._time_of('rise') + patience:
            return state
        return _enter_now(
            state, 'damped', f'did not rise by {state.time_ns * 1e-9:.3f} s: '
            f'{condition.height:.3f} m over its feet, less than {RISEN_HEIGHT:g} of '
            f'{self._stance_height:.3f} m')

    def _rolled(self, state: ModeState, condition: falls.BodyCondition) -> ModeState:
        """Rise when the belly is down; else roll, or give up."""
        rolls = self.rolls(condition)
        if not rolls:
            return _enter_now(state, 'rising', state.reason, ('fold', 'rise'))
        if state.tries >= self.parameters.recovery_tries:
            return _enter_now(state, 'damped', f'still tilted by {condition.tilt:.2f} rad after '
                              f'{state.tries} tries')
        rolling = _enter_now(state, 'recovering', state.reason, (*rolls, 'tuck'))
        return replace(rolling, tries=state.tries + 1)

    @staticmethod
    def rolls(condition: falls.BodyCondition) -> tuple[str, ...]:
        """Movements that bring the belly down from how it lies."""
        if condition.tilt <= UPRIGHT_TILT:
            return ()
        side = SIDES[0] if condition.down_in_base[1] > 0.0 else SIDES[1]
        on_its_back = condition.down_in_base[2] > ON_ITS_BACK
        names = ('turn', 'tip', 'over') if on_its_back else ('push', 'over')
        return tuple(f'{name}_{side}' for name in names)

    def _elapsed(self, state: ModeState) -> float:
        return max(state.time_ns - state.begun_ns, 0) * 1e-9 if state.begun_ns >= 0 else 0.0

    def _share(self, state: ModeState) -> float:
        """Time since the present movement began, as a share of its duration."""
        return self._elapsed(state) / self.movements.named(state.movements[0]).duration

    def _time_of(self, movement: str) -> float:
        return self.movements.named(movement).duration + self.movements.pause


def enter(state: ModeState, mode: str, movements: tuple[str, ...], reason: str) -> ModeState:
    """Enter a mode at the next tick, whose stamp is not known yet."""
    return replace(state, mode=mode, movements=movements, reason=reason, begun_ns=-1,
                   fall=falls.NOT_FALLING)


def _enter_now(state: ModeState, mode: str, reason: str, movements: tuple[str, ...] = ()
               ) -> ModeState:
    return replace(enter(state, mode, movements, reason), begun_ns=state.time_ns)
