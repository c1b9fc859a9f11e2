# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page on safety names tests that exist, and the security policy is that of the tables."""

from __future__ import annotations

import re
from collections import defaultdict
from contextlib import suppress
from pathlib import Path
from xml.etree import ElementTree

import pytest
from checkout import ROOT

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import ros_processes
from rclpy.node import NodeNameNonExistentError
from ros_processes import RUN_S, SHARED_HZ, Processes, Ros

from dmp_cpg_ros.commands import security_policy
from dmp_cpg_ros.nodes.messages.interfaces import DRIVEN, SERVICES, TOPICS
from dmp_cpg_ros.suite_table import DRIVER, KINDS, RECORDER, ROBOT, WALKING_NODES

processes, ros, ros_domain = (
    ros_processes.processes, ros_processes.ros, ros_processes.ros_domain)

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


RARE = {'/clock', 'canonical_state', 'foot_contacts', 'gait_memory', 'ground_truth',
        'joint_states', '/tf', '/tf_static'}
"""Topics for some parameters, for real time or lock-step alone, or for what is not in the wheels.
"""

STEERING = {('publish', 'topic'): '/cmd_vel', ('subscribe', 'topic'): '/inhibition_gains',
            ('request', 'service'): '/inhibit',
            ('reply', 'service'): '/scenario_player/get_type_description'}
"""An end of each kind that whoever steers the robot has."""

SCENARIO = 'name: w\nduration: 600.0\nparameters: {voting: true}\nevents: []\n'


@pytest.mark.parametrize('options', [(), ('--lock-step',)])
def test_the_policy_covers_the_running_graph(
        processes: Processes, ros: Ros, tmp_path: Path, options: tuple[str, ...]) -> None:
    """Each end has its right, and but for rare ones each right of a node its end."""
    node = ros.node
    ends = {('publish', 'topic'): node.get_publisher_names_and_types_by_node,
            ('subscribe', 'topic'): node.get_subscriber_names_and_types_by_node,
            ('reply', 'service'): node.get_service_names_and_types_by_node,
            ('request', 'service'): node.get_client_names_and_types_by_node}
    policies = {name: {of: {full(right, name) for right in rights}
                       for of, rights in rules.items()}
                for name, rules in security_policy.policies().items()}
    there = {*WALKING_NODES, RECORDER, security_policy.PLAYER, security_policy.VIEWER}
    used = defaultdict[tuple[str, tuple[str, str]], set[str]](set)
    walk = processes.walk(SCENARIO, tmp_path / 'run', '--rate', str(SHARED_HZ), *options)
    walk.wait_for_output(r'at rest', RUN_S)
    view = processes.executable(security_policy.VIEWER, '--port', '0')

    def wanted() -> list[str]:
        lacking = []
        for name in there:
            for of, rights in policies[name].items():
                with suppress(NodeNameNonExistentError):
                    used[name, of] |= {end for end, _ in ends[of](name, '/')}
                if of == ('reply', 'service') and name == security_policy.VIEWER:
                    continue  # it has no parameters
                if name not in (security_policy.PLAYER, security_policy.VIEWER):
                    rare = {full(topic, name) for topic in RARE}
                    lacking += [f'{name}: {of} {right}' for right in
                                rights - used[name, of] - rare if name != ROBOT
                                or of != ('request', 'service')]
                elif STEERING[of] not in used[name, of]:
                    lacking.append(f'{name}: {of} {STEERING[of]}')
        return lacking

    view.wait_for_output('token', RUN_S)
    ros.spin_until(lambda: not wanted(), what=lambda: str(wanted()))
    for (name, of), seen in used.items():
        assert seen <= policies[name][of], (name, of, seen - policies[name][of])


def full(name: str, node: str) -> str:
    """Name of a node's topic or service in the graph."""
    return name.replace('~', f'/{node}') if name.startswith('~') else f'/{name.lstrip("/")}'


def test_each_node_may_do_what_the_tables_say_and_no_more() -> None:
    enclaves = ElementTree.parse(POLICY).getroot().findall('.//enclave')
    nodes = [(kind, name) for kind in KINDS.values() for name in kind.instances]
    assert {of.get('path') for of in enclaves} == {
        f'/dmp_cpg_ros/{name}' for name in (
            security_policy.PLAYER, security_policy.VIEWER, *security_policy.CLIENTS,
            *(name for _, name in nodes))}
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


ROS2 = """#!/bin/sh
echo "$@" >> "$0.log"
case "$2 $3" in
  "create_enclave $BAD") echo "no such enclave" >&2; exit 1;;
  create_keystore*) mkdir -p "$3/enclaves";;
  create_enclave*) mkdir -p "$3/enclaves$4" && touch "$3/enclaves$4/key.pem";;
  create_permission*) test -f "$5" || exit 1;;
esac
"""


def test_a_keystore_is_made_with_the_usual_tools(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    """Each enclave once, its permissions again each time; without the tools it says so."""
    keystore, ros2 = tmp_path / 'keystore', tmp_path / 'ros2'
    monkeypatch.setenv('PATH', str(tmp_path))
    assert security_policy.main(['--keystore', str(keystore)]) == 2
    assert 'no ros2 command' in capsys.readouterr().err
    ros2.write_text(ROS2, encoding='utf-8')
    ros2.chmod(0o755)
    monkeypatch.setenv('PATH', f'{tmp_path}:/usr/bin:/bin')
    for _ in range(2):
        assert security_policy.main(['--keystore', str(keystore)]) == 0
    calls = (tmp_path / 'ros2.log').read_text(encoding='utf-8').splitlines()
    made = [line.split()[1] for line in calls]
    nodes = len(security_policy.policies())
    assert [made.count(f'create_{what}') for what in ('keystore', 'enclave', 'permission')] == [
        1, nodes, 2 * nodes]
    other = tmp_path / 'other'
    monkeypatch.setenv('BAD', str(other))
    assert security_policy.main(['--keystore', str(other)]) == 2
    assert 'no such enclave' in capsys.readouterr().err
