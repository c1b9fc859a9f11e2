# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proofs of certificates: whatever is certified has one, and spoiled ones are refused.

``python -m dmp_cpg_ros.studies.proofs`` writes and checks proofs of the grid's settings and of
random ones, and then spoils them in two ways. *Damage* changes one thing in a file, in which
everything else follows from the parameters and a few chosen witnesses, so that it contradicts
itself. A *forgery* changes parameters or witnesses and repairs what follows from them, so that
nothing but what it claims can give it away; what it claims is judged in floating point, by other
formulas than the checker's. Forgeries of which no claim is refuted may be true: they are counted
apart, whether they are refused or not.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from dmp_cpg_ros.analysis.strict_json import to_json
from dmp_cpg_ros.core.canonical.coupling import CouplingGraph
from dmp_cpg_ros.core.canonical.hopf import AndronovHopf
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates import check_proof, proof, step
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.contraction.equilibrium import inhibited_equilibrium
from dmp_cpg_ros.core.contraction.synchronisation import connectivity
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.studies.certificate_settings import Arguments, grid, random_arguments
from dmp_cpg_ros.studies.output import at_least_one, markdown_table
from dmp_cpg_ros.studies.workers import Workers

Values = dict[str, Any]

REFUSALS = (ArithmeticError, LookupError, TypeError, ValueError, RecursionError)

REFUSED, WRONG, TRUE, CAREFUL, SAME = (
    'refused', 'ACCEPTED', 'accepted, nothing refuted', 'refused, nothing refuted', 'unchanged')
"""Verdicts: only the first two are of files that had to be refused."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study; returns 1 where a proof is missing or a false one is accepted."""
    parser = argparse.ArgumentParser(prog='proofs', description=__doc__.splitlines()[0])
    add = parser.add_argument
    add('--workers', type=at_least_one, default=1, metavar='N', help='processes (default: 1)')
    add('--mutations', type=int, default=10_000, metavar='N',
        help='spoiled proofs that have to be refused, half of them forged (default: 10000)')
    add('--random', type=int, default=500, metavar='N',
        help='random certified settings beside the grid (default: 500)')
    add('--every', type=int, default=1, metavar='N', help='of the grid, every N-th only; 0: none')
    add('--seed', type=int, default=1, help='of the random settings and of what is spoiled')
    options = parser.parse_args(arguments)
    with Workers(options.workers, progress=False) as workers:
        cases = [case.arguments for case in grid()[::options.every]] if options.every else []
        found, drawn = list(workers.map(attempt, cases, 8)), list[tuple[bool, str]]()
        wrong = _told('grid', found)
        while sum(certified for certified, _ in drawn) < options.random:
            drawn += workers.map(random_attempt, [
                (options.seed, len(drawn) + k) for k in range(50)], 5)
        wrong += _told('random', drawn)
    texts = [text for _, text in (*found, *drawn) if text]
    counts: Counter[tuple[str, str]] = Counter()
    with Workers(options.workers, progress=False, prepare=partial(_keep, texts)) as workers:
        false = [names for names in workers.map(_refuted, texts, 20) if names]
        print(f'claims of the {len(texts)} proofs that are refuted: {false or "none"}\n',
              flush=True)
        for first, kinds in enumerate((DAMAGES, FORGERIES)):
            done = 0
            while sum(counts[kind, REFUSED] for kind in kinds) < options.mutations // 2:
                block = [(options.seed, first, done + k) for k in range(200)]
                counts.update(workers.map(_spoilt, block, 10))
                done += len(block)
    verdicts = [REFUSED, WRONG, TRUE, CAREFUL, SAME]
    print(markdown_table(['spoiled', *verdicts], [
        [kind, *(str(counts[kind, verdict]) for verdict in verdicts)]
        for kind in (*DAMAGES, *FORGERIES)] + [['all', *(str(sum(
            number for (_, one), number in counts.items() if one == verdict))
            for verdict in verdicts)]]))
    return int(bool(wrong or false or any(one == WRONG for _, one in counts)))


