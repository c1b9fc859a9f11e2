# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m dmp_cpg_ros.commands.security_policy``: the suite's SROS 2 policy, from its tables.

Who may publish, subscribe, call and answer what; ``config/security/policy.xml`` is what it prints.
With ``--enclaves`` it prints the names of the enclaves.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from xml.sax.saxutils import quoteattr

from dmp_cpg_ros.nodes.messages import interfaces
from dmp_cpg_ros.suite_table import KIND_OF, KINDS, RECORDER

ENCLAVE = '/dmp_cpg_ros'
"""Above the enclave of each node."""

PLAYER = 'scenario_player'
"""Node of ``walk``, with the rights of a user of the suite and those to play a scenario."""

PARAMETER_SERVICES = tuple(f'~/{name}' for name in (
    'describe_parameters', 'get_parameter_types', 'get_parameters', 'list_parameters',
    'set_parameters', 'set_parameters_atomically'))
LIFECYCLE_SERVICES = tuple(f'~/{name}' for name in (
    'change_state', 'get_state', 'get_available_states', 'get_available_transitions',
    'get_transition_graph'))
"""Services that rclpy gives to every node, and to every managed one."""

Rules = dict[tuple[str, str], set[str]]
"""Names by verb and kind, such as ``('publish', 'topic')``."""


def rules_of(kind: str) -> Rules:
    """What a kind of node of the suite may do."""
    return {
        ('publish', 'topic'): {'/rosout', '/parameter_events', '~/transition_event', *(
            topic.name for topic in interfaces.published_by(kind))},
        ('subscribe', 'topic'): {'/parameter_events', *(
            topic.name for topic in interfaces.read_by(kind))},
        ('reply', 'service'): {*PARAMETER_SERVICES, *LIFECYCLE_SERVICES, *(
            service.name for service in interfaces.served_by(kind))},
        ('request', 'service'): {f'/{name}/get_parameters' for name, of in KIND_OF.items()
                                 if of not in (kind, RECORDER)}}


def rules_of_user() -> Rules:
    """What whoever steers the robot may do, and what ``walk`` does."""
    def named(topics: Iterable[interfaces.Interface], users: str) -> set[str]:
        found = set()
        for topic in topics:
            if 'user' in getattr(topic, users):
                owners = topic.publishers if users == 'subscribers' else topic.subscribers
                found |= {topic.name.replace('~', f'/{name}') for owner in owners
                          for name in KINDS[owner].instances}
        return found

    return {
        ('publish', 'topic'): {'/rosout', '/parameter_events',
                               *named(interfaces.TOPICS, 'publishers')},
        ('subscribe', 'topic'): {'/clock', 'body_mode', 'inhibition_gains',
                                 *named(interfaces.TOPICS, 'subscribers')},
        ('reply', 'service'): set(PARAMETER_SERVICES),
        ('request', 'service'): {
            *named(interfaces.SERVICES, 'subscribers'),
            *(f'/{node}/{name[2:]}' for node in KIND_OF
              for name in ('~/change_state', '~/get_parameters', '~/set_parameters_atomically'))}}


def policies() -> dict[str, Rules]:
    """Rules by the name of the node."""
    return {**{name: rules_of(kind) for name, kind in KIND_OF.items()},
            PLAYER: rules_of_user()}


def policy_xml() -> str:
    """The policy as ``ros2 security create_permission`` reads it."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>',
             '<!-- Written by python -m dmp_cpg_ros.commands.security_policy; do not edit. -->',
             '<policy version="0.2.0">', '  <enclaves>']
    for node, rules in sorted(policies().items()):
        lines += [f'    <enclave path={quoteattr(f"{ENCLAVE}/{node}")}>', '      <profiles>',
                  f'        <profile ns="/" node={quoteattr(node)}>']
        for (verb, kind), names in rules.items():
            lines += [f'          <{kind}s {verb}="ALLOW">',
                      *(f'            <{kind}>{name}</{kind}>' for name in sorted(names)),
                      f'          </{kind}s>']
        lines += ['        </profile>', '      </profiles>', '    </enclave>']
    return '\n'.join([*lines, '  </enclaves>', '</policy>', ''])


if __name__ == '__main__':
    sys.stdout.write(' '.join(f'{ENCLAVE}/{node}' for node in policies()) + '\n'
                     if sys.argv[1:] == ['--enclaves'] else policy_xml())
