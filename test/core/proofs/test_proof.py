# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proofs of certificates: written, checked by a script that knows nothing of the package, and
refused when anything in them is changed.
"""

from __future__ import annotations

import copy
import json
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import count, islice
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from core_examples import GAITS, TICK, network, suite_parameters
from house import code_lines

from dmp_cpg_ros.core.canonical.coupling import Edges, graph_from_edges
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.system import CanonicalSystem
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.inequality import STEP_ROWS, Certificate
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.maths.exponential import phi_functions
from dmp_cpg_ros.core.proofs import check_proof, check_rest, check_step
from dmp_cpg_ros.core.proofs.proof import completed, proof_of, written
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.studies.certificate_settings import random_setting
from dmp_cpg_ros.studies.spoiled_steps import StepOfStates

P = suite_parameters()
CHECKERS = (check_proof, check_step, check_rest)


def running(gait: GaitNetwork, inhibition: InhibitionParameters = P.inhibition,
            tick: float = TICK) -> Setting:
    return Setting.of(gait, replace(P, inhibition=inhibition), tick)


def proof(gait: GaitNetwork, inhibition: InhibitionParameters = P.inhibition,
          tick: float = TICK) -> dict[str, Any]:
    """As it stands in a file."""
    found: dict[str, Any] = json.loads(text(gait, inhibition, tick))
    return found


def text(gait: GaitNetwork, inhibition: InhibitionParameters, tick: float) -> str:
    return json.dumps(proof_of(running(gait, inhibition, tick)), allow_nan=False)


def usual_proof(gait: str = 'amble', tick: float = TICK) -> dict[str, Any]:
    """That of a gait with the usual parameters, which many tests read and change."""
    found: dict[str, Any] = json.loads(usual_text(gait, tick))
    return found


@cache
def usual_text(gait: str, tick: float) -> str:
    return text(network(gait), P.inhibition, tick)


REGIONAL = (901, 1704, 3450, 3472, 4154, 6203)
"""Seeds of settings with little coupling that contract on a region alone and rest within 4 s; one
in a thousand does."""


def settings(seeds: Iterable[int], share: tuple[float, float]
             ) -> Iterator[tuple[GaitNetwork, InhibitionParameters, float, Certificate]]:
    """Random certified settings with a coupling gain in a range, as multiples of rho r^2."""
    for seed in seeds:
        rng = np.random.default_rng(seed)

        def some(low: float, high: float, rng: np.random.Generator = rng) -> float:
            return float(np.exp(rng.uniform(np.log(low), np.log(high))))

        radius, growth = some(0.3, 1.6), some(0.5, 30.0)
        gait = network(
            str(rng.choice(list(GAITS))), rho=growth / radius**2, radius=radius,
            coupling_gain=growth * some(*share), paced=some(0.25, 3.0),
            coupling_graph=str(rng.choice(['all_to_all', 'ring', 'path', 'star',
                                           'directed_ring'])))
        inhibition = InhibitionParameters(
            inhibition_gain=some(60.0, 6000.0), region_radius=radius * some(0.03, 1.2),
            inhibited_legs=tuple(rng.permutation(LEGS)[:rng.integers(1, 4)].tolist()))
        tick = float(rng.choice([0.001, 0.004, 0.01]))
        certificate = certify(running(gait, inhibition, tick))
        if certificate.holds:
            yield gait, inhibition, tick, certificate


@cache
def proved() -> list[tuple[GaitNetwork, InhibitionParameters, float, Certificate, str]]:
    """Thirty of these settings with much coupling, and their proofs."""
    return [(*setting, text(*setting[:3])) for setting in islice(
        settings(count(), (5.0, 100.0)), 30)]


@pytest.mark.parametrize('gait', GAITS)
def test_every_gait_has_a_proof_of_every_inequality(gait: str) -> None:
    found = check_rest.check(usual_proof(gait))
    certificate = certify(running(network(gait)))
    assert set(found) == {
        f'step_{row.name}' if row.name == 'time_to_rest' else row.name
        for row in certificate.inequalities if row.required} | {
            'premises', 'step_premises', 'time_step'}
    assert float(found['synchronisation'][1]) == pytest.approx(
        certificate['synchronisation'].right, rel=1e-6)
    assert float(found['capture'][0]) == pytest.approx(
        certificate['capture'].left / certificate['capture'].right, rel=1e-6)


def test_random_certified_settings_have_proofs() -> None:
    assert len(proved()) == 30
    for *_, found in proved():
        check_proof.check(json.loads(found))


def test_settings_that_contract_on_a_region_alone_have_proofs() -> None:
    cases = list(settings(REGIONAL, (1.5, 5.0)))
    assert len(cases) == len(REGIONAL)
    for gait, inhibition, tick, certificate in cases:
        assert certificate.contraction_grade == 'regional'
        found = proof(gait, inhibition, tick)
        assert found['witnesses']['half_planes']
        check_proof.check(found)


@pytest.mark.parametrize('edges', [
    ((1, 0), (2, 1), (3, 2)),                                # each follows the one before
    ((1, 0), (2, 0), (3, 0)),                                # all follow one, uncoupled ones
    ((0, 1), (1, 0), (2, 1), (2, 3), (3, 2)),                # a pair that follows a pair
    ((0, 3), (1, 0), (1, 3), (2, 1), (2, 3), (3, 1)),        # one that follows three
    ((1, 0), (1, 2), (2, 0), (2, 1), (3, 0))])
def test_graphs_whose_components_follow_one_another_have_proofs(edges: Edges) -> None:
    gait = coupled(edges, np.eye(2))
    inhibition = InhibitionParameters(inhibition_gain=2000.0)
    certificate = certify(running(gait, inhibition))
    assert certificate.holds, certificate.explained()
    found = check_proof.check(proof(gait, inhibition))
    assert float(found['synchronisation'][1]) == pytest.approx(
        certificate['synchronisation'].right, rel=1e-6)


def coupled(edges: Edges, gain: np.ndarray) -> GaitNetwork:
    """The oscillators of an amble on a graph of its own."""
    gait = network()
    system = gait.system
    gait.system = CanonicalSystem(graph_from_edges(4, edges, 100.0 * gain, gait.gait.phases),
                                  system.oscillators, system.target)
    return gait


def test_couplings_that_are_not_multiples_of_one_have_no_proof() -> None:
    with pytest.raises(ParameterError, match='k_ij I'):
        proof(coupled(((0, 1), (1, 0), (2, 1), (3, 2)), np.diag([1.0, 1.1])))


def test_what_is_not_certified_has_no_proof() -> None:
    slow = random_setting(np.random.default_rng((53, 25)))       # of the equation, not of the step
    assert certify(slow).failing[0].name == 'time_to_rest'
    with pytest.raises(ParameterError, match='no exact proof'):
        proof_of(slow)
    for changes in ({'coupling_gain': 2.0}, {'coupling_gain': 8.0}):
        with pytest.raises(ParameterError, match='no exact proof'):
            proof(network(**changes))
    with pytest.raises(ParameterError, match='no exact proof'):
        proof(network(), InhibitionParameters(inhibition_gain=150.0))


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all strings."""
    if isinstance(value, str):
        yield path
    else:
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from places(one, (*path, key))


