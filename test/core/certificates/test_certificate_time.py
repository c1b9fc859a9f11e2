# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bounds on the time to rest and to walking are never exceeded by what the nodes run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_examples import TICK, network

from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.certificates import settling
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.gate import UNCERTIFIED
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.timing import time_to_places
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.entry import in_places
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.reference.filter import ReferenceParameters, ReferenceSystem
from dmp_cpg_ros.core.reference.stop_distance import slowing_time, stop_distance
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.core.voting.parameters import VotingParameters

LEG = LegParameters()


def certificate(gait: GaitNetwork, inhibition: InhibitionParameters | None = None,
                reference: ReferenceParameters | None = None) -> Certificate:
    return certify(Setting.of(gait, SuiteParameters(
        inhibition=inhibition or InhibitionParameters(),
        reference=reference or ReferenceParameters()), TICK))


class Gait:
    """Reference, oscillators and supervisor in the order of a tick, without a robot."""

    def __init__(self, gait: GaitNetwork, inhibition: InhibitionParameters,
                 reference: ReferenceParameters, x: np.ndarray, r: np.ndarray,
                 stop: SupervisorState | None = None) -> None:
        self.network, self.reference = gait, ReferenceSystem(
            reference, gait.scale.hip_radius)
        self.supervisor = GaitSupervisor(
            inhibition, VotingParameters(), LEG.activity_rate, reference)
        self.stop = stop or replace(self.supervisor.initial_state(), state='walking',
                                    requested=False, armed=False, activity=(1.0,) * 4)
        self.published, self.x, self.r = self.supervisor.inhibition(self.stop), x, r
        self.command = tuple(r.tolist())
        self.tick_count = 0

    def tick(self) -> SupervisorState:
        self.tick_count += 1
        self.r = self.reference.towards(self.r, self.command, self.published, TICK)
        self.x = self.network.step(self.x, self.r, self.published, TICK)
        rate = self.network.rate(self.x, self.r, self.published)
        self.stop = self.supervisor.step(
            self.stop, self.tick_count * round(TICK * 1e9), self.network, self.x, rate, self.r,
            self.command)
        self.published = self.supervisor.inhibition(self.stop)
        return self.stop

    def until(self, word: str, request: bool, limit: float) -> float:
        """Time from a request to a state word [s]."""
        self.stop = self.supervisor.request(self.stop, request)
        begin = self.tick_count
        while self.stop.state != word and (self.tick_count - begin) * TICK < limit:
            self.tick()
        return (self.tick_count - begin) * TICK


def settings() -> list[tuple[str, dict[str, object], InhibitionParameters, ReferenceParameters]]:
    plain, slow = ReferenceParameters(), ReferenceParameters(alpha_r=6.0, max_speed=0.5)
    return [
        ('amble', {}, InhibitionParameters(auto_inhibit=False), plain),
        ('trot', {'coupling_graph': 'ring', 'coupling_gain': 60.0},
         InhibitionParameters(auto_inhibit=False, inhibited_legs=('rr',)), slow),
        ('walk', {'coupling_graph': 'path'},
         InhibitionParameters(auto_inhibit=False, capture_speed=0.3), plain),
        ('pace', {'coupling_graph': 'star', 'coupling_gain': 25.0, 'rho': 5.0},
         InhibitionParameters(auto_inhibit=False, inhibition_gain=320.0, region_radius=0.4), slow),
        ('amble', {'coupling_graph': 'directed_ring', 'radius': 0.5, 'rho': 30.0},
         InhibitionParameters(auto_inhibit=False, region_radius=0.15,
                              inhibited_legs=('fr', 'rl')), slow),
        ('amble', {}, InhibitionParameters(auto_inhibit=False, inhibited_legs=('auto',)),
         replace(plain, braking=3.0)),
        ('trot', {'coupling_graph': 'ring'}, InhibitionParameters(auto_inhibit=False),
         replace(slow, braking=1.0))]


