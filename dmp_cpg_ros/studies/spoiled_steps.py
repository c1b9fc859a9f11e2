# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a careful liar would say of the step in a proof, and what the program's own step says of
it.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import ExponentialStep
from dmp_cpg_ros.core.proofs import check_step, proof
from dmp_cpg_ros.studies.proof_claims import Values

_STATES = 40
_CLEARLY = 1e-7  # share by which a claim must fail


def forged_step(text: str, kind: str, rng: np.random.Generator) -> str:
    """Text of a proof with a false witness of the step, and rows that follow from it."""
    found = json.loads(text)
    p, xi, w = (check_step.read(of) for of in (
        found['parameters'], found['witnesses']['xi'], found['step']['witnesses']))
    rows = check_step.read(found['step']['rows'])
    STEP_FORGERIES[kind](w, rows, rng)
    try:
        rows = {name: sorted(sides) for name, sides in check_step.rows(p, xi, w).items()}
    except (ArithmeticError, LookupError, TypeError, ValueError):
        pass
    return json.dumps({**found, 'step': proof.written({}, {}, {}, {'witnesses': w, 'rows': rows})[
        'step']})


def _small(rng: np.random.Generator) -> Fraction:
    return Fraction(float(10.0 ** rng.uniform(-5.0, -0.3)))


def _smaller_box(w: Values, rows: Values, rng: np.random.Generator) -> None:
    w['box'][rng.integers(len(w['box']))] *= 1 - _small(rng)


def _smaller_disc(w: Values, rows: Values, rng: np.random.Generator) -> None:
    w['disc'] *= 1 - _small(rng)


def _other_norm(w: Values, rows: Values, rng: np.random.Generator) -> None:
    w['v'] = [x * Fraction(float(np.exp(2.0 * rng.normal()))) for x in w['v']]


def _smaller_norm(w: Values, rows: Values, rng: np.random.Generator) -> None:
    """Those of the matrices of disagreement, and what is said with them."""
    share = 1 - _small(rng)
    w['norms'] = [share * x for x in w['norms']]
    rows['step_synchronisation'][0] *= share


STEP_FORGERIES: dict[str, Callable[[Values, Values, np.random.Generator], None]] = {
    'smaller box of the step': _smaller_box,
    'smaller disc': _smaller_disc,
    'another norm of the step': _other_norm,
    'smaller norm of the step': _smaller_norm,
}
"""Changes of the witnesses of the step."""


def refuted_step(text: str, rng: np.random.Generator) -> list[str]:
    """Claims of the part ``step`` of a proof that some states refute, in floating point and with
    the program's own step.
    """
    found = json.loads(text)
    p, xi, w, rows = (check_step.read(of) for of in (
        found['parameters'], found['witnesses']['xi'], found['step']['witnesses'],
        found['step']['rows']))
    r, R = float(p['radius']), float(w['disc'])
    held = np.array([gain > 0 for gain in p['gains']])
    u, v, shares = (np.array(of, dtype=float) for of in (w['box'], w['v'], xi))
    claimed = {name: float(sides[0]) for name, sides in rows.items()}
    inside = _inside(u, R, rng)
    anywhere = R * np.exp(2j * np.pi * rng.random((_STATES, len(u)))) * rng.choice(
        [1.0, 0.3], (_STATES, len(u)))
    after = _stepped(p, inside, 1) / r
    far = np.abs(after - 1.0)
    other = inside * (1.0 - 1e-6) + 1e-6
    apart = np.abs(_stepped(p, other, 1) / r - after) / v
    free = [anywhere, 0.05 * anywhere]
    for _ in range(10):                              # the slowest pattern is what remains
        free.append(_stepped(p, free[-1], 0) / r)
    released = _stepped(p, anywhere, 0) / r
    before = [np.sqrt(np.abs(y - (y @ shares)[:, None])**2 @ shares) for y in free]
    clearly = 1.0 + _CLEARLY
    claims = {
        'disc': R >= 1.0 and max(np.abs(released).max(), np.abs(after).max()) <= R * clearly,
        'box': bool(np.all(far[:, ~held] <= u[~held] * clearly)) and np.allclose(
            u[held], float(p['region_radius']) / r),
        'step_capture': far[:, held].max() <= claimed['step_capture'] * clearly,
        'step_contraction': bool(np.all(apart.max(axis=1) <= claimed['step_contraction'] * (
            np.abs(other - inside) / v).max(axis=1) * clearly)),
        'step_synchronisation': all(
            np.all(later <= claimed['step_synchronisation'] * now * clearly + 1e-12)
            for now, later in zip(before[1:], before[2:], strict=False))}
    return [name for name, holds in claims.items() if not holds]


def _inside(u: Array, R: float, rng: np.random.Generator) -> Any:
    """States in a box and a disc, over r and in locked coordinates, (count, N) complex."""
    y = 1.0 + u * np.exp(2j * np.pi * rng.random((2 * _STATES, 1))) * rng.choice(
        [1.0, 0.5], (2 * _STATES, len(u)))
    y[::2] = 1.0 + u * np.exp(2j * np.pi * rng.random((_STATES, len(u))))
    for _ in range(60):
        y = np.where(np.abs(y) > R, 1.0 + 0.8 * (y - 1.0), y)
    return y


def _stepped(p: Values, y: Any, held: int) -> Any:
    """The program's step of states over r."""
    r, rho, omega = (float(p[name]) for name in ('radius', 'rho', 'omega_max'))
    gains = held * np.array(p['gains'], dtype=float)
    K = np.array(p['coupling'], dtype=float)
    M = np.diag(K.sum(axis=1) + gains) - K
    step = ExponentialStep(-np.kron(M, np.eye(2)), np.kron(gains, [r, 0.0]),
                           float(check_step.step_of(p)))

    def nonlinear(x: Array) -> Array:
        z = x.reshape(-1, 2).view(complex)[:, 0]
        return np.asarray(((rho * (r * r - np.abs(z)**2) - 1j * omega) * z)[:, None].view(
            float).reshape(x.shape))

    return np.array([step(one.view(float), nonlinear).view(complex) for one in r * y])
