# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Learning: known weights come back, movements are reproduced, symmetries hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from demonstrations import LETTERS, handwriting, joint_angles, straight_reach, walking_joints
from hypothesis import given, settings
from hypothesis import strategies as st

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.learning import discrete as learning_discrete
from dmp_cpg_ros.core.learning import rhythmic as learning_rhythmic
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.learning.learning import FitOptions, ridge_regression, smallest_good
from dmp_cpg_ros.core.learning.rhythmic import learn_rhythmic
from dmp_cpg_ros.core.primitives.demonstration import Demonstration, derivatives
from dmp_cpg_ros.core.primitives.discrete import DiscreteInput
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicInput
from dmp_cpg_ros.paper.daughters import Homogeneous, transformed

DISCRETE = {
    **{f'letter {letter}': handwriting(letter) for letter in LETTERS},
    'minimum jerk': straight_reach([0.0, 1.0, -0.5], [1.0, -1.0, 0.0]),
    'joint angles': joint_angles(),
}


def positions_only(demonstration):
    return Demonstration(demonstration.times, demonstration.positions, names=demonstration.names)


@pytest.mark.parametrize('name', DISCRETE)
@pytest.mark.parametrize('method', ['response', 'joint'])
@pytest.mark.parametrize('recorded', ['positions', 'everything'])
def test_25_bases_reproduce_a_movement_to_less_than_one_percent(name, method, recorded):
    demonstration = DISCRETE[name] if recorded == 'everything' else positions_only(DISCRETE[name])
    learned = learn_discrete(demonstration, 25, options=FitOptions(method))
    assert learning_discrete.reproduction_errors(learned, demonstration).max() < 0.01


@pytest.mark.parametrize(('recorded', 'method'), [
    ('everything', 'response'), *(('positions', of) for of in ('response', 'joint', 'local'))])
def test_25_bases_reproduce_a_rhythm_to_less_than_one_percent(recorded, method):
    demonstration = (
        walking_joints() if recorded == 'everything' else positions_only(walking_joints())
    )
    learned = learn_rhythmic(demonstration, 25, options=FitOptions(method))
    assert learning_rhythmic.reproduction_errors(learned, demonstration).max() < 0.01


def test_local_regression_improves_with_more_bases():
    demonstration = handwriting('e')
    errors = [
        learning_discrete.reproduction_errors(
            learn_discrete(demonstration, count, options=FitOptions('local')), demonstration
        ).max()
        for count in (15, 30, 60, 120)
    ]
    assert np.all(np.diff(errors) < 0.0)
    assert errors[-1] < 0.01


@settings(max_examples=10)
@given(st.integers(0, 1000), st.sampled_from(['scaled', 'printed']))
def test_known_weights_of_a_discrete_primitive_come_back(seed, form):
    rng = np.random.default_rng(seed)
    template = learn_discrete(straight_reach([0.0, 0.0], [1.0, 2.0], 1.0), 10, form=form)
    true = replace(
        template,
        weights=template.weights + rng.normal(0.0, 300.0, (10, 2)),
        start_velocity=rng.normal(size=2),
    )
    times = np.linspace(0.0, 1.0, 400)
    made = true.rollout(times)
    learned = learn_discrete(
        Demonstration(times, made.positions),
        10,
        goals=[true.goal],
        form=form,
        options=FitOptions(ridge=0.0),
    )
    np.testing.assert_allclose(learned.weights, true.weights, atol=0.5)
    np.testing.assert_allclose(learned.start, true.start, atol=1e-6)
    np.testing.assert_allclose(learned.start_velocity, true.start_velocity, atol=1e-4)


@settings(max_examples=10)
@given(st.integers(0, 1000))
def test_known_weights_of_a_rhythmic_primitive_come_back(seed):
    rng = np.random.default_rng(seed)
    template = learn_rhythmic(walking_joints(), 9, period=0.5)
    true = replace(template, weights=rng.normal(0.0, 300.0, template.weights.shape))
    made = true.rollout(np.linspace(0.0, 1.7, 900))
    learned = learn_rhythmic(
        Demonstration(made.times, made.positions),
        9,
        period=0.5,
        centres=[true.centre],
        options=FitOptions(ridge=0.0),
    )
    x = np.stack([np.cos(np.linspace(0, 6, 50)), -np.sin(np.linspace(0, 6, 50))], axis=1)
    np.testing.assert_allclose(learned.forcing(x), true.forcing(x), atol=0.01)
    np.testing.assert_allclose(learned.weights, true.weights, atol=0.1)


