# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Attack on what is proved of the step: states on the edges of what it speaks of, stepped once by
the program's own step.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.certificates.network import NetworkAnalysis, Setting, analyse_network
from dmp_cpg_ros.core.certificates.step import SteppedNetwork, stepped_network
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.studies.certificate_settings import random_setting
from dmp_cpg_ros.studies.draws import Case, Judged

Complex = NDArray[np.complex128]
Analysed = tuple[Setting, NetworkAnalysis, SteppedNetwork | None]

_STATES = 200
_SHARE = (0.5, 0.9)  # of a distance after a step, for which it is taken where the row is left out


def analysed(s: Setting) -> Analysed:
    """What is proved of the step of a suite."""
    analysis = analyse_network(s.network, s.parameters.inhibition, s.span)
    return s, analysis, stepped_network(s, analysis)


def places(s: Setting) -> Complex:
    """Factors from locked coordinates to x_1 + i x_2, ndarray (4,)."""
    return state_at(s.network.system.graph.phases).view(complex)[:, 0]


def as_states(s: Setting, y: Complex) -> Array:
    """States (4, 2) of locked coordinates (4,)."""
    return np.ascontiguousarray((y * places(s))[:, None]).view(float)


def locked_step(s: Setting, y: Complex, omega: float, gains: Array, h: float) -> Complex:
    """The program's step of locked coordinates, ndarray (count, 4)."""
    return np.array([s.network.system.step(as_states(s, one), omega, gains, h).view(complex)[:, 0]
                     for one in y]) / places(s)


def in_box(s: Setting, found: SteppedNetwork, rng: np.random.Generator, count: int) -> Complex:
    """Locked coordinates (count, 4) in the box and in the disc, most of them on an edge, some in
    one direction, some as near to the origin as they can be.
    """
    r = s.network.parameters.radius
    angle = rng.uniform(0.0, 2.0 * np.pi, (count, 1)) + rng.normal(size=(count, 4)) * rng.choice(
        [0.0, 0.1, 3.0], (count, 1))
    share = np.where(rng.random((count, 4)) < 0.7, 1.0, rng.random((count, 4)))
    y = r + found.distance * share * np.exp(1j * angle)
    y[::4] = np.maximum(r - found.distance, 1e-3 * r * rng.normal(size=(len(y[::4]), 4)))
    for _ in range(100):
        y = np.where(np.abs(y) > found.disc, r + 0.8 * (y - r), y)
    return y


def disagreement(y: Complex, xi: Array) -> Array:
    """(Σ ξ_i |y_i − ȳ|²)^½, ndarray (count,)."""
    return np.asarray(np.sqrt(np.abs(y - (y @ xi)[:, None]) ** 2 @ xi))


def draw(rng: np.random.Generator, weaken: bool) -> Case:
    """A setting, by the seed that it is drawn with."""
    return {'seed': int(rng.integers(1 << 30)),
            'share': float(rng.uniform(*_SHARE)) if weaken else 1.0}


def _drawn(case: Case) -> tuple[np.random.Generator, Setting, NetworkAnalysis,
                                SteppedNetwork] | None:
    rng = np.random.default_rng(case['seed'])
    s, analysis, found = analysed(random_setting(rng))
    return (rng, s, analysis, found) if found is not None and found.proved else None


def judge_capture(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """No step leads out of the box, nor inhibited nodes farther than it says (line 8)."""
    drawn = _drawn(case)
    if drawn is None:
        return None
    rng, s, analysis, found = drawn
    held, r = analysis.capture.gains > 0.0, s.network.parameters.radius
    most = np.where(held, found.farthest * case['share'], 1.0) * found.distance
    y = in_box(s, found, rng, _STATES)
    after = locked_step(s, y, s.span.omega[1], analysis.capture.gains, found.step_s)
    far = float((np.abs(after - r) / most).max())
    return (f'leaves what a step keeps, to {far:.4g} of it' if far > 1.0 + 1e-9 else ''), far


def judge_contraction(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Steps take states of the box towards each other, in the weighted maximum norm (line 10)."""
    drawn = _drawn(case)
    if drawn is None:
        return None
    rng, s, analysis, found = drawn
    kept = math.exp(-0.99 * found.approach * found.step_s)
    v = np.linalg.solve(kept * np.eye(4) - found.differences, np.ones(4))    # Z v <= kept v
    v, growth = v / v.max(), s.network.parameters.rho * s.network.parameters.radius**2
    if weaken:
        kept *= math.exp(-growth * found.step_s)
    y = in_box(s, found, rng, _STATES)
    aside = 1e-4 * np.exp(2j * np.pi * rng.random((_STATES, 1))) * v
    z = np.where(np.abs(y + aside - s.network.parameters.radius) <= found.distance, y + aside,
                 y - aside)
    gains, omega = analysis.capture.gains, s.span.omega[1]
    after = [locked_step(s, one, omega, gains, found.step_s) for one in (y, z)]
    left = float(((np.abs(after[0] - after[1]) / v).max(axis=1)
                  / (np.abs(y - z) / v).max(axis=1)).max()) / kept
    return (f'keeps {left:.4g} times the difference that it may' if left > 1.0 + 1e-7 else ''
            ), left


def judge_synchronisation(_: RobotDescription, case: Case, weaken: bool) -> Judged:
    """Steps of free oscillators shrink their disagreement (line 1); of components that follow one
    another its weights are beyond rounding.
    """
    drawn = _drawn(case)
    if drawn is None or drawn[2].found.weights is None:
        return None
    rng, s, analysis, found = drawn
    xi, growth = drawn[2].found.weights, analysis.found.growth if weaken else 0.0
    y = found.disc * rng.random((_STATES, 4)) ** rng.choice([0.3, 8.0], (_STATES, 1)) * np.exp(
        1j * rng.normal(size=(_STATES, 4)) * rng.choice([0.1, 3.0], (_STATES, 1)))
    left = 0.0
    for _n in range(20):                             # the slowest pattern is what remains
        before, y = disagreement(y, xi), locked_step(
            s, y, s.span.omega[1], np.zeros(4), found.step_s)
        left = max(left, float((disagreement(y, xi) / before)[before > 1e-7].max(initial=0.0)))
    left *= math.exp((found.locking + growth) * found.step_s)
    return (f'keeps {left:.4g} times the disagreement that it may' if left > 1.0 + 1e-7 else ''
            ), left