def _told(name: str, found: list[tuple[bool, str]]) -> int:
    """Print what became of settings; returns how many are wrong."""
    counts = Counter((certified, bool(text)) for certified, text in found)
    proved, missing, unasked = counts[True, True], counts[True, False], counts[False, True]
    refused = sum(not accepted(text) for _, text in found if text)
    print(f'{name}: {len(found)} settings, {proved + missing} certified, {proved} of them with a '
          f'proof; {unasked} proofs of others; {refused} proofs refused', flush=True)
    return missing + unasked + refused


def attempt(arguments: Arguments) -> tuple[bool, str]:
    """Whether a setting is certified, and the text of its proof; empty without one."""
    certified = certify(*arguments).holds
    try:
        return certified, to_json(proof.proof_of(*arguments))
    except ParameterError:
        return certified, ''


def random_attempt(seed: tuple[int, int]) -> tuple[bool, str]:
    """The same of a random setting."""
    return attempt(random_arguments(np.random.default_rng(seed)))


def accepted(text: str) -> bool:
    """Whether the checker accepts a file."""
    try:
        check_proof.check(json.loads(text, object_pairs_hook=check_proof.once))
    except REFUSALS:
        return False
    return True


_texts: list[str] = []


def _keep(texts: list[str]) -> None:
    _texts[:] = texts


def _refuted(text: str) -> list[str]:
    return refuted(*parts(text))


def parts(text: str) -> tuple[Values, Values]:
    """Parameters and witnesses of a proof."""
    found = json.loads(text)
    return check_proof.read(found['parameters']), check_proof.read(found['witnesses'])


def _spoilt(seed: tuple[int, int, int]) -> tuple[str, str]:
    rng = np.random.default_rng(seed)
    text, other = (_texts[rng.integers(len(_texts))] for _ in range(2))
    kinds = (DAMAGES, FORGERIES)[seed[1]]
    kind = list(kinds)[seed[2] % len(kinds)]
    return kind, verdict(text, kind, other, rng)


def verdict(text: str, kind: str, other: str, rng: np.random.Generator) -> str:
    """Spoil a proof and see what becomes of it."""
    if kind in DAMAGES:
        changed = damaged(text, kind, other, rng)
        try:
            if json.loads(changed, object_pairs_hook=check_proof.once) == json.loads(text):
                return SAME
        except ValueError:
            pass
        if not accepted(changed):
            return REFUSED
        return WRONG if refuted(*parts(changed)) else TRUE
    p, w = parts(text)
    changed, w = forged(p, w, json.loads(text)['rows'], kind, rng)
    false, taken = refuted(p, w), accepted(changed)
    return (WRONG if taken else REFUSED) if false else TRUE if taken else CAREFUL


