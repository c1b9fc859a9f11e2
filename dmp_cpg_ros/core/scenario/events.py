# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The kinds of events that a scenario may have, one table: how each is read and what it says.

A new kind is one entry in :data:`EVENT_KINDS` here and one in the tables of those who act on it:
:class:`~dmp_cpg_ros.nodes.scenario_player.ScenarioPlayer` for the nodes, and
:meth:`~dmp_cpg_ros.core.loop.WalkingLoop.takers` for the plain loop (pushes go to
:attr:`~dmp_cpg_ros.robot.mujoco_robot.MujocoRobot.takers`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.scenario.parameter_change import read_change
from dmp_cpg_ros.core.scenario.push import read_push

Command = tuple[float, float, float]
Read = Callable[[Any, str], tuple[Any, str]]

LONGEST_S = 86400.0
"""Latest time in a scenario [s]."""


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
            raise DataError(
                f"{where} needs 'at' and exactly one of {', '.join(EVENT_KINDS)}, "
                f'not {dict(entry)}'
            )
        try:
            at = float(entry['at'])
        except (TypeError, ValueError) as error:
            raise DataError(
                f'{where}: at = {entry["at"]!r} must be a number of seconds'
            ) from error
        if not 0.0 <= at <= LONGEST_S:
            raise DataError(f'{where}: at = {at} s must lie between 0 and a day')
        value, label = EVENT_KINDS[kinds[0]](entry[kinds[0]], where)
        return cls(at, kinds[0], value, str(entry.get('label', '')) or label)


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
    try:
        v_x, v_y, gamma = (float(value.get(key, 0.0)) for key in ('v_x', 'v_y', 'gamma'))
    except (TypeError, ValueError) as error:
        raise DataError(f'{where}: command {value} must hold numbers') from error
    if not all(abs(number) <= 100.0 for number in (v_x, v_y, gamma)):
        raise DataError(f'{where}: command {value} must be finite and at most 100')
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
    try:
        weights = {leg: float(weight) for leg, weight in value.items()}
    except (TypeError, ValueError) as error:
        raise DataError(f'{where}: votes {value} must hold numbers') from error
    if not all(0.0 <= weight <= 100.0 for weight in weights.values()):
        raise DataError(f'{where}: votes {value} must be finite, at least 0 and at most 100')
    told = ', '.join(f'{leg} {weight:g}' for leg, weight in weights.items())
    return weights, f'votes {told}' if told else 'no more votes'


def _request(what: str) -> Read:
    """Reader of a request without a value: ``stand_up: true``."""

    def read(value: Any, where: str) -> tuple[bool, str]:
        if value is not True:
            raise DataError(f'{where}: {what} must be true, not {value!r}')
        return True, what.replace('_', ' ')

    return read


EVENT_KINDS: dict[str, Read] = {
    'command': _command,
    'inhibit': _inhibit,
    'gait': _gait,
    'push': read_push,
    'set': read_change,
    'votes': _votes,
    **{what: _request(what) for what in REQUESTS},
}
"""Kind of event to the function that reads its value, ``(value, where) -> (value, label)``; it
raises DataError.
"""
