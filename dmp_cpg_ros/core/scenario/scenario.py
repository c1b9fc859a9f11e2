# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Scenarios: what is asked of the robot, and when on the robot's clock.

A scenario is a list of events. A command or a vote holds until the next one and is repeated like a
joystick does, so that a timeout of cmd_vel can be tried by ``command: silence``.

A new kind of event is one entry in :data:`EVENT_KINDS` here and one in the table of
:class:`~dmp_cpg_ros.nodes.scenario_player.ScenarioPlayer`, which delivers it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, cast

from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.parameters import Key, shown
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.robot_model.world import PREFIX, WORLDS, world_overrides
from dmp_cpg_ros.core.scenario.fault import Fault
from dmp_cpg_ros.core.scenario.push import FRAMES, LARGEST_MEAN_FORCE, LONGEST_PUSH_S, Push
from dmp_cpg_ros.core.suite_parameters import OWNER, SuiteParameters

Command = tuple[float, float, float]
Read = Callable[[Any, str], tuple[Any, str]]

LONGEST_S = 86400.0
"""Latest time in a scenario [s]."""

LARGEST_IMPULSE = 1000.0
"""Largest component of an impulse [N s]."""

COMMAND_PERIOD_NS = 100_000_000
"""Period at which a command is repeated [ns]."""

KEYS = {
    'name': Key('text', 'short name', default='scenario'),
    'duration': Key('number', "length on the robot's clock, at most a day", 's'),
    'events': Key('list', 'what happens, and when, in order of time; `[]` for nothing'),
    'parameters': Key('mapping', 'parameters that every node that has them starts with',
                      default='none'),
    'world': Key('mapping', f'`kind` of ground ({", ".join(WORLDS)}) and its numbers: parameters '
                 f'of the robot without their `{PREFIX}`', default='flat')}
"""Entries of a scenario."""

EVENT_KEYS = {
    'at': Key('number', "time on the robot's clock, not before that of the event above", 's'),
    'label': Key('text', 'what is told when it happens', default='what the event does')}
"""Entries of an event beside one of :data:`EVENT_KINDS`."""

LASTING_KINDS = ('command', 'votes')
"""Kinds of events that hold until the next of their kind, and are repeated."""

SENT_KINDS = (*LASTING_KINDS, 'push', 'fail')
"""Kinds of events that may be there before the first tick; for all others a node is asked."""


@dataclass(frozen=True)
class Event:
    """One event as the scenario's file says it.

    Attributes
    ----------
    at : float
        Time on the robot's clock [s].
    kind : str
        A key of ``EVENT_KINDS``.
    value : object
        What the kind's reader made of the file's value.
    label : str
        What to tell the user.
    """

    at: float
    kind: str
    value: Any
    label: str

    @classmethod
    def from_mapping(cls, entry: Any, where: str) -> Event:
        """Read one entry of a scenario's list; raises DataError that says what is valid."""
        first, *others = EVENT_KEYS
        known(entry, (first, *EVENT_KINDS, *others), where)
        kinds = [kind for kind in EVENT_KINDS if kind in entry]
        if 'at' not in entry or len(kinds) != 1:
            raise DataError(f"{where} needs 'at' and exactly one of {', '.join(EVENT_KINDS)}, not "
                            f'{dict(entry)}')
        (at,) = numbers([entry['at']], where, f'at = {entry["at"]!r} s', 0.0, LONGEST_S)
        value, label = EVENT_KINDS[kinds[0]](entry[kinds[0]], where)
        return cls(at, kinds[0], value, str(entry.get('label', '')) or label)


def numbers(values: Iterable[Any], where: str, what: str, low: float, high: float) -> list[float]:
    """Numbers within a range; raises DataError that says what they are."""
    try:
        found = [float(value) for value in values]
    except (TypeError, ValueError) as error:
        raise DataError(f'{where}: {what} must be numbers: {error}') from error
    if not all(low <= number <= high for number in found):
        raise DataError(f'{where}: {what} must be finite, at least {low:g} and at most {high:g}')
    return found


