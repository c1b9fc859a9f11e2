# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A robot that makes no way although it walks waits for its feet and stops; nothing else does.

But for the last test the robot only stands, and is told how its body comes ahead.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from limbless import NO_FEEDBACK
from standing_run import ROBOT, TICK, Run, walking
from test_push_recovery import ahead

from dmp_cpg_ros.core.balance.controller import (
    PostureController,
    PostureFeedback,
    PostureParameters,
    PostureState,
)
from dmp_cpg_ros.core.balance.progress import feet_behind
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.inhibition.blocked import (
    BRISK,
    FEET_HELD,
    FIRM,
    HELD,
    LATE_NS,
    NO_BLOCK,
    NO_WAY,
    PATIENCE,
    PINNED,
    SETTLES_NS,
    SLOW,
    SLUGGISH,
    STEP,
    TOO_HIGH,
    InTime,
    Progress,
    block_step,
)
from dmp_cpg_ros.core.inhibition.caution import LEAST
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.robot_model.grounds import Steps
from dmp_cpg_ros.studies.walking_trials import Walk, obstacle

LENGTH = 0.28
FROUDE = (GRAVITY * LENGTH) ** 0.5
STUCK = Progress()


class Told(PostureController):
    """Knows nothing but how the body comes ahead."""

    progress: Progress | None = STUCK

    def step(self, memory: PostureState, *_: object) -> tuple[PostureState, PostureFeedback]:
        return memory, replace(NO_FEEDBACK, progress=self.progress)


def told(run: Run, progress: Progress | None = STUCK) -> Told:
    run.loop.body.posture = posture = Told(ROBOT, PostureParameters())
    posture.progress = progress
    return posture


def blocked(**changes: object) -> Run:
    run = walking(**changes)
    told(run)
    run.until('waiting')
    return run


def test_a_body_that_makes_no_way_stops_as_predicted_and_stays() -> None:
    run = walking()
    told(run)
    length = run.loop.canonical.scale.leg_length
    patience = PATIENCE * length / (BRISK * (GRAVITY * length) ** 0.5)
    assert run.until('waiting') == pytest.approx(patience, rel=0.02)
    assert run.loop.stop.block.acts and run.loop.inhibition.requested
    assert not run.loop.inhibition.automatic
    assert run.loop.stop.block.why == NO_WAY
    predicted, bound = ahead(run.loop), run.loop.time_to_rest()
    assert run.until('at_rest') == pytest.approx(predicted) and predicted <= bound
    run.go(4.0)
    assert run.words()[-1] == 'at_rest' and run.loop.stop.block.acts


@pytest.mark.parametrize('command', [(-0.3, 0.0, 0.0), (0.0, 0.0, 0.5), (0.1, 0.3, 0.0)])
@pytest.mark.parametrize('auto', [True, False])
def test_a_command_that_leads_elsewhere_starts_it(command: tuple[float, float, float],
                                                  auto: bool) -> None:
    run = blocked(inhibition=InhibitionParameters(auto_inhibit=auto, start_inhibited=False))
    run.until('at_rest')
    run.loop.command(0.3, 0.1)
    run.go(0.2)
    assert run.loop.stop.state == 'at_rest'
    run.loop.command(*command)
    run.until('walking')
    assert not run.loop.stop.block.acts


def test_the_service_starts_it_at_the_same_command_and_it_is_found_again() -> None:
    run = blocked()
    run.until('at_rest')
    run.loop.request(False)
    run.until('walking')
    run.until('waiting')
    assert run.loop.stop.block.acts


def test_any_command_starts_it_after_a_zero_command() -> None:
    run = blocked()
    run.until('at_rest')
    run.loop.command(0.0)
    run.go(0.1)
    assert run.loop.stop.state == 'at_rest'
    run.loop.command(0.5)
    run.until('walking')


def test_a_stop_that_the_service_asks_for_is_its_own() -> None:
    run = blocked()
    run.loop.request(True)
    run.loop.command(-0.3)
    run.until('at_rest')
    run.go(0.5)
    assert run.loop.stop.state == 'at_rest' and not run.loop.stop.block.acts


def test_without_block_stop_or_knowledge_it_walks_on() -> None:
    for run, progress in ((walking(inhibition=InhibitionParameters(block_stop=False)), STUCK),
                          (walking(), None)):
        told(run, progress)
        run.go(6.0)
        assert run.loop.stop.state == 'walking' and run.loop.stop.block is NO_BLOCK


