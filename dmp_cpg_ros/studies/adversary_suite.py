# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on the suite: its loop without legs, under sequences of requests, commands, accepted
changes and votes, against what is promised of each stop and start.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.votes import vote_bound
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.studies.draws import Case
from dmp_cpg_ros.studies.oscillator_loop import Oscillators

LONGEST, RECOVERIES = 12.0, 5.0
"""Time after which a stop counts as one that never ends [s]; and in which radii come back to the
cycle where that is longer, in 1/(2ρr²): inhibition waits for them.
"""

FORESEEN = 10.0
"""Time within which a stop is looked for when it is predicted [s]."""

STRIDE = np.radians(200.0)
"""Turn of a leg at rest that counts as a stride [rad]: more than it may rest ahead."""


class _Expected(NamedTuple):
    """What is promised of a stop or a start: since when [ns], and times and way from then on."""

    since_ns: int
    stop: bool
    bound_s: float
    predicted_s: float
    bound_m: float = np.inf

    @property
    def words(self) -> tuple[str, ...]:
        """States in which it is done."""
        return ('at_rest',) if self.stop else ('walking', 'free')


def play(description: RobotDescription, case: Case, weaken: str = '', counts: Counter[str] | None
         = None) -> tuple[str, float]:
    """Run a case to its end.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    case : dict
        ``gait``, ``tick_s``, ``parameters`` by name, perhaps ``lead_s`` (``request_lead``) and
        ``gaits`` (entries of a gaits file by name), and ``events``: lists of a wait [s], a kind
        (``stop``, ``start``, ``command``, ``set``, ``gait``, ``vote``, ``push``, ``take_over``,
        ``leave``, ``forget``) and a value.
    weaken : str
        What is left out, one of ``CONDITIONS``.
    counts : Counter, optional
        Where stops, starts and changes are counted.

    Returns
    -------
    what : str
        What is wrong; empty when nothing is.
    closest : float
        Largest share of a bound that was needed.
    """
    counts = Counter() if counts is None else counts
    loop, closest, way = Oscillators(description, case, weaken), 0.0, 0.0
    expected: _Expected | None = None
    turned, resting = np.zeros(4), False
    for wait, kind, value in [*case['events'], [0.0, 'stop', None], [_longest(case), 'end', None]]:
        for _ in range(round(wait / case['tick_s'])):
            before, gait = phase(loop.x), loop.canon.gait.name
            held, by = loop.held and loop.stop.armed, loop.acting.gains
            loop.advance()
            moved = (phase(loop.x) - before + np.pi) % (2.0 * np.pi) - np.pi
            if loop.canon.gait.name != gait:  # states turn at rest, and no leg moves
                moved = np.zeros(4)
            turned = turned + moved if resting and loop.stop.requested else np.zeros(4)
            resting = loop.stop.requested and (resting or loop.stop.state == 'at_rest')
            way += case['tick_s'] * float(np.hypot(*loop.r[:2]))
            if not np.all(np.isfinite(loop.x)):
                return 'the oscillators diverge', closest
            if held and loop.acting.requested and not loop.held and _certain(loop, by):
                return 'C is left again', closest
            if np.abs(turned).max() > STRIDE:
                return 'a leg takes a stride while the stop is in force', closest
            if expected is None:
                if kind == 'end' and loop.stop.state == 'at_rest':
                    break
                continue
            told, share = _kept(loop, expected, way, case['tick_s'])
            if told:
                return told, closest
            closest = max(closest, share)
            if loop.stop.state in expected.words:
                expected = None
                if kind == 'end':
                    break
        resting = resting and kind != 'start'
        counts[kind] += kind != 'end'
        if kind != 'end':
            former, expected = expected, _do(loop, kind, value, expected, counts)
            way = way if expected is former else 0.0
    return ('' if loop.stop.state == 'at_rest' else 'the last stop does not end'), closest


def _longest(case: Case) -> float:
    """Time after which a stop of a case counts as one that never ends [s]."""
    given = [case['parameters'], *(value for _, kind, value in case['events'] if kind == 'set')]
    rho, r = (min(values.get(name, usual) for values in given) for name, usual in (
        ('rho', CanonicalParameters.rho), ('radius', CanonicalParameters.radius)))
    return float(max(LONGEST, RECOVERIES / (2.0 * rho * r**2)))


