# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on the suite: its loop without legs, in random settings under random sequences of
requests, commands, accepted changes and votes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import TOPOLOGIES
from dmp_cpg_ros.core.canonical.inhibition import AUTO
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.votes import vote_bound
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import OWNER
from dmp_cpg_ros.core.voting.parameters import SUM, WINNER_TAKE_ALL
from dmp_cpg_ros.studies.draws import Case, log_uniform
from dmp_cpg_ros.studies.oscillator_loop import GAITS, Oscillators

LONGEST = 12.0
"""Time after which a stop counts as one that never ends [s]."""

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
        ``gait``, ``tick_s``, ``parameters`` by name, perhaps ``lead_s`` (``request_lead``), and
        ``events``: lists of a wait [s], a kind (``stop``, ``start``, ``command``, ``set``,
        ``gait``, ``vote``, ``push``, ``take_over``, ``leave``, ``forget``) and a value.
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
    for wait, kind, value in [*case['events'], [0.0, 'stop', None], [LONGEST, 'end', None]]:
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
    if abs(since - expected.predicted_s) > 1e-6:
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
    predicted = np.nan if loop.voted_now or loop.ahead else min(predicted, LONGEST)
    return _Expected(loop.now_ns, True, bound, predicted, loop.stop_distance())


_NUMBERS = {'coupling_gain': (8.0, 400.0), 'rho': (0.5, 20.0), 'inhibition_gain': (60.0, 4000.0),
            'region_radius': (0.03, 1.2), 'cadence_scale': (0.7, 4.0), 'alpha_r': (0.7, 6.0),
            'capture_speed': (0.02, 2.0), 'max_speed': (0.05, 4.0), 'braking': (0.2, 6.0),
            'radius': (0.3, 3.0), 'gait_change_rate': (0.05, 0.5)}
_DEFAULTS = {'max_lateral_speed': 0.3, 'max_turn_rate': 1.0, 'auto_inhibit': False}


def random_change(rng: np.random.Generator, names: Sequence[str]) -> Case:
    """A random value of one of some parameters."""
    name = str(rng.choice(names))
    if name == 'inhibited_legs':
        if rng.random() < 0.3:
            return {name: (AUTO,)}
        count = 1 + rng.choice(4, p=(0.5, 0.3, 0.15, 0.05))
        return {name: tuple(rng.permutation(LEGS)[:count].tolist())}
    if name == 'coupling_graph':
        return {name: str(rng.choice(TOPOLOGIES))}
    return {name: log_uniform(rng, *_NUMBERS[name])}


_LIMITS = {'max_lateral_speed': 0.0, 'max_turn_rate': 0.0}
_TELLING = {'places': 0, 'acting': 1, 'holding': 2, 'arming': 4, 'leads': 5, 'way': 5}
"""Which of the sequences that once told something is about a condition."""
_GUIDED = {'arming': {'alpha_r': (0.7, 4.0), 'max_speed': (1.0, 4.0)},
           'acting': {'alpha_r': (3.0, 6.0), 'max_speed': (0.3, 2.0),
                      'cadence_scale': (0.7, 0.8), 'gait_change_rate': (0.05, 0.25),
                      'inhibition_gain': (900.0, 2500.0)},
           'leads': {'alpha_r': (3.0, 6.0), 'cadence_scale': (1.0, 3.0)},
           'way': {'max_speed': (0.3, 2.0)}}
"""Parameters with which a condition that is left out shows."""


def setting(rng: np.random.Generator, weaken: str = '') -> Case:
    """Random parameters, certified or not; where a condition is left out near those it is for."""
    guided = _GUIDED.get(weaken, {})
    names = rng.permutation(list(_NUMBERS))[:rng.integers(0, 4 if guided else 7)]
    parameters: Case = dict(_DEFAULTS)
    for name in (*names, 'coupling_graph', 'inhibited_legs'):
        parameters |= random_change(rng, [name])
    if guided:
        parameters |= {name: log_uniform(rng, *span) for name, span in guided.items()}
        return {'gait': str(rng.choice(list(GAITS))), 'tick_s': 0.004, 'events': [],
                'lead_s': 0.2 if weaken in ('leads', 'way') else 0.0, 'parameters': parameters}
    if rng.random() < 0.2:
        parameters |= {'voting': True, 'vote_fade': float(rng.uniform(0.05, 3.0)),
                       'vote_majority': int(rng.integers(1, 5)),
                       'vote_rule': str(rng.choice((SUM, WINNER_TAKE_ALL), p=(0.8, 0.2))),
                       'vote_resume': bool(rng.random() < 0.3)}
        if rng.random() < 0.3:
            parameters['vote_limit'] = float(rng.uniform(0.05, 1.0))
        parameters['silence_weight'] = 0.0   # silent sensors vote after what is predicted
    return {'gait': str(rng.choice(list(GAITS))), 'parameters': parameters,
            'tick_s': float(rng.choice([0.001, 0.002, 0.004, 0.004, 0.01])), 'events': [],
            'lead_s': float(rng.choice([0.0, 0.024, log_uniform(rng, 0.002, 0.2),
                                        rng.uniform(0.05, 0.2)]))}


