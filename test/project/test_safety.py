# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page on safety names tests that exist, and the security policy is that of the tables."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest
from checkout import ROOT

pytest.importorskip('rclpy')

from dmp_cpg_ros.commands import security_policy
from dmp_cpg_ros.nodes.messages.interfaces import DRIVEN, SERVICES, TOPICS
from dmp_cpg_ros.suite_table import DRIVER, KINDS, RECORDER, ROBOT

PAGE = (ROOT / 'doc' / 'safety.md').read_text(encoding='utf-8')
POLICY = ROOT / 'config' / 'security' / 'policy.xml'


def test_every_line_has_a_test_that_exists() -> None:
    rows = [row for row in PAGE.split('## Hazards and tests')[1].split('##')[0].splitlines()
            if row.startswith('| ') and not row.startswith('| hazard')]
    named = [re.findall(r'`(test_\w+)`', row) for row in rows]
    assert len(rows) > 10 and all(named)
    sources = [path.read_text(encoding='utf-8') for path in (ROOT / 'test').rglob('test_*.py')]
    for name in {name for names in named for name in names} | set(
            re.findall(r'`(test_\w+)`', PAGE)):
        assert any(f'def {name}(' in source for source in sources), name


def test_no_conformity_is_claimed() -> None:
    assert 'Nothing here is a claim of conformity' in PAGE


def test_the_policy_is_that_of_the_tables() -> None:
    assert POLICY.read_text(encoding='utf-8') == security_policy.policy_xml()


def test_each_node_may_do_what_the_tables_say_and_no_more() -> None:
    enclaves = ElementTree.parse(POLICY).getroot().findall('.//enclave')
    nodes = [(kind, name) for kind in KINDS.values() for name in kind.instances]
    assert {of.get('path') for of in enclaves} == {
        f'/dmp_cpg_ros/{name}' for name in ('scenario_player', *(name for _, name in nodes))}
    for kind, name in nodes:
        stands_for = {kind.name: None, **({ROBOT: DRIVEN} if kind.name == DRIVER else {})}
        (profile,) = (of for enclave in enclaves if enclave.get('path') == f'/dmp_cpg_ros/{name}'
                      for of in enclave.findall('.//profile'))

        def allowed(group: str, verb: str, profile: ElementTree.Element = profile) -> set[str]:
            return {str(of.text) for part in profile.findall(f'{group}s[@{verb}="ALLOW"]')
                    for of in part}

        ours = {topic.name for topic in TOPICS}
        assert allowed('topic', 'publish') & ours == {
            topic.name for topic in TOPICS for of, only in stands_for.items()
            if of in topic.publishers and (only is None or topic.name in only)}
        assert allowed('topic', 'subscribe') & ours == {
            topic.name for topic in TOPICS for of, only in stands_for.items() if (
                topic.recorded if kind.name == RECORDER else of in topic.subscribers)
            and (only is None or topic.name in only)}
        assert allowed('service', 'reply') & {service.name for service in SERVICES} == {
            service.name for service in SERVICES if kind.name in service.publishers}
        assert not allowed('topic', 'publish') & {'cmd_vel', 'push', 'votes'}
