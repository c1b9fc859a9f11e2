# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Exact witnesses of a certificate, which anyone can check without this package.

The witnesses are found in double precision, rounded to the safe side on a binary grid, and
completed in rational arithmetic with the formulas of
:mod:`~dmp_cpg_ros.core.proofs.check_proof`. doc/certificate.md describes the format.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np

from dmp_cpg_ros.core.certificates.network import NetworkAnalysis, Setting, analyse_network
from dmp_cpg_ros.core.certificates.step import cycle_radius_error, stepped_network
from dmp_cpg_ros.core.certificates.timing import LONGEST_STOP, time_to_rest
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL
from dmp_cpg_ros.core.contraction.synchronisation import cascade_weights, slowest_rate
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.proofs import check_proof as exact
from dmp_cpg_ros.core.proofs.step_proof import falling, rest_proof, step_proof

Values = dict[str, Any]

_ROUNDING = 1e-9  # share that is given away, so that rounding does not decide
_SLOWER = (1e-4, 0.05, 0.1, 0.2, 0.3, 0.5)  # shares of the rate given away for more even weights
_MOST_STEPS = 10_000  # of the grid, from a guess
_CASCADE = 2.0**-64  # weight of a component of a graph, as a share of those before it


def proof_of(s: Setting) -> Values:
    """Prove the required inequalities of a gait without voting and contact feedback.

    Parameters
    ----------
    s : Setting
        What runs.

    Returns
    -------
    dict
        What strict JSON can write, for
        :func:`~dmp_cpg_ros.core.proofs.check_proof.check`.

    Raises
    ------
    ParameterError
        If an inequality fails, or holds too narrowly for these witnesses.
    """
    if s.parameters.inhibition.auto:
        raise ParameterError('a proof is for inhibited_legs that are named, not for auto')
    if s.parameters.reference.braking:
        raise ParameterError('a proof is for a reference without braking')
    analysis = analyse_network(s.network, s.parameters.inhibition, s.span)
    if time_to_rest(s, analysis.capture, analysis.rest) >= LONGEST_STOP:
        raise ParameterError('no exact proof is found: the time to rest is not certified')
    p = _parameters(s, analysis)
    shares = cascade_weights(s.network.system.graph, _CASCADE) if (
        analysis.found.weights is None) else analysis.found.weights
    reason, step = 'it does not contract', None
    reaches = (False, True) if analysis.contraction.reach == GLOBAL else (True,)
    for regional, slower in product(reaches, _SLOWER):
        try:
            w = completed(p, _chosen(p, analysis, shares, regional, slower))
            if step is None:
                step = step_proof(p, w['xi'], stepped_network(s, analysis))
                fallen = falling(p, step)
            rest = rest_proof(p, w, step, fallen)
            proof = written(p, w, exact.rows(p, w, not rest), step, rest)
            exact.check(proof)
            return proof
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            reason = str(error)
    raise ParameterError(f'no exact proof is found: {reason}')


def written(p: Values, w: Values, rows: Values, step: Values, rest: Values) -> Values:
    """Parameters, witnesses, rows and what is proved of the step as they stand in a file."""
    return {'format': 'dmp_cpg_ros proof 4', 'parameters': _written(p), 'witnesses': _written(w),
            'rows': _written(rows), 'step': _written(step), 'rest': _written(rest)}


def _parameters(s: Setting, analysis: NetworkAnalysis) -> Values:
    """Numbers that the suite runs with, as the fractions that they are."""
    oscillators, span, leg = s.network.parameters, s.span, s.parameters.leg
    graph = s.network.system.graph
    coupling, weights = np.zeros((graph.size, graph.size)), graph.weights
    if weights is None:
        raise ParameterError('no exact proof is known for couplings other than k_ij I')
    for (i, j), k in zip(graph.edges, weights, strict=True):
        coupling[i, j] = k
    values = {
        'rho': oscillators.rho, 'radius': oscillators.radius,
        'region_radius': s.parameters.inhibition.region_radius, 'tick': s.tick_s,
        'omega_max': span.omega[1], 'omega_at_rest': span.omega_at_rest,
        'omega_armed_min': span.omega_armed[0], 'omega_armed_max': span.omega_armed[1],
        'omega_slope': span.omega_slope, 'foot_speed': span.foot_speed,
        'armed_speed': span.armed_speed, 'alpha_r': s.parameters.reference.alpha_r,
        'activity_rate': leg.activity_rate, 'stiffness': leg.stiffness, 'damping': leg.damping,
        'slowest_filter': min(leg.activity_rate, leg.placement_rate,
                              s.parameters.posture.activity_rate),
        'clearance': leg.clearance}
    return {**{name: Fraction(value) for name, value in values.items()},
            'coupling': [[Fraction(k) for k in row] for row in coupling.tolist()],
            'gains': [Fraction(gain) for gain in analysis.capture.gains.tolist()]}


