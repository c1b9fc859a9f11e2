# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the feet have felt of the ground: nothing where it is even, and for a while where not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from core_examples import quadruped, standing_state
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.terrain import (
    CLEAR_OF_GROUND,
    CLIMBED,
    DEEP,
    FADES,
    FLICKERS,
    FOLLOWED,
    FORGOTTEN,
    HIGHEST,
    HOLLOW,
    JUMP,
    LEVEL_FEET,
    LOWEST,
    MARGIN,
    RAISED,
    RELAXES,
    SEARCHED,
    SINKING,
    STEADY,
    STEP,
    UNEVEN,
    Terrain,
    contacts,
    pressure,
)
from dmp_cpg_ros.core.gait.contact_feedback import believed
from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs

LENGTH = 0.28
NOTHING = Terrain()
KNOWN = Terrain(0.02, 0.0, ((0.0, 0.0, 0.0),) * 4, (0.0, 0.0, 0.3))
UP = (0.0, 0.0, 1.0)
STANDING, SWINGING = -0.2, 0.5
PLACES = ((0.2, 0.1), (0.2, -0.1), (-0.2, 0.1), (-0.2, -0.1))

heights = st.lists(st.floats(-0.5, 0.5), min_size=4, max_size=4)


def felt(z: Sequence[float], terrain: Terrain = NOTHING, x: float = 0.0,
         swung: Sequence[float] = (STANDING,) * 4, touches: Sequence[bool] = (True,) * 4,
         calm: bool = True, in_turn: bool = True, rests: Sequence[bool] = (False,) * 4,
         quiet_s: float = 0.0, dt: float = 0.0) -> tuple[Terrain, tuple[float, ...]]:
    feet: list[Triple] = [
        (x + a, b, up) for (a, b), up in zip(PLACES, z, strict=True)]
    return terrain.felt(
        (x, 0.0, 0.3), feet, UP, swung, touches, LENGTH, calm, in_turn, rests, quiet_s, dt)


@given(heights)
def test_even_ground_leaves_nothing(z: list[float]) -> None:
    z = (np.array(z) * UNEVEN * LENGTH).tolist()  # spread over UNEVEN l at most
    assert felt(z, felt(z)[0]) == (felt(z)[0], LEVEL_FEET)
    assert felt(z)[0].rough == 0.0


@given(heights)
def test_first_step_leads_up(z: list[float]) -> None:
    z = (np.array(z) * STEP * LENGTH).tolist()
    rough = felt(z)[0].rough
    assert (rough > 0.0) == (max(z) - np.median(z) > STEP * LENGTH)
    assert rough == 0.0 or rough == pytest.approx(max(z) - min(z))


@pytest.mark.parametrize('z', [(0.0, 0.0, 0.0, -0.3), (0.06, 0.0, 0.0, -0.1)])
def test_foot_that_hangs_in_a_gap_tells_nothing(z: tuple[float, ...]) -> None:
    terrain, level = felt(z)
    assert (terrain.rough, level) == (0.0, LEVEL_FEET)


@pytest.mark.parametrize('calm', [False, True])
def test_body_that_is_not_calm_feels_no_first_step(calm: bool) -> None:
    """On what is known to be rough it goes on to feel: bodies tilt there."""
    feet: list[Triple] = [(a, b, up) for (a, b), up in zip(PLACES, (0.1, 0, 0, 0), strict=True)]
    said = UP, (STANDING,) * 4, (True,) * 4, LENGTH, calm
    assert (NOTHING.felt((0.0, 0.0, 0.3), feet, *said)[0].rough > 0.0) == calm
    assert KNOWN.felt((0.0, 0.0, 0.3), feet, *said)[0].rough == pytest.approx(0.1)


@given(heights)
def test_feet_stand_where_the_ground_is(z: list[float]) -> None:
    terrain, level = felt(z, KNOWN)
    spread = max(z) - min(z)
    if spread > max(KNOWN.rough, UNEVEN * LENGTH):
        assert terrain.rough == pytest.approx(min(spread, HIGHEST * LENGTH))
        assert np.array(level) + RAISED * terrain.rough == pytest.approx(np.array(z) - np.mean(z))
    else:
        assert terrain.rough == KNOWN.rough


def test_slope_of_the_plane_is_even() -> None:
    normal = (-0.6, 0.0, 0.8)
    feet = [(x, y, 0.75 * x) for x, y in PLACES]
    terrain, level = NOTHING.felt((0.0, 0.0, 0.3), feet, normal, (STANDING,) * 4, (True,) * 4,
                                    LENGTH)
    assert (terrain.rough, level) == (0.0, LEVEL_FEET)