def damaged(text: str, kind: str, other: str, rng: np.random.Generator) -> str:
    """Text of a proof in which one thing is changed."""
    found = json.loads(text)
    parts = {name: found[name] for name in ('parameters', 'witnesses', 'rows')}
    return DAMAGES[kind](found, [*_places(parts)], json.loads(other), rng)


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Containers and keys of all that is in a value."""
    for key, one in [*(value.items() if isinstance(value, dict) else enumerate(value))]:
        yield value, key
        if not isinstance(one, str):
            yield from _places(one)


def _number(change: Callable[[str, np.random.Generator], Any]) -> Callable[..., str]:
    """Damage of one number."""
    def damage(found: Values, places: list[Any], other: Values, rng: np.random.Generator) -> str:
        numbers = [(at, key) for at, key in places if isinstance(at[key], str)]
        at, key = numbers[rng.integers(len(numbers))]
        at[key] = change(at[key], rng)
        return json.dumps(found)
    return damage


def _other_digit(text: str, rng: np.random.Generator) -> str:
    at = int(rng.choice([k for k, sign in enumerate(text) if sign.isdigit()]))
    return text[:at] + str((int(text[at]) + rng.integers(1, 10)) % 10) + text[at + 1:]


def _nudged(text: str, rng: np.random.Generator) -> str:
    change = Fraction(int(rng.choice([-1, 1])), 10**int(rng.integers(1, 16)))
    return str(Fraction(text) * (1 + change) or change)


def _spelling(text: str, rng: np.random.Generator) -> Any:
    value = Fraction(text)
    ways = [f'{text}.0', f' {text}', f'+{text}', f'{text}0', f'0{text}', 'nan', 'inf', '1e9999999',
            '0x1', '', f'{2 * value.numerator}/{2 * value.denominator}', f'{text}/1', f'{text}/0',
            float(value), math.nan, math.inf, int(value), None, True, [], [text], {}]
    return ways[rng.integers(len(ways))]


def _huge(text: str, rng: np.random.Generator) -> str:
    return str(Fraction(text) + Fraction(1, 10**int(rng.integers(20, 4000))))


def _list(change: Callable[[list[Any], np.random.Generator], object]) -> Callable[..., str]:
    """Damage of one list."""
    def damage(found: Values, places: list[Any], other: Values, rng: np.random.Generator) -> str:
        lists = [at[key] for at, key in places if isinstance(at[key], list) and len(at[key]) > 1]
        change(lists[rng.integers(len(lists))], rng)
        return json.dumps(found)
    return damage


def _swap(values: list[Any], rng: np.random.Generator) -> None:
    i, j = rng.permutation(len(values))[:2]
    values[i], values[j] = values[j], values[i]


def _double(values: list[Any], rng: np.random.Generator) -> None:
    at = rng.integers(len(values))
    values.insert(at, values[at])


def _named(found: Values, places: list[Any], other: Values, rng: np.random.Generator) -> str:
    """Damage of a name: dropped, changed, added, or there twice with another value."""
    names = [(at, key) for at, key in places if isinstance(at, dict)]
    at, key = names[rng.integers(len(names))]
    way = rng.integers(4)
    if way == 3:
        return json.dumps(found).replace(f'"{key}":', f'"{key}": "1", "{key}":', 1)
    value = at.pop(key) if way < 2 else at[key]
    if way:
        at[f'{key}_'] = value
    return json.dumps(found)


def _cut(found: Values, places: list[Any], other: Values, rng: np.random.Generator) -> str:
    text = json.dumps(found)
    return text[:rng.integers(len(text))]


def _exchanged(found: Values, places: list[Any], other: Values, rng: np.random.Generator) -> str:
    part = str(rng.choice(['parameters', 'witnesses', 'rows']))
    return json.dumps({**found, part: other[part]})


DAMAGES: dict[str, Callable[..., Any]] = {
    'digit changed': _number(_other_digit),
    'sign changed': _number(lambda text, rng: str(-Fraction(text))),
    'number nudged': _number(_nudged),
    'number misspelled': _number(_spelling),
    'huge denominator': _number(_huge),
    'entries swapped': _list(_swap),
    'entry dropped': _list(lambda values, rng: values.pop(rng.integers(len(values)))),
    'entry doubled': _list(_double),
    'name changed': _named,
    'file cut': _cut,
    'part of another proof': _exchanged,
}
"""Kinds of damage: (file, places in it, another file, rng) -> text."""


def forged(p: Values, w: Values, rows: Values, kind: str, rng: np.random.Generator
           ) -> tuple[str, Values]:
    """Text of a proof of something else, and its witnesses; what follows from parameters and
    witnesses is repaired, and both sides of each row are put in order.
    """
    after = FORGERIES[kind](p, w, rng)
    try:
        w = proof.completed(p, w)
    except (*REFUSALS, np.linalg.LinAlgError):
        pass
    if after is not None:
        after(w)
    stated: Values = rows
    try:
        stated = {name: sorted(sides) for name, sides in check_proof.rows(p, w).items()}
    except REFUSALS:
        pass
    return json.dumps({**proof.written(p, w, {}), 'rows': proof.written(p, w, stated)['rows']
                       if stated is not rows else rows}), w


def _small(rng: np.random.Generator, smallest: float = -6.0) -> Fraction:
    """Share of any order of magnitude."""
    return Fraction(float(10.0 ** rng.uniform(smallest, 0.0)))


def _other_parameter(p: Values, w: Values, rng: np.random.Generator) -> None:
    name = list(p)[rng.integers(len(p))]
    factor = Fraction(float(np.exp(rng.choice([-1, 1]) * rng.uniform(0.05, 3.0))))
    p[name] = _scaled(p[name], factor)


def _other_gain(p: Values, w: Values, rng: np.random.Generator) -> None:
    """Another gain of one edge or of one inhibited leg, or none."""
    row = [*p['coupling'], p['gains']][rng.integers(len(p['gains']) + 1)]
    used = np.flatnonzero([gain > 0 for gain in row])
    if len(used):
        row[rng.choice(used)] *= Fraction(float(rng.uniform(0.0, 1.0) * rng.integers(2)))


def _scaled(value: Any, factor: Fraction) -> Any:
    return [_scaled(one, factor) for one in value] if isinstance(value, list) else value * factor


def _too_connected(p: Values, w: Values, rng: np.random.Generator) -> Callable[[Values], None]:
    """More connectivity than there is; one in two puts the factors right where they show it."""
    w['connectivity'] *= 1 + _small(rng)

    def mended(w: Values) -> None:
        w['D'] = [max(x, Fraction(0)) for x in w['D']]
    return mended if rng.random() < 0.5 else lambda w: None


def _other_weights(p: Values, w: Values, rng: np.random.Generator) -> None:
    xi = [Fraction(float(x)) for x in rng.dirichlet(np.ones(len(w['xi'])))]
    w['xi'] = [x / sum(xi) for x in xi]


def _faster(p: Values, w: Values, rng: np.random.Generator) -> None:
    w['rate'] *= 1 + _small(rng, -3.0)


def _other_norm(p: Values, w: Values, rng: np.random.Generator) -> None:
    w['v'] = [x * Fraction(float(np.exp(rng.normal()))) for x in w['v']]


def _smaller_box(p: Values, w: Values, rng: np.random.Generator) -> None:
    w['u'][rng.integers(len(w['u']))] *= 1 - _small(rng)


def _higher_planes(p: Values, w: Values, rng: np.random.Generator) -> None:
    """Half-planes that are farther from the origin or turned; a new one where there is none."""
    r, t = p['radius'], _small(rng) / 2
    turned = [(1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)]
    if not w['half_planes'] or rng.random() < 0.3:
        height = r * Fraction(float(rng.uniform(0.0, 1.0)))
        w['half_planes'].append([*turned, [height] * len(w['u'])])
    else:
        plane = w['half_planes'][rng.integers(len(w['half_planes']))]
        plane[2] = [h + r * _small(rng) for h in plane[2]]


def _elsewhere(p: Values, w: Values, rng: np.random.Generator) -> Callable[[Values], None]:
    """Equilibria elsewhere, one in two with the error that the true ones had."""
    errors = [error for *_, error in w['equilibria']]
    which = rng.integers(2)
    for z in w['equilibria'][which][0]:
        z[:] = [x + p['radius'] * _small(rng) * int(rng.choice([-1, 1])) for x in z]

    def kept(w: Values) -> None:
        w['equilibria'][which][2] = errors[which]
    return kept if rng.random() < 0.5 else lambda w: None


def _too_small(p: Values, w: Values, rng: np.random.Generator) -> Callable[[Values], None]:
    """One of the numbers that are rounded to the safe side, beyond it."""
    name = str(rng.choice(['rest_distance', 'rest_size', 'mild_root', 'cycle_error',
                           'arming_time', 'error']))

    def lower(w: Values) -> None:
        share = _small(rng)
        if name == 'error':
            which = w['equilibria'][rng.integers(2)]
            which[2] = proof.on_grid(which[2] * (1 - share) / 1000)
        else:
            w[name] = proof.on_grid(w[name] * (1 + (share if name == 'rest_size' else -share)))
    return lower


FORGERIES: dict[str, Callable[..., Any]] = {
    'another parameter': _other_parameter,
    'another gain': _other_gain,
    'more connectivity': _too_connected,
    'other weights': _other_weights,
    'faster contraction': _faster,
    'another norm': _other_norm,
    'smaller box': _smaller_box,
    'higher half-planes': _higher_planes,
    'equilibrium elsewhere': _elsewhere,
    'bound too small': _too_small,
}
"""Kinds of forgery: change parameters and witnesses; what they return changes what is repaired."""

_CLEARLY = 1e-7
"""Share by which a claim must fail, so that rounding does not refute it."""

_LESS = 1.0 - _CLEARLY

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)  # (a, 2)


def refuted(p: Values, w: Values) -> list[str]:
    """Claims of a proof that do not hold, in floating point.

    States on faces of the box and the half-planes are sampled with the field and the Jacobian of
    the oscillators, connectivity is an eigenvalue and equilibria are found by Newton's method, so
    that nothing is shared with the checker. Time to rest is compared with what the reference's and
    the swings' filters alone need.
    """
    K, gains = (np.array(p[name], dtype=float) for name in ('coupling', 'gains'))
    numbers = [float(x) for x in p.values() if isinstance(x, Fraction)]
    fastest = float(max(p['omega_at_rest'], p['omega_armed_max']))
    if min(*numbers, K.min(), gains.min()) < 0.0 or fastest > float(p['omega_max']) / _LESS:
        return ['premises']
    if min(float(p['rho']), float(p['radius']), gains.max(), K.sum(axis=1).max()) <= 0.0 or min(
            map(float, (*w['v'], *w['xi']))) <= 0.0:
        return ['positive']
    claimed = _Claimed(p, w)
    claims = claimed.box() | claimed.sampled() | claimed.times() | claimed.half_planes()
    claims |= claimed.rest() or {'equilibrium': False}
    return [name for name, holds in claims.items() if not holds]


class _Claimed:
    """Parameters and witnesses of a proof as floating-point numbers, and whether they fit."""

    def __init__(self, p: Values, w: Values) -> None:
        self.p, self.w = p, w
        self.rho, self.r, self.r0, self.tick, self.omega, self.slow = (float(p[name]) for name in (
            'rho', 'radius', 'region_radius', 'tick', 'omega_max', 'omega_at_rest'))
        self.K, self.gains = (np.array(p[name], dtype=float) for name in ('coupling', 'gains'))
        self.u, self.v, self.xi = (np.array(w[name], dtype=float) for name in ('u', 'v', 'xi'))
        self.connectivity, self.rate = float(w['connectivity']), float(w['rate'])
        self.planes = [[np.array(part, dtype=float) for part in plane[:3]]
                       for plane in w['half_planes']]
        size, K = len(self.K), self.K
        self.oscillator = AndronovHopf(self.rho, self.r)
        self.graph = CouplingGraph(size, tuple((int(i), int(j)) for i, j in np.argwhere(K > 0.0)),
                                   K[K > 0.0][:, None, None] * np.eye(2), np.zeros(size))
        self.system = CanonicalSystem(self.graph, self.oscillator)
        self.target, self.held = np.array([self.r, 0.0]), self.gains > 0.0
        self.growth, self.kept = self.rho * self.r**2, self.gains + K.sum(axis=1)
        self.scale = _CLEARLY * (self.omega + K.max()) * self.r
        self.places = self.r * min(0.02, self.slow / K.sum(axis=1).max())

    def box(self) -> dict[str, bool]:
        """Synchronisation, entry, the faces of the box, and contraction in it."""
        r, u, v, K, kept = self.r, self.u, self.v, self.K, self.kept
        x = self.target + u[:, None, None] * _CIRCLE                           # (N, a, 2)
        field = (self.oscillator.field(x, self.omega) * _CIRCLE).sum(axis=2)
        on_face = np.where(self._in_disc(x), field, -np.inf).max(axis=1) + K @ u - kept * u
        inner = np.max([np.maximum(0.0, r - u), *(h for *_, h in self.planes)],
                       axis=0) if self.planes else 0 * u
        J = self.oscillator.jacobian(inner[:, None, None] * _CIRCLE, self.omega)
        most = np.linalg.eigvalsh(0.5 * (J + np.swapaxes(J, 2, 3)))[..., 1].max(axis=1)
        known = connectivity(self.graph.block_laplacian(), len(K), self.xi)
        return {
            'synchronisation': self.growth * _LESS < self.connectivity
            and abs(self.xi.sum() - 1.0) < _CLEARLY and self.connectivity * _LESS <= known,
            'entry': bool(np.all(np.abs(u - self.r0)[self.held] <= _CLEARLY * r) and np.all(
                u[~self.held] >= min(2.0 * r, self.r0 + self.places) * _LESS)),
            'box': bool(np.all((on_face <= self.scale) | (u >= 2.0 * r * _LESS))),
            'contraction': self.rate > 0.0 and bool(np.all(
                most - kept + (K @ v) / v <= -self.rate + _CLEARLY * kept.max()))}

    def sampled(self) -> dict[str, bool]:
        """The sampled step."""
        rho, r, r0, omega, tick = self.rho, self.r, self.r0, self.omega, self.tick
        decay = min(self.connectivity - self.growth, self.rate, 2.0 * self.growth)
        return {
            'time_step': tick * _LESS <= step.longest_step(rho, r, omega, decay),
            'mild_root': float(self.w['mild_root']) >= math.hypot(omega, self.growth) * _LESS,
            'cycle_radius': step.cycle_radius_error(rho, r, omega, tick) * _LESS - 1e-10 <= float(
                self.w['cycle_error']) <= min(0.02, (r0 / r)**2),
            'region_per_tick': omega * tick * _LESS <= 4.0 * math.asin(min(1.0, 0.5 * r0 / r))}

    def times(self) -> dict[str, bool]:
        """Rates of the filters, and the times that they take at least."""
        p, fast = self.p, float(self.p['foot_speed'])
        return {
            'rates': min(p['alpha_r'], p['slowest_filter'], p['stiffness'], p['damping']) > 0,
            'rest_posture': float(p['clearance']) * 0.02 * _LESS <= 0.01,
            'arming_time': fast == 0.0 or fast * _LESS * math.exp(
                -float(p['alpha_r'] * self.w['arming_time'])) <= float(p['armed_speed']),
            'time_to_rest': p['activity_rate'] > 0 and p['alpha_r'] > 0 and max(
                math.log(50.0) / float(p['activity_rate']),
                math.log(max(100.0 * fast, 1.0)) / float(p['alpha_r'])) < 10.0}

    def half_planes(self) -> dict[str, bool]:
        """States on the half-planes move inwards, and entries lie behind them."""
        r, u, held = self.r, self.u, []
        entry = np.concatenate([0.98 * r * _CIRCLE, r * _CIRCLE])
        entry = entry[np.hypot(*(entry - self.target).T) <= self.r0]
        for c, s, h in self.planes:
            n, along = np.array([c, -s]), np.array([s, c])
            x = h[:, None, None] * n + np.linspace(-r, r, len(_CIRCLE))[:, None] * along
            near = np.hypot(*np.moveaxis(x - self.target, 2, 0)) <= u[:, None]
            inwards = np.where(self._in_disc(x) & near, self.oscillator.field(x, self.omega) @ n,
                               np.inf).min(axis=1)
            held.append(bool(np.all(
                inwards + self.K @ h + self.gains * r * c - self.kept * h >= -self.scale)
                and np.all(h.max() + self.places <= entry @ n + self.scale) and h.min() >= 0.0))
        return {'half-planes': all(held)} if held else {}

    def rest(self) -> dict[str, bool]:
        """Equilibria at the slowest and the fastest cadence; empty where one is not found."""
        claims = dict[str, bool]()
        for at, (y, _, error) in zip((self.slow, self.omega), self.w['equilibria'][::-1],
                                     strict=True):
            rest, states = inhibited_equilibrium(self.system, at, self.gains), np.array(
                y, dtype=float)
            if rest is None:
                return {}
            off = np.linalg.norm(rest.state - states, axis=1) / self.v
            claims[f'equilibrium at {at:.3g}'] = (
                float(off.max()) * _LESS - 1e-9 * self.r <= float(error))
            near = np.linalg.norm(states - self.target, axis=1)[self.held].max()
            claims['rest_in_region'] = bool(  # of the fastest, which comes last
                rest.distance[self.held].max() * _LESS < self.r0
                and near * _LESS <= float(self.w['rest_distance']))
            claims.setdefault('rest_radius', bool(
                rest.radius.min() > 0.5 * self.r * _LESS
                and np.hypot(*states.T).min() >= float(self.w['rest_size']) * _LESS))
        return claims

    def _in_disc(self, x: Array) -> Array:
        return np.asarray(np.hypot(x[..., 0], x[..., 1]) <= self.r)


if __name__ == '__main__':
    sys.exit(main())
