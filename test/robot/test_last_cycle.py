# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rhythm of the last cycle keeps time with the legs that are heard."""

from __future__ import annotations

from collections.abc import Sequence
from math import tau

import numpy as np
import pytest

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets
from dmp_cpg_ros.robot.absent_legs import (
    CARRIED_NS,
    IN_TIME_NS,
    JOINTS,
    SETTLED_NS,
    SEVERAL_NS,
    AbsentLegs,
)
from dmp_cpg_ros.robot.last_cycle import KNOWN_NS, LastCycle

TICK_NS, DEAD = 4_000_000, 0
PERIOD_S = 0.42


class Legs:
    """Legs that move to and fro, at a rate that may change."""

    def __init__(self) -> None:
        random = np.random.default_rng(3)
        self._size, self._lag = random.uniform(0.1, 0.4, 12), random.uniform(0.0, tau, 12)
        self.now = TICK_NS
        self._phase = 0.0
        self.memory = LastCycle()
        self.absent = AbsentLegs(self.memory, 1_000_000_000)
        self._heard_ns, self.given = [0] * len(LEGS), np.zeros(12)

    def step(self, faster: float = 1.0, dead: Sequence[int] | bool = (), off: Array | float = 0.0
             ) -> tuple[Array, Array]:
        """One tick; returns positions (12,) that are given out, and where the legs are: some are
        dead, ``True`` for the first, and joints are off (12,) [rad].
        """
        dead = (DEAD,) if dead is True else dead or ()
        self.now += TICK_NS
        rate = faster * tau / PERIOD_S
        self._phase += rate * TICK_NS * 1e-9
        wanted = np.array((self._size * np.sin(self._phase + self._lag) + off,
                           rate * self._size * np.cos(self._phase + self._lag), np.zeros(12)))
        for i, of in enumerate(JOINTS):
            if i not in dead:
                self.memory.accept(i, self.now, JointTargets(*wanted[:, of]))
                self._heard_ns[i] = self.now
        ages = [self.now - heard_ns for heard_ns in self._heard_ns]
        targets = wanted.copy()
        for i, of in enumerate(JOINTS):
            targets[:, of] = self.memory.acting(i, self.now)[1]
        if max(ages) > CARRIED_NS:
            self.absent.watch(self.now, ages)
        if self.absent.since_ns:
            assert self.absent.go_on(self.now, targets, self.given)
        self.absent.taking_up(self.now, targets[0])
        self.given = targets[0].copy()
        return targets[0], wanted[0]


@pytest.mark.parametrize('faster', [0.85, 1.0, 1.15])
def test_a_leg_that_is_away_goes_on_in_time_with_the_others(faster: float) -> None:
    """Its rhythm alone would be off by a third of a cycle after 0.8 s."""
    legs = Legs()
    for _ in range(500):
        legs.step()
    most = 0.0
    for tick in range(200):
        given, wanted = legs.step(faster, dead=True)
        live = np.ones(12, dtype=bool)
        live[JOINTS[DEAD]] = False
        assert np.array_equal(given[live], wanted[live])
        if tick > 80:
            most = max(most, float(np.abs(given - wanted).max()))
    assert most < 0.06 if faster == 1.0 else most < 0.12
    for tick in range(100):
        before = legs.given
        given, wanted = legs.step(faster)
        assert np.abs(given - before).max() < 1.5 * 0.4 * faster * tau / PERIOD_S * TICK_NS * 1e-9
        assert bool(legs.absent.since_ns) == ((tick + 1) * TICK_NS <= IN_TIME_NS)
    assert np.allclose(given, wanted)


@pytest.mark.parametrize('back', [30, 200])
def test_a_leg_that_is_away_once_more_has_the_rhythm_of_before(back: int) -> None:
    """Of its targets there are none of one period in a row."""
    legs = Legs()
    for _ in range(500):
        legs.step()
    for _ in range(2):
        for _ in range(100):
            legs.step(dead=True)
        for _ in range(back):
            given, wanted = legs.step()
        assert not legs.absent.since_ns and np.abs(given - wanted).max() < 0.06
    for _ in range(100):
        given, wanted = legs.step(dead=True)
        assert legs.absent.rhythm is not None and np.abs(given - wanted).max() < 0.15
        assert not legs.absent.rhythm.of_before


