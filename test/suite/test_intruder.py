# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An intruder is named and does not keep the robot from walking; the study tries all attacks."""

from __future__ import annotations

import re

import pytest
import ros_processes

from dmp_cpg_ros.studies import intruder

ros_domain = ros_processes.ros_domain


def test_forged_targets_do_not_keep_the_robot_from_walking(
        ros_domain: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
        ) -> None:
    for name, seconds in (('STEADY_S', 2.5), ('ATTACK_S', 1.0), ('RECOVERY_S', 2.0)):
        monkeypatch.setattr(intruder, name, seconds)
    assert intruder.main(
        ['--lock-step', '--duration', '1', '--attacks', 'joint_targets times 3']) == 0
    outcome = re.search(r"Outcome\(attack='joint_targets times 3', messages=(\d+), fell=False, "
                        r'speed=0.\d+, named_s=\d', capsys.readouterr().out)
    assert outcome is not None and int(outcome[1]) > 100