def known(values: Any, valid: tuple[str, ...], where: str) -> None:
    """Raise DataError unless the values are a mapping with valid keys only."""
    if not isinstance(values, Mapping):
        raise DataError(f'{where} must be a mapping with {", ".join(valid)}, not {values!r}')
    for name in values:
        if name not in valid:
            raise DataError(f"{where}: '{name}' is not known; valid are {', '.join(valid)}")


def _command(value: Any, where: str) -> tuple[Command | None, str]:
    """Read a velocity, such as ``{v_x: 0.5, v_y: 0.0, gamma: 0.0}``, or ``silence``."""
    if value == 'silence':
        return None, 'silence'
    if not isinstance(value, Mapping):
        raise DataError(f'{where}: command must be silence, or a mapping with v_x, v_y, gamma, '
                        f'not {value!r}')
    known(value, ('v_x', 'v_y', 'gamma'), where)
    v_x, v_y, gamma = numbers((value.get(key, 0.0) for key in ('v_x', 'v_y', 'gamma')), where,
                              f'command {value}', -100.0, 100.0)
    return (v_x, v_y, gamma), f'v = ({v_x:g}, {v_y:g}) m/s, gamma = {gamma:g} rad/s'


def _inhibit(value: Any, where: str) -> tuple[bool, str]:
    """Read a request of the service: true stops, false resumes."""
    if not isinstance(value, bool):
        raise DataError(f'{where}: inhibit must be true or false, not {value!r}')
    return value, 'inhibit' if value else 'resume'


def _gait(value: Any, where: str) -> tuple[str, str]:
    """Read the name of a gait; whether there is such a gait, whoever changes it knows."""
    if not isinstance(value, str) or not value:
        raise DataError(f'{where}: gait must be the name of a gait, not {value!r}')
    return value, f'gait {value}'


def _votes(value: Any, where: str) -> tuple[dict[str, float] | None, str]:
    """Read votes for a stop: weights by leg; none end what was voted before."""
    known(value, LEGS, where)
    weights = dict(zip(value, numbers(value.values(), where, f'votes {value}', 0.0, 100.0),
                       strict=True))
    told = ', '.join(f'{leg} {weight:g}' for leg, weight in weights.items())
    return (weights, f'votes {told}') if told else (None, 'no more votes')


def _push(value: Any, where: str) -> tuple[Push, str]:
    """Read a push, such as ``{impulse: [0, 5, 0], duration: 0.1, frame: base_footprint}``, or in
    the frame odom or world.
    """
    known(value, ('impulse', 'duration', 'frame'), f'{where}: push')
    impulse = value.get('impulse')
    if not isinstance(impulse, (list, tuple)) or len(impulse) != 3:
        raise DataError(f'{where}: push needs impulse: [x, y, z] in N s, not {impulse!r}')
    x, y, z = numbers(impulse, where, f'impulse {impulse} N s', -LARGEST_IMPULSE, LARGEST_IMPULSE)
    (duration,) = numbers([value.get('duration', Push.duration_s)], where,
                          'duration of the push', 1e-6, LONGEST_PUSH_S)
    most = LARGEST_MEAN_FORCE * duration
    numbers((x, y, z), where, f'impulse {impulse} N s over {duration:g} s', -most, most)
    frame = value.get('frame', FRAMES[0])
    if frame not in FRAMES:
        raise DataError(f"{where}: push in frame '{frame}'; valid are {', '.join(FRAMES)}")
    label = f'push of ({x:g}, {y:g}, {z:g}) N s over {duration:g} s in {frame}'
    return Push((x, y, z), duration, frame), label


def _change(value: Any, where: str) -> tuple[dict[str, Any], str]:
    """Read a change of parameters of one owner, all at once, such as ``{inhibition_gain: 300}``.

    Whole numbers are floats where the parameter is one, lists are tuples. Ranges are left to the
    owner, which refuses what is outside.
    """
    if not isinstance(value, Mapping) or not value:
        raise DataError(f'{where}: set must be a mapping from parameters to values, not {value!r}')
    known(value, tuple(sorted(OWNER)), f'{where}: set')
    owners = sorted({OWNER[name] for name in value})
    if len(owners) > 1:
        raise DataError(f'{where}: {", ".join(value)} belong to {" and ".join(owners)}; make one '
                        'event for each')
    floats = {field.name for part in SuiteParameters().sets.values()
              for field in fields(cast(Any, part)) if isinstance(field.default, float)}
    values = {name: tuple(entry) if isinstance(entry, list)
              else float(entry) if name in floats and type(entry) is int else entry
              for name, entry in value.items()}
    return values, 'set ' + ', '.join(f'{name} = {entry}' for name, entry in value.items())


