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
from dmp_cpg_ros.core.proofs import check_proof, check_rest, check_step, proof
from dmp_cpg_ros.core.proofs.step_proof import rest_proof
from dmp_cpg_ros.studies.proof_claims import Values

_STATES, _AT_ONCE = 40, 4
_CLEARLY = 1e-7  # share by which a claim must fail


def forged_step(text: str, kind: str, rng: np.random.Generator) -> str:
    """Text of a proof with a false witness of the step, and rows that follow from it."""
    found = json.loads(text)
    p, first, w, rows, rest = (check_proof.read(of) for of in (
        found['parameters'], found['witnesses'], found['step']['witnesses'], found['step']['rows'],
        found['rest']))
    STEP_FORGERIES[kind](w, rows, rng)
    try:
        rows = {name: sorted(sides) for name, sides in check_step.rows(
            p, first['xi'], w).items()}
    except (ArithmeticError, LookupError, TypeError, ValueError):
        pass
    rest = rest_proof(p, first, {'witnesses': w}) or rest
    if kind == SOONER and rest:
        bound, longest = rest['step_time_to_rest']
        rest = {'step_time_to_rest': (bound * Fraction(float(rng.uniform(0.05, 1.0))), longest)}
    changed = proof.written({}, {}, {}, {'witnesses': w, 'rows': rows}, rest)
    return json.dumps({**found, 'step': changed['step'], 'rest': changed['rest']})


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


SOONER = 'sooner at rest'

STEP_FORGERIES: dict[str, Callable[[Values, Values, np.random.Generator], None]] = {
    'smaller box of the step': _smaller_box,
    'smaller disc': _smaller_disc,
    'another norm of the step': _other_norm,
    'smaller norm of the step': _smaller_norm,
    SOONER: lambda w, rows, rng: None,
}
"""Changes of the witnesses of the step; the last is one of the time in which it comes to rest."""


def refuted_step(text: str, rng: np.random.Generator) -> list[str]:
    """Claims of the parts ``step`` and ``rest`` of a proof that some states refute, in floating
    point and with the program's own step.
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
            for now, later in zip(before[1:], before[2:], strict=False)),
        'step_time_to_rest': not found['rest'] or _rests(p, inside[:_AT_ONCE], float(
            check_proof.read(found['rest'])['step_time_to_rest'][0]
            - Fraction(found['witnesses']['arming_time'])))}
    return [name for name, holds in claims.items() if not holds]


def _inside(u: Array, R: float, rng: np.random.Generator) -> Any:
    """States in a box and a disc, over r and in locked coordinates, (count, N) complex."""
    y = 1.0 + u * np.exp(2j * np.pi * rng.random((2 * _STATES, 1))) * rng.choice(
        [1.0, 0.5], (2 * _STATES, len(u)))
    y[::2] = 1.0 + u * np.exp(2j * np.pi * rng.random((_STATES, len(u))))
    for _ in range(60):
        y = np.where(np.abs(y) > R, 1.0 + 0.8 * (y - 1.0), y)
    return y


class StepOfStates:
    """The program's step of some states at once, (count, N) complex."""

    def __init__(self, p: Values, held: int, count: int) -> None:
        self.r, self.rho, self.omega = (float(p[name]) for name in ('radius', 'rho', 'omega_max'))
        gains, K = held * np.array(p['gains'], dtype=float), np.array(p['coupling'], dtype=float)
        self.M, self.pull = np.diag(K.sum(axis=1) + gains) - K, gains * self.r
        M: Any = np.kron(np.eye(count), np.kron(self.M, np.eye(2)))
        self._step = ExponentialStep(
            -M, np.tile(np.kron(self.pull, [1.0, 0.0]), count), float(check_step.step_of(p)))

    def after(self, y: Any, omega: float) -> Any:
        """States a step later."""
        return self._step(y.view(float).ravel(), lambda x: self._own(
            x.view(complex), omega).view(float)).view(complex).reshape(y.shape)

    def rates(self, y: Any, omega: float) -> Any:
        """Their rates [1/s]."""
        return self._own(y, omega) - y @ self.M.T + self.pull

    def _own(self, z: Any, omega: float) -> Any:
        return (self.rho * (self.r**2 - np.abs(z)**2) - 1j * omega) * z


def _stepped(p: Values, y: Any, held: int) -> Any:
    """The program's step of states over r."""
    step = StepOfStates(p, held, 1)
    return np.array([step.after(one[None], step.omega)[0] for one in step.r * y])


def _rests(p: Values, y: Any, seconds: float) -> bool:
    """Whether states over r, armed, rest after a time and what it takes to come into C."""
    step, tick = StepOfStates(p, 1, len(y)), float(p['tick'])
    slow, alpha_r, slope, at_rest = (float(p[name]) for name in (
        'omega_armed_min', 'alpha_r', 'omega_slope', 'omega_at_rest'))
    wait = (2.0 * np.pi - float(check_proof.arc(p))) / slow
    speed, activity = float(p['armed_speed']) * np.exp(-alpha_r * wait), np.ones(y.shape)
    fade, swing = (np.exp(-rate * tick) for rate in (alpha_r, float(p['activity_rate'])))
    y = step.r * y
    for _ in range(int((seconds - wait) / tick)):
        omega = min(at_rest + slope * speed, float(p['omega_armed_max']))
        wanted = np.minimum(1.0, np.abs(step.rates(y, omega) / y) / slow)
        for _ in range(round(tick / float(check_step.step_of(p)))):
            y = step.after(y, omega)
        speed, activity = speed * fade, wanted + (activity - wanted) * swing
    phases = np.abs(step.rates(y, at_rest + slope * speed) / y).max()
    return bool(seconds > wait and max(
        phases / float(check_rest.QUIET), speed / float(check_rest.SLOW),
        activity.max() / float(check_proof.FEW)) <= 1.0 + _CLEARLY)
