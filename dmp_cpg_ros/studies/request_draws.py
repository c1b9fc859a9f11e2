# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random sequences of all that a user may ask of the running nodes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.scenario.fault import COMPONENTS, KINDS, PLACED
from dmp_cpg_ros.core.suite_parameters import CANONICAL, INHIBITION, OWNER
from dmp_cpg_ros.studies.draws import Case, log_uniform
from dmp_cpg_ros.studies.random_commands import GAITS, NUMBERS, WORDS, setting
from dmp_cpg_ros.suite_table import POSTURE, RECORDER, ROBOT, WALKING_NODES

EVERY, SAME_TICK, MOST = (0.08, 1.6), 0.15, 25.0
"""Time between two events [s], share of those that come within the tick of the one before, and
time of the last one [s].
"""

QUIET, QUIET_S = 0.5, 1.5
"""Share of stops and starts after which nothing is asked for a while, and how long [s]."""

WALKS_S, RESTS_S, STANDS_S, RECOVERS_S = 3.0, 5.0, 4.0, 16.0
"""How long a robot is given at the end to walk, to rest, to stand up, and to recover [s]."""

REST, SHUT_DOWN, INTERRUPT = ENDS = ('inhibit', 'shut_down', 'interrupt')
"""How a sequence ends: at rest, or while the robot walks: by the transition ``shutdown`` of every
node, in an order that is drawn, or by Ctrl-C.
"""

TOGETHER = 0.3
"""Share of kills of two nodes at once."""

APART = {CANONICAL, INHIBITION}
"""Nodes that do not die at once: each remembers the gait for the other."""

FAILS = (0.02, 0.3)
"""How long a component fails [s]."""

PUSH = 0.25
"""Largest change of speed that a push would give the free body [m/s]."""

ODD = (math.nan, math.inf, -1.0, 1e300, -5, 3, True, '', 'nope', 'fl', 'trot', ['fl', 'fl'],
       [1.0, math.nan], [True], ['nope'])
"""Values of which most are wrong for most parameters."""

STRANGE = ('', 'nope', 'rho ', 'gait', 'leg', 'robot', 'lock_step', 'use_sim_time', 'control_rate',
           'seed', 'expected_nodes', 'kp')
"""Names of parameters of which nodes have some, which cannot change, or none."""

GAINS = tuple(of.name for of in fields(PostureParameters) if isinstance(of.default, float)
              and of.default > 0.0 and of.name not in ('activity_rate', 'reach'))
"""Gains of the posture that change by a little."""


def drawn(seed: int, robot: str, mass: float, kills: int = 0) -> Case:
    """A sequence of events and how the suite starts; robot file, its mass [kg], and how often
    nodes are killed within, and once more in the walk at the end.
    """
    rng = np.random.default_rng(seed)
    events, at = [list(event) for event in _before(rng)], 0.5
    while at < MOST:
        kind, value = _event(rng, mass)
        events.append([round(at, 3), kind, value])
        at += 0.0 if rng.random() < SAME_TICK else log_uniform(rng, *EVERY)
        if kind == 'inhibit' and rng.random() < QUIET:
            at += QUIET_S
    case = {
        'seed': seed, 'robot': robot, 'gait': str(rng.choice(GAITS)),
        'start_pose': str(rng.choice(['standing', 'lying'], p=(0.8, 0.2))),
        'control_rate': float(rng.choice([125.0, 250.0])),
        'stamped_cmd_vel': bool(rng.random() < 0.3), 'voting': bool(rng.random() < 0.3),
        'events': events, 'end': _end(rng)}
    return _with_kills(case, kills) if kills else case


def _with_kills(case: Case, kills: int) -> Case:
    """The same sequence with nodes that are killed between its events, or in the tick of one; who
    shuts down is not started again, so it ends in another way.
    """
    rng = np.random.default_rng((case['seed'], 9))
    events = case['events']
    for _ in range(kills):
        nodes = _victims(rng)
        # Ahead of what comes in the same tick; a node that is inactive for a moment is awaited by
        # those who come back, and so are these by who waits for it.
        with_events = [at for at, kind, _ in events if at > 1.0 and kind != 'cycle']
        at = float(rng.choice(with_events) if with_events and rng.random() < 0.5
                   else round(rng.uniform(1.0, MOST), 3))
        cycled = any(kind == 'cycle' and of == at for of, kind, _ in events)
        place = next((k for k, event in enumerate(events)
                      if (event[0] > at if cycled else event[0] >= at)), len(events))
        events.insert(place, [at, 'kill', nodes])
    end = [INTERRUPT, True] if case['end'][0] == SHUT_DOWN else case['end']
    return {**case, 'end': end, 'dies': _victims(rng)}


