# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lanes, against the paths of the feet of one side over a whole cycle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from core_examples import quadruped

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.lanes import BESIDE, INWARDS, OWN_LANES, Lanes
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold
from dmp_cpg_ros.suite import load_gaits

WIDTH = 0.05
NARROW = quadruped()
GAITS = load_gaits()
SPEEDS = np.linspace(-3.0, 3.0, 25)
LEG_NAMES = ('fl', 'fr', 'rl', 'rr')


def wide(description: RobotDescription) -> RobotDescription:
    """Return the robot with legs that can touch."""
    return replace(description, legs=tuple(
        replace(leg, width=WIDTH) for leg in description.legs))


def paced(name: str, v_x: float, description: RobotDescription, v_y: float = 0.0,
          gamma: float = 0.0) -> tuple[Any, ...]:
    """Gait, velocity, rate and duty factor of a reference."""
    velocity, omega, _, duty = GAITS[name].pace(
        np.array((v_x, v_y, gamma)), body_scale(description))
    return GAITS[name], velocity, omega, duty


def paths(walk: tuple[Any, ...], description: RobotDescription, legs: tuple[int, int]) -> Array:
    """Places of a fore and a hind foot over a cycle, (2, 2000, 2) [m]."""
    gait, velocity, omega, duty = walk
    places = []
    for leg in legs:
        path = FootPath(nominal_foothold(description, LEG_NAMES[leg]).tolist(), *velocity, omega,
                        duty, 0.0)
        cycle = (np.arange(2000) / 2000 - gait.lag[leg] + 0.5) % 1.0 - 0.5
        places.append([path.at(float(c))[0][:2] for c in cycle])
    return np.array(places)


def nearest(walk: tuple[Any, ...], description: RobotDescription) -> float:
    """Least distance ahead of fl from rl over a cycle [m]."""
    fore, hind = paths(walk, description, (0, 2))
    return float(np.min(fore[:, 0] - hind[:, 0]))


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
    assert lanes.aside(GAITS['trot'], (0.0, 0.0, 0.0), 10.0, 0.6) == OWN_LANES


def test_an_amble_keeps_its_feet_where_they_are() -> None:
    robot = wide(NARROW)
    for name in ('amble', 'walk'):
        for speed in SPEEDS:
            assert Lanes(robot).aside(*paced(name, float(speed), robot)) == OWN_LANES


def test_legs_that_pass_through_each_other_need_no_lanes() -> None:
    assert Lanes(NARROW).aside(*paced('trot', 3.0, NARROW)) is OWN_LANES


@pytest.mark.parametrize('gamma', [-0.5, 0.0, 0.5])
@pytest.mark.parametrize('v_y', [-0.4, -0.2, 0.2, 0.4])
@pytest.mark.parametrize('v_x', [2.75, 2.0, -2.5])
def test_sideways_and_in_curves_a_foot_passes_the_other_one_beside_it(
        v_x: float, v_y: float, gamma: float) -> None:
    """What moving sideways does to the feet counts: outwards alone would bring one of the inner
    ones before the other leg.
    """
    robot = wide(NARROW)
    walk = paced('trot', v_x, robot, v_y, gamma)
    aside, needed = Lanes(robot).aside(*walk), WIDTH + BESIDE * body_scale(robot).leg_length
    for legs, outward in (((0, 2), 1.0), ((1, 3), -1.0)):
        fore, hind = paths(walk, robot, legs)
        at = int(np.argmin(fore[:, 0] - hind[:, 0]))
        short = needed - (fore[at, 0] - hind[at, 0])
        beside = outward * (hind[at, 1] + aside[legs[1]] - fore[at, 1] - aside[legs[0]])
        passes = beside if v_x > 0.0 else -beside
        assert short < 0.0 or passes > 0.8 * min(short, needed) or passes < -0.8 * INWARDS * short


def test_lanes_change_with_the_velocity_without_jumps() -> None:
    robot = wide(NARROW)
    lanes, sideways = Lanes(robot), np.linspace(-0.6, 0.6, 2001)
    found = np.array([lanes.aside(*paced('trot', 2.5, robot, v_y)) for v_y in sideways])
    assert np.abs(found).max() > WIDTH
    assert np.abs(np.diff(found, axis=0)).max() < 0.002
