# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to the mode manager: accepted with what will happen, or refused with the reason."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.modes.manager import UPRIGHT_TILT, ModeManager, ModeState, enter

_DONE_IN = {'stand_up': ('standing', 'rising'), 'lie_down': ('lying', 'lowering', 'stopping'),
            'recover': ('recovering',)}
"""Modes in which there is nothing left to do for a request."""

REQUESTS = tuple(_DONE_IN)
"""What may be asked for; the services bear these names."""


class ModeAnswer(NamedTuple):
    """Answer to a request.

    Attributes
    ----------
    accepted : bool
        Whether it will happen (or has already).
    text : str
        What will happen and how long it takes, or why not.
    """

    accepted: bool
    text: str


def request(modes: ModeManager, state: ModeState, what: str) -> tuple[ModeState, ModeAnswer]:
    """Take a request between two ticks; it acts from the next on.

    Parameters
    ----------
    state : ModeState
        State after the last tick.
    what : str
        One of ``REQUESTS``.

    Returns
    -------
    state : ModeState
    answer : ModeAnswer

    Raises
    ------
    ParameterError
        If there is no such request.
    """
    if what not in REQUESTS:
        raise ParameterError(f"request '{what}' must be one of {', '.join(REQUESTS)}")
    mode, condition, duration = state.mode, state.condition, modes.movements.duration
    if condition is None:
        return state, ModeAnswer(False, 'no state of the robot yet; is mujoco_robot running?')
    if mode in _DONE_IN[what]:
        tries = f', try {state.tries}' if mode == 'recovering' else ''
        return state, ModeAnswer(True, f'already {mode}{tries}')
    if what == 'recover':
        return _recover(modes, state)
    if mode == 'stopping':
        return enter(state, 'standing', (), 'lying down was called off'), ModeAnswer(
            True, 'stays standing; the gait goes on at a command, unless the service inhibit has '
            'stopped it')
    if mode == 'standing':
        return enter(state, 'stopping', (), 'asked to lie down'), ModeAnswer(
            True, f'lying {duration(("lower",)):.2f} s after the gait has come to rest; it is '
            'inhibited now')
    refused = f'cannot {what.replace("_", " ")} while'
    if mode == 'recovering':
        return state, ModeAnswer(False, f'{refused} recovering; it will stand up by itself')
    if condition.tilt > UPRIGHT_TILT:
        return state, ModeAnswer(False, f'{refused} tilted by {condition.tilt:.2f} rad, more than '
                                 f'{UPRIGHT_TILT} rad; use recover')
    movements: tuple[str, ...]
    if what == 'stand_up':
        folded = mode in ('lying', 'lowering') and state.movements[:1] != ('fold',)
        new, end, movements = 'rising', 'standing', ('rise',) if folded else ('fold', 'rise')
    else:
        raised = mode == 'rising' and state.movements[0] == 'rise'
        new, end, movements = 'lowering', 'lying', ('lower',) if raised else ('fold',)
    return enter(state, new, movements, f'asked for {end}'), ModeAnswer(
        True, f'{new}, {end} in {duration(movements):.2f} s')


def _recover(modes: ModeManager, state: ModeState) -> tuple[ModeState, ModeAnswer]:
    if state.mode != 'damped':
        return state, ModeAnswer(
            False, f'the robot is {state.mode} and has not fallen; use stand_up or lie_down')
    assert state.condition is not None
    rolls, duration = modes.rolls(state.condition), modes.movements.duration
    once, then = duration(('tuck', *rolls)), duration(('tuck',)) + duration(('fold', 'rise'))
    after = f'{once:.2f} s for every try to roll over, then ' if rolls else ''
    new = replace(enter(state, 'recovering', ('tuck',), 'asked to recover'), tries=0)
    return new, ModeAnswer(True, f'standing after {after}{then:.2f} s; '
                           f'at most {modes.parameters.recovery_tries} tries')
