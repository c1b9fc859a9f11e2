# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Exact witnesses of what a certificate says of the step that runs, for
:mod:`~dmp_cpg_ros.core.proofs.check_step` and :mod:`~dmp_cpg_ros.core.proofs.check_rest`.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from dmp_cpg_ros.core.certificates.step import SteppedNetwork
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.proofs import check_rest
from dmp_cpg_ros.core.proofs import check_step as exact

Values = dict[str, Any]

_ROOM = 1e-9  # share that is given away, so that rounding does not decide
_MOST_TRIALS = 40


def step_proof(p: Values, xi: list[Fraction], found: SteppedNetwork | None) -> Values:
    """Witnesses and rows of the step; empty where it is not proved, or too narrowly for these.

    Parameters
    ----------
    p : dict
        Parameters of a proof, as fractions.
    xi : list of Fraction
        Weights of the nodes.
    found : SteppedNetwork or None
        What is proved of the step in double precision.
    """
    if found is None or not found.proved:
        return {}
    try:
        w = _witnesses(p, xi, found)
        rows = exact.rows(p, xi, w)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return {}
    return {'witnesses': w, 'rows': rows} if all(
        left < right for left, right in rows.values()) else {}


def falling(p: Values, step: Values) -> tuple[Any, ...]:
    """What bounds how the step comes to rest, whatever else a proof has; empty where nothing does.

    Parameters
    ----------
    p, step : dict
        As for :func:`rest_proof`.
    """
    try:
        return check_rest.falling(p, step['witnesses'])
    except (ArithmeticError, LookupError, ValueError):
        return ()


def rest_proof(p: Values, w: Values, step: Values, fallen: tuple[Any, ...] = ()) -> Values:
    """Row of the time in which the step comes to rest; empty where it is not proved.

    Parameters
    ----------
    p, w : dict
        Parameters and witnesses of a proof, as fractions.
    step : dict
        From :func:`step_proof`.
    fallen : tuple
        From :func:`falling`, where it is known.
    """
    try:
        bound = check_rest.time_to_rest(p, w, step['witnesses'], fallen)
    except (ArithmeticError, LookupError, ValueError):
        return {}
    return {'step_time_to_rest': (bound, check_rest.LONGEST)} if (
        bound < check_rest.LONGEST) else {}


def _witnesses(p: Values, xi: list[Fraction], found: SteppedNetwork) -> Values:
    h, r, w = exact.step_of(p), p['radius'], exact.step_of(p) * p['omega_max']
    g, free, held = h * p['rho'] * r * r, exact.phi_of(p, 0), exact.phi_of(p, 1)
    quick, pull = exact.QUICKEST * w, _float([h * gain for gain in p['gains']])
    disc = _up(max(1.0, _disc(free, g, quick, 0.0 * pull), _disc(held, g, w, pull)))
    _, far = exact.size(p, 0, free, quick, disc)
    both, near = exact.size(p, 1, held, w, disc)
    u = _box(p, both, g, w, disc, near, found.distance)
    reached = [*exact.boxed(p, both, u, w, near)[:2], u]
    inner = max(0.0, 1.0 - float(max(map(max, reached))))
    shift = _up(0.5 * float(g) * (3.0 * min(2.0 - inner, float(near))**2 - 2.0 + inner**2))
    loose = _up(float(g) * (1.5 * float(far)**2 - 1.0))
    return {'disc': disc, 'box': u, 'shifts': [shift, loose], 'v': _perron(found.differences),
            'norms': [_norm(of, xi, quick) for of in exact.matrices(free, loose)[:9]]}


def _disc(of: Any, g: Fraction, w: Fraction, pull: Array) -> float:
    """R/r of a disc that no step leaves."""
    T, C_y, C_a, C_b, *_, C, _ = map(_float, exact.moduli(exact.matrices(of, 2 * g), w))
    pushed, kept = C @ pull + (C_y + C_a + C_b).sum(axis=1) * 2.0 * float(g), 1.0 - T.sum(axis=1)
    return float((pushed / kept).max()) if kept.min() > 0.0 else np.inf


def _box(p: Values, both: Any, g: Fraction, w: Fraction, disc: Fraction, far: Fraction,
         distance: Array) -> list[Fraction]:
    """Box of shares of r that free nodes do not leave, enlarged from one."""
    held, edge = np.array([gain > 0 for gain in p['gains']]), disc + 1
    r0 = p['region_radius'] / p['radius']
    T, C_y, C_a, C_b = (_float(X) for X in both[0][:4])
    J = T + (C_y + C_a + C_b) * 2.0 * float(g)
    u = [r0 if leg else min(edge, _up(d)) for leg, d in zip(
        held, (distance / float(p['radius'])).tolist(), strict=True)]
    for _ in range(_MOST_TRIALS):
        over = _float(exact.boxed(p, both, u, w, far)[2]) - _float(u)
        moving = np.flatnonzero(~held & np.array([x < edge for x in u]))
        if np.all(over[moving] <= 0.0):
            break
        room = np.linalg.solve(np.eye(len(moving)) - J[np.ix_(moving, moving)],
                               np.maximum(over, 0.0)[moving] + 1e-7)
        for i, more in zip(moving, room.tolist(), strict=True):
            u[i] = min(edge, u[i] + _up(more)) if np.all(room > 0.0) else edge
    return u


def _perron(Z: Array) -> list[Fraction]:
    """Weights of the maximum norm in which a nonnegative matrix is smallest."""
    values, vectors = np.linalg.eig(Z + 1e-9 * Z.max())
    v = np.abs(vectors[:, np.argmax(values.real)].real)
    return [_up(x) for x in (v / v.max()).tolist()]


def _norm(of: exact.Polynomial, xi: list[Fraction], w: Fraction) -> Fraction:
    """Norm of differences between nodes, a little above it."""
    root, K = np.sqrt(_float(xi)), exact.gram(of, xi)
    scale = exact.ONE * np.outer(root, root)
    top = max(float(np.linalg.eigvalsh(_float(even) / scale)[-1])
              for even in exact.bernstein(K[::2], w * w))
    rest = sum(float(w)**m * float(np.linalg.norm(_float(K[m]) / scale)) for m in (1, 3, 5))
    return _up(float(np.sqrt(max(top, 0.0) + rest)) + 1e-9)


def _up(x: float) -> Fraction:
    """x, a little above it, on the grid."""
    return -(-Fraction(x * (1.0 + _ROOM)) // exact.GRID) * exact.GRID + exact.GRID


def _float(values: Any) -> Array:
    return np.array(values, dtype=float)
