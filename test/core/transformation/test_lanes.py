# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lanes, against the paths of the feet of one side over a whole cycle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from core_examples import quadruped

from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.lanes import BESIDE, OWN_LANES, Lanes
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold
from dmp_cpg_ros.suite import load_gaits

WIDTH = 0.05
NARROW = quadruped()
GAITS = load_gaits()
SPEEDS = np.linspace(-3.0, 3.0, 25)


def wide(description: RobotDescription) -> RobotDescription:
    """Return the robot with legs that can touch."""
    return replace(description, legs=tuple(
        replace(leg, width=WIDTH) for leg in description.legs))


def paced(name: str, v_x: float, description: RobotDescription) -> tuple[Any, ...]:
    """Gait, speed, rate and duty factor at a speed."""
    (v_x, _, _), omega, _, duty = GAITS[name].pace(
        np.array((v_x, 0.0, 0.0)), body_scale(description))
    return GAITS[name], v_x, omega, duty


def nearest(walk: tuple[Any, ...], description: RobotDescription) -> float:
    """Least distance ahead of fl from rl over a cycle [m]."""
    gait, v_x, omega, duty = walk
    places = []
    for leg in (0, 2):
        foot = nominal_foothold(description, ('fl', 'fr', 'rl', 'rr')[leg])
        path = FootPath((float(foot[0]), 0.0, 0.0), v_x, 0.0, 0.0, omega, duty, 0.0)
        cycle = (np.arange(2000) / 2000 - gait.lag[leg] + 0.5) % 1.0 - 0.5
        places.append(np.array([path.at(float(c))[0][0] for c in cycle]))
    return float(np.min(places[0] - places[1]))


@pytest.mark.parametrize('name', ['trot', 'pace', 'bound', 'pronk'])
def test_feet_are_apart_by_what_legs_need_wherever_their_paths_come_as_near(
        name: str) -> None:
    robot = wide(NARROW)
    lanes, needed = Lanes(robot), WIDTH + BESIDE * body_scale(robot).leg_length
    for speed in SPEEDS:
        walk = paced(name, float(speed), robot)
        gap, aside = nearest(walk, robot), lanes.aside(*walk)
        short = float(np.clip(needed - gap, 0.0, needed))
        assert max(aside[0], aside[2]) == pytest.approx(short, abs=1e-3)
        assert min(aside[0], aside[2]) == 0.0
        assert aside[0] + aside[1] == aside[2] + aside[3] == 0.0


def test_a_fast_trot_needs_lanes_and_a_slow_one_does_not() -> None:
    robot = wide(NARROW)
    lanes = Lanes(robot)
    ahead, back, slow = (
        lanes.aside(*paced('trot', speed, robot)) for speed in (3.0, -3.0, 0.5))
    assert ahead[2] > WIDTH and ahead[0] == 0.0  # who comes from behind passes outside
    assert back[0] > WIDTH and back[2] == 0.0
    assert slow == OWN_LANES
    assert lanes.aside(GAITS['trot'], 0.0, 10.0, 0.6) == OWN_LANES


def test_an_amble_keeps_its_feet_where_they_are() -> None:
    robot = wide(NARROW)
    for name in ('amble', 'walk'):
        for speed in SPEEDS:
            assert Lanes(robot).aside(*paced(name, float(speed), robot)) == OWN_LANES


def test_legs_that_pass_through_each_other_need_no_lanes() -> None:
    assert Lanes(NARROW).aside(*paced('trot', 3.0, NARROW)) is OWN_LANES