def _chosen(p: Values, analysis: NetworkAnalysis, shares: Array, regional: bool, slower: float
            ) -> Values:
    """Witnesses from which the others follow."""
    rest, fast = analysis.rest, analysis.rest_at_speed
    if rest is None or fast is None or not analysis.capture.holds:
        raise ValueError('there is no equilibrium, or C is left')
    xi, largest = [Fraction(share) for share in shares.tolist()], int(shares.argmax())
    xi[largest] += 1 - sum(xi)
    u = _box(p, analysis)
    planes = _half_planes(p, u) if regional else []
    v, rate = _shrinking(p, _inner(p, u, planes), slower)
    return {'connectivity': on_grid(analysis.found.connectivity * (1.0 - _ROUNDING)), 'xi': xi,
            'u': u, 'half_planes': planes, 'v': v, 'rate': rate,
            'equilibria': [[_places(fast)], [_places(rest)]]}


def completed(p: Values, chosen: Values) -> Values:
    """All witnesses of parameters, from ``connectivity``, ``xi``, ``u``, ``v``, ``rate``, cosine,
    sine and heights of ``half_planes`` and the states of ``equilibria``; they prove nothing yet.

    Raises
    ------
    ArithmeticError, ValueError
        If one of them does not exist.
    """
    b, xi, u, v, rate = (chosen[name] for name in ('connectivity', 'xi', 'u', 'v', 'rate'))
    T, D = _factors(exact.disagreement(p, xi, b))
    r, foot, armed, alpha_r = (p[name] for name in (
        'radius', 'foot_speed', 'armed_speed', 'alpha_r'))
    sine, inner = _corner(p), _inner(p, u, chosen['half_planes'])
    (y_fast, *_), (y_rest, *_) = chosen['equilibria']
    equilibria = []
    for at, y in (('omega_max', y_fast), ('omega_at_rest', y_rest)):
        flow = exact.speeds(p, p[at], y)
        equilibria.append([y, flow, _root(
            max(f / q**2 for f, q in zip(flow, v, strict=True)) / rate**2)])
    far = max((z[0] - r)**2 + z[1]**2 for z, gain in zip(y_fast, p['gains'], strict=True)
              if gain > 0)
    size = min(z[0]**2 + z[1]**2 for z in y_rest)
    # Where the lower bound (1 + x/256 + x²/2^17)^256 of the exponential reaches the ratio.
    ratio = float(foot / armed) if foot else 1.0
    logarithm = 256.0 * (math.sqrt(2.0 * ratio**(1.0 / 256.0) - 1.0) - 1.0)
    return {
        'connectivity': b, 'xi': xi, 'T': T, 'D': D, 'u': u, 'pull': exact.pull(p, u),
        'half_planes': [[c, s, h, sine, exact.plane_rates(p, u, c, s, h)]
                        for c, s, h, *_ in chosen['half_planes']],
        'v': v, 'rate': rate, 'shrinks': exact.shrinks(p, v, inner, rate),
        'equilibria': equilibria, 'rest_distance': _root(far),
        'rest_size': -_least(-math.sqrt(size), lambda x: x >= 0 or x * x <= size),
        'mild_root': _root(p['omega_max']**2 + (p['rho'] * r**2)**2),
        'cycle_error': _least(cycle_radius_error(*(float(p[name]) for name in (
            'rho', 'radius', 'omega_max', 'tick'))), lambda x: x >= 0 and exact.leads_outwards(
                p, r * (1 - x)) and not exact.leads_outwards(p, r * (1 + x))),
        'arming_time': _least(logarithm / float(alpha_r), lambda x: x >= 0 and (
            armed >= foot * exact.decay(alpha_r * x)))}


def _inner(p: Values, u: list[Fraction], planes: list[list[Any]]) -> list[Fraction]:
    """Lower bounds on |y_i|."""
    return [max(Fraction(0), p['radius'] - d, *(plane[2][i] for plane in planes)) if planes
            else Fraction(0) for i, d in enumerate(u)]


def _corner(p: Values) -> Fraction:
    """Sine of the angle at which the circle of C meets the one of 0.98 r."""
    short = 1 - exact.FEW
    return _root(1 - ((short**2 + 1 - (p['region_radius'] / p['radius'])**2) / (2 * short))**2)


def _factors(S: list[list[Fraction]]) -> tuple[list[list[Fraction]], list[Fraction]]:
    """T and D of S = T diag(D) Tᵀ, by elimination."""
    N = len(S)
    T, D = [[Fraction(i == j) for j in range(N)] for i in range(N)], []
    for k in range(N):
        D.append(S[k][k])
        for i in range(k + 1, N):
            T[i][k] = S[i][k] / S[k][k]
            S[i] = [x - T[i][k] * y for x, y in zip(S[i], S[k], strict=True)]
    return T, D


