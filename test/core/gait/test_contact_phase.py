# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Contact feedback: its directions, its bounds, and that walking, stops and starts keep theirs."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import phase, phase_rotation, wrapped
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.contraction.capture import PLACE_TOLERANCE, RADIUS_TOLERANCE
from dmp_cpg_ros.core.gait.contact_feedback import (
    LOADED,
    UNLOADED,
    ContactLimits,
    ContactState,
    bounded,
    contact_feedback,
    initial_contact_state,
    standing,
    touchdown_error,
)
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.supervisor import LOCKED_PHASE_ERROR
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.robot.perfect_tracking import PerfectTrackingRobot
from dmp_cpg_ros.suite import Suite, load_gait, load_gaits, load_suite

TICK = 0.004
QUARTER = 20.0
FREE = Inhibition(False, np.zeros(4), 0.3)
WALKING = ContactState(np.ones(4, dtype=bool), 10.0)
AT = np.array((0.4, 0.0, 0.0))


@lru_cache
def suite_with(**values: object) -> Suite:
    return load_suite(None, {'contact_feedback': True, 'auto_inhibit': False,
                             'cmd_vel_timeout': 0.0, **values})


def network_and_certificate(**values: object) -> tuple[GaitNetwork, Certificate]:
    suite = suite_with(**values)
    scale = body_scale(load_description(suite.robot_file))
    running = Running(suite.parameters, suite.gait, scale, TICK)
    certificate = running.certificate(whole=True)
    return GaitNetwork(suite.parameters.canonical, suite.gait, scale), certificate


def places(network: GaitNetwork, x: np.ndarray) -> np.ndarray:
    """States in coordinates in which legs in their places coincide, (4, 2)."""
    return np.array([phase_rotation(-phi) @ state
                     for phi, state in zip(network.gait.phases, x, strict=True)])


def test_a_foot_stands_with_hysteresis_and_keeps_what_is_not_known() -> None:
    force = np.array((0.0, UNLOADED, 0.5 * (LOADED + UNLOADED), 1.0, np.nan)) * QUARTER
    down = standing(np.ones(5, dtype=bool), force, QUARTER)
    up = standing(np.zeros(5, dtype=bool), force, QUARTER)
    assert down.tolist() == [False, True, True, True, True]
    assert up.tolist() == [False, False, False, True, False]


def test_early_feet_ask_to_advance_and_late_ones_to_wait() -> None:
    duty = 0.6                                              # touchdown at 0.2
    position = np.array((-0.1, 0.05, 0.19, 0.21, 0.3, 0.45, -0.4))
    lands = touchdown_error(position, duty, np.ones(7, dtype=bool))
    hangs = touchdown_error(position, duty, np.zeros(7, dtype=bool))
    assert np.sign(lands).tolist() == [0, 1, 0, 0, 0, 0, 0]  # a foot that scuffs while it rises: 0
    assert np.sign(hangs).tolist() == [0, 0, 0, 0, -1, 0, 0]  # in mid-stance it waits no longer


@pytest.mark.parametrize('seed', range(20))
def test_every_offset_is_within_the_share_of_a_common_one(seed: int) -> None:
    random = np.random.default_rng(seed)
    own, slowest, fastest = random.uniform(0.0, 3.0), -random.uniform(0, 6), random.uniform(0, 3)
    offsets = bounded(random.normal(0.0, 10.0, 4), own, slowest, fastest)
    assert np.ptp(offsets) <= 2.0 * own + 1e-12
    assert slowest <= offsets.min() <= offsets.max() <= fastest


@pytest.mark.parametrize('early', [True, False])
def test_touchdown_is_reached_sooner_where_feet_are_early_and_later_where_late(
    early: bool,
) -> None:
    network, certificate = network_and_certificate(gait='trot')
    limits, state, x = certificate.contact, WALKING, network.locked_state()
    without = x
    for _ in range(100):
        position = network.gait.cycle_position(phase(x))
        in_front = (position > 0.0) & (position < 0.4)
        force = np.where(in_front, float(early), 1.0 - float(early)) * 2.0 * QUARTER
        state, offset = contact_feedback(
            state, force, QUARTER, limits, network, x, AT, FREE, TICK)
        x = network.step(x, AT, FREE, TICK, offset)
        without = network.step(without, AT, FREE, TICK)
    ahead = wrapped(phase(x) - phase(without))
    assert np.all(ahead * (1.0 if early else -1.0) > 0.02)


@pytest.mark.parametrize(
    ('gait', 'graph', 'gain'),
    [('amble', 'all_to_all', 100.0), ('trot', 'all_to_all', 30.0), ('trot', 'ring', 150.0),
     ('amble', 'star', 400.0), ('walk', 'directed_ring', 400.0)],
)
@pytest.mark.parametrize('worst', [False, True])
def test_legs_stay_in_their_places_under_any_contacts(
    gait: str, graph: str, gain: float, worst: bool
) -> None:
    """Random contacts, and offsets at their bounds that always pull the legs apart."""
    network, certificate = network_and_certificate(
        gait=gait, coupling_graph=graph, coupling_gain=gain, contact_gain=300.0,
        margin_share=0.95)
    assert certificate['contact_feedback'].holds
    limits = certificate.contact
    assert limits is not None and limits.own > 0.0
    random = np.random.default_rng(7)
    state, x, felt = WALKING, network.locked_state(), 0.0
    radius = network.parameters.radius
    omega = network.omega(AT)
    for k in range(700):
        if k % random.integers(1, 40) == 0:
            force = random.choice((0.0, 50.0, np.nan), 4)
        state, offset = contact_feedback(
            state, force, QUARTER, limits, network, x, AT, FREE, TICK)
        if worst:
            apart = np.sign(network.phase_errors(x) + 1e-12 * random.normal(size=4))
            if k // 100 % 2:
                apart = np.array((1.0, -1.0, -1.0, 1.0))
            offset = bounded(1e3 * apart, limits.own, -0.5 * omega, limits.omega_max - omega)
        felt = max(felt, float(np.abs(offset).max()))
        x = network.step(x, AT, FREE, TICK, offset)
        together = places(network, x)
        assert np.abs(network.phase_errors(x)).max() <= LOCKED_PHASE_ERROR
        assert max(np.hypot(*(a - b)) for a in together for b in together) <= (
            PLACE_TOLERANCE * radius)
        assert np.hypot(*x.T).min() >= (1.0 - RADIUS_TOLERANCE) * radius
    assert felt >= min(limits.own, 0.5)                      # the contacts did something


