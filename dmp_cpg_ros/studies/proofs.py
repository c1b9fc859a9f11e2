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
import sys
from collections import Counter
from collections.abc import Collection, Sequence
from functools import partial

import numpy as np

from dmp_cpg_ros.analysis.strict_json import to_json
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.proofs import check_proof, check_rest, check_step, proof
from dmp_cpg_ros.studies.certificate_settings import grid, random_setting
from dmp_cpg_ros.studies.output import at_least_one, markdown_table
from dmp_cpg_ros.studies.proof_claims import Values, refuted
from dmp_cpg_ros.studies.spoiled_proofs import DAMAGES, FORGERIES, REFUSALS, damaged, forged
from dmp_cpg_ros.studies.spoiled_steps import STEP_FORGERIES, forged_step, refuted_step
from dmp_cpg_ros.studies.workers import Workers

LIES = {**FORGERIES, **STEP_FORGERIES}
"""Kinds of forgery, of the step too."""

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
    with Workers(options.workers) as workers:
        every = grid(Progress('grid: '))[::options.every] if options.every else ()
        cases = [case.running for case in every]
        found, drawn = list(workers.map(attempt, cases, 8)), list[tuple[bool, str]]()
        wrong = _told('grid', found)
        while sum(certified for certified, _ in drawn) < options.random:
            drawn += workers.map(random_attempt, [
                (options.seed, len(drawn) + k) for k in range(50)], 5)
        wrong += _told('random', drawn)
    texts = [text for _, text in (*found, *drawn) if text]
    counts: Counter[tuple[str, str]] = Counter()
    with Workers(options.workers, prepare=partial(_keep, texts)) as workers:
        false = [names for names in workers.map(_refuted, texts, 20) if names]
        print(f'claims of the {len(texts)} proofs that are refuted: {false or "none"}\n',
              flush=True)
        for first, kinds in enumerate((DAMAGES, LIES)):
            done = 0
            while sum(counts[kind, REFUSED] for kind in kinds) < options.mutations // 2:
                block = [(options.seed, first, done + k) for k in range(200)]
                counts.update(workers.map(_spoilt, block, 10))
                done += len(block)
    verdicts = [REFUSED, WRONG, TRUE, CAREFUL, SAME]
    print(markdown_table(['spoiled', *verdicts], [
        [kind, *(str(counts[kind, verdict]) for verdict in verdicts)]
        for kind in (*DAMAGES, *LIES)] + [['all', *(str(sum(
            number for (_, one), number in counts.items() if one == verdict))
            for verdict in verdicts)]]))
    return int(bool(wrong or false or any(one == WRONG for _, one in counts)))


def _told(name: str, found: list[tuple[bool, str]]) -> int:
    """Print what became of settings; returns how many are wrong."""
    counts = Counter((certified, bool(text)) for certified, text in found)
    proved, missing, unasked = counts[True, True], counts[True, False], counts[False, True]
    refused = sum(not accepted(text) for _, text in found if text)
    parts = [json.loads(text) for _, text in found if text]
    stepped, resting = (sum(bool(part[of]) for part in parts) for of in ('step', 'rest'))
    print(f'{name}: {len(found)} settings, {proved + missing} certified, {proved} of them with a '
          f'proof, {stepped} with one of the step, {resting} with one of its time to rest; '
          f'{unasked} proofs of others; {refused} proofs refused', flush=True)
    return missing + unasked + refused


def attempt(s: Setting) -> tuple[bool, str]:
    """Whether a setting is certified, and the text of its proof; empty without one."""
    certified = certify(s).holds
    try:
        return certified, to_json(proof.proof_of(s))
    except ParameterError:
        return certified, ''


def random_attempt(seed: tuple[int, int]) -> tuple[bool, str]:
    """The same of a random setting."""
    return attempt(random_setting(np.random.default_rng(seed)))


def accepted(text: str) -> bool:
    """Whether the checkers accept a file, and what it has of the step."""
    try:
        found = json.loads(text, object_pairs_hook=check_proof.once)
        if found['rest']:
            check_rest.check(found)                  # all of it
        else:
            check_proof.check(found)
            if found['step']:
                check_step.check(found)
    except REFUSALS:
        return False
    return True


_texts: list[str] = []


def _keep(texts: list[str]) -> None:
    _texts[:] = texts


def _refuted(text: str) -> list[str]:
    return all_refuted(text, np.random.default_rng(0))


def all_refuted(text: str, rng: np.random.Generator) -> list[str]:
    """Claims of a proof that do not hold in floating point, those of its step included."""
    return refuted(*parts(text)) + (refuted_step(text, rng) if json.loads(text)['step'] else [])


def parts(text: str) -> tuple[Values, Values]:
    """Parameters and witnesses of a proof."""
    found = json.loads(text)
    return check_proof.read(found['parameters']), check_proof.read(found['witnesses'])


def _spoilt(seed: tuple[int, int, int]) -> tuple[str, str]:
    rng = np.random.default_rng(seed)
    text, other = (_texts[rng.integers(len(_texts))] for _ in range(2))
    kinds: Collection[str] = (DAMAGES, LIES)[seed[1]]
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
    found = lie(text, kind, rng)
    if found is None:
        return SAME
    changed, false = found
    taken = accepted(changed)
    return (WRONG if taken else REFUSED) if false else TRUE if taken else CAREFUL


def lie(text: str, kind: str, rng: np.random.Generator) -> tuple[str, bool] | None:
    """Forge a proof; also tells whether a claim of it is refuted. None where it has no step."""
    if kind in STEP_FORGERIES:
        if not json.loads(text)['step']:
            return None
        changed = forged_step(text, kind, rng)
        return changed, bool(refuted_step(changed, rng))
    p, w = parts(text)
    changed, w = forged(p, w, json.loads(text)['rows'], kind, rng)
    return changed, bool(refuted(p, w))


if __name__ == '__main__':
    sys.exit(main())