def test_memory_fades_on_the_way_alone() -> None:
    terrain, _ = felt((0.1, 0.0, 0.0, 0.0))
    flat = (0.0,) * 4
    assert felt(flat, terrain)[0].rough == terrain.rough == pytest.approx(0.1)
    step, x, level = 0.5 * JUMP * LENGTH, 0.0, None
    while terrain.rough:
        x += step
        before, (terrain, level) = terrain.rough, felt(flat, terrain, x)
        assert terrain.rough < before
    assert x == pytest.approx(FADES * LENGTH * np.log(0.1 / (FORGOTTEN * LENGTH)), abs=2.0 * step)
    assert level == LEVEL_FEET


def lifted(terrain: Terrain) -> Terrain:
    """The same once the first foot is free in its swing."""
    return terrain._replace(lifted=(True, False, False, False))


def test_swinging_foot_that_touches_tells_a_step() -> None:
    terrain = lifted(felt((0.0,) * 4, KNOWN)[0])
    swung, touches = (SWINGING, STANDING, STANDING, STANDING), (True,) * 4
    met, _ = felt((0.05, 0.0, 0.0, 0.0), terrain, swung=swung, touches=touches)
    assert met.rough == pytest.approx(0.05 + MARGIN * LENGTH)
    missed, _ = felt((0.05, 0.0, 0.0, 0.0), terrain, swung=swung, touches=(False, *touches[1:]))
    assert missed.rough == KNOWN.rough
    assert missed.footholds == terrain.footholds  # where it swings is no foothold


@pytest.mark.parametrize('calm', [False, True])
@pytest.mark.parametrize('height', [CLEAR_OF_GROUND / 2.0, CLEAR_OF_GROUND * 1.5])
def test_swinging_foot_finds_the_first_step(calm: bool, height: float) -> None:
    terrain, height = lifted(felt((0.0,) * 4)[0]), height * LENGTH
    met, _ = felt((height, 0.0, 0.0, 0.0), terrain, swung=(SWINGING, *(STANDING,) * 3), calm=calm)
    finds = calm and height > CLEAR_OF_GROUND * LENGTH
    assert met.rough == pytest.approx(height + MARGIN * LENGTH if finds else 0.0)


@pytest.mark.parametrize('calm', [False, True])
@pytest.mark.parametrize('flickers', [1, FLICKERS + 1])
@pytest.mark.parametrize('height', [CLIMBED * 0.9, CLIMBED * 1.5])
def test_what_a_foot_meets_too_high_is_not_climbed(
        calm: bool, flickers: int, height: float) -> None:
    up, swings = height * LENGTH, (SWINGING, *(STANDING,) * 3)
    terrain = lifted(felt((0.0,) * 4)[0])._replace(changes=(flickers - 1, 0, 0, 0),
                                                   touched=(False, True, True, True))
    met, _ = felt((up, 0.0, 0.0, 0.0), terrain, x=0.01, swung=swings, calm=calm)
    low, _ = felt((up / 4.0, 0.0, 0.0, 0.0), met, x=0.01, swung=swings)
    if not (calm and flickers <= FLICKERS and height > CLIMBED):
        assert met.high == -1 and met.barred == 0.0
        assert (met.rough > 0.0) == (calm and height < CLIMBED)
        return
    assert met.high == 0 and met.rough == 0.0 and met.barred == FADES * LENGTH
    assert low.rough == 0.0 and low.high == 0                     # until the foot has come down
    down, _ = felt((0.0,) * 4, low, x=0.03, swung=(1.1, *(STANDING,) * 3))
    assert down.high == -1 and down.barred == pytest.approx(FADES * LENGTH - 0.02)
    on_top, _ = felt((up, 0.0, 0.0, 0.0), low, x=0.01)             # where it may have come up
    assert on_top.rough > 0.0
    away, _ = felt((0.0,) * 4, down._replace(barred=0.01), x=0.06)
    assert away.barred == 0.0


@pytest.mark.parametrize('steady', [0.5 * STEADY, 1.5 * STEADY])
def test_a_foot_that_was_shaken_is_believed_when_it_has_rested(steady: float) -> None:
    shaken = lifted(felt((0.0,) * 4)[0])._replace(
        changes=(FLICKERS + 3, 0, 0, 0), touched=(True,) * 4,
        changed=(SWINGING - steady, 0.0, 0.0, 0.0))
    met, _ = felt((1.5 * CLIMBED * LENGTH, 0.0, 0.0, 0.0), shaken,
                  swung=(SWINGING, *(STANDING,) * 3))
    assert (met.barred > 0.0) == (steady > STEADY)


