# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feet go to where they are placed, only off the ground; standing feet go with the ground."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GAITS, TICK, quadruped
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.canonical.phase import phase_generator, state_at
from dmp_cpg_ros.core.transformation.foothold_offset import OffsetRates
from dmp_cpg_ros.core.transformation.leg import LegFeedback, LegParameters, LegPrimitive

RATES = OffsetRates(40.0, 20.0, 10.0)
lengths = st.floats(-0.3, 0.3)
vectors = st.tuples(lengths, lengths, lengths).map(np.array)


@given(shift=vectors, wanted=vectors, height=st.floats(0.0, 1.0), dt=st.floats(1e-4, 0.1))
def test_a_swinging_foot_comes_nearer_and_does_not_overshoot(
        shift: np.ndarray, wanted: np.ndarray, height: float, dt: float) -> None:
    after = shift + dt * np.array(RATES.in_swing(shift, wanted, height, 1.0, dt))
    assert np.all(np.abs(after - wanted) <= np.abs(shift - wanted) + 1e-12)
    assert np.all((after - wanted) * (shift - wanted) >= -1e-12)


@given(shift=vectors, wanted=vectors)
def test_a_foot_on_the_ground_is_not_dragged_to_its_placement(
        shift: np.ndarray, wanted: np.ndarray) -> None:
    assert not any(RATES.in_swing(shift, wanted, 0.0, 1.0, TICK))


@given(shift=vectors, away=vectors)
def test_at_rest_a_foot_holds_its_place_and_returns_to_level(
        shift: np.ndarray, away: np.ndarray) -> None:
    rate = RATES.in_stance(shift, (0.0, 0.0), away[:2], 0.0, TICK)
    assert not any(rate[:2])
    assert abs(shift[2] + TICK * rate[2]) <= abs(shift[2])


@pytest.mark.parametrize('excess', [[0.4, 0.0], [0.0, -0.6]])
def test_a_yielding_foot_stays_where_it_is_in_the_world(excess: list[float]) -> None:
    """The body moves faster than planned; its standing feet do not leave their footholds."""
    robot, dt = quadruped(), 0.001
    leg, gait = LegPrimitive('fl', robot, LegParameters(yielding_rate=0.0)), GAITS['trot']
    r, e = np.array([0.5, 0.0, 0.0]), np.array(excess)
    omega, state = gait.omega(0.5, leg.scale), leg.initial_state()
    drift, moved, places = -e, np.zeros(2), []
    for k in range(600):
        x = state_at(omega * k * dt)
        asked = LegFeedback(state.joints.position, (0.0,) * 3, drift, (0.0,) * 3)
        state, goal, _ = leg.step(state, gait, x, omega * phase_generator() @ x, r, asked, dt)
        moved = moved + dt * (r[:2] * leg.rolling[0] + e)
        foot = leg.kinematics.foot_in_base(goal)
        position = gait.scalar_cycle_position(float(omega * k * dt))
        standing = abs(position) > 0.5 * (1.0 - gait.duty(0.5, leg.scale)) + 0.02
        places.append(np.array([*(foot[:2] + moved), float(standing)]))
    table = np.array(places)
    stance = np.flatnonzero(table[:, 2])
    first = stance[: np.flatnonzero(np.append(np.diff(stance), 9) > 1)[0] + 1]
    assert np.ptp(table[first, :2], axis=0).max() < 2e-3