def _victims(rng: np.random.Generator) -> list[str]:
    """One node or two that die at once."""
    nodes = [str(name) for name in rng.permutation([of for of in WALKING_NODES if of != ROBOT])]
    count = 1 + (rng.random() < TOGETHER and not APART.issuperset(nodes[:2]))
    return nodes[:count]


def ending(case: Case) -> list[list[Any]]:
    """Events by which a robot is brought to walk, whatever was before, and to its end."""
    at = max([event[0] for event in case['events']], default=0.0) + 0.5
    end, failed = [], may_lie(case)
    for wait, kind, value in (
            (0.0, 'votes', {}), (1.0, 'command', 'silence'), (STANDS_S, 'stand_up', True),
            *([(RECOVERS_S, 'recover', True), (STANDS_S, 'stand_up', True)] if failed else ()),
            (0.0, 'command', {'v_x': 0.2}),
            *([(0.5 * WALKS_S, 'inhibit', False), (0.5 * WALKS_S, 'kill', case['dies'])]
              if 'dies' in case else [(WALKS_S, 'inhibit', False)]),
            (RESTS_S, *case['end'])):
        end.append([round(at, 3), kind, value])
        at += wait
    return [*end, [round(at, 3), 'command', 'silence']]


def ends_at_rest(case: Case) -> bool:
    """Whether the robot is brought to rest before the nodes end."""
    return bool(case['end'][0] == REST)


def may_lie(case: Case) -> bool:
    """Whether something fails of which doc/faults.md says that the robot may lie down or fall."""
    return any(kind == 'fail' and value['component'] == 'joint'
               for _, kind, value in case['events'])


def _end(rng: np.random.Generator) -> list[Any]:
    kind = str(rng.choice(ENDS, p=(0.5, 0.25, 0.25)))
    order = [str(name) for name in rng.permutation([*WALKING_NODES, RECORDER])]
    return [kind, order if kind == SHUT_DOWN else True]


def _before(rng: np.random.Generator) -> Iterator[tuple[float, str, Any]]:
    """What is asked before the first tick, and how the gait is started."""
    if rng.random() < 0.5:
        yield 0.0, str(rng.choice(['stand_up', 'lie_down', 'recover'])), True
    if rng.random() < 0.5:
        yield 0.0, 'inhibit', bool(rng.random() < 0.5)
    yield 0.2, 'command', {'v_x': 0.4}
    yield 0.3, 'inhibit', False


def _event(rng: np.random.Generator, mass: float) -> tuple[str, Any]:
    kind = str(rng.choice(
        ['command', 'twist', 'inhibit', 'mode', 'set', 'gait', 'parameters', 'cycle', 'transition',
         'push', 'fail', 'at_once', 'votes'],
        p=(0.18, 0.04, 0.27, 0.06, 0.12, 0.07, 0.06, 0.05, 0.02, 0.04, 0.04, 0.03, 0.02)))
    match kind:
        case 'command':
            return kind, _command(rng)
        case 'twist':
            return kind, _twist(rng)
        case 'mode':
            return _mode(rng)
        case 'set':
            return kind, _settings(rng)
        case 'cycle':
            return kind, _cycle(rng)
        case 'transition':
            return kind, [str(rng.choice(WALKING_NODES)), int(rng.choice([0, 1, 3, 99, 10, 60]))]
        case 'push':
            angle, size = rng.uniform(-np.pi, np.pi), mass * PUSH * rng.random()
            return kind, {'impulse': [round(size * math.cos(angle), 3),
                                      round(size * math.sin(angle), 3), 0.0], 'duration': 0.1}
        case 'at_once':
            return kind, [list(_request(rng)) for _ in range(rng.integers(2, 4))]
        case 'votes':
            return kind, {str(leg): 1.0 for leg in rng.permutation(LEGS)[:rng.integers(0, 4)]}
        case 'fail':
            return kind, _failure(rng)
    return _request(rng, kind)