@pytest.mark.parametrize('method', ['response', 'joint', 'local'])
def test_learning_commutes_with_rotation_scale_and_translation(method):
    demonstration, angle = positions_only(handwriting('s')), 0.7
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    map_ = Homogeneous.of(2, 3.0, R, [5.0, -2.0])
    moved = Demonstration(demonstration.times, map_.forward(demonstration.positions))
    options, times = FitOptions(method), demonstration.times
    first = learn_discrete(moved, 15, options=options)
    second = transformed(learn_discrete(demonstration, 15, options=options), map_)
    np.testing.assert_allclose(
        first.weights, second.weights, atol=1e-5 * np.abs(second.weights).max()
    )
    np.testing.assert_allclose(
        first.rollout(times).positions, second.rollout(times).positions, atol=1e-8
    )


def test_rhythmic_learning_commutes_with_rotation_scale_and_translation():
    demonstration, rng = positions_only(walking_joints()), np.random.default_rng(3)
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    R = R * np.sign(np.linalg.det(R))
    map_ = Homogeneous.of(3, 0.4, R, rng.normal(size=3))
    moved = Demonstration(demonstration.times, map_.forward(demonstration.positions))
    first, second = (
        learn_rhythmic(moved, 15),
        transformed(learn_rhythmic(demonstration, 15), map_),
    )
    np.testing.assert_allclose(
        first.on_cycle(np.arange(6.0))[0], second.on_cycle(np.arange(6.0))[0], atol=1e-5
    )


@pytest.mark.parametrize('form', ['scaled', 'printed'])
def test_several_demonstrations_of_one_primitive_with_other_speeds_starts_and_goals(form):
    template = learn_discrete(handwriting('a'), 12, form=form)
    movements, goals, rng = [], [], np.random.default_rng(5)
    for tau in (0.8, 1.0, 1.2):
        start, goal = rng.normal(0.0, 0.02, (2, 2))
        times = np.linspace(0.0, tau * template.duration, 500)
        made = template.rollout(
            times, DiscreteInput(goal, tau), template.initial_state(start, [0, 0], goal, tau)
        )
        movements.append(Demonstration(times, made.positions))
        goals.append(goal)
    learned = learn_discrete(
        movements,
        12,
        stiffness=template.transformation.stiffness,
        damping=template.transformation.damping,
        goals=goals,
        form=form,
    )
    assert learned.duration == pytest.approx(template.duration)
    assert learning_discrete.reproduction_errors(learned, movements, goals).max() < 1e-4


def test_several_rhythms_with_other_periods_phases_and_centres():
    recordings = []
    for period, shift, centre in ((0.45, 0.0, 0.0), (0.5, 0.12, 1.0), (0.6, 0.31, -0.5)):
        long = walking_joints(period, 6.3, dt=0.004)
        keep = long.times >= shift
        recordings.append(Demonstration(long.times[keep], long.positions[keep] + centre))
    learned = learn_rhythmic(recordings, 25)
    assert learned.period == pytest.approx(np.mean([0.45, 0.5, 0.6]), rel=1e-6)
    for recording in recordings:
        assert learning_rhythmic.reproduction_errors(learned, recording).max() < 1e-3


def test_more_noisy_demonstrations_give_a_better_primitive():
    clean, errors = handwriting('e'), []
    for count in (1, 16):
        rng = np.random.default_rng(0)
        noisy = [
            Demonstration(
                clean.times, clean.positions + rng.normal(0.0, 1e-3, clean.positions.shape)
            )
            for _ in range(count)
        ]
        learned = learn_discrete(
            noisy, 25, goals=[clean.positions[-1]] * count, options=FitOptions(ridge=1e-8)
        )
        made = learned.rollout(clean.times).positions
        errors.append(float(np.sqrt(np.mean((made - clean.positions) ** 2))))
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 3e-4


def test_response_regression_bears_noise_better_than_differentiation():
    rng, clean = np.random.default_rng(1), joint_angles()
    noisy = Demonstration(
        clean.times, clean.positions + rng.normal(0.0, 2e-3, clean.positions.shape)
    )
    errors = {}
    for method in ('response', 'joint'):
        learned = learn_discrete(noisy, 15, options=FitOptions(method))
        errors[method] = np.sqrt(
            np.mean((learned.rollout(clean.times).positions - clean.positions) ** 2)
        )
    assert errors['response'] < errors['joint']
    assert errors['response'] < 2e-3


