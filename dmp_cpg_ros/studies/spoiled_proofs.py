# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ways to spoil a proof: damage to its text, and forgeries that a careful liar would make."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np

from dmp_cpg_ros.core.proofs import check_proof, proof
from dmp_cpg_ros.studies.proof_claims import Values

REFUSALS = (ArithmeticError, LookupError, TypeError, ValueError, RecursionError)
"""What the checker raises for what proves nothing."""


def damaged(text: str, kind: str, other: str, rng: np.random.Generator) -> str:
    """Text of a proof in which one thing is changed."""
    found = json.loads(text)
    parts = {name: found[name] for name in ('parameters', 'witnesses', 'rows', 'step', 'rest')}
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
    part = str(rng.choice(['parameters', 'witnesses', 'rows', 'step', 'rest']))
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
        stated = {name: sorted(sides) for name, sides in check_proof.rows(p, w, True).items()}
    except REFUSALS:
        pass
    return json.dumps({**proof.written(p, w, {}, {}, {}), 'rows': proof.written(
        p, w, stated, {}, {})['rows'] if stated is not rows else rows}), w


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
