# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Cases of the benchmark of walking: what walks, how fast, on what ground, and what befalls it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import pi
from typing import Any

from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES
from dmp_cpg_ros.studies.late_walks import Stalls
from dmp_cpg_ros.studies.loop_recording import Velocity
from dmp_cpg_ros.studies.push_trials import MANOEUVRES
from dmp_cpg_ros.studies.walking_trials import Values

DIRECTIONS = {'ahead': 0.0, 'ahead left': 0.25 * pi, 'left': 0.5 * pi, 'back left': 0.75 * pi,
              'back': pi, 'back right': 1.25 * pi, 'right': 1.5 * pi, 'ahead right': 1.75 * pi}
"""Directions of the pushes [rad]."""

PUSHED = (('amble', 0.5), ('trot', 0.5), ('trot', 1.0))
"""Gaits and speeds that are pushed."""

Ground = tuple[str, dict[str, float]]
"""A world with some of its parameters."""

ROUGH: tuple[Ground, ...] = (
    ('blocks', {'height': 0.05}), ('slope', {'degrees': 15.0}), ('slope', {'degrees': -15.0}),
    ('steps', {'height': 0.08}), ('low_friction', {'friction': 0.3}))
"""Grounds that are crossed."""

STAIRS = {'count': 5, 'depth': 0.3, 'platform': 1.5}
"""Five stairs up and five down within ``FINISH``."""

ROUGHER: tuple[Ground, ...] = (
    ('steps', {'height': 0.1, **STAIRS}), ('slope', {'degrees': 20.0}),
    ('slope', {'degrees': -20.0}), ('low_friction', {'friction': 0.2}),
    ('rough_slope', {'degrees': 12.0, 'height': 0.04}), ('hills', {'degrees': 15.0}),
    ('blocks', {'height': 0.07}), ('gaps', {'width': 0.1, 'count': 5, 'depth': 0.5}))
"""Harder grounds."""

HIGHER: tuple[Ground, ...] = (('steps', {'height': 0.15, **STAIRS}),)
"""Grounds for a robot with longer legs, ``CLIMBER``."""

CLIMBER = 'robots/go2.yaml'

CLIMBING: dict[Values, str] = {(('climbing', False),): 'off', (): 'on'}
"""The parameter, without and with which stairs are walked at."""

UNTUNED = 100
"""First seed on harder grounds: those below were looked at in between."""

OBSTACLES = (0.13, 0.16, 0.2, 0.25, 1.0)
"""Heights of steps that the package's own robot does not cross [m]."""

OBSTACLE_SPEEDS = (0.3, 0.5)
"""Speeds at which it walks at them [m/s]."""

ROUGH_GAITS = ('amble', 'trot')

FELT_GROUNDS: tuple[Ground, ...] = (
    *(('blocks', {'height': height}) for height in (0.03, 0.05, 0.07)),
    *(('steps', {'height': height}) for height in (0.05, 0.08)))
"""Grounds that are crossed with and without feeling them."""

FEELING: dict[Values, str] = {
    (('contact_feedback', felt), ('stumble_lift', lift)): words for felt, lift, words in (
        (False, 0.0, 'nothing'), (True, 0.0, 'touchdown, in the phase'),
        (False, 0.13, 'obstacles, in the swing'), (True, 0.13, 'both'))}
"""Parameters, and what they make the legs feel."""

STRAIGHT = {
    'amble': (0.1, 0.2, 0.5, 0.8, 1.0, 1.25, 1.5), 'walk': (0.1, 0.2, 0.5, 0.8),
    'trot': (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0), 'pace': (0.2, 0.5, 0.8),
    'bound': (0.2, 0.5, 0.8), 'pronk': (0.2, 0.5, 0.8)}
"""Speeds forwards of the table ``speeds`` by gait [m/s]."""

OTHERS: tuple[tuple[str, Velocity], ...] = (
    ('amble', (-0.3, 0.0, 0.0)), ('trot', (-0.5, 0.0, 0.0)), ('amble', (0.0, 0.3, 0.0)),
    ('trot', (0.0, 0.5, 0.0)), ('amble', (0.0, 0.0, 1.0)), ('trot', (0.0, 0.0, 1.0)),
    ('trot', (0.0, 0.0, 2.0)), ('amble', (0.5, 0.0, 0.5)), ('trot', (1.0, 0.0, 1.0)))
"""Velocities of the table ``speeds`` that are not straight ahead."""

ROBOTS = tuple(f'robots/{name}.yaml' for name in (
    'mini_quadruped', 'mini_cheetah', 'go1', 'go2', 'aliengo', 'a2', 'spot', 'pegasus', 'b2',
    'hyqreal1', 'hyqreal2'))
"""Robots by their files; all but the first need the extra ``robots``."""

RETURNS = 120_000
"""First seed of the walks forth and back."""

RESTARTED = (('amble', 0.5), ('trot', 1.0), ('trot', 2.0), ('pace', 0.5), ('bound', 0.5),
             ('pronk', 0.6))
"""Walks whose posture control begins anew."""