def _request(rng: np.random.Generator, kind: str = '') -> tuple[str, Any]:
    """A request of one answer."""
    kind = kind or str(rng.choice(['inhibit', 'mode', 'gait', 'parameters'], p=(0.4, 0.2, 0.1,
                                                                               0.3)))
    if kind == 'inhibit':
        return kind, bool(rng.random() < 0.4)
    if kind == 'gait':
        return kind, str(rng.choice([*GAITS, 'nope'], p=(*[0.16] * 6, 0.04)))
    return _mode(rng) if kind == 'mode' else (kind, _parameters(rng))


def _mode(rng: np.random.Generator) -> tuple[str, Any]:
    return str(rng.choice(REQUESTS, p=(0.6, 0.3, 0.1))), True


def _command(rng: np.random.Generator) -> Any:
    kind = rng.random()
    if kind < 0.1:
        return 'silence'
    if kind < 0.25:
        return {'v_x': 0.0}
    if kind < 0.6:
        return {'v_x': round(rng.uniform(0.1, 0.8), 3)}
    return {'v_x': round(rng.uniform(-100.0, 100.0) ** 3 * 1e-6 * 3.0, 3),
            'v_y': round(rng.uniform(-1.0, 1.0), 3), 'gamma': round(rng.uniform(-2.0, 2.0), 3)}


def _twist(rng: np.random.Generator) -> list[Any]:
    velocity = [float(rng.choice([0.0, 0.3, -1e6, 1e308, math.nan, math.inf, 5e-324]))
                for _ in range(3)]
    stamps = (None, [0, 0], [-1, 0], [2**31 - 1, 999_999_999], [5, 0])
    return [velocity, stamps[rng.integers(len(stamps))]]


def _settings(rng: np.random.Generator) -> Case:
    """One parameter that may change, or a few of the same owner."""
    values = setting(rng)
    owner = OWNER[next(iter(values))]
    while rng.random() < 0.25:
        more = setting(rng)
        if OWNER[next(iter(more))] == owner:
            values |= more
    return {name: list(value) if isinstance(value, tuple) else value
            for name, value in values.items()}


def _parameters(rng: np.random.Generator) -> list[Any]:
    """What is set without any care whose it is and of which type."""
    kind, whole = rng.random(), bool(rng.random() < 0.5)
    if kind < 0.25:                                          # gains of the posture
        usual, name = PostureParameters(), str(rng.choice(GAINS))
        return [POSTURE, {name: float(getattr(usual, name) * rng.uniform(0.8, 1.2))}, whole]
    if kind < 0.5:                                           # several owners' at one of them
        node = str(rng.choice([CANONICAL, INHIBITION, *WALKING_NODES]))
        values = _settings(rng) | _settings(rng)
        return [node, values, whole]
    node = str(rng.choice(WALKING_NODES))
    names = [*NUMBERS, *WORDS, *STRANGE]
    return [node, {str(rng.choice(names)): ODD[rng.integers(len(ODD))]
                   for _ in range(rng.integers(1, 4))}, whole]


def _failure(rng: np.random.Generator) -> Case:
    component = str(rng.choice(list(COMPONENTS)))
    if component == 'joint' and rng.random() < 0.7:
        component = 'encoder'
    leg = {'leg': str(rng.choice(LEGS))} if component in PLACED and rng.random() < 0.7 else {}
    return {'component': component, 'kind': str(rng.choice(list(KINDS))),
            'for_s': round(log_uniform(rng, *FAILS), 3), **leg}


def _cycle(rng: np.random.Generator) -> list[Any]:
    """States that a node is taken through, and what is asked of all meanwhile."""
    node = str(rng.choice(WALKING_NODES))
    whole = node != ROBOT and rng.random() < 0.5             # a simulated robot loses its state
    steps: list[Any] = ['deactivate', *(['cleanup', 'configure'] if whole else []), 'activate']
    if rng.random() < 0.3:
        steps += ['deactivate', 'activate']
    for _ in range(rng.integers(0, 3)):
        steps.insert(int(rng.integers(0, len(steps))), list(_request(rng)))
    return [node, steps]
