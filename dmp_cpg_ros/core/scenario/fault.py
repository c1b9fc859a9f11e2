# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Failure injection: a component of the robot fails in one of seven ways for a while.

Component and kind as in PX4's failure injection. An injector stands between robot and suite: what
the sensors tell passes :meth:`FaultInjector.sensed`, the targets that legs send pass
:meth:`FaultInjector.sent`, and what the drives make of them :meth:`FaultInjector.driven`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.parameters import Key, needed, shown
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, RobotState

WRONG_STAMP_NS, LATE_NS = 10_000_000_000, 100_000_000
"""By which a wrong clock is ahead, and by which what is slow or delayed is late [ns]."""

KINDS = {
    'off': 'says nothing', 'stuck': 'says the same all the time', 'garbage': 'says anything',
    'wrong': 'is off by a constant', 'slow': f'says something new every {1e-9 * LATE_NS:g} s only',
    'delayed': f'is {1e-9 * LATE_NS:g} s late',
    'intermittent': 'says nothing every other time, by chance'}
"""Kinds of failures, and what a component does then."""

READINGS = {'imu': ('gyro_in_base', 'acceleration_in_base'),
            'encoder': ('joint_position', 'joint_velocity'), 'contact': ('foot_force',)}
READINGS['bus'] = tuple(name for names in READINGS.values() for name in names)
"""Components that are sensors, and what they measure; the bus carries all of it."""

COMPONENTS = {
    'imu': 'turn rate and acceleration of the base', 'encoder': 'angles and speeds of the joints',
    'contact': 'forces on the feet', 'bus': 'all sensors', 'clock': "the robot's stamps",
    'link': 'the way of targets to the robot', 'node': 'who sends targets', 'joint': 'the drives'}
"""What may fail: sensors, and what else."""

WRONG: dict[str, Any] = {
    'gyro_in_base': np.array((0.3, 0.0, 0.0)), 'acceleration_in_base': np.array((2.0, 0.0, 0.0)),
    'joint_position': 0.15, 'joint_velocity': 0.0, 'foot_force': 60.0}
"""By which a wrong sensor is off [rad/s], [m/s^2], [rad], [rad/s], [N]."""

WILD = {'gyro_in_base': 20.0, 'acceleration_in_base': 100.0, 'joint_position': 2.0,
        'joint_velocity': 50.0, 'foot_force': 500.0}
"""Standard deviation of garbage, which is possible, one reading at a time."""

WRONG_TARGET, WILD_TARGET = 0.15, 2.0
"""The same of targets [rad]."""

USUAL_S, LONGEST_S = 0.5, 600.0
"""How long a failure lasts that does not say, and the longest [s]."""

PLACED = ('encoder', 'contact', 'link', 'node', 'joint')
"""Components of which every leg has its own."""

KEYS = {
    'component': Key('word', 'what fails'), 'kind': Key('word', 'what it does then'),
    'for_s': Key('number', f'how long, at most {LONGEST_S:g}', 's', f'{USUAL_S:g}'),
    'leg': Key('word', f'whose, of {", ".join(LEGS)}; some components only', default='all legs')}
"""Entries of a failure."""

Message = tuple[str, int, JointTargets]
"""Leg, stamp [ns] and targets (3,) as they are sent to the robot."""


@dataclass(frozen=True)
class Fault:
    """A failure.

    Attributes
    ----------
    component, kind : str
        Of ``COMPONENTS``, ``KINDS``.
    for_s : float
        How long it lasts [s].
    leg : str
        Whose; empty for all legs.
    """

    component: str
    kind: str
    for_s: float = USUAL_S
    leg: str = ''

    @classmethod
    def from_mapping(cls, value: Any, where: str = 'fail') -> Fault:
        """Read ``{component: imu, kind: stuck, for_s: 0.5, leg: fl}``, the last two optional.

        Raises
        ------
        DataError
            If there is no such failure; the text says what is valid.
        """
        valid = {'component': tuple(COMPONENTS), 'kind': tuple(KINDS), 'leg': LEGS}
        if not isinstance(value, Mapping) or not (
                set(needed(KEYS)) <= set(value) <= set(KEYS)):
            raise DataError(f'{where} must be a mapping with component, kind, for_s, leg, the '
                            f'last two as needed, not {shown(value)}')
        if value['kind'] is False:  # what YAML 1.1 makes of a bare off
            value = {**value, 'kind': 'off'}
        for name, words in valid.items():
            if name in value and value[name] not in words:
                raise DataError(f'{where}: {name} {shown(value[name])} is not known; valid are '
                                f'{", ".join(words)}')
        if 'leg' in value and value['component'] not in PLACED:
            raise DataError(f'{where}: no leg has a {value["component"]} of its own; '
                            f'{", ".join(PLACED)} have')
        seconds = value.get('for_s', cls.for_s)
        if isinstance(seconds, bool) or not isinstance(seconds, (int, float)) or not (
                0.0 < seconds <= LONGEST_S):
            raise DataError(f'{where}: for_s must be a number above 0 and at most {LONGEST_S:g} s'
                            f', not {shown(seconds)}')
        return cls(value['component'], value['kind'], float(seconds), value.get('leg', ''))

    def as_mapping(self) -> dict[str, Any]:
        """What :meth:`from_mapping` reads."""
        return {name: value for name, value in vars(self).items() if value != ''}

    def __str__(self) -> str:
        """In words, such as ``imu stuck for 0.5 s``."""
        return f'{self.component}{self.leg and " of "}{self.leg} {self.kind} for {self.for_s:g} s'


