# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Votes through real nodes: weak couplings, one vote goes unheard, three stop; and bad votes."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from messages import canonical_writer

pytest.importorskip('rclpy')

import ros_processes
from core_examples import network, quadruped, standing_state
from plain_run import plain_run
from ros_processes import Processes, Ros
from sensor_msgs.msg import JointState

from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.commands.walk import main
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.voting.votes import VoteInbox
from dmp_cpg_ros.nodes.framework.ticks import HOLD_TICKS
from dmp_cpg_ros.nodes.framework.told_stop import HEARTBEAT_NS
from dmp_cpg_ros.nodes.messages.commands import read_votes
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.reference import ReferenceWriter
from dmp_cpg_ros.nodes.messages.robot_state import RobotStateWriter
from dmp_cpg_ros.nodes.messages.values import stamp_ns

processes, ros, ros_domain = ros_processes.processes, ros_processes.ros, ros_processes.ros_domain

SCENARIO = """\
name: votes
duration: 6.6
parameters:
  {voting: true, coupling_gain: 5.0, inhibited_legs: [fl, fr, rl], physics: perfect_tracking,
   control_rate: 50.0}
events:
  - {at: 0.1, inhibit: false}
  - {at: 0.1, command: {v_x: 0.3}}
  - {at: 1.0, votes: {rr: 1.0}}
  - {at: 2.6, votes: {fr: 1.0, rl: 1.0, rr: 1.0}}
  - {at: 4.8, votes: {}}
  - {at: 6.0, inhibit: false}
"""
"""Synchronised legs of which none alone can stop the others; three are certified to."""


def test_one_vote_does_not_stop_the_nodes_and_three_do(
        processes: Processes, tmp_path: Path) -> None:
    run = processes.walked(SCENARIO, tmp_path / 'run', '--lock-step', '--composed')
    recording, (_, ticks) = load_recording(run / 'bag'), plain_run(tmp_path / 'run.yaml')
    np.testing.assert_array_equal(recording.canonical.x, [tick.x for tick in ticks])
    np.testing.assert_array_equal(
        recording.targets.position, [tick.targets.position for tick in ticks])
    told = recording.inhibition
    one = [event for event in told if 1.1 < event.time < 2.6]
    assert one and {event.message for event in one} <= {'walking', 'free'}
    assert {event.values['cause'] for event in one} == {'rr scenario'}
    assert {event.values['requested'] for event in one} == {'false'}
    words = [word for word, _ in groupby(
        event.message for event in told if 2.6 <= event.time < 6.0)]
    assert words[-3:] == ['waiting', 'captured', 'at_rest']
    rest = next(event for event in told if event.message == 'at_rest' and event.time > 2.6)
    assert rest.values['cause'] == 'fr scenario, rl scenario, rr scenario'
    assert (rest.values['voted'], rest.values['asked']) == ('true', 'false')
    assert float(rest.values['vote_fl']) == 0.0 < float(rest.values['vote_rr'])
    measured, predicted, bound = (
        float(rest.values[f'{name}_s']) for name in ('measured', 'predicted', 'bound'))
    assert measured == pytest.approx(predicted, abs=1e-6) and measured <= bound
    assert told[-1].message in ('releasing', 'walking', 'free')


