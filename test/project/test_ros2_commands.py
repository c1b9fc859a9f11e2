# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documents ask of the command ``ros2``, asked of a suite that runs.

There is no ``ros2`` where the tests are, so that each command is done by hand: the name is in the
graph with this type, the message has these fields, somebody hears it, the node answers.
"""

from __future__ import annotations

import importlib
import re
import shlex
from collections.abc import Iterator
from typing import Any

import pytest
import yaml

pytest.importorskip('rclpy')

import ros_processes
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from ros_processes import Processes, Ros
from test_readme import DOCUMENTS, blocks, text

from dmp_cpg_ros.nodes.messages.interfaces import COMMAND_INTERFACES, POWER
from dmp_cpg_ros.suite_table import DRIVER

shared_domain, shared_suite, ros = (
    ros_processes.shared_domain, ros_processes.shared_suite, ros_processes.shared_ros)

SPOKEN = ('topic pub', 'topic echo', 'service call', 'param set')
"""What speaks with nodes; ``test_readme.py`` has ``run`` and ``launch``."""

OF_NAV2 = ('/initialpose',)
"""Topics that Nav2 reads, which is not here: of these the message alone is tried."""


def asked() -> Iterator[list[str]]:
    """Words of each such command behind ``ros2``, without how often."""
    for document in DOCUMENTS:
        lines = [*''.join(blocks(document, 'bash')).splitlines(),
                 *re.findall(r'`(ros2 [^`]+)`', text(document))]
        for line in lines:
            words = [word for word in shlex.split(line, comments=True)[1:]
                     if not re.fullmatch(r'--once|-r|\d+', word)]
            if ' '.join(words[:2]) in SPOKEN:
                yield words


def kind(name: str) -> Any:
    """Class of a type, such as ``std_srvs/srv/SetBool``."""
    package, folder, of = name.split('/')
    return getattr(importlib.import_module(f'{package}.{folder}'), of)


def filled(message: Any, values: dict[str, Any]) -> Any:
    """A message with values; what is no field, or of another type, is an error of it."""
    for name, value in values.items():
        if isinstance(value, dict):
            filled(getattr(message, name), value)
        else:
            setattr(message, name, value)
    return message


@pytest.fixture(scope='module')
def suite(shared_suite: Processes) -> Processes:
    shared_suite.node(DRIVER, command_interfaces=[*COMMAND_INTERFACES, POWER])
    return shared_suite


def test_a_command_of_each_kind_is_in_the_documents() -> None:
    assert {' '.join(words[:2]) for words in asked()} == set(SPOKEN)


@pytest.mark.parametrize('words', list(asked()), ids=' '.join)
def test_what_ros2_is_asked_is_answered(suite: Processes, ros: Ros, words: list[str]) -> None:
    what, name, *rest = ' '.join(words[:2]), *words[2:]
    value = yaml.safe_load(rest[1]) if len(rest) > 1 else {}
    if what == 'param set':
        answer = ros.call(SetParameters, f'{name}/set_parameters', SetParameters.Request(
            parameters=[Parameter(rest[0], value=value).to_parameter_msg()]))
        assert answer.results[0].successful, answer.results[0].reason
    elif what == 'service call':
        known = ros.node.get_service_names_and_types
        ros.spin_until(lambda: (name, [rest[0]]) in known(), what=lambda: str(known()))
        assert ros.call(kind(rest[0]), name, filled(kind(rest[0]).Request(), value)).message
    elif name in OF_NAV2:
        filled(kind(rest[0])(), value)
    else:
        known = ros.node.get_topic_names_and_types
        ros.spin_until(lambda: name in dict(known()), what=lambda: str(known()))
        (type_name,) = dict(known())[name]
        if what == 'topic echo':
            offered = ros.node.get_publishers_info_by_topic(name)[0].qos_profile
            heard = ros.collect(kind(type_name), name, QoSProfile(
                depth=10, reliability=offered.reliability, durability=offered.durability))
            ros.spin_until(lambda: bool(heard))
        else:
            assert type_name == rest[0]
            publisher = ros.node.create_publisher(kind(type_name), name, 10)
            ros.spin_until(lambda: publisher.get_subscription_count() > 0)
            publisher.publish(filled(kind(type_name)(), value))