@dataclass
class _Acting:
    """A fault that acts, with what it holds back."""

    fault: Fault
    end_ns: int
    state: RobotState | None = None
    targets: JointTargets | None = None
    stamp_ns: int = -1


class FaultInjector:
    """Lets components of one robot fail; nothing is changed while no fault acts.

    Parameters
    ----------
    seed : int
        Of what is garbage and what is intermittent.
    """

    def __init__(self, seed: int = 0) -> None:
        self.seed(seed)
        self._acting: list[_Acting] = []
        self._states: deque[RobotState] = deque(maxlen=512)
        self._sent: dict[str, deque[Message]] = {leg: deque(maxlen=512) for leg in LEGS}
        self._targets: deque[tuple[int, JointTargets]] = deque(maxlen=512)
        self._now = 0

    def seed(self, seed: int) -> None:
        """Begin anew with what is garbage and what is intermittent."""
        self._random = np.random.default_rng((seed, 77))

    def add(self, fault: Fault, now_ns: int | None = None) -> None:
        """Let a component fail from a time on [ns], that of the last state by default."""
        now = self._now if now_ns is None else now_ns
        self._acting.append(_Acting(fault, now + round(fault.for_s * 1e9)))

    @property
    def acting(self) -> tuple[Fault, ...]:
        """What fails at present."""
        return tuple(acting.fault for acting in self._acting)

    def sensed(self, state: RobotState) -> RobotState:
        """State as the sensors tell it."""
        self._now = now = state.time_ns
        self._acting = [acting for acting in self._acting if now < acting.end_ns]
        self._states.append(state)
        for acting in self._acting:
            component, kind = acting.fault.component, acting.fault.kind
            if component in READINGS:
                source = self._source(acting, state)
                state = replace_unchecked(state, **{
                    name: self._reading(name, kind, acting.fault.leg, state, source)
                    for name in READINGS[component]})
            elif component == 'clock':
                state = replace_unchecked(state, time_ns=self._stamp(acting, now))
        return state

    def sent(self, messages: list[Message]) -> list[Message]:
        """Messages of the legs' targets as they arrive at the robot."""
        for message in messages:
            self._sent[message[0]].append(message)
        for acting in self._acting:
            if acting.fault.component in ('link', 'node'):
                legs = (acting.fault.leg,) if acting.fault.leg else LEGS
                messages = [arriving for message in messages for arriving in (
                    self._message(acting, message) if message[0] in legs else [message])]
        return messages

    def driven(self, targets: JointTargets) -> JointTargets:
        """Targets of all joints as the drives follow them."""
        self._targets.append((self._now, targets))
        for acting in self._acting:
            if acting.fault.component == 'joint':
                part = _joints(acting.fault.leg)
                other = self._followed(acting, targets)
                columns = [np.where(part, values, kept) for values, kept in zip(
                    (other.position, other.velocity, other.effort),
                    (targets.position, targets.velocity, targets.effort), strict=True)]
                targets = JointTargets(*columns)
        return targets

    # Inside --------------------------------------------------------------------------------------

    def _source(self, acting: _Acting, state: RobotState) -> RobotState:
        """State that something stuck, slow or delayed tells of."""
        kind = acting.fault.kind
        if kind == 'delayed':
            return next((of for of in self._states if of.time_ns >= self._now - LATE_NS), state)
        if acting.state is None or (
                kind == 'slow' and self._now >= acting.state.time_ns + LATE_NS):
            acting.state = state
        return acting.state

    def _reading(self, name: str, kind: str, leg: str, state: RobotState, source: RobotState
                 ) -> Array:
        """One measured quantity of a state as a failing sensor tells it."""
        right, other = _measured(state, name), _measured(source, name)
        match kind:
            case 'off':
                other = np.full(right.shape, np.nan)
            case 'intermittent':
                other = right if self._random.random() < 0.5 else np.full(right.shape, np.nan)
            case 'garbage':
                other = WILD[name] * self._random.standard_normal(right.shape)
            case 'wrong':
                other = right + WRONG[name]
        mine = np.array([leg in ('', of) for of in LEGS])
        part = np.repeat(mine, 3) if len(right) == 12 else mine if len(right) == 4 else True
        return np.where(part, other, right)

    def _stamp(self, acting: _Acting, now: int) -> int:
        """Stamp of a failing clock [ns]."""
        begun = acting.end_ns - round(acting.fault.for_s * 1e9)
        if acting.stamp_ns < 0 or (acting.fault.kind == 'slow'
                                   and now >= acting.stamp_ns + LATE_NS):
            acting.stamp_ns = now
        stamps: dict[str, Callable[[], int]] = {
            'off': lambda: 0, 'stuck': lambda: acting.stamp_ns, 'slow': lambda: acting.stamp_ns,
            'garbage': lambda: int(self._random.integers(0, 2**62)),
            'wrong': lambda: now + WRONG_STAMP_NS, 'delayed': lambda: max(now - LATE_NS, 0),
            'intermittent': lambda: now if self._random.random() < 0.5 else begun}
        return stamps[acting.fault.kind]()

    def _message(self, acting: _Acting, message: Message) -> list[Message]:
        """What becomes of a message; a failing node stamps anew, a link carries old stamps."""
        leg, stamp, targets = message
        kind, fresh = acting.fault.kind, acting.fault.component == 'node'
        if kind == 'off' or (kind == 'intermittent' and self._random.random() < 0.5) or (
                kind == 'garbage' and not fresh):  # what is corrupted is refused by its reader
            return []
        if kind == 'intermittent':
            return [message]
        if kind == 'garbage':
            wild = WILD_TARGET * self._random.standard_normal(3)
            return [(leg, stamp, JointTargets(wild, np.zeros(3), np.zeros(3)))]
        if kind == 'wrong':
            return [(leg, stamp, replace_unchecked(
                targets, position=targets.position + WRONG_TARGET))]
        before = self._sent[leg][-2][1] if len(self._sent[leg]) > 1 else 0
        if kind == 'slow' and stamp // LATE_NS != before // LATE_NS:
            return [message]
        if kind == 'slow' and not fresh:
            return []
        since = {'slow': stamp // LATE_NS * LATE_NS, 'delayed': stamp - LATE_NS}.get(
            kind, acting.end_ns - round(acting.fault.for_s * 1e9))
        old = next((of for of in self._sent[leg] if of[1] >= since), message)
        return [(leg, stamp, old[2])] if fresh else [old]

    def _followed(self, acting: _Acting, targets: JointTargets) -> JointTargets:
        """Targets that failing drives follow; one without power is moved freely."""
        kind, zero, state = acting.fault.kind, np.zeros(12), self._states[-1]
        limp = JointTargets(state.joint_position, state.joint_velocity, zero)
        match kind:
            case 'off':
                return limp
            case 'intermittent':
                return limp if self._random.random() < 0.5 else targets
            case 'garbage':
                return JointTargets(WILD_TARGET * self._random.standard_normal(12), zero, zero)
            case 'wrong':
                return replace_unchecked(targets, position=targets.position + WRONG_TARGET)
            case 'stuck':
                acting.targets = acting.targets or JointTargets(state.joint_position, zero, zero)
                return acting.targets
            case 'slow':
                if acting.targets is None or self._now >= acting.stamp_ns + LATE_NS:
                    acting.targets, acting.stamp_ns = targets, self._now
                return acting.targets
        return next((of for at, of in self._targets if at >= self._now - LATE_NS), targets)


def _measured(state: RobotState, name: str) -> Array:
    value: Array = (state.measured_rate_in_base if name == 'gyro_in_base'
                    else getattr(state, name))
    return value


def _joints(leg: str) -> Array:
    """Which of the twelve joints are of a leg, or all."""
    return np.repeat([leg in ('', of) for of in LEGS], 3)
