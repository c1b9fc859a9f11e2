# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to the mode manager: accepted with what will happen, or refused with the reason."""

from __future__ import annotations

from dataclasses import dataclass, replace

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.modes.manager import UPRIGHT_TILT, ModeManager, ModeState, enter

REQUESTS = ('stand_up', 'lie_down', 'recover')
"""What may be asked for; the services bear these names."""


@dataclass(frozen=True)
class ModeAnswer:
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
    if state.condition is None:
        return state, ModeAnswer(False, 'no state of the robot yet; is mujoco_robot running?')
    if what == 'recover':
        return _recover(modes, state)
    return _stand_up(modes, state) if what == 'stand_up' else _lie_down(modes, state)


def _stand_up(modes: ModeManager, state: ModeState) -> tuple[ModeState, ModeAnswer]:
    if state.mode in ('standing', 'rising'):
        return state, ModeAnswer(True, f'already {state.mode}')
    if state.mode == 'stopping':
        return enter(state, 'standing', (), 'lying down was called off'), ModeAnswer(
            True, 'stays standing, the gait inhibited; resume it with the service inhibit'
        )
    refusal = _not_from_here(state, 'stand up')
    if refusal:
        return state, refusal
    folded = state.mode in ('lying', 'lowering') and state.movements[:1] != ('fold',)
    return _begin(modes, state, 'rising', ('rise',) if folded else ('fold', 'rise'), 'standing')


def _lie_down(modes: ModeManager, state: ModeState) -> tuple[ModeState, ModeAnswer]:
    if state.mode in ('lying', 'lowering', 'stopping'):
        return state, ModeAnswer(True, f'already {state.mode}')
    if state.mode == 'standing':
        takes = modes.movements.duration(('lower',))
        return enter(state, 'stopping', (), 'asked to lie down'), ModeAnswer(
            True, f'lying {takes:.2f} s after the gait has come to rest; it is inhibited now'
        )
    refusal = _not_from_here(state, 'lie down')
    if refusal:
        return state, refusal
    raised = state.mode == 'rising' and state.movements[0] == 'rise'
    return _begin(modes, state, 'lowering', ('lower',) if raised else ('fold',), 'lying')


def _recover(modes: ModeManager, state: ModeState) -> tuple[ModeState, ModeAnswer]:
    if state.mode == 'recovering':
        return state, ModeAnswer(True, f'already recovering, try {state.tries}')
    if state.mode != 'damped':
        return state, ModeAnswer(
            False, f'the robot is {state.mode} and has not fallen; use stand_up or lie_down'
        )
    assert state.condition is not None
    duration = modes.movements.duration
    once = duration(('tuck', *modes.rolls(state.condition)))
    rise = duration(('fold', 'rise'))
    upright = state.condition.tilt <= UPRIGHT_TILT
    new = replace(enter(state, 'recovering', ('tuck',), 'asked to recover'), tries=0)
    after = '' if upright else f'{once:.2f} s for every try to roll over, then '
    return new, ModeAnswer(
        True,
        f'standing after {after}{duration(("tuck",)) + rise:.2f} s; '
        f'at most {modes.parameters.recovery_tries} tries',
    )


def _not_from_here(state: ModeState, what: str) -> ModeAnswer | None:
    """Refuse what would need the robot to be the right way up."""
    assert state.condition is not None
    if state.mode == 'recovering':
        return ModeAnswer(False, f'cannot {what} while recovering; it will stand up by itself')
    if state.condition.tilt > UPRIGHT_TILT:
        return ModeAnswer(
            False,
            f'cannot {what} while tilted by {state.condition.tilt:.2f} rad, more than '
            f'{UPRIGHT_TILT} rad; use recover',
        )
    return None


def _begin(
    modes: ModeManager, state: ModeState, mode: str, movements: tuple[str, ...], end: str
) -> tuple[ModeState, ModeAnswer]:
    takes = modes.movements.duration(movements)
    new = enter(state, mode, movements, f'asked for {end}')
    return new, ModeAnswer(True, f'{mode}, {end} in {takes:.2f} s')
