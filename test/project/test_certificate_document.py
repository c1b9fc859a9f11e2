# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every line of the proof in doc/certificate.md names what discharges it, and a test."""

from __future__ import annotations

import re

from checkout import ROOT
from core_examples import TICK, network, suite_parameters

from dmp_cpg_ros.core.certificates.certify import certify

CONDITIONS = {'in places', 'together', 'holding', 'prediction', 'quickness'}


def lines() -> list[list[str]]:
    text = (ROOT / 'doc' / 'certificate.md').read_text(encoding='utf-8')
    found = [re.split(r'(?<!\\)\|', row)[1:-1] for row in text.splitlines()
             if re.match(r'\| \d+ \|[^|]*[^\d|]', row) and '`test_' in row]
    return [[cell.strip() for cell in row] for row in found]


def test_the_proof_has_all_its_lines() -> None:
    assert [int(line[0]) for line in lines()] == list(range(1, 25))


def test_every_line_names_an_inequality_that_certify_prints_or_a_condition() -> None:
    p = suite_parameters()
    rows = {row.name for row in certify(network(), p.inhibition, p.reference, p.leg, p.posture,
                                        TICK).inequalities} | {'votes_suffice'}
    for line in lines():
        conditions = set(re.findall(r'\*([a-z ]+)\*', line[2]))
        named = set(re.findall(r'`([a-z_]+)`', line[2]))
        assert conditions | named, line
        assert conditions <= CONDITIONS and named <= rows, line


def test_every_line_names_a_test_that_exists() -> None:
    tests = {name for file in (ROOT / 'test').rglob('test_*.py')
             for name in re.findall(r'^def (test_\w+)', file.read_text(encoding='utf-8'), re.M)}
    for line in lines():
        named = set(re.findall(r'`(test_\w+)`', line[3]))
        assert named and named <= tests, named - tests


def test_what_rests_on_a_sampled_inequality_says_so() -> None:
    p = suite_parameters()
    rows = certify(network(), p.inhibition, p.reference, p.leg, p.posture, TICK).inequalities
    for row in rows:
        if row.required and not row.proved:
            line = next(line for line in lines() if f'`{row.name}`' in line[2])
            assert '*Sampled*' in line[1]
