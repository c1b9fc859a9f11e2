# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios: what is asked of the robot, and when on the robot's clock.

A scenario is a list of events. A command event holds until the next one and is repeated like a
joystick does, so that a timeout of cmd_vel can be tried by ``command: silence``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.core.robot_state import RobotState

COMMAND_PERIOD_NS = 100_000_000
"""Period at which a command is repeated [ns]."""

Command = tuple[float, float, float]


@dataclass(frozen=True)
class Action:
    """One thing that happens.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick before which it happens [ns].
    command : tuple of float or None
        Velocity command (v_x, v_y, γ) [m/s, m/s, rad/s].
    inhibit : bool or None
        Request of the service: true stops, false resumes.
    label : str
        What to tell the user; empty for repetitions.
    """

    time_ns: int
    command: Command | None = None
    inhibit: bool | None = None
    label: str = ''


@dataclass(frozen=True)
class Scenario:
    """A scenario.

    Attributes
    ----------
    name : str
        Short name.
    duration_s : float
        Length on the robot's clock [s].
    events : tuple of (float, object)
        Time [s], then a command, ``None`` for silence, or a bool for the service.
    labels : tuple of str
        One per event.
    parameters : dict
        Parameters that every node that has them starts with.
    """

    name: str
    duration_s: float
    events: tuple[tuple[float, Command | bool | None], ...]
    labels: tuple[str, ...]
    parameters: dict[str, Any]

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any], where: str = 'scenario') -> Scenario:
        """Build from YAML.

        Raises
        ------
        DataError
            If a key is missing or unknown, or a value cannot be used; the text says which and what
            is valid.
        """
        _known(values, ('name', 'duration', 'events', 'parameters'), where)
        try:
            duration = float(values['duration'])
            entries = list(values['events'])
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(
                f'{where} needs duration (a number of seconds) and events (a list): {error}'
            ) from error
        if not 0.0 < duration <= 86400.0:
            raise DataError(f'{where}: duration = {duration} s must be positive and at most a day')
        parsed = [
            _event(entry, f'{where}, event {place + 1}') for place, entry in enumerate(entries)
        ]
        times = [at for at, _, _ in parsed]
        if times != sorted(times) or (times and times[-1] > duration):
            raise DataError(
                f'{where}: the times of the events must increase and lie within the duration'
            )
        return cls(
            str(values.get('name', 'scenario')),
            duration,
            tuple((at, what) for at, what, _ in parsed),
            tuple(label for _, _, label in parsed),
            dict(values.get('parameters') or {}),
        )

    def timeline(self, tick_ns: int) -> tuple[Action, ...]:
        """All actions in order, each at the first tick that is not before its time."""
        actions = []
        ends = [round(at * 1e9) for at, what in self.events if not isinstance(what, bool)]
        ends.append(round(self.duration_s * 1e9))
        begun = 0
        for (at, what), label in zip(self.events, self.labels, strict=True):
            time_ns = round(at * 1e9)
            if isinstance(what, bool):
                actions.append(Action(_tick_after(time_ns, tick_ns), inhibit=what, label=label))
                continue
            begun += 1
            if what is None:
                continue
            for repeated in range(time_ns, max(ends[begun], time_ns + 1), COMMAND_PERIOD_NS):
                actions.append(
                    Action(
                        _tick_after(repeated, tick_ns),
                        command=what,
                        label=label if repeated == time_ns else '',
                    )
                )
        return tuple(sorted(actions, key=lambda action: action.time_ns))

    def ticks(self, tick_ns: int) -> int:
        """Number of control ticks in the scenario."""
        return _tick_after(round(self.duration_s * 1e9), tick_ns) // tick_ns


def play(
    scenario: Scenario,
    tick_ns: int,
    step: Callable[[], RobotState],
    command: Callable[[Command], None],
    inhibit: Callable[[bool], None],
) -> None:
    """Play a scenario on the plain loop.

    Parameters
    ----------
    scenario : Scenario
        What happens.
    tick_ns : int
        Control tick [ns].
    step : callable () → RobotState
        Runs one tick of loop and robot.
    command, inhibit : callable
        Take a command and a request before the tick at which they act.
    """
    actions, place = scenario.timeline(tick_ns), 0
    for k in range(scenario.ticks(tick_ns)):
        while place < len(actions) and actions[place].time_ns <= k * tick_ns:
            action = actions[place]
            if action.command is not None:
                command(action.command)
            if action.inhibit is not None:
                inhibit(action.inhibit)
            place += 1
        step()


def _event(entry: Any, where: str) -> tuple[float, Command | bool | None, str]:
    _known(entry, ('at', 'command', 'inhibit', 'label'), where)
    if 'at' not in entry or ('command' in entry) == ('inhibit' in entry):
        raise DataError(f"{where} needs 'at' and either 'command' or 'inhibit', not {dict(entry)}")
    try:
        at, label = float(entry['at']), str(entry.get('label', ''))
    except (TypeError, ValueError) as error:
        raise DataError(f'{where}: at = {entry["at"]!r} must be a number of seconds') from error
    if not 0.0 <= at <= 86400.0:
        raise DataError(f'{where}: at = {at} s must lie between 0 and a day')
    if 'inhibit' in entry:
        if not isinstance(entry['inhibit'], bool):
            raise DataError(f'{where}: inhibit must be true or false, not {entry["inhibit"]!r}')
        return at, entry['inhibit'], label or ('inhibit' if entry['inhibit'] else 'resume')
    if entry['command'] == 'silence':
        return at, None, label or 'silence'
    _known(entry['command'], ('v_x', 'v_y', 'gamma'), where)
    try:
        command = tuple(float(entry['command'].get(key, 0.0)) for key in ('v_x', 'v_y', 'gamma'))
    except (TypeError, ValueError) as error:
        raise DataError(f'{where}: command {entry["command"]} must hold numbers') from error
    if not all(abs(value) <= 100.0 for value in command):
        raise DataError(f'{where}: command {command} must be finite and at most 100')
    v_x, v_y, gamma = command
    return at, (v_x, v_y, gamma), label or f'v = ({v_x:g}, {v_y:g}) m/s, gamma = {gamma:g} rad/s'


def _known(values: Any, valid: tuple[str, ...], where: str) -> None:
    if not isinstance(values, Mapping):
        raise DataError(f'{where} must be a mapping with {", ".join(valid)}, not {values!r}')
    for name in values:
        if name not in valid:
            raise DataError(f"{where}: '{name}' is not known; valid are {', '.join(valid)}")


def _tick_after(time_ns: int, tick_ns: int) -> int:
    if tick_ns <= 0:
        raise DmpCpgError(f'a control tick of {tick_ns} ns must be positive')
    return -(-time_ns // tick_ns) * tick_ns
