# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feet and Jacobians that are kept are those of the angles that are asked for."""

from __future__ import annotations

import numpy as np
from core_examples import quadruped

from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics, RobotLegs

ROBOT = quadruped()


def test_every_question_is_answered_for_its_angles() -> None:
    legs, alone = RobotLegs(ROBOT), [LegKinematics(leg) for leg in ROBOT.legs]
    random = np.random.default_rng(3)
    one, other = random.uniform(-1.0, 1.0, (2, 12))
    for q in (one, other, other, one):
        asked = q.tolist()
        for i, (foot, jacobian) in enumerate(legs.at(asked)):
            angles = q[3 * i:3 * i + 3]
            np.testing.assert_array_equal(foot, alone[i].foot_in_base(angles))
            np.testing.assert_array_equal(jacobian, alone[i].jacobian_in_base(angles))
        asked[5] += 0.1  # what the caller does with its list is not seen
    assert legs.at(one.tolist()) is legs.at(one.tolist())


def test_angles_that_are_no_numbers_are_not_kept() -> None:
    legs, q = RobotLegs(ROBOT), [0.1] * 12
    q[0] = float('nan')
    assert np.isnan(legs.at(q)[0][0]).any()
    assert np.isfinite(legs.at([0.1] * 12)[0][0]).all()