def test_uneven_sampling_does_not_matter():
    rng, demonstration = np.random.default_rng(2), handwriting('w', dt=5e-4)
    keep = np.sort(
        np.concatenate(
            [
                [0, len(demonstration.times) - 1],
                rng.choice(np.arange(1, len(demonstration.times) - 1), 300, replace=False),
            ]
        )
    )
    uneven = Demonstration(demonstration.times[keep], demonstration.positions[keep])
    learned = learn_discrete(uneven, 25)
    assert (
        learning_discrete.reproduction_errors(learned, positions_only(demonstration)).max() < 0.01
    )


def test_the_chosen_number_of_bases_grows_with_detail_and_falls_with_noise():
    smooth = learn_discrete(straight_reach([0.0], [1.0]), None).bases.count
    detailed = learn_discrete(positions_only(handwriting('e')), None).bases.count
    clean, rng = handwriting('e'), np.random.default_rng(4)
    noisy = Demonstration(
        clean.times, clean.positions + rng.normal(0.0, 4e-3, clean.positions.shape)
    )
    assert smooth < detailed
    assert learn_discrete(noisy, None).bases.count < detailed


def test_held_out_error_sees_what_the_fit_does_not():
    rng, clean = np.random.default_rng(6), straight_reach([0.0], [1.0], dt=0.02)
    noisy = [
        Demonstration(clean.times, clean.positions + rng.normal(0.0, 0.05, clean.positions.shape))
        for _ in range(2)
    ]
    errors = learning_discrete.task(noisy, goals=[[1.0], [1.0]]).held_out_errors((5, 10, 40))
    assert errors[40] > errors[5]
    chosen = learn_discrete(noisy, None, goals=[[1.0], [1.0]])
    assert chosen.bases.count < 14


def test_rhythmic_bases_are_chosen_too():
    errors = learning_rhythmic.task(walking_joints(noise=0.01)).held_out_errors((5, 43))
    assert errors[43] > errors[5]
    assert learn_rhythmic(walking_joints(noise=0.01), None).bases.count < 14


def test_ridge_shrinks_the_weights():
    sizes = [
        np.linalg.norm(
            learn_discrete(handwriting('a'), 25, options=FitOptions(ridge=ridge)).weights
        )
        for ridge in (0.0, 1e-6, 1e-2)
    ]
    assert sizes[0] >= sizes[1] > sizes[2]


@given(st.integers(0, 99), st.floats(1e-6, 1.0))
def test_ridge_regression_zeroes_the_gradient(seed, ridge):
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(30, 6)), rng.normal(size=(30, 2))
    W = ridge_regression(A, B, ridge)
    gradient = A.T @ (A @ W - B) + ridge * np.mean(np.sum(A**2, axis=0)) * W
    np.testing.assert_allclose(gradient, 0.0, atol=1e-9)


def test_the_smallest_number_that_is_good_enough_is_taken():
    assert smallest_good({5: 0.2, 10: 0.0104, 20: 0.01, 40: 0.011}) == 10
    assert smallest_good({5: 9e-4, 10: 1e-9}) == 5


@pytest.mark.parametrize('degree', [4])
def test_derivatives_of_a_polynomial_are_exact_even_for_uneven_times(degree):
    times = np.sort(np.random.default_rng(0).uniform(0.0, 1.0, 40))
    poly = np.polynomial.Polynomial([1.0, -2.0, 3.0, 0.5, -4.0])
    first, second = derivatives(times, poly(times)[:, None], degree=degree)
    np.testing.assert_allclose(first[:, 0], poly.deriv(1)(times), atol=1e-8)
    np.testing.assert_allclose(second[:, 0], poly.deriv(2)(times), atol=1e-5)


@pytest.mark.parametrize('name', [*DISCRETE, 'walk'])
def test_derivatives_of_the_built_demonstrations_are_their_derivatives(name):
    d = walking_joints() if name == 'walk' else DISCRETE[name]
    v = np.gradient(d.positions, d.times, axis=0, edge_order=2)
    a = np.gradient(d.velocities, d.times, axis=0, edge_order=2)
    np.testing.assert_allclose(v, d.velocities, atol=2e-3 * np.abs(d.velocities).max())
    np.testing.assert_allclose(a, d.accelerations, atol=2e-2 * np.abs(d.accelerations).max())


def test_a_learned_primitive_takes_another_goal_and_amplitude():
    reach = learn_discrete(joint_angles(), 25)
    goal = reach.goal + 0.4
    np.testing.assert_allclose(
        reach.rollout(np.linspace(0.0, 3.0, 300), DiscreteInput(goal)).positions[-1],
        goal,
        atol=1e-4,
    )
    walk = learn_rhythmic(walking_joints(), 25)
    times = np.linspace(0.0, walk.period, 101)
    small = walk.rollout(times, RhythmicInput(walk.centre, 0.5)).positions
    np.testing.assert_allclose(
        np.ptp(small, axis=0), 0.5 * np.ptp(walk.rollout(times).positions, axis=0), rtol=1e-6
    )