@pytest.mark.parametrize('case', range(7))
def test_no_stop_takes_longer_than_its_bound_from_any_phase_and_speed(case: int) -> None:
    gait, canonical, inhibition, reference = settings()[case]
    oscillators = network(gait, **canonical)
    found = certificate(oscillators, inhibition, reference)
    assert found.holds, found.explained()
    limits = np.array([reference.max_speed, reference.max_lateral_speed, reference.max_turn_rate])
    longest = 0.0
    for phase in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
        for share in (1.0, 0.25):
            run = Gait(oscillators, inhibition, reference, oscillators.locked_state(phase),
                       share * limits)
            longest = max(longest, run.until('at_rest', True, 1.5 * found.time_to_rest))
    assert longest <= found.time_to_rest
    assert found.time_to_rest < 1.6 * longest            # a bound, and not a platitude


@pytest.mark.parametrize('case', range(7))
def test_no_start_takes_longer_than_its_bound_and_stops_within_starts_keep_theirs(
        case: int) -> None:
    gait, canonical, inhibition, reference = settings()[case]
    oscillators = network(gait, **canonical)
    found = certificate(oscillators, inhibition, reference)
    speed = np.array([reference.max_speed, 0.0, 0.0])
    run = Gait(oscillators, inhibition, reference, oscillators.locked_state(), 0.2 * speed)
    run.until('at_rest', True, 5.0)
    for _ in range(100):
        run.tick()
    resting = (run.x, run.stop)
    assert run.until('walking', False, 5.0) <= found.time_to_walking
    for delay in (1, 20, 60, 150):                       # ticks after the release
        again = Gait(oscillators, inhibition, reference, resting[0], np.zeros(3), resting[1])
        again.command = tuple(speed.tolist())
        again.tick_count = run.tick_count
        again.stop = again.supervisor.request(again.stop, False)
        for _ in range(delay):
            again.tick()
        assert again.until('at_rest', True, 2.0 * found.time_to_rest) <= found.time_to_rest


@pytest.mark.parametrize('spread', [0.5, 0.8, 1.02, 1.5])
@pytest.mark.parametrize('rho', [1.0, 8.0, 30.0])
def test_free_legs_are_in_their_places_within_the_bound_from_inside_and_outside(
        rho: float, spread: float) -> None:
    free = network('amble', rho=rho)
    radius, rng = free.parameters.radius, np.random.default_rng(round(10.0 * rho + spread))
    setting = Setting.of(free, SuiteParameters(canonical=free.parameters), TICK)
    for aside in (0.0, 0.02):
        x = spread * free.locked_state() + aside * radius * rng.standard_normal((4, 2))
        bound, dt, ticks = time_to_places(setting, x), 0.001, 0
        none = Inhibition(False, np.zeros(4), 0.3)
        while not in_places(free, x, 0.3) and ticks * dt <= bound:
            x = free.step(x, np.zeros(3), none, dt)
            ticks += 1
        assert ticks * dt <= bound + dt
        if aside == 0.0 and abs(spread - 1.0) > 0.1:
            assert 0.0 < bound < 1.2 * ticks * dt + 0.03    # a bound, and not a platitude


def test_a_rest_that_cannot_come_in_time_is_known_as_such_without_going_to_the_horizon(
        monkeypatch: pytest.MonkeyPatch) -> None:
    def bounds() -> list[float]:
        return [certificate(
            network('amble', coupling_graph=graph, coupling_gain=gain), InhibitionParameters(
                inhibition_gain=600.0)).time_to_rest
                for graph in ('path', 'star', 'directed_ring')
                for gain in (15.0, 20.0, 25.0, 30.0, 40.0, 60.0, 100.0)]

    known, looked_at = bounds(), 0

    def too_slow(*_: object) -> bool:
        nonlocal looked_at
        looked_at += 1
        return False

    monkeypatch.setattr(settling, '_too_slow', too_slow)
    assert bounds() == known
    assert looked_at > 10 and min(known) < np.inf


def test_the_bound_grows_with_the_distance_to_the_speed_of_capture() -> None:
    bounds = [certificate(network(), InhibitionParameters(capture_speed=speed)).time_to_rest
              for speed in (0.05, 0.1, 0.4)]
    assert bounds[0] > bounds[1] > bounds[2]