def test_there_is_no_feedback_without_limits_at_rest_and_before_the_start_is_over() -> None:
    network, certificate = network_and_certificate()
    limits, force = certificate.contact, np.zeros(4)
    assert limits is not None and limits.after == certificate.time_to_walking > 0.0
    positions = [network.locked_state(phi) for phi in np.linspace(0.0, 6.0, 40)]

    def acts(allowed: ContactLimits | None, state: ContactState, inhibition: Inhibition = FREE,
             feet: np.ndarray = force) -> bool:
        return any(np.any(contact_feedback(
            state, feet, QUARTER, allowed, network, x, AT, inhibition, TICK)[1])
            for x in positions)

    assert acts(limits, WALKING)
    assert not acts(limits, initial_contact_state())
    assert not acts(limits, WALKING, replace(FREE, requested=True))
    assert not acts(limits, WALKING, feet=np.full(4, np.nan))
    assert not acts(None, WALKING)
    after, _ = contact_feedback(WALKING, force, QUARTER, limits, network, positions[0], AT,
                                replace(FREE, requested=True), TICK)
    assert after.released == 0.0


def test_the_certificate_says_what_share_of_the_margin_is_used() -> None:
    _, half = network_and_certificate(margin_share=0.5)
    _, most = network_and_certificate(margin_share=0.9)
    row = half['contact_feedback']
    assert row.holds and row.left == pytest.approx(0.5 * row.right)
    assert row.right <= half['frequency_mismatch'].right
    assert most['contact_feedback'].left == pytest.approx(0.9 * row.right)
    without = Running(replace(suite_with().parameters, canonical=replace(
        suite_with().parameters.canonical, contact_feedback=False)), load_gait('amble'),
        body_scale(load_description(suite_with().robot_file)), TICK).certificate(whole=True)
    assert without.contact is None
    assert half.time_to_rest > without.time_to_rest
    assert [entry.name for entry in without.inequalities] == [
        entry.name for entry in half.inequalities if entry.name != 'contact_feedback']


@pytest.mark.parametrize(('gait', 'seed'), [('amble', 0), ('trot', 1), ('amble', 2)])
def test_stop_and_start_keep_bound_and_prediction_under_random_contacts(
    gait: str, seed: int
) -> None:
    # contacts at random would tell of steps
    suite, random = suite_with(
        gait=gait, contact_gain=300.0, climbing=False), np.random.default_rng(seed)
    robot = PerfectTrackingRobot(load_description(suite.robot_file), suite.tick_ns)
    loop = WalkingLoop(robot.description, load_gait(gait), suite.parameters)
    _, certificate = network_and_certificate(gait=gait, contact_gain=300.0)
    state, force, offset = robot.reset(), np.zeros(4), 0.0

    def walk(duration: float, until: tuple[str, ...] = ()) -> None:
        nonlocal state, force, offset
        for k in range(round(duration / TICK)):
            if k % 7 == 0:
                force = random.choice((0.0, 50.0), 4)
            tick = loop.tick(replace(state, foot_force=force))
            state = robot.step(tick.targets)
            speed = np.hypot(*(tick.x_dot.T)) / np.hypot(*(tick.x.T))
            offset = max(offset, float(np.abs(speed - loop.network.omega(tick.r)).max()))
            if tick.supervisor.state in until:
                return

    walk(0.1)
    predicted = loop.request(False)
    loop.command(0.5)
    walk(1.0, until=('walking', 'free'))
    assert loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)
    assert predicted <= certificate.time_to_walking
    walk(random.uniform(1.0, 2.0))
    assert offset > 0.5                                     # feedback was felt
    predicted = loop.request(True)
    walk(3.0, until=('at_rest',))
    assert loop.stop.state == 'at_rest'
    assert loop.stop.measured_s <= certificate.time_to_rest
    assert loop.stop.measured_s == pytest.approx(predicted, abs=2.5 * TICK)
    walk(0.5)
    assert loop.stop.state == 'at_rest'


def test_legs_keep_their_places_while_a_gait_changes_under_random_contacts() -> None:
    # What swinging feet meet at random feigns steps.
    suite = suite_with(gait='amble', contact_gain=300.0, climbing=False)
    random = np.random.default_rng(5)
    robot = PerfectTrackingRobot(load_description(suite.robot_file), suite.tick_ns)
    loop = WalkingLoop(robot.description, load_gait('amble'), suite.parameters, load_gaits())
    state, force = robot.reset(), np.zeros(4)
    loop.tick(state)
    loop.request(False)
    loop.command(0.4)
    words = set()
    for k in range(900):
        if k % 7 == 0:
            force = random.choice((0.0, 50.0), 4)
        if k == 250:
            loop.change_gait('trot')
        tick = loop.tick(replace(state, foot_force=force))
        state = robot.step(tick.targets)
        words.add(loop.network.gait.name)
        if k > 100:
            assert np.abs(loop.network.phase_errors(loop.x)).max() <= LOCKED_PHASE_ERROR
    assert {'amble', 'trot'} < words