@pytest.mark.parametrize(
    ('arguments', 'error', 'text'),
    [
        (([],), DataError, 'at least one'),
        (([handwriting('a'), straight_reach([0.0], [1.0])],), DataError, 'same degrees'),
        ((handwriting('a'), 0), ParameterError, 'at least 1'),
        ((handwriting('a'), 7.5), ParameterError, 'whole number'),
        ((handwriting('a'), 10_000), DataError, 'at most as many bases'),
    ],
)
def test_what_cannot_be_learned_is_refused(arguments, error, text):
    with pytest.raises(error, match=text):
        learn_discrete(*arguments)


@pytest.mark.parametrize('method', ['joint', 'local'])
def test_forces_of_noisy_samples_with_a_gap_are_refused_and_responses_are_not(method):
    rng, clean = np.random.default_rng(3), straight_reach([0.0, 1.0], [1.0, -1.0], dt=0.001)
    kept = np.sort(rng.choice(len(clean.times), 300, replace=False))
    kept = kept[(clean.times[kept] < 0.35) | (clean.times[kept] > 0.65)]
    noisy = clean.positions[kept] + 0.01 * rng.normal(size=(len(kept), 2))
    recorded = Demonstration(clean.times[kept], noisy)
    with pytest.raises(DataError, match="use the method 'response'"):
        learn_discrete(recorded, 25, options=FitOptions(method))
    learned = learn_discrete(recorded, 10, options=FitOptions(ridge=1e-4))
    assert np.abs(learned.rollout(clean.times).positions - clean.positions).max() < 0.2


@pytest.mark.parametrize('method', ['response', 'joint', 'local'])
@pytest.mark.parametrize('gap', [0.0, 0.3])
@pytest.mark.parametrize('noise', [0.0, 1e-3, 1e-2])
def test_what_is_learned_from_uneven_samples_is_right_or_refused(method, gap, noise):
    rng, clean = np.random.default_rng(1), straight_reach([0.0, 1.0], [1.0, -1.0], dt=0.002)
    kept = np.sort(rng.choice(len(clean.times), 350, replace=False))
    kept = kept[np.abs(clean.times[kept] - 0.5) > 0.5 * gap]
    recorded = Demonstration(
        clean.times[kept], clean.positions[kept] + noise * rng.normal(size=(len(kept), 2)))
    try:
        learned = learn_discrete(recorded, 25, options=FitOptions(method))
    except DataError as error:
        assert 'gaps' in str(error) and (gap or noise)
    else:
        made, size = learned.rollout(clean.times).positions, np.ptp(clean.positions, axis=0)
        errors = np.abs(made - clean.positions) / size
        assert errors[kept].max() < 0.75
        assert (np.ptp(made, axis=0) / size).max() < 1.4
        assert gap or errors.max() < 0.75


@pytest.mark.parametrize('goal', [np.full(2, np.nan), np.zeros(5), np.zeros(1)])
def test_a_goal_that_does_not_fit_is_refused_in_flight(goal):
    reach = learn_discrete(straight_reach([0.0, 1.0], [1.0, -1.0]), 10)
    with pytest.raises(ParameterError, match='goal must be 2 finite'):
        reach.step(reach.initial_state(), DiscreteInput(goal), 0.01)
    cycle = learn_rhythmic(walking_joints(), 10)
    with pytest.raises(ParameterError, match='centre must be'):
        cycle.step(cycle.initial_state(), RhythmicInput(goal), 0.01)


@pytest.mark.parametrize('options', [{'method': 'magic'}, {'ridge': -1.0}, {'overlap': 1.0}])
def test_bad_options_are_refused(options):
    with pytest.raises(ParameterError):
        FitOptions(**options)


@pytest.mark.parametrize(
    ('times', 'positions', 'text'),
    [
        (np.zeros(9), np.zeros(9), 'increase'),
        (np.arange(5.0), np.zeros(5), 'at least 8'),
        (np.arange(9.0), np.zeros((8, 1)), 'shape'),
        (np.arange(9.0), np.full(9, np.nan), 'finite'),
        (np.arange(9.0), ['high'] * 9, 'must be numbers'),
        (np.append(np.arange(8.0), np.nan), np.zeros(9), 'finite'),
    ],
)
def test_bad_demonstrations_are_refused(times, positions, text):
    with pytest.raises(DataError, match=text):
        Demonstration(times, positions)