def test_nobody_is_blocked_by_a_clock_that_is_set_ahead() -> None:
    run = walking()
    told(run)
    run.go(0.1).time_ns += 1_000_000_000_000
    run.go(TICK)
    assert run.loop.stop.state == 'walking' and not run.loop.stop.block.acts


@settings(max_examples=30, deadline=None)
@given(st.floats(SLOW, 1.5), st.floats(LEAST, 1.0), st.floats(-pi, pi), st.floats(1.1, 10.0))
def test_no_body_is_blocked_that_makes_a_step_in_its_time(speed: float, share: float, angle: float,
                                                          hurry: float) -> None:
    """Whatever is asked: it makes ``STEP`` before ``PATIENCE`` is over."""
    asked = min(speed, BRISK) * FROUDE
    rate = hurry * asked * STEP / PATIENCE
    heading = np.array((cos(angle), sin(angle)))
    wanted, r = speed * FROUDE, np.array((*(heading * speed * share * FROUDE), 0.3))
    state, progress = NO_BLOCK, Progress(tuple((rate * heading).tolist()), 0.5 * HELD * LENGTH)
    for _ in range(1500):
        state = block_step(state, r, wanted, progress, LENGTH, 0.02)
        assert not state.acts and state.most == 1.0


def test_a_body_waits_for_feet_that_are_held_and_stops_when_they_stay_so() -> None:
    r, going = np.array((0.5, 0.0, 0.0)), (0.9 * SLUGGISH * 0.5, 0.0)
    most = []
    for behind in np.linspace(HELD, PINNED + 0.2, 20):
        state = NO_BLOCK
        for _ in range(200):
            state = block_step(state, r, 0.5, Progress(going, float(behind) * LENGTH), LENGTH,
                               TICK)
        most.append(state.most)
    assert np.all(np.diff(most) <= 1e-12) and (most[0], most[-1]) == (1.0, LEAST)
    state, held = NO_BLOCK, Progress(going, (PINNED + 0.2) * LENGTH)
    ticks = 0
    while not state.acts:
        state, ticks = block_step(state, r, 0.5, held, LENGTH, TICK), ticks + 1
    assert ticks * TICK * BRISK * FROUDE == pytest.approx(FIRM * LENGTH, rel=0.1)
    assert state.why == FEET_HELD


@pytest.mark.parametrize('gap_ns, lag_ns', [(LATE_NS + 1, 0), (4_000_000, LATE_NS + 1)])
def test_feet_of_legs_whose_targets_come_late_are_no_obstacle(gap_ns: int, lag_ns: int) -> None:
    """A robot that went on with its last rhythm while a node came back was taken for blocked, and
    stood for good.
    """
    held = Progress((0.1, 0.0), (PINNED + 0.2) * LENGTH, rough=0.01, high=1.0)
    in_time, now = InTime(), 10**9
    assert in_time.of_obstacles(now, held) is held
    in_time = in_time.at(now, now - 4_000_000, now + 30_000_000)  # as late as it may be
    assert in_time.of_obstacles(now, held) is held
    in_time = in_time.at(now, now - gap_ns, now + lag_ns)
    told = in_time.of_obstacles(now, held)
    assert told is not None and not block_step(
        NO_BLOCK, np.array((0.5, 0.0, 0.0)), 0.5, told, LENGTH, 1.0).why
    assert (told.velocity, told.rough) == (held.velocity, held.rough)
    later = now + SETTLES_NS
    assert in_time.at(later, later - 4_000_000, 0).of_obstacles(later, held) == told
    assert in_time.of_obstacles(later + 1, held) is held
    assert in_time.of_obstacles(now, None) is None


@pytest.mark.parametrize('caution', [True, False])
def test_the_command_is_not_followed_farther_than_the_feet_allow(caution: bool) -> None:
    run = walking(inhibition=InhibitionParameters(caution=caution))
    told(run, Progress((0.1, 0.0), 0.5 * (HELD + PINNED) * run.loop.canonical.scale.leg_length))
    run.go(0.4)
    assert run.loop.stop.state == 'walking'
    assert run.loop.stop.share == run.loop.stop.block.most < 0.9


def test_a_body_that_runs_ahead_of_its_feet_is_not_held() -> None:
    r, state = np.array((0.5, 0.0, 0.0)), NO_BLOCK
    for _ in range(500):
        state = block_step(state, r, 0.5, Progress((0.45, 0.0), PINNED * LENGTH), LENGTH, TICK)
        assert state.pinned == 0.0 or state.comes < SLUGGISH * 0.5
    assert state.most == 1.0 and not state.acts