def mutated(found: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """The proof with a digit, a sign or an entry changed."""
    changed = copy.deepcopy(found)
    paths = [path for path in places(changed) if path[0] != 'format']
    *way, last = paths[rng.integers(len(paths))]
    inside = changed
    for key in way:
        inside = inside[key]
    text = inside[last]
    kind = rng.integers(4)
    if kind == 0:
        del inside[last]
    elif kind == 1 and Fraction(text):
        inside[last] = str(-Fraction(text))
    else:
        digits = [k for k, sign in enumerate(text) if sign.isdigit()]
        k = digits[rng.integers(len(digits))]
        other = str((int(text[k]) + rng.integers(1, 10)) % 10)
        inside[last] = text[:k] + other + text[k + 1:]
    return changed


def test_mutated_proofs_are_refused() -> None:
    rng = np.random.default_rng(3)
    regional = next(settings(REGIONAL, (1.5, 5.0)))
    originals = [usual_proof(), proof(network('trot', coupling_graph='directed_ring')),
                 proof(*regional[:3])]
    for original in originals:
        checkers = [check_proof, *[check_step] * bool(original['step']),
                    *[check_rest] * bool(original['rest'])]
        checkers[-1].check(original)
        for _ in range(80):
            changed = mutated(original, rng)
            with pytest.raises((ArithmeticError, LookupError, TypeError, ValueError)):
                for checker in checkers[-1:] if original['rest'] else checkers:
                    checker.check(changed)


@pytest.mark.parametrize(('name', 'value'), [
    ('coupling_gain', None), ('inhibition', None), ('omega_max', '40'), ('tick', '1/5')])
def test_a_proof_is_not_accepted_for_parameters_that_are_worse(name: str, value: str | None
                                                               ) -> None:
    changed = usual_proof()
    p = changed['parameters']
    if name == 'coupling_gain':
        p['coupling'] = [[str(Fraction(k) / 100) for k in row] for row in p['coupling']]
    elif name == 'inhibition':
        p['gains'] = [str(Fraction(gain) / 4) for gain in p['gains']]
    else:
        p[name] = value
    with pytest.raises(ValueError):
        check_proof.check(changed)


@pytest.mark.parametrize('gait', GAITS)
@pytest.mark.parametrize('tick', [0.001, TICK, 0.01])
def test_the_step_of_every_gait_has_a_proof_that_says_what_certify_does(gait: str, tick: float
                                                                        ) -> None:
    certificate = certify(running(network(gait), tick=tick))
    found = check_rest.check(usual_proof(gait, tick))
    assert {'step_premises', *STEP_ROWS} < set(found) and certificate['step_capture'].required
    bound, longest = found['step_time_to_rest']
    assert longest == 10 and 0.98 * certificate.time_to_rest < float(bound) <= 1.0001 * (
        certificate.time_to_rest)
    length = tick / max(1, round(tick / 0.005))
    farthest, r0 = map(float, found['step_capture'])
    assert farthest / r0 == pytest.approx(certificate['step_capture'].left, rel=1e-3)
    for name in ('step_contraction', 'step_synchronisation'):
        rate = -np.log(float(found[name][0])) / length
        assert rate == pytest.approx(certificate[name].right, rel=0.01)


def test_proved_times_to_rest_are_never_far_above_those_that_are_stated() -> None:
    shares = []
    for *_, certificate, text_of_it in proved()[:20]:
        found = json.loads(text_of_it)
        if found['rest']:
            shares.append(float(check_rest.check(found)['step_time_to_rest'][0])
                          / certificate.time_to_rest)
    assert len(shares) > 15 and max(shares) < 1.01


@pytest.mark.parametrize(('name', 'worse'), [
    ('alpha_r', Fraction(1, 2)), ('activity_rate', Fraction(1, 8)), ('omega_slope', 40),
    ('armed_speed', Fraction(1, 9)), ('omega_armed_min', Fraction(1, 4)), ('foot_speed', 40)])
def test_a_time_to_rest_is_not_accepted_for_parameters_that_make_it_longer(
        name: str, worse: Fraction) -> None:
    found = usual_proof()
    stated = Fraction(found['rest']['step_time_to_rest'][0])
    p, w, s = (check_proof.read(of) for of in (
        found['parameters'], found['witnesses'], found['step']['witnesses']))
    p[name] *= worse
    w = completed(p, w)
    assert check_rest.time_to_rest(p, w, s) > stated
    changed = {**written(p, w, check_proof.rows(p, w, False), {}, {}), **{
        part: found[part] for part in ('step', 'rest')}}
    check_proof.check(changed)
    check_step.check(changed)
    with pytest.raises(ValueError, match='rest'):
        check_rest.check(changed)


def test_steps_from_the_box_keep_the_bounds_that_a_time_to_rest_is_made_of() -> None:
    """Of what is moved, of rates and of another frequency; halved, each of them fails."""
    rng = np.random.default_rng(4)
    close = np.zeros(4)
    for *_, text_of_it in proved()[:6]:
        found = json.loads(text_of_it)
        if not found['rest']:
            continue
        p, s = (check_proof.read(of) for of in (found['parameters'], found['step']['witnesses']))
        Z, P, S, G, Y, near = (np.array(of, dtype=float) for of in check_rest.falling(p, s))
        h, r, omega = (float(x) for x in (check_step.step_of(p), p['radius'], p['omega_max']))
        u = np.minimum(np.array(s['box'], dtype=float), 0.3)
        y = 1.0 + u * rng.random((12, 4)) * np.exp(2j * np.pi * rng.random((12, 4)))
        y /= np.maximum(np.abs(y), 1.0)
        step = StepOfStates(p, 1, len(y))
        after, slower = (step.after(r * y, at) / r for at in (omega, 0.97 * omega))
        moved = np.abs(after - y)
        c, later = (h / r * np.abs(step.rates(r * x, omega)) for x in (y, after))
        twice = np.abs(step.after(r * after, omega) / r - after)
        for k, (what, bound) in enumerate([
                (twice, moved @ Z.T), (later, moved @ P.T + c @ S.T), (moved, c @ G.T),
                (np.abs(after - slower), 0.03 * omega * h * Y)]):
            share = float((what / bound).max())
            assert share <= 1.0 + 1e-9
            close[k] = max(close[k], share)
        assert np.abs(after).max() <= near
    assert close.min() > 0.5


def test_a_slow_leg_behind_quick_ones_has_a_proof() -> None:
    found = proof_of(random_setting(np.random.default_rng((3, 785))))
    p, w = (check_proof.read(found[part]) for part in ('parameters', 'witnesses'))
    assert float(max(w['v']) / min(w['v'])) > 1e3                # no one norm fits all legs
    left, right = check_proof.rows(p, w, alone=True)['time_to_rest']
    assert left > right
    assert check_rest.check(found)['step_time_to_rest'][0] < 10


def test_a_step_that_synchronises_slowly_while_it_turns_fast_has_a_proof() -> None:
    found = proof_of(random_setting(np.random.default_rng((51, 26))))
    assert check_rest.check(found)['step_synchronisation'][0] < 1


def test_a_norm_is_refused_that_any_frequency_exceeds() -> None:
    rng = np.random.default_rng(2)
    for shift in (0.0, 0.01):
        p = check_proof.read(usual_proof()['parameters'])
        weights = rng.dirichlet(np.full(4, 4.0))
        xi = [Fraction(x) for x in weights.tolist()]
        xi[0] += 1 - sum(xi)
        spread = np.diag(weights) - np.outer(weights, weights)
        values, vectors = np.linalg.eigh(spread)
        root = vectors[:, 1:] * np.sqrt(values[1:])                    # |root.T y|^2 = y' spread y
        back = vectors[:, 1:] / np.sqrt(values[1:])
        for of in check_step.matrices(check_step.phi_of(p, 0), Fraction(shift))[:9]:
            d = [np.array(x, dtype=float) / check_step.ONE for x in of.d]
            most = max(np.linalg.norm(root.T @ sum(
                (-1j * w)**m * x for m, x in enumerate(d)) @ back, 2)
                for w in np.linspace(-0.5, 0.5, 41))
            with pytest.raises(ValueError, match='norm'):
                check_step.norm(of, xi, Fraction(1, 2), Fraction(0.999 * most))
            check_step.norm(of, xi, Fraction(1, 2), Fraction(1.2 * most))


def test_a_setting_whose_step_is_not_proved_has_a_proof_without_it() -> None:
    for gait, inhibition, tick, certificate in settings(count(), (1.5, 8.0)):
        if certificate['time_step'].required:
            found = proof(gait, inhibition, tick)
            check_proof.check(found)
            assert found['step'] == found['rest'] == {}
            for checker in (check_step, check_rest):
                with pytest.raises(LookupError):
                    checker.check(found)
            return


@pytest.mark.parametrize(('name', 'worse'), [
    ('omega_max', 3), ('tick', Fraction(5, 4)), ('rho', 3), ('region_radius', Fraction(1, 2))])
def test_a_proof_of_the_step_is_not_accepted_for_parameters_that_are_worse(
        name: str, worse: Fraction) -> None:
    changed = usual_proof()
    changed['parameters'][name] = str(Fraction(changed['parameters'][name]) * worse)
    with pytest.raises(ValueError):
        check_step.check(changed)


def test_the_functions_of_the_step_are_exact_far_beyond_what_is_added() -> None:
    rng = np.random.default_rng(1)
    for size in (0.3, 3.0, 300.0):
        z = size * rng.random((4, 4)) * (np.eye(4) - 1.0)
        z -= np.diag(z.sum(axis=1) - size * rng.random(4))
        whole = [[int(Fraction(x) * check_step.ONE) for x in row] for row in z.tolist()]
        for share, found in zip((0.5, 1.0), check_step.phi(whole), strict=True):
            for here, there in zip(found, phi_functions(-share * z), strict=True):
                assert np.abs(np.array(here, dtype=float) / check_step.ONE - there).max() < 1e-13
        half, full = (np.array(of, dtype=object) for of in check_step.phi(whole))
        squared = half[0] @ half[0] // check_step.ONE                  # phi_0 twice as far
        recursion = np.array(check_step.diagonal([check_step.ONE] * 4)) - np.array(
            whole) @ full[1] // check_step.ONE                          # 1 - z phi_1
        for other in (squared, recursion):
            assert np.abs(other - full[0]).max() < check_step.ONE >> 350


@pytest.mark.parametrize('checker', CHECKERS)
def test_a_checker_can_be_read_at_a_sitting(checker: ModuleType) -> None:
    path = Path(str(checker.__file__))
    assert code_lines(path) <= 150
    text = path.read_text(encoding='utf-8')
    imported = re.findall(r'^(?:import|from) (\w+)', text, re.MULTILINE)
    own = {path.stem for path in path.parent.glob('check_*.py')} | {'dmp_cpg_ros'}
    assert set(imported) - own <= {'json', 'os', 'sys', 'fractions', 'typing'}
    packaged = re.findall(r'dmp_cpg_ros\.core\.proofs(?:\.(\w+))? import (.*)', text)
    assert all(set((name or names).split(', ')) <= own for name, names in packaged)


@pytest.mark.parametrize('checker', CHECKERS)
def test_a_checker_is_a_script_of_its_own(checker: ModuleType, tmp_path: Path) -> None:
    path, script = tmp_path / 'proof.json', tmp_path / Path(str(checker.__file__)).name
    for each in CHECKERS:                            # beside each other, and nothing else
        (tmp_path / Path(str(each.__file__)).name).write_bytes(
            Path(str(each.__file__)).read_bytes())
    found = usual_proof()
    path.write_text(json.dumps(found), encoding='utf-8')

    def status(arguments: Sequence[str] = (str(path),)) -> int:
        ended = subprocess.run([sys.executable, '-E', '-S', str(script), *arguments],
                               capture_output=True, text=True, check=False)
        assert (ended.stdout + ended.stderr).count('\n') == 1
        return ended.returncode

    assert status() == 0
    text = path.read_text(encoding='utf-8')
    found['witnesses']['rate'] = found['step']['witnesses']['disc'] = '1'
    for changed in (json.dumps(found), text[:-1], text.replace('{', '{"format": "", ', 1),
                    text.replace('"rho": "8"', '"rho": NaN'),
                    text.replace('"rho": "8"', '"rho": "8e999999999"'), '[' * 100_000):
        path.write_text(changed, encoding='utf-8')
        assert changed != text and status() == 1
    path.unlink()
    assert status() == 2 and status([]) == 2
