# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops drawn at random: how often the body does not stand as was said at the request."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import pi
from statistics import median
from typing import Any

import numpy as np

from dmp_cpg_ros.studies.loop_recording import StopOutcome
from dmp_cpg_ros.studies.stop_trials import StopCase

LARGEST_PUSH = 2.6
"""[N s]; 0.3 m/s of the package's robot."""

DOUBTS = (0.05, 1e-6)
"""Probabilities β that what is said of the next stop is wrong."""

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


def summary(cases: Sequence[StopCase], outcomes: Sequence[StopOutcome], seed: int
            ) -> dict[str, Any]:
    """What became of independent stops, and what they say of the next one.

    With none of N that is not as was said, one is so with a probability below ε unless something
    of probability (1 − ε)^N = β has happened.

    Returns
    -------
    dict
        Numbers of stops, of those that fell, that were stepped out of, and that did not become
        what was said, ``late`` and ``far`` among them; of all but those stepped out of ``still_s``
        and ``within_s`` as median and largest; and ``below``, ε by β, without those that fail.
    """
    claimed = [outcome for outcome in outcomes if not (outcome.stepped or outcome.fell)]
    count, broken = len(outcomes), sum(outcome.broken for outcome in outcomes)
    return {
        'seed': seed, 'stops': count,
        'grounds': dict(Counter(case.ground for case in cases)),
        **{name: sum(getattr(outcome, name) for outcome in outcomes)
           for name in ('fell', 'stepped', 'broken', 'late', 'far')},
        **{name: [median(values), max(values)] for name, values in (
            (name, [getattr(outcome, name) for outcome in claimed])
            for name in ('still_s', 'within_s')) if values},
        'below': {} if broken else {
            f'{doubt:g}': 1.0 - doubt ** (1.0 / count) for doubt in DOUBTS}}


def scenario_bound(of: Mapping[str, Any]) -> str:
    """A summary in words."""
    text = (f'{of["stops"]} stops, {of["stepped"]} stepped out of; in {of["broken"]} the body did '
            'not stand as was said')
    if of['broken']:
        return text
    shares = ' and below '.join(
        f'{share:.2g} at confidence 1 - {doubt}' for doubt, share in of['below'].items())
    return f'{text}: it does not in another one drawn alike with a probability below {shares}'