@pytest.mark.parametrize('rise', [-0.02, 0.03])
def test_a_standing_foot_that_the_body_lifts_is_no_higher_foothold(rise: float) -> None:
    terrain = felt((0.1, 0.0, 0.0, 0.0))[0]
    tilted, _ = felt((0.1, 0.0, 0.0, rise), terrain, touches=(True, True, True, False))
    assert tilted.footholds[3][2] == min(0.0, rise)
    stands, _ = felt((0.1, 0.0, 0.0, rise), terrain)
    assert stands.footholds[3][2] == rise


def test_before_an_obstacle_the_height_goes_to_what_feet_stand_on() -> None:
    barred = felt((0.0,) * 4)[0]._replace(rough=0.5 * LENGTH, barred=FADES * LENGTH)
    last = barred
    for _ in range(1000):
        now, _ = felt((0.3 * LENGTH, 0.0, 0.0, 0.0), last, dt=0.004)
        assert now.rough >= last.rough * np.exp(-RELAXES * 0.004) - 1e-12
        last = now
    assert last.rough == pytest.approx(0.3 * LENGTH)


@pytest.mark.parametrize('free', [False, True])
def test_foot_that_has_touched_since_its_stance_has_met_nothing(free: bool) -> None:
    """As one does whose sensor is late."""
    terrain = felt((0.0,) * 4)[0]
    for share in np.linspace(0.0, 1.0, 21):
        touches = (not (free and share == 0.1), True, True, True)
        terrain, _ = felt((0.1 * LENGTH * min(1.0, 8.0 * share), 0.0, 0.0, 0.0), terrain,
                          swung=(float(share), *(STANDING,) * 3), touches=touches)
    assert (terrain.rough > 0.0) == free


@pytest.mark.parametrize('gaps', [0.0, 0.1])
@pytest.mark.parametrize('depth', [HOLLOW / 2.0, HOLLOW * 1.5])
def test_swinging_foot_that_may_be_in_a_gap_tells_nothing(gaps: float, depth: float) -> None:
    lower, up = -depth * LENGTH, 2.0 * CLEAR_OF_GROUND * LENGTH
    terrain = lifted(felt((0.0, 0.0, 0.0, lower))[0]._replace(gaps=gaps))
    met, _ = felt((up, 0.0, 0.0, lower), terrain, swung=(SWINGING, *(STANDING,) * 3))
    assert (met.rough > 0.0) == (not gaps and depth < HOLLOW)


def test_foot_in_the_air_looks_for_the_ground_where_it_is_rough() -> None:
    swung, touches = (1.2, STANDING, STANDING, STANDING), (False, True, True, True)
    for z in ((0.0,) * 4, (0.1, 0.0, 0.0, 0.0)):
        terrain, stood = felt(z)
        _, level = felt(z, terrain, swung=swung, touches=touches)
        searched = SEARCHED * LENGTH if terrain.rough else 0.0
        assert np.array(stood) - level == pytest.approx((searched, 0.0, 0.0, 0.0))


def test_estimate_that_begins_anew_forgets() -> None:
    terrain, _ = felt((0.1, 0.0, 0.0, 0.0))
    assert felt((0.0,) * 4, terrain, x=2.0 * JUMP * LENGTH)[0].rough == 0.0


def test_body_leans_less_than_the_footholds_where_it_is_rough() -> None:
    assert NOTHING.followed == 1.0
    assert KNOWN.followed == FOLLOWED < 1.0


@pytest.mark.parametrize(('deep', 'touches', 'swung', 'finds'), [
    (1.2, False, 1.5, True), (1.2, False, STANDING, True), (1.2, True, 1.5, False),
    (1.2, False, SWINGING, False), (0.8, False, 1.5, False)])
def test_foot_without_ground_finds_a_gap(
        deep: float, touches: bool, swung: float, finds: bool) -> None:
    stood, _ = felt((0.0,) * 4)
    low = (-deep * HOLLOW * LENGTH, 0.0, 0.0, 0.0)
    arguments = {'swung': (swung, *[STANDING] * 3), 'touches': (touches, True, True, True)}
    found, level = felt(low, stood, **arguments)
    assert (found.gaps > 0.0) == finds and not found.rough and level is LEVEL_FEET
    assert not any(found.empty)   # it may find ground yet
    low = (-(DEEP + 0.2 * HOLLOW) * LENGTH, 0.0, 0.0, 0.0) if finds else low
    deeper, _ = felt(low, stood, **arguments)
    assert deeper.empty == (finds, False, False, False)
    rough, _ = felt(low, stood._replace(rough=HIGHEST * LENGTH), **arguments)
    assert not any(rough.empty)
    for which in ('calm', 'in_turn'):
        never, _ = felt(low, stood, **{which: False}, **arguments)
        assert never.gaps == 0.0 and not any(never.empty)


