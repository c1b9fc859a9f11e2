# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``ros2 param set /canonical_oscillators gait trot``: accepted, refused, followed, automatic."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip('rclpy')

import ros_processes
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python
from ros_processes import Processes, Ros

processes, ros_domain, ros = (
    ros_processes.processes, ros_processes.ros_domain, ros_processes.ros)

OWNER, FOLLOWER = 'canonical_oscillators', 'inhibition'


def set_parameter(ros: Ros, node: str, name: str, value: Any) -> Any:
    request = SetParameters.Request(
        parameters=[Parameter(name, value=value).to_parameter_msg()])
    return ros.call(SetParameters, f'{node}/set_parameters', request).results[0]


def get_parameter(ros: Ros, node: str, name: str) -> Any:
    answer = ros.call(GetParameters, f'{node}/get_parameters',
                      GetParameters.Request(names=[name]))
    return parameter_value_to_python(answer.values[0])


def test_the_gait_is_set_through_the_nodes_own_service(processes: Processes, ros: Ros) -> None:
    nodes = [processes.node(OWNER), processes.node(FOLLOWER)]
    unknown = set_parameter(ros, OWNER, 'gait', 'gallop')
    assert not unknown.successful
    assert "no gait 'gallop'; valid are amble, walk, trot" in unknown.reason

    assert set_parameter(ros, OWNER, 'gait', 'trot').successful
    ros.spin_until(lambda: get_parameter(ros, FOLLOWER, 'gait') == 'trot')
    elsewhere = set_parameter(ros, FOLLOWER, 'gait', 'walk')
    assert not elsewhere.successful and f'param set /{OWNER} gait walk' in elsewhere.reason

    assert set_parameter(ros, FOLLOWER, 'inhibition_gain', 280.0).successful
    ros.spin_until(lambda: get_parameter(ros, OWNER, 'inhibition_gain') == 280.0)
    refused = set_parameter(ros, OWNER, 'gait', 'pronk')
    assert not refused.successful
    assert 'capture: ' in refused.reason and 'is not < k_inh = 280 1/s' in refused.reason
    assert get_parameter(ros, OWNER, 'gait') == 'trot'

    assert set_parameter(ros, FOLLOWER, 'inhibition_gain', 400.0).successful
    ros.spin_until(lambda: get_parameter(ros, OWNER, 'inhibition_gain') == 400.0)
    assert set_parameter(ros, OWNER, 'auto_gait', True).successful
    chosen = set_parameter(ros, OWNER, 'gait', 'walk')
    assert not chosen.successful and 'set auto_gait to false first' in chosen.reason
    strange = set_parameter(ros, OWNER, 'auto_gaits', ['walk', 'gallop'])
    assert not strange.successful and 'valid are amble' in strange.reason
    for node in nodes:
        node.interrupt()
        assert node.wait() == 0, str(node)
        assert 'Traceback' not in node.output, node
