# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops with random learned motions, a sample of the study."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_examples import TICK, network, suite_parameters

pytest.importorskip('mujoco')  # the robot's geometry is read from its model

from dmp_cpg_ros.core.certificates.certify import GROUND, certify
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.inhibition.supervisor import REST_ACTIVITY
from dmp_cpg_ros.studies.learned_motions import (
    KEPT,
    NOT_CERTIFIED,
    REFUSED,
    UNASKED,
    random_motion,
    tried,
)


def test_stops_with_any_motion_are_as_promised() -> None:
    outcomes = [tried(True, (2, k)) for k in range(8)]
    assert {one['outcome'] for one in outcomes} <= {KEPT, NOT_CERTIFIED, REFUSED, UNASKED}
    assert any(one['outcome'] == KEPT for one in outcomes)


def test_motions_that_no_foot_can_walk_with_are_refused_by_name() -> None:
    told = []
    for seed in range(40):
        try:
            random_motion(np.random.default_rng(seed))
        except DataError as error:
            told.append(str(error))
    assert 0 < len(told) < 40
    assert all('no foot can walk so' in text or 'never rises' in text for text in told)


def test_a_motion_that_may_lift_feet_at_rest_is_certified_by_its_height() -> None:
    p = suite_parameters()
    high = replace(p, leg=replace(p.leg, clearance=0.6))
    learned = replace(high, leg=replace(high.leg, motion='file'))
    paths, motions = (certify(Setting.of(network(), of, TICK)) for of in (high, learned))
    assert paths['rest_posture'].holds and not motions['rest_posture'].holds
    assert motions['rest_posture'].left == pytest.approx(0.6 * REST_ACTIVITY)
    assert motions['rest_posture'].right == GROUND
