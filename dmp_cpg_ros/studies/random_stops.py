# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops drawn at random: how often the body does not stand as was said at the request."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from math import pi

import numpy as np

from dmp_cpg_ros.studies.loop_recording import StopOutcome
from dmp_cpg_ros.studies.stop_trials import StopCase

LARGEST_PUSH = 2.6
"""[N s]; 0.3 m/s of the package's robot."""

ROUGHNESS = {'flat': (0.0, 0.0), 'slope': (-6.0, 6.0), 'hills': (0.0, 5.0)}
"""Grounds, and how rough they are at least and at most [deg]. On blocks a foot may stand on an
edge, and slide off it a second after the body stood.
"""


def random_cases(options: argparse.Namespace) -> list[StopCase]:
    """Independent stops of one leg, or of any, with one braking; each depends on the seed and its
    number only.
    """
    cases, speeds = [], options.speeds
    for number in range(options.random):
        rng = np.random.default_rng((options.seed, number))
        case = StopCase(
            str(rng.choice(options.gaits)), float(rng.uniform(min(speeds), max(speeds))),
            float(rng.random()), leg=options.legs[0], push=float(rng.uniform(0.0, LARGEST_PUSH)),
            braking=options.braking[0], resumes=not options.no_resume,
            friction=float(rng.uniform(0.3, 1.0)), payload=float(rng.uniform(0.0, 0.3)),
            direction=float(rng.uniform(0.0, 2.0 * pi)), seed=int(rng.integers(1, 2 ** 31)))
        ground = str(rng.choice(tuple(ROUGHNESS)))
        cases.append(replace(case, ground=ground,
                             roughness=float(rng.uniform(*ROUGHNESS[ground]))))
    return cases


def scenario_bound(outcomes: Sequence[StopOutcome]) -> str:
    """What N independent stops say of the next one: with none that is not as was said, one is so
    with a probability below ε unless something of probability (1 − ε)^N = β has happened.
    """
    count, broken, stepped = len(outcomes), *(
        sum(getattr(outcome, name) for outcome in outcomes) for name in ('broken', 'stepped'))
    of = f'{count} stops, {stepped} stepped out of; in {broken} the body did not stand as was said'
    if broken:
        return of
    shares = (f'{1.0 - doubt ** (1.0 / count):.2g} at confidence 1 - {doubt:g}'
              for doubt in (0.05, 1e-6))
    return (f'{of}: it does not in another one drawn alike with a probability below '
            f'{" and below ".join(shares)}')
