# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes back after a robot felt nothing is felt once its feet are where they are to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_examples import TICK, quadruped, standing_state

from dmp_cpg_ros.core.balance.unfelt import LONGEST_S, LOOKS_S, LOST, SOUND, PlannedFeet
from dmp_cpg_ros.core.maths.vec3 import triple
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics
from dmp_cpg_ros.core.transformation.leg import body_scale, nominal_foothold

ROBOT = quadruped()
LEGS = [LegKinematics(leg) for leg in ROBOT.legs]
FOOTHOLDS = [triple(nominal_foothold(ROBOT, leg.name).tolist()) for leg in ROBOT.legs]
LENGTH = body_scale(ROBOT).leg_length
OMEGA, STATE = 2.0 * np.pi / 0.6, standing_state(ROBOT)
OFFSETS = {'trot': (0.0, 0.5, 0.5, 0.0), 'amble': (0.0, 0.5, 0.75, 0.25)}


def planned(gait: str, time_s: float, speed: float) -> PlannedFeet:
    """Feet of a walk at a time [s] and a speed ahead [m/s]."""
    positions = [(offset + OMEGA * time_s / (2.0 * np.pi) + 0.5) % 1.0 - 0.5
                 for offset in OFFSETS[gait]]
    return PlannedFeet(LEGS, FOOTHOLDS, (speed, 0.0, 0.0), [OMEGA] * 4, 0.6, positions)


def seen(gait: str, late_s: float, speed: float, seconds: float, *, moving: float = 1.0,
         legs: tuple[bool, ...] | None = None, aside: float = 0.02) -> list[bool]:
    """Whether a robot feels anything in the ticks after it has felt nothing, with joints that are
    late, and feet that are all aside by the same [m].
    """
    back, told = LOST, []
    for k in range(round(seconds / TICK)):
        plan = planned(gait, k * TICK, speed)
        late = planned(gait, k * TICK - late_s, speed)
        angles = np.concatenate([
            leg.angles((x + aside, y, z)) for leg, (x, y, z) in zip(
                LEGS, (late.foot(i) for i in range(4)), strict=True)])
        back, state = back.felt(
            replace(STATE, joint_position=angles, felt_legs=legs), plan, moving, LENGTH, TICK)
        told.append(not state.feels_nothing)
    return told


@pytest.mark.parametrize('gait', OFFSETS)
@pytest.mark.parametrize('legs', [None, (True, True, False, True)])
def test_what_is_late_is_not_felt_and_what_is_in_time_is_after_a_moment(
        gait: str, legs: tuple[bool, ...] | None) -> None:
    for late_s in (0.06, 0.1, 0.15, 0.2):
        assert not any(seen(gait, late_s, 0.5, LONGEST_S - 2.0 * TICK, legs=legs))
    for late_s in (0.0, 0.02):
        felt = seen(gait, late_s, 0.5, 1.0, legs=legs)
        begun = felt.index(True)
        assert begun * TICK <= 2.0 * LOOKS_S and all(felt[begun:])


def test_feet_that_hardly_move_and_legs_that_rest_are_felt() -> None:
    assert seen('trot', 0.1, 0.02, 0.2)[-1]
    assert seen('trot', 0.1, 0.5, TICK, moving=0.0)[-1]


def test_it_is_felt_in_the_end_whatever_it_tells() -> None:
    felt = seen('trot', 0.1, 0.5, LONGEST_S + 0.1)
    assert felt[-1] and not felt[-60]


def test_who_has_felt_all_along_feels_what_is_told() -> None:
    assert SOUND.felt(STATE, planned('trot', 0.1, 0.5), 1.0, LENGTH, TICK) == (SOUND, STATE)
