# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gaits as data: symmetries, tables, rest phase, similarity."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GAITS
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.lags import ENDS, SIDES, stand_together
from dmp_cpg_ros.core.gait.transition import GaitTransition
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.suite import load_gait

SCALE = BodyScale(0.28, 0.22)
MIRRORED = [1, 0, 3, 2]  # fl with fr, rl with rr

gaits = pytest.mark.parametrize('gait', GAITS.values(), ids=GAITS)
lags = st.lists(st.floats(0.0, 0.999), min_size=4, max_size=4).map(np.array)


def made(**changes: object) -> Gait:
    values = {'speed': [0.0, 1.0], 'cadence': [0.3, 0.4], 'duty_factor': [0.7, 0.6],
              'lag': dict.fromkeys(LEGS, 0.0), **changes}
    return Gait.from_mapping('made', values)


@gaits
def test_left_and_right_do_the_same_half_a_cycle_apart_or_together(gait: Gait) -> None:
    apart = (gait.lag[MIRRORED] - gait.lag) % 1.0
    together = gait.name in ('bound', 'pronk')
    assert np.allclose(apart, 0.0 if together else 0.5)


def test_the_gaits_are_what_their_names_say() -> None:
    lag = {name: gait.lag for name, gait in GAITS.items()}
    fl, fr, rl, rr = range(4)
    assert lag['trot'][fl] == lag['trot'][rr] and lag['trot'][fr] == lag['trot'][rl]
    assert lag['pace'][fl] == lag['pace'][rl] and lag['pace'][fr] == lag['pace'][rr]
    assert lag['bound'][fl] == lag['bound'][fr] and lag['bound'][rl] == lag['bound'][rr]
    assert len(set(lag['pronk'])) == 1
    # four evenly spaced beats, each hind foot before the fore foot of its side
    assert np.allclose(np.sort(lag['amble']), [0.0, 0.25, 0.5, 0.75])
    assert np.argsort(lag['amble']).tolist() == [fl, rr, fr, rl]
    assert np.all(GAITS['walk'].duty_factor >= 0.75)


@gaits
def test_a_leg_that_lags_is_where_the_first_was(gait: Gait) -> None:
    position = gait.cycle_position(1.0 + gait.phases)
    behind = gait.cycle_position(1.0 - 2.0 * np.pi * gait.lag)
    assert np.allclose(position, behind)
    assert np.all((position >= -0.5) & (position < 0.5))


@given(lag=lags)
def test_at_phase_zero_all_legs_are_farthest_from_mid_swing(lag: np.ndarray) -> None:
    gait = made(lag=dict(zip(LEGS, lag, strict=True)))

    def nearest(phi: float) -> float:
        return float(np.abs(gait.cycle_position(phi + gait.phases)).min())

    best = max(nearest(phi) for phi in np.linspace(-np.pi, np.pi, 361))
    assert nearest(0.0) >= best - 1e-6


@gaits
def test_cycle_position_turns_with_the_phase(gait: Gait) -> None:
    a, b = gait.cycle_position(0.3), gait.cycle_position(0.3 + 2.0 * np.pi * 0.1)
    assert (b - a) % 1.0 == pytest.approx(0.1)


@gaits
def test_tables_hold_at_their_points_and_outside_and_are_linear_between(gait: Gait) -> None:
    root = (GRAVITY * SCALE.leg_length) ** 0.5
    to_omega = 2.0 * np.pi * (GRAVITY / SCALE.leg_length) ** 0.5
    for speed, cadence, duty in zip(gait.speed, gait.cadence, gait.duty_factor, strict=True):
        assert gait.omega(speed * root, SCALE) == pytest.approx(to_omega * cadence)
        assert gait.duty(speed * root, SCALE) == pytest.approx(duty)
    assert gait.omega(100.0, SCALE) == pytest.approx(to_omega * gait.cadence[-1])
    middle = float(gait.speed[:2].mean()) * root
    assert gait.duty(middle, SCALE) == pytest.approx(gait.duty_factor[:2].mean())


@given(speed=st.floats(0.0, 3.0), size=st.floats(0.2, 10.0))
def test_similar_robots_move_similarly(speed: float, size: float) -> None:
    """Four times the size: twice the speed at half the cadence (Alexander & Jayes 1983)."""
    gait, larger = GAITS['amble'], BodyScale(SCALE.leg_length * size, SCALE.hip_radius * size)
    faster = speed * size**0.5
    assert gait.omega(faster, larger) == pytest.approx(gait.omega(speed, SCALE) / size**0.5)
    assert gait.duty(faster, larger) == pytest.approx(gait.duty(speed, SCALE))


@given(v_x=st.floats(-2, 2), v_y=st.floats(-2, 2), gamma=st.floats(-2, 2), at=st.floats(-4, 4))
def test_foot_speed_bounds_the_speed_of_every_foot(
        v_x: float, v_y: float, gamma: float, at: float) -> None:
    foot = SCALE.hip_radius * np.array([np.cos(at), np.sin(at)])
    velocity = np.array([v_x - gamma * foot[1], v_y + gamma * foot[0]])
    assert np.hypot(*velocity) <= SCALE.foot_speed(v_x, v_y, gamma) + 1e-9


@pytest.mark.parametrize(('changes', 'words'), [
    ({'lag': {'fl': 0.0}}, 'fl, fr, rl, rr'),
    ({'lag': {'fl': 0.0, 'fr': 1.0, 'rl': 0.0, 'rr': 0.0}}, 'in \\[0, 1\\)'),
    ({'speed': [0.0, 0.0]}, 'must increase'),
    ({'speed': [0.0]}, 'equal lengths'),
    ({'cadence': [0.3, 0.0]}, 'cadence must be positive'),
    ({'cadence': [0.3, np.nan]}, 'cadence must be positive'),
    ({'duty_factor': [0.7, 1.0]}, 'in \\(0, 1\\)'),
    ({'duty_factor': ['x', 1.0]}, 'made'),
    ({'stride': 1.0}, "no entry 'stride'; valid are lag, speed, cadence, duty_factor"),
])
def test_impossible_gaits_are_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        made(**changes)


def test_what_stands_on_one_side_or_one_end_alone_or_swings_as_one_is_not_firm() -> None:
    assert {name for name, gait in GAITS.items() if gait.firm == 1.0} == {'amble', 'walk', 'trot'}
    assert all(gait.firm in (0.0, 1.0) for gait in GAITS.values())
    way = GaitTransition(GAITS['trot'], GAITS['pace'])
    assert [way.at(share, 0.1).firm for share in (0.0, 0.5, 1.0)] == [1.0, 0.5, 0.0]


def test_feet_that_hardly_ever_stand_share_no_stance() -> None:
    with np.errstate(all='raise'):
        lag = np.array([0.1234, 0.2345, 0.3456, 0.4567])
        assert stand_together(lag, 1e-6, SIDES) == stand_together(lag, 1e-6, ENDS) == 0.0


@pytest.mark.parametrize('name', ['gallop', ['trot'], None, 7, {}])
def test_a_gait_that_there_is_not_is_refused_with_the_valid_names(name: object) -> None:
    with pytest.raises(ParameterError, match='valid are amble'):
        load_gait(name)  # type: ignore[arg-type]