def _fail(value: Any, where: str) -> tuple[Fault, str]:
    """Read a failure, such as ``{component: imu, kind: stuck, for_s: 0.5}``."""
    fault = Fault.from_mapping(value, f'{where}: fail')
    return fault, f'fail: {fault}'


def _request(what: str, value: Any, where: str) -> tuple[bool, str]:
    """Read a request without a value: ``stand_up: true``."""
    if value is not True:
        raise DataError(f'{where}: {what} must be true, not {value!r}')
    return True, what.replace('_', ' ')


EVENT_KINDS: dict[str, Read] = {
    'command': _command, 'inhibit': _inhibit, 'gait': _gait, 'push': _push, 'set': _change,
    'votes': _votes, 'fail': _fail, **{what: partial(_request, what) for what in REQUESTS}}
"""Kind of event to the function that reads its value, ``(value, where) -> (value, label)``; it
raises DataError.
"""


@dataclass(frozen=True)
class Action:
    """One thing that happens.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick before which it happens [ns].
    kind : str
        A key of :data:`EVENT_KINDS`.
    value : object
        The event's value: (v_x, v_y, γ) [m/s, m/s, rad/s] of a command, true (stop) or false of
        inhibit, a name of gait, ...; None where something ends and nothing is sent.
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
        known(values, tuple(KEYS), where)
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
        before = 0.0
        for place, event in enumerate(events):
            if not before <= event.at <= duration:
                raise DataError(
                    f'{where}, event {place + 1}: at = {event.at:g} s must not be before the '
                    f'event above it, nor after the duration: {before:g} to {duration:g} s')
            before = event.at
        return cls(str(values.get('name', KEYS['name'].default)), duration, events,
                   {**world_overrides(values.get('world'), where), **parameters})

    def timeline(self, tick_ns: int) -> tuple[Action, ...]:
        """All actions in order, each at the first tick that is not before its time; what nodes are
        asked for at 0 s at their second one, for before their first they refuse.

        Raises
        ------
        DataError
            If no tick is left for an event that does not last; one that does would end at once.
        """
        actions, end_ns = list[Action](), self.ticks(tick_ns) * tick_ns
        for place, event in enumerate(self.events):
            time_ns, times = round(event.at * 1e9), range(1)
            if event.kind not in SENT_KINDS:
                time_ns = max(time_ns, tick_ns)
            if event.kind not in LASTING_KINDS and _tick_after(time_ns, tick_ns) >= end_ns:
                raise DataError(
                    f'event {place + 1}, {event.label}: at = {event.at:g} s leaves no tick: '
                    f'the last is at {(end_ns - tick_ns) * 1e-9:g} s')
            if event.kind in LASTING_KINDS:
                following = [e.at for e in self.events[place + 1:] if e.kind == event.kind]
                until_ns = round((following or [self.duration_s])[0] * 1e9)
                ends = event.value is None
                times = range(0, 1 if ends else max(until_ns - time_ns, 1), COMMAND_PERIOD_NS)
            actions += [Action(_tick_after(time_ns + later, tick_ns), event.kind, event.value,
                               '' if later else event.label) for later in times]
        return tuple(sorted(actions, key=lambda action: action.time_ns))

    def ticks(self, tick_ns: int) -> int:
        """Number of control ticks in the scenario."""
        return _tick_after(round(self.duration_s * 1e9), tick_ns) // tick_ns


def _tick_after(time_ns: int, tick_ns: int) -> int:
    if tick_ns <= 0:
        raise DmpCpgError(f'a control tick of {tick_ns} ns must be positive')
    return -(-time_ns // tick_ns) * tick_ns
