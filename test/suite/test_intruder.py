# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An intruder is named and does not keep the robot from walking; the study tries all attacks."""

from __future__ import annotations

import ros_processes
from ros_processes import Processes

processes, ros_domain = ros_processes.processes, ros_processes.ros_domain


def test_forged_targets_do_not_keep_the_robot_from_walking(processes: Processes) -> None:
    study = processes.python('-m', 'dmp_cpg_ros.studies.intruder', '--lock-step', '--duration',
                             '1', '--rate', str(ros_processes.SHARED_HZ), '--attacks',
                             'joint_targets times 3')
    assert study.wait(4 * ros_processes.DEADLINE_S) == 0, str(study)
    outcome = study.wait_for_output(r"Outcome\(attack='joint_targets times 3', messages=(\d+), "
                                    r'fell=False, speed=0.\d+, turned=\S+, named_s=(\d)')
    assert int(outcome[1]) > 100