@pytest.mark.usefixtures('ros_domain')
def test_a_scenario_that_votes_needs_voting(tmp_path: Path,
                                            capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tmp_path / 'votes.yaml'
    scenario.write_text(SCENARIO.replace('voting: true, ', ''), encoding='utf-8')
    assert main([str(scenario), '--out', str(tmp_path / 'run')]) == 2
    assert 'needs voting:=true' in capsys.readouterr().err


def test_sensors_that_fall_silent_by_their_stamps_stop_the_gait(
        processes: Processes, ros: Ros) -> None:
    """Contacts are told, the IMU dies, and later a user votes what is no vote. Who writes faster
    than the node reads replaces what it wrote: a tick is told when the one before was answered
    (without an IMU, some ticks later: what is silent is waited for).
    """
    node = processes.node('inhibition', voting=True, start_inhibited=False, auto_inhibit=False)
    state = interface('inhibition_state')
    told = ros.collect(state.type, state.name, state.reader_qos)
    gains = interface('inhibition_gains')
    answers = ros.collect(gains.type, gains.name, gains.reader_qos)
    names = ('canonical_state', 'reference', 'foot_contacts', 'imu', 'votes')
    say = {name: ros.node.create_publisher(
        interface(name).type, name, interface(name).publisher_qos) for name in names}
    ros.spin_until(lambda: all(end.get_subscription_count() == 1 for end in say.values()),
                   what=lambda: str(node))
    gait = network()
    x, oscillators, reference = gait.locked_state(), canonical_writer(), ReferenceWriter()
    rate = gait.rate(x, np.zeros(3), Inhibition(False, np.zeros(4), 0.3))
    robot = RobotStateWriter()
    at = {'ns': -HEARTBEAT_NS}

    def tick(imu: bool) -> None:
        at['ns'] += HEARTBEAT_NS
        robot.fill(standing_state(quadruped(), at['ns']))
        say['foot_contacts'].publish(robot.foot_contacts.serialized)
        if imu:
            say['imu'].publish(robot.imu.serialized)
        say['reference'].publish(reference.fill(at['ns'], np.zeros(3)).serialized)
        say['canonical_state'].publish(oscillators.fill(
            at['ns'], x, rate, gait.gait).serialized)

    def last() -> dict[str, str]:
        return {entry.key: entry.value for entry in told[-1].status[0].values} if told else {}

    def until(wanted: Callable[[], bool], imu: bool) -> None:
        def answered() -> bool:
            lag_ns = 0 if imu else (1 + HOLD_TICKS) * HEARTBEAT_NS
            return bool(answers) and stamp_ns(answers[-1].header.stamp) >= at['ns'] - lag_ns

        while not wanted():
            tick(imu)
            ros.spin_until(answered, what=lambda: f'{last()} {node}')

    until(lambda: at['ns'] > 1_000_000_000 and bool(told), True)
    assert last()['cause'] == 'none' and last()['requested'] == 'false'
    alive_ns = at['ns']
    until(lambda: last()['requested'] == 'true', False)
    assert last()['cause'] == 'fl silence, fr silence, rl silence, rr silence'
    assert float(last()['request_stamp']) * 1e9 - alive_ns == pytest.approx(
        500_000_000 + HEARTBEAT_NS)  # the first tick that is later than the limit
    until(lambda: last()['cause'] == 'none', True)
    assert last()['voted'] == 'true'
    say['votes'].publish(JointState(name=['fl'], effort=[math.nan]))
    say['votes'].publish(JointState(name=['rl'], effort=[1.0]))
    until(lambda: last()['cause'] == 'rl user', True)
    node.wait_for_output('must be finite and at least 0')


# Messages --------------------------------------------------------------------------------------


def test_votes_are_read_by_voter_and_leg() -> None:
    message = JointState(name=['cliff detector/rr', 'cliff detector/fl'], effort=[0.5, 0.25])
    assert read_votes(message) == ({'rr': 0.5, 'fl': 0.25}, 'cliff detector')
    assert read_votes(JointState(name=['rr'], effort=[0.5])) == ({'rr': 0.5}, '')


@pytest.mark.parametrize(('message', 'text'), [
    (JointState(name=['fl', 'fr'], effort=[1.0]), 'one weight'),
    (JointState(name=['fl']), 'one weight'),
    (JointState(name=['fl'], position=[1.0]), 'one weight'),
    (JointState(name=['a/fl', 'b/fr'], effort=[1.0, 1.0]), 'one voter'),
    (JointState(name=['fl', 'fl'], effort=[1.0, 1.0]), 'none twice'),
    (JointState(), 'one or more of the legs'),
    (JointState(name=['fl_foot'], effort=[1.0]), 'one or more of the legs'),
    (JointState(name=['fl'], effort=[math.nan]), 'finite'),
    (JointState(name=['fl'], effort=[-1.0]), 'at least 0'),
])
def test_bad_votes_are_refused_and_leave_nothing(message: JointState, text: str) -> None:
    box = VoteInbox()
    with pytest.raises(DataError, match=text):
        box.accept(*read_votes(message))
    assert box.take() == ()