def random_events(rng: np.random.Generator, voting: bool, weaken: str = '') -> list[list[Any]]:
    """Random events; the first two start the gait. Where a condition is left out they are mostly
    about that one.
    """
    events: list[list[Any]] = [[0.1, 'start', None],
                               [0.0, 'command', [float(rng.uniform(0.0, 3.0)), 0.0, 0.0]]]
    if weaken and rng.random() < 0.9:
        return events + _telling(rng, False, _TELLING.get(weaken))
    if rng.random() < 0.6:
        return events + _telling(rng, voting)
    for _ in range(rng.integers(3, 14)):
        kind = str(rng.choice(
            ['stop', 'start', 'change', 'command', 'vote', 'push', 'take_over'],
            p=(0.28, 0.22, 0.27, 0.08, 0.03, 0.08, 0.04)))
        value: Any = None
        if kind == 'change':
            kind, value = _changing(rng)
        elif kind == 'command':
            value = [float(rng.uniform(-1.0, 3.0)), 0.0, float(rng.uniform(-0.5, 0.5))]
        elif kind == 'vote':
            if not voting:
                continue
            value = _votes(rng)
        elif kind == 'push':
            value = _push(rng)
        same = rng.random() < 0.2                            # within the tick of the one before
        events.append([0.0 if same else log_uniform(rng, 0.004, 3.0), kind, value])
    return events


def _changing(rng: np.random.Generator) -> tuple[str, Any]:
    """Another gait or another value of a parameter."""
    if rng.random() < 0.3:
        return 'gait', str(rng.choice(list(GAITS)))
    names = OWNER.keys() & {*_NUMBERS, 'inhibited_legs', 'coupling_graph'}
    return 'set', random_change(rng, sorted(names))


def _votes(rng: np.random.Generator) -> Case:
    """Weights of some legs, mostly whole ones."""
    legs = rng.permutation(LEGS)[:rng.integers(1, 5)]
    return {str(leg): float(rng.choice([1.0, 1.0, rng.uniform(0.02, 1.0)])) for leg in legs}


def _push(rng: np.random.Generator) -> list[float]:
    """Margin [m], and how long it lasts [s]."""
    return [float(rng.uniform(-0.05, 0.1)), log_uniform(rng, 0.004, 1.0)]


def _telling(rng: np.random.Generator, voting: bool, about: int | None = None
             ) -> list[list[Any]]:
    """Sequences that once told that something was missing, at other times and values."""
    def change(*names: str) -> Case:
        return random_change(rng, names)

    def soon() -> float:
        return log_uniform(rng, 0.004, 0.6) if rng.random() < 0.8 else 0.0

    if voting and rng.random() < 0.7:                        # changes while votes hold the gait
        return [entry for _ in range(2) for entry in (
            [2.0, 'vote', _votes(rng)],
            *([4.0 * soon(), *_changing(rng)] for _ in range(3)), [3.0, 'start', None])]
    kind = rng.integers(7) if about is None else about
    if kind == 6:                                            # who is started again within a lead
        return [entry for _ in range(3) for entry in (
            [2.0 + soon(), 'stop', None], [0.1 * soon(), 'forget', None],
            [0.1 * soon(), str(rng.choice(('leave', 'start', 'forget'))), None],
            [0.5 * soon(), 'take_over', None], [0.1 * soon(), 'stop', None],
            [soon(), str(rng.choice(('leave', 'forget'))), None], [soon(), 'take_over', None],
            [0.1 * soon(), *_changing(rng)], [3.0, 'start', None],
            [0.1 * soon(), str(rng.choice(('leave', 'forget'))), None],
            [0.1 * soon(), 'take_over', None])]
    if kind == 0:                                            # stops within starts
        return [entry for _ in range(3) for entry in (
            [2.0, 'stop', None], [2.0, 'start', None], [soon(), 'stop', None],
            [soon(), 'start', None], [soon(), 'stop', None], [soon(), 'take_over', None])]
    if kind == 1:                                            # what acts is not what was accepted
        first = [1.5, 'set', change('cadence_scale')] if about is not None else (
            [[1.5, 'set', change('cadence_scale')], [1.5, 'gait', str(rng.choice(list(GAITS)))],
             [1.5, 'set', change('max_speed') | _LIMITS]][rng.integers(3)])
        return [first,
                [soon(), 'set', change('inhibition_gain', 'region_radius', 'cadence_scale')],
                [soon(), 'stop', None], [3.0, 'start', None],
                [1.0, 'set', change('cadence_scale')], [soon(), 'stop', None]]
    if kind == 2:                                            # changes at rest
        return [[1.0, 'stop', None], *([2.0, 'set', change(
            'inhibited_legs', 'coupling_gain', 'inhibition_gain', 'region_radius', 'rho')]
            for _ in range(3)), [2.0, 'start', None]]
    if kind == 3:                                            # stops of a robot that was pushed
        return [entry for _ in range(3) for entry in (
            [soon(), 'push', _push(rng)], [soon(), 'stop', None], [soon(), 'push', _push(rng)],
            [2.0, 'start', None])]
    if kind == 5:                                            # requests that overtake others
        return [entry for _ in range(3) for entry in (
            [2.0 + soon(), 'stop', None], [0.1 * soon(), *_changing(rng)],
            [0.1 * soon(), 'start', None], [0.1 * soon(), 'stop', None], [0.1 * soon(), 'command',
            [float(rng.uniform(0.0, 3.0)), 0.0, 0.0]], [3.0, 'start', None])]
    lower = _LIMITS if rng.random() < 0.5 else {}
    return [[0.0, 'command', [3.0, 0.0, 0.0]],
            [1.5, 'set', change('max_speed', 'alpha_r') | lower], [soon(), 'stop', None]]


def varied(rng: np.random.Generator, case: Case) -> Case:
    """A case with other waits, or with one event more or less."""
    events = [[max(0.0, wait * float(np.exp(0.2 * rng.normal()))), kind, value]
              for wait, kind, value in case['events']]
    if rng.random() < 0.3 and len(events) > 3:
        events.pop(int(rng.integers(2, len(events))))
    if rng.random() < 0.5:
        events += random_events(rng, 'voting' in case['parameters'])[2:4]
    return {**case, 'events': events}


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
