# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random settings of the suite, gaits of a user's own among them, and random sequences of
requests, commands, changes and votes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import TOPOLOGIES
from dmp_cpg_ros.core.canonical.inhibition import AUTO
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import OWNER
from dmp_cpg_ros.core.voting.parameters import SUM, WINNER_TAKE_ALL
from dmp_cpg_ros.studies.draws import Case, log_uniform
from dmp_cpg_ros.studies.oscillator_loop import GAITS, gaits_of

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
    gaits = own_gaits(rng) if rng.random() < 0.5 else {}
    return {'gait': str(rng.choice(list(gaits or GAITS))), 'gaits': gaits,
            'parameters': parameters,
            'tick_s': float(rng.choice([0.001, 0.002, 0.004, 0.004, 0.01])), 'events': [],
            'lead_s': float(rng.choice([0.0, 0.024, log_uniform(rng, 0.002, 0.2),
                                        rng.uniform(0.05, 0.2)]))}


def own_gaits(rng: np.random.Generator) -> Case:
    """Entries of a gaits file: one to three gaits with any lags, cadences and duty factors."""
    return {f'own_{k}': _own_gait(rng) for k in range(rng.integers(1, 4))}


def _own_gait(rng: np.random.Generator) -> Case:
    """Lags of any size or in twelfths of a cycle; cadences that need not rise with the speed."""
    lags = rng.uniform(0.0, 1.0, 4) if rng.random() < 0.5 else rng.integers(0, 12, 4) / 12.0
    rows = int(rng.integers(1, 5))
    speeds = np.cumsum(rng.uniform(0.05, 0.7, rows)) - (0.05 if rng.random() < 0.5 else 0.0)
    slow = log_uniform(rng, 0.1, 0.6)
    entry = {'lag': dict(zip(LEGS, lags.tolist(), strict=True)), 'speed': speeds.tolist(),
             'cadence': [slow * log_uniform(rng, 0.7, 2.5) for _ in range(rows)],
             'duty_factor': rng.uniform(0.3, 0.9, rows).tolist()}
    if rng.random() < 0.7:
        entry['highest_speed'] = float(speeds[-1] + rng.uniform(0.0, 1.0))
    return entry


def random_events(rng: np.random.Generator, case: Case, weaken: str = '') -> list[list[Any]]:
    """Random events of a case; the first two start the gait. Where a condition is left out they
    are mostly about that one.
    """
    gaits, voting = list(gaits_of(case)), 'voting' in case['parameters']
    events: list[list[Any]] = [[0.1, 'start', None],
                               [0.0, 'command', [float(rng.uniform(0.0, 3.0)), 0.0, 0.0]]]
    if weaken and rng.random() < 0.9:
        return events + _telling(rng, gaits, False, _TELLING.get(weaken))
    if rng.random() < 0.6:
        return events + _telling(rng, gaits, voting)
    for _ in range(rng.integers(3, 14)):
        kind = str(rng.choice(
            ['stop', 'start', 'change', 'command', 'vote', 'push', 'take_over'],
            p=(0.28, 0.22, 0.27, 0.08, 0.03, 0.08, 0.04)))
        value: Any = None
        if kind == 'change':
            kind, value = _changing(rng, gaits)
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


def _changing(rng: np.random.Generator, gaits: Sequence[str]) -> tuple[str, Any]:
    """Another gait or another value of a parameter."""
    if rng.random() < 0.3:
        return 'gait', str(rng.choice(gaits))
    names = OWNER.keys() & {*_NUMBERS, 'inhibited_legs', 'coupling_graph'}
    return 'set', random_change(rng, sorted(names))


def _votes(rng: np.random.Generator) -> Case:
    """Weights of some legs, mostly whole ones."""
    legs = rng.permutation(LEGS)[:rng.integers(1, 5)]
    return {str(leg): float(rng.choice([1.0, 1.0, rng.uniform(0.02, 1.0)])) for leg in legs}


def _push(rng: np.random.Generator) -> list[float]:
    """Margin [m], and how long it lasts [s]."""
    return [float(rng.uniform(-0.05, 0.1)), log_uniform(rng, 0.004, 1.0)]


def _telling(rng: np.random.Generator, gaits: Sequence[str], voting: bool,
             about: int | None = None) -> list[list[Any]]:
    """Sequences that once told that something was missing, at other times and values."""
    def change(*names: str) -> Case:
        return random_change(rng, names)

    def soon() -> float:
        return log_uniform(rng, 0.004, 0.6) if rng.random() < 0.8 else 0.0

    if voting and rng.random() < 0.7:                        # changes while votes hold the gait
        return [entry for _ in range(2) for entry in (
            [2.0, 'vote', _votes(rng)],
            *([4.0 * soon(), *_changing(rng, gaits)] for _ in range(3)), [3.0, 'start', None])]
    kind = rng.integers(7) if about is None else about
    if kind == 6:                                            # who is started again within a lead
        return [entry for _ in range(3) for entry in (
            [2.0 + soon(), 'stop', None], [0.1 * soon(), 'forget', None],
            [0.1 * soon(), str(rng.choice(('leave', 'start', 'forget'))), None],
            [0.5 * soon(), 'take_over', None], [0.1 * soon(), 'stop', None],
            [soon(), str(rng.choice(('leave', 'forget'))), None], [soon(), 'take_over', None],
            [0.1 * soon(), *_changing(rng, gaits)], [3.0, 'start', None],
            [0.1 * soon(), str(rng.choice(('leave', 'forget'))), None],
            [0.1 * soon(), 'take_over', None])]
    if kind == 0:                                            # stops within starts
        return [entry for _ in range(3) for entry in (
            [2.0, 'stop', None], [2.0, 'start', None], [soon(), 'stop', None],
            [soon(), 'start', None], [soon(), 'stop', None], [soon(), 'take_over', None])]
    if kind == 1:                                            # what acts is not what was accepted
        first = [1.5, 'set', change('cadence_scale')] if about is not None else (
            [[1.5, 'set', change('cadence_scale')], [1.5, 'gait', str(rng.choice(gaits))],
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
            [2.0 + soon(), 'stop', None], [0.1 * soon(), *_changing(rng, gaits)],
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
        events += random_events(rng, case)[2:4]
    return {**case, 'events': events}