def test_gaps_are_counted_on_for_a_way() -> None:
    before = NOTHING._replace(footholds=KNOWN.footholds, place=KNOWN.place, gaps=FADES * LENGTH)
    on, _ = felt((0.0,) * 4, before, x=0.1)
    assert on.gaps == pytest.approx(FADES * LENGTH - 0.1)
    past, _ = felt((0.0,) * 4, on._replace(gaps=0.05), x=0.2)
    assert past.gaps == 0.0
    anew, _ = felt((0.0,) * 4, on, x=0.1 + 2.0 * JUMP * LENGTH)
    assert anew.gaps == 0.0


FLAT, RESTING, HANGS = (0.0,) * 4, (True,) * 4, (False, True, True, True)


@pytest.mark.parametrize('swung', [STANDING, SWINGING, 1.2])
@pytest.mark.parametrize('known', [NOTHING, KNOWN])
def test_foot_that_hangs_at_rest_goes_down_until_it_stands(known: Terrain, swung: float) -> None:
    known = felt(FLAT, known, swung=(SWINGING,) * 4, touches=HANGS)[0]   # it has walked
    terrain, before = felt(FLAT, known, swung=(swung,) * 4, rests=RESTING)
    for _ in range(5):
        terrain, level = felt(FLAT, terrain, swung=(swung,) * 4, touches=HANGS, rests=RESTING,
                              quiet_s=0.01)
    found = 0.05 * SINKING * LENGTH
    assert np.subtract(level, before) == pytest.approx((-found, 0.0, 0.0, 0.0))
    stands = felt(FLAT, terrain, swung=(swung,) * 4, rests=RESTING, quiet_s=0.01)
    assert stands[1] == pytest.approx(level)
    assert felt(FLAT, stands[0], swung=(swung,) * 4)[0].lowered == (
        LEVEL_FEET if swung == SWINGING else pytest.approx((-found, 0.0, 0.0, 0.0)))
    for _ in range(9):
        terrain, _ = felt(FLAT, terrain, touches=HANGS, rests=RESTING, quiet_s=1.0)
    assert terrain.lowered == pytest.approx((-LOWEST * LENGTH, 0.0, 0.0, 0.0))
    held_up = felt(FLAT, touches=(False,) * 3 + (True,), rests=RESTING, quiet_s=0.01)
    assert held_up[1] is LEVEL_FEET


@pytest.mark.parametrize(('rests', 'quiet_s'), [((False,) * 4, 0.01), (RESTING, 0.0)])
def test_feet_of_legs_that_walk_and_of_bodies_that_sway_stay(
        rests: tuple[bool, ...], quiet_s: float) -> None:
    known = Terrain(walked=True)
    assert felt(FLAT, known, touches=HANGS, rests=rests, quiet_s=quiet_s)[1] is LEVEL_FEET


def test_robot_that_was_put_on_its_feet_and_has_not_walked_stays() -> None:
    assert felt(FLAT, touches=HANGS, rests=RESTING, quiet_s=0.01)[1] is LEVEL_FEET


@pytest.mark.parametrize(('load', 'dead', 'rests'), [
    (20.0, False, True), (20.0, True, False), (0.0, True, True), (0.0, False, True)])
def test_foot_that_presses_on_the_ground_and_tells_nothing_does_not_hang(
        load: float, dead: bool, rests: bool) -> None:
    """The first foot bears a load, and its sensor tells it or is dead."""
    robot = quadruped()
    state = standing_state(robot)
    legs = RobotLegs(robot).at(state.joint_position.tolist())
    force, effort = np.full(4, 20.0), np.zeros(12)
    force[0] = 0.0 if dead else load
    effort[:3] = np.array(legs[0][1]).T @ (0.0, 0.0, -load)   # τ = Jᵀ f of what the foot presses
    assert pressure(legs[0][1], effort[:3].tolist()) == pytest.approx(load)
    state = replace(state, foot_force=force, joint_effort=effort)
    assert contacts(state, force, RESTING, legs, 20.0) == (
        [force[0] > 2.0, True, True, True], [rests, True, True, True])
    broken = replace(state, foot_force=np.array((np.nan, 20.0, 20.0, 20.0)))
    assert contacts(broken, believed(broken.foot_force), RESTING, legs, 20.0)[1][0] is False
