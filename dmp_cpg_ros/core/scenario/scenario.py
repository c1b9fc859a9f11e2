# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios: what is asked of the robot, and when on the robot's clock.

A scenario is a list of events. A command or a vote holds until the next one and is repeated like a
joystick does, so that a timeout of cmd_vel can be tried by ``command: silence``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.core.parameters import shown
from dmp_cpg_ros.core.robot_model.world import world_overrides
from dmp_cpg_ros.core.scenario.events import LONGEST_S, Event, known

COMMAND_PERIOD_NS = 100_000_000
"""Period at which a command is repeated [ns]."""

LASTING_KINDS = ('command', 'votes')
"""Kinds of events that hold until the next of their kind, and are repeated."""

Takers = Mapping[str, Callable[[Any], Any]]
"""Kind of event to the function that takes its value."""


@dataclass(frozen=True)
class Action:
    """One thing that happens.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick before which it happens [ns].
    kind : str
        A key of :data:`~dmp_cpg_ros.core.scenario.events.EVENT_KINDS`.
    value : object
        The event's value: (v_x, v_y, γ) [m/s, m/s, rad/s] of a command, true (stop) or false of
        inhibit, a name of gait, ...
    label : str
        What to tell the user; empty for repetitions.
    """

    time_ns: int
    kind: str
    value: Any
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
    events : tuple of Event
        In order of time.
    parameters : dict
        Parameters that every node that has them starts with, those of the world included.
    """

    name: str
    duration_s: float
    events: tuple[Event, ...]
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
        known(values, ('name', 'duration', 'events', 'parameters', 'world'), where)
        try:
            duration, entries = float(values['duration']), list(values['events'])
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f'{where} needs duration (a number of seconds) and events (a list): '
                            f'{error}') from error
        parameters = values.get('parameters') or {}
        if not isinstance(parameters, Mapping):
            raise DataError(f'{where}: parameters must be a mapping, not {shown(parameters)}')
        if not 0.0 < duration <= LONGEST_S:
            raise DataError(f'{where}: duration = {duration} s must be positive and at most a day')
        events = tuple(Event.from_mapping(entry, f'{where}, event {place + 1}')
                       for place, entry in enumerate(entries))
        times = [event.at for event in events]
        if times != sorted(times) or (times and times[-1] > duration):
            raise DataError(
                f'{where}: the times of the events must increase and lie within the duration')
        return cls(str(values.get('name', 'scenario')), duration, events,
                   {**world_overrides(values.get('world'), where), **parameters})

    def timeline(self, tick_ns: int) -> tuple[Action, ...]:
        """All actions in order, each at the first tick that is not before its time."""
        actions: list[Action] = []
        for place, event in enumerate(self.events):
            time_ns, times = round(event.at * 1e9), range(1)
            if event.kind in LASTING_KINDS:
                following = [e.at for e in self.events[place + 1:] if e.kind == event.kind]
                end_ns = round((following or [self.duration_s])[0] * 1e9)
                times = range(0, max(end_ns - time_ns, 1) if event.value else 0, COMMAND_PERIOD_NS)
            actions += [Action(_tick_after(time_ns + later, tick_ns), event.kind, event.value,
                               '' if later else event.label) for later in times]
        return tuple(sorted(actions, key=lambda action: action.time_ns))

    def ticks(self, tick_ns: int) -> int:
        """Number of control ticks in the scenario."""
        return _tick_after(round(self.duration_s * 1e9), tick_ns) // tick_ns


def play(scenario: Scenario, tick_ns: int, step: Callable[[], Any], takers: Takers) -> None:
    """Play a scenario on the plain loop.

    Parameters
    ----------
    scenario : Scenario
        What happens.
    tick_ns : int
        Control tick [ns].
    step : callable ()
        Runs one tick of loop and robot.
    takers : mapping of str to callable (value)
        Take events of their kind before the tick at which they act, such as
        :meth:`~dmp_cpg_ros.core.loop.WalkingLoop.takers`.

    Raises
    ------
    DataError
        If the scenario has events of a kind that nobody takes.
    """
    actions, place = scenario.timeline(tick_ns), 0
    missing = {action.kind for action in actions} - set(takers)
    if missing:
        raise DataError(
            f'nobody takes {", ".join(sorted(missing))}; taken are {", ".join(sorted(takers))}')
    for k in range(scenario.ticks(tick_ns)):
        while place < len(actions) and actions[place].time_ns <= k * tick_ns:
            takers[actions[place].kind](actions[place].value)
            place += 1
        step()


def _tick_after(time_ns: int, tick_ns: int) -> int:
    if tick_ns <= 0:
        raise DmpCpgError(f'a control tick of {tick_ns} ns must be positive')
    return -(-time_ns // tick_ns) * tick_ns