def test_the_bound_knows_that_legs_are_caught_later_where_nobody_steps_out_of_a_stop() -> None:
    bounds = {(speed, steps): certificate(network(), InhibitionParameters(
        capture_speed=speed, push_recovery=steps)).time_to_rest
              for speed in (0.1, 0.5) for steps in (True, False)}
    assert bounds[0.5, True] < bounds[0.5, False] < bounds[0.1, False] == bounds[0.1, True]
    assert 'push_recovery' not in UNCERTIFIED


@pytest.mark.parametrize('name', ['amble', 'walk', 'trot', 'bound'])
@pytest.mark.parametrize(('speed', 'alpha_r'), [(0.2, 3.0), (1.0, 3.0), (3.0, 3.0), (1.0, 6.0)])
def test_the_reference_does_not_go_farther_than_its_bound_and_nearly_as_far(
        name: str, speed: float, alpha_r: float) -> None:
    gait, inhibition = network(name), InhibitionParameters(auto_inhibit=False)
    reference = ReferenceParameters(alpha_r=alpha_r)
    case = Gait(gait, inhibition, reference, gait.locked_state(0.4),
                np.array([speed, 0.2 * speed, 0.3]))
    bound = stop_distance(reference, *[float(np.hypot(*case.r[:2]))] * 2, TICK)
    way = _way_to_rest(case)
    assert way <= bound <= 1.25 * way


@pytest.mark.parametrize(('speed', 'braking'), [(0.2, 1.0), (1.0, 3.0), (3.0, 6.0)])
@pytest.mark.parametrize('turn', [0.0, 1.5])
def test_braking_is_as_fast_as_is_asked_and_within_its_bounds(
        speed: float, braking: float, turn: float) -> None:
    reference, r = ReferenceParameters(braking=braking), np.array([speed, 0.2 * speed, turn])
    of, scale = ReferenceSystem(reference, network().scale.hip_radius), network().scale
    start, feet, way, ticks = r, scale.foot_speed(*r), 0.0, 0
    stopping = Inhibition(True, np.zeros(4), 0.3)
    while r.any():
        way += TICK * float(np.hypot(*r[:2]))
        before, r = r, of.towards(r, (9.0, 9.0, 9.0), stopping, TICK)
        ticks += 1
        assert np.all(np.abs(r) <= np.abs(before)) and np.all(r * start >= 0.0)  # no overshoot
        assert np.allclose(np.cross(r, start), 0.0)                       # along the same curve
    assert ticks * TICK <= slowing_time(reference, feet, 0.0, TICK) + TICK
    most = float(np.hypot(*start[:2]))
    bound = stop_distance(reference, most, most, TICK, turn * scale.hip_radius)
    assert way + 2 * TICK * most <= bound + 1e-12 and bound <= 1.1 * (way + 2 * TICK * most)


def test_a_reference_that_speeds_up_when_a_stop_is_requested_keeps_the_bound() -> None:
    gait, reference = network(), ReferenceParameters(max_acceleration=50.0)
    case = Gait(gait, InhibitionParameters(auto_inhibit=False), reference, gait.locked_state(),
                np.array([0.5, 0.0, 0.0]))
    case.command = (3.0, 0.0, 0.0)
    bound = stop_distance(reference, 0.5, 3.0, TICK)
    way = _way_to_rest(case)
    assert stop_distance(reference, 0.5, 0.5, TICK) < way <= bound <= 1.25 * way


def test_the_certificate_bounds_the_way_from_the_largest_speed() -> None:
    reference = ReferenceParameters(max_speed=1.2, max_lateral_speed=0.5)
    found = certificate(network(), reference=reference)
    assert found.distance_to_rest == stop_distance(reference, 1.3, 1.3, TICK)
    assert found.as_mapping()['distance_to_rest_m'] == found.distance_to_rest


def _way_to_rest(case: Gait) -> float:
    """Way of the reference from a request to rest [m]."""
    case.stop, way = case.supervisor.request(case.stop, True), 0.0
    for _ in range(2000):
        case.tick()
        way += float(np.hypot(*case.r[:2])) * TICK
        if case.stop.state == 'at_rest':
            return way
    raise AssertionError('it does not come to rest')
