# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feet that play a learned primitive: what was shown is played, at every speed and in curves."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from core_examples import quadruped
from hypothesis import given, settings
from hypothesis import strategies as st
from walked_feet import drawn_motion

from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.transformation.foot_path import FootPath
from dmp_cpg_ros.core.transformation.learned_motion import (
    FootSamples,
    LearnedMotion,
    learn_motion,
    warped,
)

ROBOT = quadruped()
HEIGHT = ROBOT.stance_height
PATH = FootPath((0.2, 0.1, -0.26), 0.5, 0.0, 0.0, 12.0, 0.65, 0.2 * HEIGHT, (0.95, 1.0))
TICK = 0.004


@pytest.fixture(scope='module')
def motion():
    return drawn_motion(PATH, HEIGHT)


def played(motion, path, cycles=3.0, leg='fl'):
    """Cycle positions, places and velocities of a foot at a steady rate."""
    foot, state, rows = motion.of_leg(leg, ROBOT), None, []
    for k in range(round(cycles * 2.0 * np.pi / path.omega / TICK)):
        c = (k * TICK * path.omega / (2.0 * np.pi) + 0.5) % 1.0 - 0.5
        state, place, velocity = foot.step(state, path, c, path.omega, TICK if k else 0.0)
        rows.append((c, *place, *velocity))
    return np.split(np.array(rows), (1, 4), axis=1)


def test_a_foot_repeats_what_it_was_shown(motion):
    c, place, _ = played(motion, PATH)
    shown = np.array([PATH.at(float(at))[0] for at in c[:, 0]])
    stride = 0.5 * 2.0 * np.pi / PATH.omega
    assert np.abs(place - shown).max() < 0.02 * stride


@settings(max_examples=15)
@given(v=st.floats(0.1, 1.2), gamma=st.floats(-1.0, 1.0), omega=st.floats(8.0, 16.0),
       duty=st.floats(0.4, 0.8))
def test_a_standing_foot_moves_against_the_body_at_every_speed_and_in_curves(
        motion, v, gamma, omega, duty):
    path = PATH._replace(v_x=v, gamma=gamma, omega=omega, duty=duty)
    c, place, velocity = played(motion, path)
    standing = np.abs(c[:, 0]) > 0.5 * (1.0 - duty) + 0.08  # past the bases' blur at its ends
    since = (c[:, 0] - np.copysign(0.5, c[:, 0])) * 2.0 * np.pi / omega
    expected = np.array([path.stance(t) for t in since])
    cycle = 2.0 * np.pi / omega
    speed = np.hypot(v, 0.25 * gamma)
    assert np.abs(place[:, :2] - expected[:, :2])[standing].max() < 0.015 * speed * cycle
    assert np.abs(velocity[:, :2] - expected[:, 2:])[standing].mean() < 0.06 * speed


@settings(max_examples=15)
@given(v=st.floats(-0.5, 1.0), omega=st.floats(8.0, 16.0), duty=st.floats(0.4, 0.8))
def test_velocities_are_the_rates_of_the_places(motion, v, omega, duty):
    path = PATH._replace(v_x=v, omega=omega, duty=duty)
    _, place, velocity = played(motion, path)
    rates = np.diff(place, axis=0) / TICK
    middle = 0.5 * (velocity[1:] + velocity[:-1])
    assert np.abs(rates - middle).max() < 0.1 * np.abs(velocity).max()


def late(share):
    """A swing that is higher than the package's and highest shortly before its end."""
    return 0.35 * HEIGHT * np.sin(np.pi * share**2) ** 2 if 0.0 < share < 1.0 else 0.0


def test_another_demonstration_is_another_motion(motion):
    other = drawn_motion(PATH, HEIGHT, late)
    assert other.clearance == pytest.approx(0.35, rel=0.05)
    path = PATH._replace(clearance=other.clearance * HEIGHT)
    c, place, _ = played(other, path)
    shares = np.array([path.swung(float(at)) for at in c[:, 0]])
    height = place[:, 2] - PATH.foothold_in_base[2]
    np.testing.assert_allclose(height, [late(s) for s in shares], atol=0.06 * 0.35 * HEIGHT)
    assert shares[np.argmax(height)] == pytest.approx(np.sqrt(0.5), abs=0.05)
    usual = played(motion, PATH)[1][:, 2] - PATH.foothold_in_base[2]
    assert np.abs(usual / usual.max() - height / height.max()).max() > 0.5


def test_the_motion_is_in_the_weights(motion):
    weights = motion.primitive.weights.copy()
    weights[:, 2::3] *= 1.5  # of the lifts
    higher = LearnedMotion(dataclasses.replace(
        motion.primitive, weights=weights,
        centre=motion.primitive.centre * np.tile((1.0, 1.0, 1.5), 4)))
    assert higher.clearance == pytest.approx(1.5 * motion.clearance)
    still = dataclasses.replace(motion.primitive, weights=np.zeros_like(weights))
    with pytest.raises(DataError, match='never rises'):
        LearnedMotion(dataclasses.replace(still, centre=np.zeros(12)))


@pytest.mark.parametrize('stop', [0.0, 0.1, 0.3, -0.45])
def test_a_foot_whose_phase_stops_comes_to_stand(motion, stop):
    foot, state = motion.of_leg('rr', ROBOT), None
    for k in range(150):
        c = (stop + (k - 149) * 0.008 + 0.5) % 1.0 - 0.5
        state, _, _ = foot.step(state, PATH, c, 12.0, TICK)
    rest = PATH._replace(v_x=0.0, clearance=0.0)
    for _ in range(100):
        state, place, velocity = foot.step(state, rest, stop, 0.0, TICK)
    np.testing.assert_allclose(place, PATH.foothold_in_base, atol=1e-12)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-12)


@given(duty=st.floats(0.2, 0.9), c=st.floats(-0.5, 0.5))
def test_swing_and_stance_take_half_a_turn_each(duty, c):
    psi, _ = warped(c, duty)
    assert (abs(psi) <= 0.5 * np.pi) == (abs(c) <= 0.5 * (1.0 - duty)) or np.isclose(
        abs(psi), 0.5 * np.pi)
    assert psi * c >= 0.0
    assert warped(0.5 * (1.0 - duty), duty)[0] == pytest.approx(0.5 * np.pi)


def test_a_foot_that_goes_nowhere_is_no_demonstration():
    c = (np.arange(600) / 200.0 + 0.5) % 1.0 - 0.5
    still = FootSamples(c, np.full(600, 0.6), np.full(600, 0.5), np.zeros((600, 3)))
    with pytest.raises(DataError, match='walks, at'):
        learn_motion([[still]] * 4, HEIGHT)
    short = FootSamples(c[:100], still.duty[:100], still.cycle[:100], still.foot[:100])
    with pytest.raises(DataError, match='two are needed'):
        learn_motion([[short]] * 4, HEIGHT)