@pytest.mark.parametrize('velocity', [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.4), (0.3, -0.2)])
def test_feet_on_their_way_are_not_behind_and_held_ones_are_as_far_as_they_are(
        velocity: tuple[float, float]) -> None:
    holds = [(0.2, 0.1, -0.3), (0.2, -0.1, -0.3), (-0.2, 0.1, -0.3), (-0.2, -0.1, -0.3)]
    duty, omega, beside = 0.7, 9.0, (0.02, -0.01)
    along = np.array(velocity) / np.hypot(*velocity)
    for phase in np.linspace(0.0, 1.0, 17):
        places = [(phase + k / 4 + 0.5) % 1.0 - 0.5 for k in range(4)]
        feet = []
        for hold, at in zip(holds, places, strict=True):
            since = (at - 0.5 if at > 0 else at + 0.5) * 2.0 * pi / omega
            feet.append((hold[0] + beside[0] - velocity[0] * since,
                         hold[1] + beside[1] - velocity[1] * since, hold[2]))
        assert feet_behind(velocity, beside, feet, holds, places, duty, omega) == pytest.approx(
            0.0, abs=1e-12)
        leading = [np.dot(along, hold[:2]) > 0.0 for hold in holds]
        held = [(x - 0.05 * along[0] * leads, y - 0.05 * along[1] * leads, z)
                for (x, y, z), leads in zip(feet, leading, strict=True)]
        stands = any(leads and abs(at) >= 0.5 * (1.0 - duty)
                     for leads, at in zip(leading, places, strict=True))
        assert feet_behind(velocity, beside, held, holds, places, duty, omega) == pytest.approx(
            0.05 * stands, abs=1e-12)


def test_what_is_too_high_blocks_at_once() -> None:
    r, going = np.array((0.5, 0.0, 0.0)), Progress((0.5, 0.0))
    assert not block_step(NO_BLOCK, r, 0.5, going, LENGTH, TICK).acts
    high = block_step(NO_BLOCK, r, 0.5, going._replace(high=1.0), LENGTH, TICK)
    assert high.acts and high.why == TOO_HIGH
    assert block_step(high, r, 0.5, going, LENGTH, TICK).why == ''
    assert not block_step(NO_BLOCK, 0.0 * r, 0.0, going._replace(high=1.0), LENGTH, TICK).acts


@pytest.mark.parametrize('gait', ['amble', 'trot'])
def test_before_a_step_that_it_does_not_climb_it_stands(gait: str) -> None:
    """One forefoot used to come up there, and the body fell off."""
    run = Walk(gait, None, Steps(height=0.2, platform=4.0), 7)
    run.loop.command(0.5)
    while not run.loop.stop.block.acts:
        assert run.walk(TICK) and run.state.time_ns < 8e9
    predicted, begin = ahead(run.loop), run.state.time_ns
    while run.loop.stop.state != 'at_rest':
        assert run.walk(TICK)
    assert 1e-9 * (run.state.time_ns - begin) == pytest.approx(predicted, abs=1e-9)
    assert run.walk(1.0)
    heights = [foot[2] for foot in run.loop.posture.balance.terrain.footholds]
    assert max(heights) - min(heights) < 0.1                         # none is up there
    place = run.state.base_position_in_world[0]
    run.loop.command(-0.3)
    assert run.walk(3.0)
    assert place - run.state.base_position_in_world[0] > 0.3


@pytest.mark.parametrize(('gait', 'seed'), [('trot', 9), ('trot', 710), ('amble', 508)])
def test_astride_a_step_that_it_may_climb_or_not_it_does_not_fall(gait: str, seed: int) -> None:
    """Feet placed by the body's tilt on what was taken for a slope once threw it over the edge."""
    outcome = obstacle(gait, 0.16, seed)
    assert outcome.stopped and not outcome.fell


def test_before_a_block_it_stands_and_walks_away() -> None:
    run = Walk('trot', None, Steps(height=0.25, platform=4.0), 5)
    run.loop.command(0.5)
    assert run.walk(7.5)
    assert run.loop.stop.block.acts and run.loop.stop.state in ('captured', 'at_rest', 'waiting')
    place = run.state.base_position_in_world[0]
    run.loop.command(-0.3)
    assert run.walk(3.0)
    assert place - run.state.base_position_in_world[0] > 0.3