TIMED: tuple[dict[str, Any], ...] = (
    *({'gait': gait, 'speed': speed} for gait, speed in (
        ('amble', 0.5), ('trot', 0.5), ('trot', 1.5), ('walk', 0.5), ('pace', 0.5),
        ('bound', 0.5))),
    {'gait': 'amble', 'speed': 0.5, 'ground': 'blocks'},
    *({'gait': 'trot', 'speed': 0.5, 'robot': f'robots/{name}.yaml'}
      for name in ('mini_cheetah', 'go1', 'go2')))
"""Walks that are pushed with and without quicker steps."""

TIMED_CHANGES = (1.6, 2.4)
"""Speed changes by their pushes [m/s]."""

STOPPED = ('at rest', 'stopping')
"""Manoeuvres in which a stop is in force, and steps may catch a push."""

PUSHED_IN = (
    ('at rest', (1.2, 1.4, 1.6), (False,)), ('at rest', (0.6, 0.8, 1.0, 1.2, 1.4, 1.6), (True,)),
    *((name, (0.8, 1.2, 1.6), (True,)) for name in MANOEUVRES if 'stopping' in name),
    *((name, (1.2,), (True,)) for name in MANOEUVRES if not name.startswith(STOPPED)))
"""Manoeuvres, speed changes by pushes [m/s], and whether the pushes are drawn."""

UNPUSHED: tuple[tuple[str, tuple[float, float], str, dict[str, float], float], ...] = (
    *((gait, span, 'flat', {}, 0.0) for gait, span in (
        ('amble', (0.3, 1.2)), ('trot', (0.3, 1.5)), ('walk', (0.2, 0.8)), ('pace', (0.2, 0.8)),
        ('bound', (0.2, 0.8)))),
    *(('amble', (0.3, 0.6), 'slope', {'degrees': degrees}, 0.0)
      for degrees in (-12.0, -6.0, 6.0, 12.0)),
    ('trot', (0.3, 1.0), 'low_friction', {}, 0.0), ('amble', (0.3, 0.8), 'low_friction', {}, 0.0),
    ('amble', (0.3, 0.8), 'flat', {}, 0.3), ('trot', (0.3, 1.5), 'flat', {}, 0.3),
    ('amble', (0.3, 0.5), 'blocks', {'height': 0.05}, 0.0))
"""Gaits, speeds [m/s], grounds and payloads of stops that nobody pushes against."""

SIDES = (0.5 * pi, 1.5 * pi)
"""Directions of the pushes of each robot [rad]."""

LATE_WALKS = (('amble', 0.5), ('amble', 1.2), ('trot', 1.0), ('trot', 2.0))
"""Gaits and speeds of walks whose targets arrive late."""

DELAYS_MS = ((0.0, 0.0), (16.0, 16.0), (20.0, 20.0), (24.0, 24.0), (40.0, 40.0), (5.0, 30.0),
             (5.0, 50.0))
"""Least and longest delays of their targets [ms]."""

SLOW_RATES = ((100.0, 10.0), (100.0, 20.0), (50.0, 0.0), (50.0, 20.0))
"""Control rates [Hz] and delays [ms] at which they walk, too."""

SLOW_WALKS = (('amble', 0.5), ('amble', 0.8), ('amble', 1.0), ('trot', 1.0))
"""Gaits and speeds of those walks."""

STARVED = (Stalls(300.0, 150.0), Stalls(150.0, 200.0),
           Stalls(300.0, 250.0, 0.2, 0.3))
"""Stalls of walks whose controllers starve."""

STARVED_WALKS = (('amble', 0.5), ('trot', 1.0))
"""Gaits and speeds of those."""

BACK_WITHIN = (0.3, 0.6, 1.1)
"""Times within which legs that die in those gaits are back [s]."""

TWICE_SILENT = tuple(product((50.0, 100.0), (0.3, 0.7, 1.1, 1.5, 2.0)))
"""Rates [Hz] at which legs are silent twice, and the time between [s]."""

WEAK = 0.4
"""Share of its torque that a weak drive has."""

MISMATCHED: dict[str, Callable[[int], Values]] = {
    'nothing': lambda seed: (),
    "payload of the robot's mass": lambda seed: (('payload', 1.0),),
    f'one drive at {WEAK:.0%}, each in turn': lambda seed: (('joint_strength', tuple(
        WEAK if k == seed % len(JOINT_NAMES) else 1.0 for k in range(len(JOINT_NAMES)))),),
    'friction and damping of the joints times 10': lambda seed: (('joint_friction', 10.0),),
    'noise and biases of the sensors times 10': lambda seed: (('sensor_noise', 10.0),),
    "trunk's centre of mass 3 cm aside, to either side": lambda seed: (
        ('mass_offset', (0.0, 0.03 - 0.06 * (seed % 2))),),
}
"""What a robot's controllers do not know of it, by the seed of the walk."""

MISMATCHED_WALKS = (('amble', 0.5), ('trot', 1.0))
"""Gaits and speeds [m/s] of robots that are not as their controllers know them."""

TOP_SPEEDS = (1.0, 1.5, 2.0, 2.5, 3.0)
"""Speeds that are tried in a trot, one after the other [m/s]."""

TOP_ERROR = 0.05
"""Share of the commanded speed that counts as having reached it."""