def test_what_is_heard_late_takes_the_place_of_what_was_done_meanwhile() -> None:
    memory = remembered(np.zeros((10, 12)))
    for tick in range(11, 15):
        memory.went_on(DEAD, tick * TICK_NS, np.ones((3, 3)))
    memory.accept(DEAD, 12 * TICK_NS, JointTargets(*np.full((3, 3), 2.0)))
    memory.went_on(DEAD, 12 * TICK_NS, np.ones((3, 3)))  # is heard already
    memory.went_on(DEAD, 13 * TICK_NS, np.ones((3, 3)))
    done = [(stamp // TICK_NS, float(value[0, 0])) for stamp, value in memory._done[DEAD]]
    assert done[-4:] == [(10, 0.0), (11, 1.0), (12, 2.0), (13, 1.0)]
    stamp, newest = memory.acting(DEAD, 20 * TICK_NS)
    assert (stamp // TICK_NS, newest[0, 0]) == (12, 2.0)


def remembered(position: Array) -> LastCycle:
    """Memory of positions (n, 12), one for each tick."""
    memory, rates = LastCycle(), np.gradient(position, TICK_NS * 1e-9, axis=0)
    for tick, (q, q_dot) in enumerate(zip(position, rates, strict=True), 1):
        for i, of in enumerate(JOINTS):
            memory.accept(i, tick * TICK_NS, JointTargets(q[of], q_dot[of], np.zeros(3)))
    return memory


def smooth(seed: int, count: int) -> Array:
    """Motion of 12 joints, (count, 12), that never repeats itself."""
    drawn = np.random.default_rng(seed).normal(size=(count + 50, 12))
    return np.stack([np.convolve(column, np.hanning(52)[1:-1], 'same')[25:-25]
                     for column in drawn.T], axis=1)


@pytest.mark.parametrize('seed', range(5))
def test_a_gait_that_balances_has_its_rhythm_and_what_resembles_its_end_by_chance_has_none(
        seed: int) -> None:
    count, period = 425, round(PERIOD_S / (TICK_NS * 1e-9))
    turns, lag = np.arange(count)[:, None] / period, np.random.default_rng(seed).uniform(size=12)
    gait, other = np.sin(tau * (turns + lag)), smooth(seed, count)
    rhythm = remembered(gait + 0.18 * other / other.std()).rhythm()
    assert rhythm is not None
    assert rhythm.period_s / PERIOD_S == pytest.approx(round(rhythm.period_s / PERIOD_S), abs=0.05)
    again, apart = 25, 176
    other[-again - 1:] = other[-again - 1 - apart:-apart]
    assert remembered(other).rhythm() is None


@pytest.mark.parametrize('seed', range(5))
def test_after_a_disturbance_a_leg_alone_has_the_cycle_of_before_at_its_phase(seed: int) -> None:
    """Its period is not a whole number of steps of the memory."""
    random, period = np.random.default_rng(seed), PERIOD_S / (TICK_NS * 1e-9)
    lag, count = random.uniform(size=12), 500 + int(random.integers(200))
    gait = np.sin(tau * (np.arange(4000)[:, None] / period + lag))
    walked = gait[:count].copy()
    blow = slice(count - 260, count - 30)
    walked[blow] += 1.5 * np.hanning(230)[:, None] * smooth(seed, 230)
    memory = remembered(walked[:count - 260])
    assert not memory.rhythm().of_before
    rest = remembered(walked)
    rest._known = memory._known
    assert rest.rhythm() is None
    rhythm = rest.rhythm(of_before=True)
    assert rhythm is not None and rhythm.of_before
    assert np.abs(rhythm.at(count * TICK_NS)[0] - walked[-1]).max() < 1e-9
    for ahead in range(int(period), 2 * int(period)):  # the difference has faded
        expected = gait[count - 1 + ahead]
        assert np.abs(rhythm.at((count + ahead) * TICK_NS)[0] - expected).max() < 0.2
    absent = AbsentLegs(rest, 1_000_000_000)
    absent.watch(count * TICK_NS, [CARRIED_NS + 1] * 4)
    assert absent.rhythm is None
    memory._known.end_ns -= KNOWN_NS
    assert rest.rhythm(of_before=True) is None  # that was too long ago
    memory._known.end_ns += KNOWN_NS
    absent, late = AbsentLegs(rest, 1_000_000_000), [CARRIED_NS + 1, 0, 0, 0]
    for k in range(100):  # others are late too, first for a moment and then for longer
        now, others = (count + k) * TICK_NS, 20 <= k < 30 or k >= 50
        absent.watch(now, [CARRIED_NS + 1, CARRIED_NS + 1, 0, 0] if others else late)
        assert absent.rhythm is not None and absent.rhythm.of_before
        if not absent.go_on(now, np.zeros((3, 12)), np.zeros(12)):
            break
    assert k == 50 + SEVERAL_NS // TICK_NS + 1
    assert not any(absent._away_ns[2:])  # who is in time is followed


@pytest.mark.parametrize('followed', [
    SETTLED_NS // TICK_NS - 12, SETTLED_NS // TICK_NS + 3, 2 * SETTLED_NS // TICK_NS])
@pytest.mark.parametrize('stood', [False, True])
def test_legs_that_have_been_followed_for_a_while_have_the_cycle_of_before_together(
        followed: int, stood: bool) -> None:
    """Unless the robot has looked after itself meanwhile."""
    legs, everyone = Legs(), tuple(range(len(LEGS)))
    off = 0.12 * smooth(2, followed) / smooth(2, followed).std()
    for _ in range(500):
        legs.step()
    for _ in range(50):
        legs.step(dead=everyone)
    while legs.absent.since_ns:
        legs.step()
    if stood:
        legs.absent.all_here()
    for tick in range(followed):
        legs.step(off=off[tick])
    assert legs.memory.rhythm() is None
    for _ in range(CARRIED_NS // TICK_NS + 1):
        legs.step(dead=everyone)
    if stood or followed * TICK_NS < SETTLED_NS:  # also when the first is known to be late
        assert legs.absent.rhythm is None
        return
    assert legs.absent.rhythm is not None and legs.absent.rhythm.of_before
    for _ in range(200):
        given, wanted = legs.step(dead=everyone)
    assert np.abs(given - wanted).max() < 0.2  # nothing is heard of what differs meanwhile


def test_what_resembles_no_phase_of_the_cycle_of_before_has_no_rhythm() -> None:
    turns = np.arange(500)[:, None] / (PERIOD_S / (TICK_NS * 1e-9))
    memory = remembered(np.sin(tau * (turns + np.linspace(0.0, 1.0, 12))))
    assert memory.rhythm() is not None
    elsewhere = remembered(smooth(1, 500))
    elsewhere._known = memory._known
    assert elsewhere.rhythm(of_before=True) is None
