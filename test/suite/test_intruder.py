# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An intruder is named and does not keep the robot from walking; the study tries all attacks."""

from __future__ import annotations

import json
from pathlib import Path

import ros_processes
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from ros_processes import SHARED_HZ, Processes, joined, reserved_domain
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dmp_cpg_ros.analysis.bag import payload_digests
from dmp_cpg_ros.core.suite_parameters import INHIBITION
from dmp_cpg_ros.layouts import GAIN_ROWS
from dmp_cpg_ros.nodes.messages.interfaces import interface, private
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.suite_table import ROBOT

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain


def test_forged_targets_do_not_keep_the_robot_from_walking(processes: Processes) -> None:
    study = processes.python('-m', 'dmp_cpg_ros.studies.intruder', '--lock-step', '--duration',
                             '1', '--rate', str(ros_processes.SHARED_HZ), '--attacks',
                             'joint_targets times 3')
    assert study.wait(4 * ros_processes.DEADLINE_S) == 0, str(study)
    outcome = study.wait_for_output(r"Outcome\(attack='joint_targets times 3', messages=(\d+), "
                                    r'fell=False, speed=0.\d+, turned=\S+, named_s=(\d)')
    assert int(outcome[1]) > 100


FAR = Time(sec=10_000)

FORGED = {
    'body_mode': String(data='lying'), 'drive_mode': String(data='damp'),
    'inhibition_state': DiagnosticArray(
        status=[DiagnosticStatus(name=INHIBITION, message='forged')]),
    'inhibition_gains': JointState(name=list(GAIN_ROWS), position=[
        *4 * [0.0], 0.3, *5 * [0.0], 1.0, 1.0]),
    f'{ROBOT}/holding_at': Clock(clock=FAR),
    f'{ROBOT}/commands_taken': JointState(name=['push'], position=[99.0]),
}
"""What ends a scenario, or lets its events come before their ticks, if it is believed."""


def test_in_lock_step_a_scenario_is_the_same_bit_for_bit_beside_an_intruder(
        processes: Processes, tmp_path: Path) -> None:
    FORGED['inhibition_gains'].header.stamp = FAR
    scenario = tmp_path / 'stop.yaml'
    scenario.write_text(json.dumps({'name': 'stop', 'duration': 2.5, 'events': [
        {'at': 0.3, 'command': {'v_x': 0.4}}, {'at': 0.8, 'push': {'impulse': [0, 2, 0]}},
        {'at': 1.2, 'inhibit': True}]}), encoding='utf-8')

    def started(where: Processes, name: str) -> ros_processes.NodeProcess:
        return where.executable('walk', str(scenario), '--composed', '--lock-step', '--no-report',
                                '--rate', str(SHARED_HZ), '--out', str(tmp_path / name))

    with reserved_domain() as empty, joined(processes.domain) as ros:
        alone = Processes(empty)
        try:
            runs = [started(alone, 'alone'), started(processes, 'beside')]
            topic, count = interface('joint_states'), 0
            ticks = ros.collect(topic.type, topic.name, topic.reader_qos)
            # Nothing tells apart who has sent as many messages: the gate has told 20 by then.
            ros.spin_until(lambda: bool(ticks) and header_ns(ticks[-1]) > 200_000_000)
            forged = {}
            for name in FORGED:
                of = (private('~/commands_taken', ROBOT) if name.endswith('commands_taken')
                      else interface(name))
                forged[of.name] = ros.node.create_publisher(of.type, of.name, of.publisher_qos)

            def forge() -> bool:
                nonlocal count
                if len(ticks) > 4 * count:
                    count += 1
                    for name, publisher in forged.items():
                        publisher.publish(FORGED[name])
                return not runs[1].running

            ros.spin_until(forge, 4 * ros_processes.DEADLINE_S, what=lambda: str(runs[1]))
            for run in runs:
                assert run.wait(4 * ros_processes.DEADLINE_S) == 0, str(run)
        finally:
            alone.end()
    beside, usual = (payload_digests(tmp_path / name / 'bag') for name in ('beside', 'alone'))
    assert beside == usual and len(usual) == 6
    said = runs[1].output
    assert 'inhibition_gains is published by /test too' in said and 'forged' not in said, said
    assert 'lying' not in said and 'looks after itself' not in said, said