def _certain(loop: Oscillators, gains: Array) -> bool:
    """Whether gains (4,) are certified to hold the legs: those of votes alone only have to be able
    to hold them once they are at rest.
    """
    return loop.stop.asked or isfinite(vote_bound(Setting.of(
        loop.network, loop.parameters, 1e-9 * loop.tick_ns), gains))


def _kept(loop: Oscillators, expected: _Expected, way: float, tick_s: float) -> tuple[str, float]:
    """What is wrong of what is promised; and the share of the bound that a stop has needed."""
    since, what = (loop.now_ns - expected.since_ns) * 1e-9, expected.words[0]
    if way > expected.bound_m + 1e-9:
        return f'goes on for {way:.4f} m, at most {expected.bound_m:.4f}', 0.0
    if loop.stop.state not in expected.words:
        late = since > expected.bound_s + tick_s * 1.5
        return (f'not {what} after {since:.3f} s, at most {expected.bound_s:.3f}' if late else ''
                ), 0.0
    if since > expected.bound_s + 1e-9:
        return f'{what} after {since:.3f} s, at most {expected.bound_s:.3f}', 0.0
    unseen = expected.predicted_s == np.inf and since > FORESEEN
    if abs(since - expected.predicted_s) > 1e-6 and not unseen:
        return f'{what} after {since:.3f} s, predicted {expected.predicted_s:.3f}', 0.0
    return '', since / expected.bound_s if expected.stop else 0.0


def _do(loop: Oscillators, kind: str, value: Any, expected: _Expected | None,
        counts: Counter[str]) -> _Expected | None:
    """Do what an event says; what is expected of the stop or the start that is under way."""
    if kind == 'leave':
        loop.leave()
        return None
    if kind == 'forget':                                     # it may act earlier than predicted
        loop.forget()
        return None if expected is None else expected._replace(predicted_s=np.nan)
    if loop.gone:
        expected = _promised(loop, loop.take_over)
        if not loop.stop.requested:
            expected = None
    if loop.inhibition.requested and not loop.lead_s if kind == 'take_over' else (
            kind == 'stop' and not loop.stop.requested):
        return _promised(loop, loop.take_over if kind == 'take_over' else None)
    if kind in ('stop', 'take_over'):
        if kind == 'stop' and not loop.stop.asked:               # votes hold it, too
            loop.request(True)
        return expected
    if kind == 'start':
        news = loop.stop.requested
        predicted = loop.request(False)
        bound = loop.lead_s + (
            loop.in_force().certificate().time_to_walking if loop.certified() else np.inf)
        if not news or loop.stop.requested or predicted == np.inf:
            return None
        return _Expected(loop.now_ns, False, bound, np.nan if loop.ahead else predicted)
    if kind == 'command':
        loop.command(*value)
        if expected is not None and not expected.stop:
            return None
        if expected is not None and loop.on_its_way:
            return _promised(loop)  # it acts until the request does
    elif kind == 'vote':
        loop.vote(value)
        return None
    elif kind == 'push':
        loop.push(*value)
    else:
        try:
            accepted = not loop.change({'gait': value} if kind == 'gait' else value)
        except DmpCpgError:
            accepted = False
        counts['accepted'] += accepted
        # What was said holds for the parameters that it was said for; a stop is said anew.
        if accepted:
            return _promised(loop) if expected is not None and expected.stop else None
    return expected


def _promised(loop: Oscillators, predict: Callable[[], float] | None = None) -> _Expected:
    """What is said of a stop that is requested now or is under way."""
    predicted = predict() if predict is not None else loop.request(True)
    bound = loop.time_to_rest() if loop.certified() else np.inf
    predicted = np.nan if loop.voted_now or loop.ahead else predicted
    return _Expected(loop.now_ns, True, bound, predicted, loop.stop_distance())


def smaller(case: Case, fails: Callable[[Case], bool]) -> Case:
    """A case from which no event and no parameter can be left out without losing the failure."""
    again = True
    while again:
        again = False
        for k in reversed(range(len(case['events']))):
            events = case['events'][:k] + case['events'][k + 1:]
            if fails({**case, 'events': events}):
                case, again = {**case, 'events': events}, True
        for name in list(case['parameters']):
            rest = {key: value for key, value in case['parameters'].items() if key != name}
            if fails({**case, 'parameters': rest}):
                case, again = {**case, 'parameters': rest}, True
    return case
