# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every line of the proof in doc/certificate.md names what discharges it, and a test."""

from __future__ import annotations

import re
from dataclasses import replace

from checkout import ROOT
from core_examples import TICK, network, suite_parameters

from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.contraction.finding import CONTINUOUS

CONDITIONS = {'in places', 'together', 'holding', 'prediction', 'quickness', 'applied'}


def lines() -> list[list[str]]:
    text = (ROOT / 'doc' / 'certificate.md').read_text(encoding='utf-8')
    found = [re.split(r'(?<!\\)\|', row)[1:-1] for row in text.splitlines()
             if re.match(r'\| \d+ \|[^|]*[^\d|]', row) and '`test_' in row]
    return [[cell.strip() for cell in row] for row in found]


def test_the_proof_has_all_its_lines() -> None:
    assert [int(line[0]) for line in lines()] == list(range(1, 26))


def test_every_line_names_an_inequality_that_certify_prints_or_a_condition() -> None:
    p = suite_parameters()
    rows = {row.name for row in certify(
        Setting.of(network(), p, TICK)).inequalities} | {'votes_suffice'}
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
    coarse = network(rho=60.0, coupling_gain=400.0, coupling_graph='path')
    found = certify(Setting.of(
        coarse, replace(p, inhibition=replace(p.inhibition, inhibition_gain=2000.0)), TICK))
    assert found.sampled
    for name in found.sampled:
        line = next(line for line in lines() if f'`{name}`' in line[2])
        assert '*Sampled*' in line[1]


def test_what_is_proved_of_the_equation_alone_is_said_to_be_weaker() -> None:
    p = suite_parameters()
    rows = certify(Setting.of(network(contact_feedback=True), p, TICK)).inequalities
    text = (ROOT / 'doc' / 'certificate.md').read_text(encoding='utf-8')
    weaker = text.split('### What is weaker than a proof')[1].split('## Delays')[0]
    for row in rows:
        if row.grade == CONTINUOUS and not row.name.endswith(('_inhibition', '_coupling')):
            held_by_steps = any(f'`{row.name}`' in line[2] for line in lines())
            assert f'`{row.name}`' in weaker or held_by_steps, row.name