def _box(p: Values, analysis: NetworkAnalysis) -> list[Fraction]:
    """The box of the capture set, a little larger where that makes it solve its inequality."""
    u, L, edge = analysis.capture.distance, _float(exact.laplacian(p, 0)), 2 * p['radius']
    legs = np.array([gain > 0 for gain in p['gains']])
    free = ~legs & (u < float(edge))
    larger = np.zeros(len(u))
    if free.any():
        larger[free] = np.linalg.solve(L[np.ix_(free, free)], np.ones(int(free.sum())))
    for room in 10.0 ** np.arange(-10.0, -4.0):
        box = [p['region_radius'] if leg else min(edge, on_grid(d) + exact.GRID) for leg, d in zip(
            legs, (u + room * larger * float(p['omega_max'] * p['radius'])).tolist(), strict=True)]
        if all(x <= 0 or leg or d == edge for x, d, leg in zip(
                exact.pull(p, box), box, legs, strict=True)):
            break
    return box


def _half_planes(p: Values, u: list[Fraction]) -> list[list[Any]]:
    """Half-planes of which each holds one leg farther from the origin than all others do."""
    r, M = float(p['radius']), _float(exact.laplacian(p, 1))
    sine = _corner(p)
    degree = max(row[i] for i, row in enumerate(exact.laplacian(p, 0)))
    places = p['radius'] * min(exact.FEW, p['omega_at_rest'] / degree)
    planes: list[list[Any]] = []
    for beta in np.linspace(0.0, 1.2, 13):
        t = on_grid(math.tan(0.5 * beta))
        c, s = (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)
        loss = float(p['omega_max']) * np.clip(_float(u) - r * float(s), 0.0, r)
        below = np.linalg.solve(M, loss + _ROUNDING * (1.0 + loss.max()))
        entry = float(exact.entry_height(p, c, s, sine) - places)
        below += max(0.0, float((r * float(c) - below).max()) - entry) + 1e-11
        h = [on_grid(x) for x in (r * float(c) - below).tolist()]
        rates = exact.plane_rates(p, u, c, s, h)
        if min(h) >= 0 and min(rates) >= 0:
            planes.append([c, s, h])
    most = np.max([_float(plane[2]) for plane in planes], axis=0, initial=0.0)
    return [plane for plane in planes if np.any(_float(plane[2]) == most)]


def _shrinking(p: Values, inner: list[Fraction], slower: float
               ) -> tuple[list[Fraction], Fraction]:
    """Weights and rate of the norm in which solutions approach each other."""
    M = _float(exact.laplacian(p, 1)) - np.diag(float(p['rho']) * (
        float(p['radius'])**2 - _float(inner)**2))
    slowest = (1.0 - slower) * slowest_rate(M)
    if not slowest > 0.0:
        raise ValueError('it does not contract')
    weights = np.linalg.solve(M - slowest * np.eye(len(M)), np.ones(len(M)))
    return [on_grid(x) for x in (weights / weights.max()).tolist()], on_grid(slowest)


def _places(rest: InhibitedEquilibrium) -> list[tuple[Fraction, Fraction]]:
    """States of an equilibrium in locked coordinates."""
    return [(on_grid(size * math.cos(ahead)), on_grid(-size * math.sin(ahead)))
            for size, ahead in zip(rest.radius.tolist(), rest.phase_ahead.tolist(), strict=True)]


def _least(guess: float, holds: Callable[[Fraction], bool]) -> Fraction:
    """Smallest number of the grid, near a guess, for which something holds."""
    x = on_grid(guess)
    for _ in range(_MOST_STEPS):
        if not holds(x):
            x += exact.GRID
        elif holds(x - exact.GRID):
            x -= exact.GRID
        else:
            return x
    raise ValueError(f'{guess} is not close to what is looked for')


def _root(square: Fraction) -> Fraction:
    """Root of a square that is not negative, rounded upwards."""
    return _least(math.sqrt(max(square, Fraction(0))), lambda x: x >= 0 and x * x >= square)


def on_grid(x: float | Fraction) -> Fraction:
    """x, rounded downwards to the grid."""
    return math.floor(Fraction(x) / exact.GRID) * exact.GRID


def _float(values: Any) -> Array:
    return np.array(values, dtype=float)


def _written(value: Any) -> Any:
    """Fractions as strings."""
    if isinstance(value, dict):
        return {key: _written(one) for key, one in value.items()}
    return str(value) if isinstance(value, Fraction) else [_written(one) for one in value]
