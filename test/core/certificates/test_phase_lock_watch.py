# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The watch on phase lock: silent while the model holds, loud when something else acts."""

from __future__ import annotations

import numpy as np
import pytest
from core_examples import GAITS, TICK, network

from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.certificates.lock_watch import (
    DISTURBED,
    LOCKED,
    LOST,
    PhaseLock,
    PhaseLockWatch,
)
from dmp_cpg_ros.core.certificates.network import EXPECTED_MISMATCH
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.running import RunningGait
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters

R = np.array([0.3, 0.0, 0.0])
FREE = Inhibition(False, np.zeros(4), 0.3)
GRAPHS = ('all_to_all', 'ring', 'path', 'star', 'directed_ring')


def watch(network_: GaitNetwork, x: np.ndarray, ticks: int, before: PhaseLock | None = None,
          omega: np.ndarray | None = None) -> tuple[np.ndarray, list[PhaseLock]]:
    """Run a free network under the watch; with frequencies of their own when given."""
    watcher, found = PhaseLockWatch(), [] if before is None else [before]
    for _ in range(ticks):
        if omega is None:
            x = network_.step(x, R, FREE, TICK)
        else:
            x = network_.system.step(x, omega, np.zeros(4), TICK)
        found.append(watcher.step(found[-1] if found else None, network_, R, x, True, TICK))
    return x, found


@pytest.mark.parametrize('graph', GRAPHS)
def test_from_any_start_the_phases_come_together_under_the_envelope(graph: str) -> None:
    rng = np.random.default_rng(7)
    running = network(coupling_graph=graph, coupling_gain=40.0)
    for _ in range(10):
        x = state_at(running.gait.phases + rng.uniform(-1.5, 1.5, 4), 1.0)
        x = x * rng.uniform(0.6, 1.1, (4, 1))
        _, found = watch(running, x, 300)
        assert all(lock.level == LOCKED for lock in found)
        assert all(lock.error <= lock.bound for lock in found)
        assert found[-1].bound < 0.5


@pytest.mark.parametrize('graph', GRAPHS)
def test_frequencies_that_differ_by_what_is_expected_are_no_alarm(graph: str) -> None:
    running = network(coupling_graph=graph)
    omega = running.omega(R) * (1.0 + EXPECTED_MISMATCH * np.array([1.0, -1.0, -1.0, 1.0]))
    _, found = watch(running, running.locked_state(), 500, omega=omega)
    assert all(lock.level == LOCKED for lock in found)
    _, found = watch(running, running.locked_state(), 500,
                     omega=running.omega(R) * np.array([3.0, 0.2, 0.2, 3.0]))
    assert found[-1].level == LOST


def test_a_disturbed_oscillator_is_an_alarm_until_it_is_back() -> None:
    running = network()
    x, found = watch(running, running.locked_state(), 100)
    assert found[-1].alarm == ''
    x[2] = state_at(np.array([1.0]), 1.0)[0]
    _, after = watch(running, x, 100, found[-1])
    assert after[1].level == DISTURBED
    assert after[1].alarm.startswith('alarm: phase-lock error')
    levels = [lock.level for lock in after[1:]]
    back = levels.index(LOCKED)
    assert set(levels[:back]) == {DISTURBED}
    assert set(levels[back:]) == {LOCKED}


def test_what_keeps_pulling_is_lost_and_stays_so_until_it_is_back() -> None:
    running = network()
    watcher = PhaseLockWatch()
    x, found = watch(running, running.locked_state(), 50)
    lock = found[-1]
    levels = []
    for k in range(100):
        x = running.step(x, R, FREE, TICK)
        if k < 50:                                   # leg rl is pushed ahead at every tick
            angle = 0.2
            turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            x[2] = turn @ x[2]
        lock = watcher.step(lock, running, R, x, True, TICK)
        levels.append(lock.level)
    assert levels[49] == LOST
    assert levels[-1] == LOCKED
    assert 'does not come back' in PhaseLock(1.0, 0.1, LOST, 0.0, np.zeros(4)).alarm


def test_inhibition_and_release_are_no_alarm() -> None:
    parameters = InhibitionParameters()
    running, watcher, lock = network(), PhaseLockWatch(), None
    held = Inhibition(True, parameters.armed_gains, 0.3)
    x = running.rest_state(held, duration=2.0)
    for k in range(300):
        inhibition = held if k < 100 else FREE
        x = running.step(x, R, inhibition, TICK)
        acts = bool(inhibition.acting_gains(x, running.system.target).any())
        lock = watcher.step(lock, running, R, x, not acts, TICK)
        assert lock.level == LOCKED
    assert lock is not None
    assert lock.error < lock.bound < 0.05


def test_places_that_move_are_followed_without_an_alarm() -> None:
    running, watcher, lock = network(), PhaseLockWatch(), None
    x = running.locked_state()
    for k in range(400):
        share = min(k / 250.0, 1.0)                  # one second from amble to trot
        lag = (1.0 - share) * GAITS['amble'].lag + share * GAITS['trot'].lag
        moving = network(type(GAITS['amble'])('moving', lag % 1.0, GAITS['amble'].speed,
                                              GAITS['amble'].cadence, GAITS['amble'].duty_factor))
        x = moving.step(x, R, FREE, TICK)
        lock = watcher.step(lock, moving, R, x, True, TICK)
        assert lock.level == LOCKED
        assert lock.error <= lock.bound


def test_changed_couplings_are_watched_with_their_own_rate() -> None:
    start = network()
    running = RunningGait(start.parameters, start.scale, KnownGaits(GAITS))
    state = running.initial_state(GAITS['amble'], InhibitionParameters(start_inhibited=False))
    watcher, bounds = PhaseLockWatch(), []
    for gain in (100.0, 25.0):
        running = running.with_parameters(type(start.parameters)(coupling_gain=gain),
                                          GaitChangeParameters(), GaitChoiceParameters())
        lock = None
        for _ in range(200):
            state = running.step(state, R, FREE, TICK)
            lock = watcher.step(lock, running.network(state.gait), R, state.x, True, TICK)
        assert lock is not None
        bounds.append(lock.bound)
    assert bounds[1] > 3.0 * bounds[0]


def test_an_uncertified_network_has_no_bound() -> None:
    running = network(coupling_gain=1.0)
    _, found = watch(running, running.locked_state(), 3)
    assert found[-1].bound == np.pi
    assert found[-1].level == LOCKED
