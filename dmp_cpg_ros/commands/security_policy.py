# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m dmp_cpg_ros.commands.security_policy``: the suite's SROS 2 policy, from its tables.

Who may publish, subscribe, call and answer what; ``config/security/policy.xml`` is what it prints.
With ``--enclaves`` it prints the names of the enclaves; with ``--keystore FOLDER`` it makes them.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.sax.saxutils import quoteattr

from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.core.suite_parameters import CHANGEABLE
from dmp_cpg_ros.nodes.messages import interfaces
from dmp_cpg_ros.suite_table import DRIVER, KIND_OF, KINDS, RECORDER, ROBOT

ENCLAVE = '/dmp_cpg_ros'
"""Above the enclave of each node."""

PLAYER = 'scenario_player'
"""Node of ``walk``, with the rights of a user of the suite and those to play a scenario."""

CLIENTS = ('joystick', 'robot_client', 'teleop')
"""Commands that are nodes of these names, with the rights of a user of the suite."""

VIEWER = 'live_view'
"""A command that looks on and steers: a user that may read what a recorder may."""

PARAMETER_SERVICES = tuple(f'~/{name}' for name in (
    'describe_parameters', 'get_parameter_types', 'get_parameters', 'list_parameters',
    'set_parameters', 'set_parameters_atomically'))
USUAL_SERVICES = ('~/get_type_description', *PARAMETER_SERVICES)
LIFECYCLE_SERVICES = tuple(f'~/{name}' for name in (
    'change_state', 'get_state', 'get_available_states', 'get_available_transitions',
    'get_transition_graph'))
"""Services that rclpy gives to every node, of parameters and all, and to every managed one."""

Rules = dict[tuple[str, str], set[str]]
"""Names by verb and kind, such as ``('publish', 'topic')``."""


def rules_of(kind: str) -> Rules:
    """What a kind of node of the suite may do."""
    asked = {f'/{owner}/get_parameters' for owner in CHANGEABLE if owner != kind}
    follows = kind in CHANGEABLE
    return {
        ('publish', 'topic'): {'/rosout', '/parameter_events', '~/transition_event', *(
            topic.name for topic in interfaces.published_by(kind))},
        ('subscribe', 'topic'): {*({'/parameter_events'} if follows else ()), *(
            topic.name for topic in interfaces.read_by(kind))},
        ('reply', 'service'): {*USUAL_SERVICES, *LIFECYCLE_SERVICES, *(
            service.name for service in interfaces.served_by(kind))},
        ('request', 'service'): asked if follows else {
            f'/{name}/ready' for name, of in KIND_OF.items()
            if of not in (ROBOT, DRIVER)} if kind in (ROBOT, DRIVER) else set()}


def rules_of_user() -> Rules:
    """What whoever steers the robot may do."""
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
        ('subscribe', 'topic'): {'/clock', 'body_mode', 'drive_mode', 'inhibition_gains',
                                 *named(interfaces.TOPICS, 'subscribers')},
        ('reply', 'service'): set(USUAL_SERVICES),
        ('request', 'service'): {
            *named(interfaces.SERVICES, 'subscribers'),
            *(f'/{node}/{service}' for node in KIND_OF for service in (
                'get_parameters', 'set_parameters', 'list_parameters',
                'set_parameters_atomically'))}}


def rules_of_player() -> Rules:
    """What ``walk`` does besides: it makes nodes active and ends them."""
    rules = rules_of_user()
    rules['request', 'service'] |= {f'/{node}/change_state' for node in KIND_OF}
    return rules


def rules_of_viewer() -> Rules:
    """What the live view does besides: it shows what a recorder may read."""
    rules = rules_of_user()
    rules['subscribe', 'topic'] |= {topic.name for topic in interfaces.read_by(RECORDER)}
    return rules


def policies() -> dict[str, Rules]:
    """Rules by the name of the node."""
    return {**{name: rules_of(kind) for name, kind in KIND_OF.items()},
            PLAYER: rules_of_player(), VIEWER: rules_of_viewer(),
            **{name: rules_of_user() for name in CLIENTS}}


def policy_xml() -> str:
    """The policy as ``ros2 security create_permission`` reads it."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>',
             '<!-- Rights of all nodes for SROS 2, written by '
             'python -m dmp_cpg_ros.commands.security_policy; do not edit. -->',
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


def make_keystore(folder: Path) -> None:
    """Make a keystore with an enclave for each node and command, with the tools of SROS 2.

    Parameters
    ----------
    folder : Path
        Made if it is not there; enclaves that are there stay, with the policy of today.

    Raises
    ------
    MissingFileError
        If there is no ``ros2`` command.
    DataError
        If it fails; the text holds its last line.
    """
    with TemporaryDirectory() as scratch:
        policy = Path(scratch) / 'policy.xml'
        policy.write_text(policy_xml(), encoding='utf-8')
        if not (folder / 'enclaves').is_dir():
            _ros2_security('create_keystore', str(folder))
        for node in policies():
            enclave = f'{ENCLAVE}/{node}'
            if not (folder / 'enclaves' / enclave.strip('/') / 'key.pem').exists():
                _ros2_security('create_enclave', str(folder), enclave)
            _ros2_security('create_permission', str(folder), enclave, str(policy))


def _ros2_security(*words: str) -> None:
    try:
        done = subprocess.run(('ros2', 'security', *words), capture_output=True, text=True,
                              check=False)
    except FileNotFoundError:
        raise MissingFileError(
            'there is no ros2 command here; a sourced ROS 2 with sros2 has it') from None
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or ['without a word']
        raise DataError(f'ros2 security {" ".join(words)} failed: {said[-1]}')


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the policy or make a keystore; returns the exit status."""
    parser = argparse.ArgumentParser(prog='security_policy', description=__doc__)
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument('--enclaves', action='store_true', help='print the names of the enclaves')
    choice.add_argument('--keystore', type=Path, metavar='FOLDER', help='make a keystore there, '
                        'with ros2 security of a sourced ROS 2')
    return run_command(parser, arguments, _run)


def _run(options: argparse.Namespace, _: Any) -> int:
    if options.keystore is not None:
        make_keystore(options.keystore)
    elif options.enclaves:
        print(*(f'{ENCLAVE}/{node}' for node in policies()))
    else:
        sys.stdout.write(policy_xml())
    return 0


if __name__ == '__main__':
    sys.exit(main())
