# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kinds of events that a scenario may have, one table: how each is read and what it says.

A new kind is one entry in :data:`EVENT_KINDS` here and one in the tables of those who act on it:
:class:`~dmp_cpg_ros.nodes.scenario_player.ScenarioPlayer` for the nodes, and
:meth:`~dmp_cpg_ros.core.loop.WalkingLoop.takers` for the plain loop (pushes go to
:attr:`~dmp_cpg_ros.robot.mujoco_robot.MujocoRobot.takers`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, cast

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.scenario.push import FRAMES, LARGEST_MEAN_FORCE, Push
from dmp_cpg_ros.core.suite_parameters import OWNER, SuiteParameters

Command = tuple[float, float, float]
Read = Callable[[Any, str], tuple[Any, str]]

LONGEST_S = 86400.0
"""Latest time in a scenario [s]."""

LARGEST_IMPULSE = 1000.0
"""Largest component of an impulse [N s]."""

LONGEST_PUSH_S = 10.0
"""Longest push [s]."""


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
        known(entry, ('at', *EVENT_KINDS, 'label'), where)
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
    """Read a velocity, or None for silence."""
    if value == 'silence':
        return None, 'silence'
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


def _votes(value: Any, where: str) -> tuple[dict[str, float], str]:
    """Read votes for a stop: weights by leg; none end what was voted before."""
    known(value, LEGS, where)
    weights = dict(zip(value, numbers(value.values(), where, f'votes {value}', 0.0, 100.0),
                       strict=True))
    told = ', '.join(f'{leg} {weight:g}' for leg, weight in weights.items())
    return weights, f'votes {told}' if told else 'no more votes'


def _push(value: Any, where: str) -> tuple[Push, str]:
    """Read a push, such as ``{impulse: [0, 5, 0], duration: 0.1, frame: odom}``."""
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


def _request(what: str, value: Any, where: str) -> tuple[bool, str]:
    """Read a request without a value: ``stand_up: true``."""
    if value is not True:
        raise DataError(f'{where}: {what} must be true, not {value!r}')
    return True, what.replace('_', ' ')


EVENT_KINDS: dict[str, Read] = {
    'command': _command, 'inhibit': _inhibit, 'gait': _gait, 'push': _push, 'set': _change,
    'votes': _votes, **{what: partial(_request, what) for what in REQUESTS}}
"""Kind of event to the function that reads its value, ``(value, where) -> (value, label)``; it
raises DataError.
"""
