# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An intruder is named and does not keep the robot from walking; the study tries all attacks."""

from __future__ import annotations

from math import nan

import pytest

pytest.importorskip('rclpy')

import ros_processes
from ros_processes import Processes

from dmp_cpg_ros.studies.intruder import Outcome, table

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain


def test_an_intruder_that_is_not_named_is_in_the_table_and_counts() -> None:
    outcomes = [Outcome('body_mode', 9, False, 0.5, 0.0, named) for named in (0.2, nan, 0.1)]
    assert [outcome.told for outcome in outcomes] == [True, False, True]
    assert all(outcome.walked_on for outcome in outcomes)
    assert table(outcomes).split()[-2] == '-'
    assert Outcome('nothing', 0, False, 0.5, 0.0, nan).told


ATTACKS = 'joint_targets times 3', 'flood of old imu'


def test_attacks_do_not_keep_the_robot_from_walking(processes: Processes) -> None:
    """And in a flood a stop that is asked for is heard."""
    study = processes.python('-m', 'dmp_cpg_ros.studies.intruder', '--lock-step', '--duration',
                             '1', '--rate', str(ros_processes.SHARED_HZ), '--attacks', *ATTACKS)
    assert study.wait(4 * ros_processes.DEADLINE_S) == 0, str(study)
    for attack in ATTACKS:
        outcome = study.wait_for_output(rf"Outcome\(attack='{attack}', messages=(\d+), "
                                        r'fell=False, speed=0.\d+, turned=\S+, named_s=(\d)')
        assert int(outcome[1]) > 100
