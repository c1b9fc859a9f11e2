# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A walking body that is disturbed follows less of its command; stops and starts do not notice."""

from __future__ import annotations

import numpy as np
import pytest
from standing_run import TICK, Run, walking
from test_push_recovery import told

from dmp_cpg_ros.core.balance.capture_point import WIDE
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.inhibition.caution import (
    CLIMBING,
    DISTURBED,
    EASY,
    LEAST,
    REGAIN,
    STRIDING,
    falls,
    followed_share,
    room,
)

SPEED = 0.5


def narrow(run: Run, share: float) -> tuple[float, ...]:
    """Margins of which one gives a share."""
    length = run.loop.canonical.scale.leg_length
    return (1.0, 1.0, (DISTURBED + share * (EASY - DISTURBED)) * length, 1.0)


def test_the_share_falls_with_the_least_margin_and_comes_back_at_its_rate() -> None:
    shares = [followed_share(1.0, room((1.0, m, 1.0, 1.0), 0.5, 1.0), TICK)
              for m in np.linspace(-0.5, 0.5)]
    assert np.all(np.diff(shares) >= 0.0) and {min(shares), max(shares)} == {LEAST, 1.0}
    assert followed_share(1.0, room((0.5 * DISTURBED,) * 4, 0.5, 1.0), TICK) == LEAST
    assert followed_share(LEAST, room(None, 0.5, 1.0), TICK) == LEAST + REGAIN * TICK
    assert followed_share(LEAST, room(WIDE, 0.5, 1.0), 10.0) == 1.0


@pytest.mark.parametrize('way', [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.3), (0.0, -0.3), (0.4, 0.4)])
def test_a_body_falls_over_edges_that_its_way_does_not_leave_behind(way: tuple[float, float]
                                                                    ) -> None:
    r = (*way, 0.0)
    assert not (falls(None, r) or falls(WIDE, r) or falls((0.001,) * 4, r))
    beyond = ((1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0))  # front, right, rear, left
    for i, edge in enumerate(beyond):
        margins = [0.1] * 4
        margins[i] = -0.001
        assert falls(margins, r) == (np.dot(edge, way) > -0.6 * np.hypot(*way))


@pytest.mark.parametrize(('felt', 'share'), [
    ({'rough': 0.05}, CLIMBING), ({'gaps': 1.0}, STRIDING), ({}, LEAST)])
def test_on_rough_ground_and_over_gaps_only_who_falls_is_cautious(felt: dict[str, float],
                                                                  share: float) -> None:
    for margin, least in ((0.01, share), (-0.05, LEAST)):
        run = walking(speed=SPEED)
        body = told(run)
        body.margins, body.progress = (1.0, margin, 1.0, 1.0), Progress((SPEED, 0.0), **felt)
        run.go(1.0)
        assert run.loop.stop.share == least
        assert (run.loop.stop.quickness > 1.0) == (not felt.get('rough') or margin < 0.0)


@pytest.mark.parametrize('share', [0.0, 0.4, 1.0])
def test_the_reference_follows_that_share_of_the_command(share: float) -> None:
    run = walking(speed=SPEED)
    body = told(run)
    body.margins = narrow(run, share)
    run.go(3.0)
    assert run.loop.r[0] == pytest.approx(max(LEAST, share) * SPEED, rel=1e-2)
    assert run.loop.stop.state == 'walking'
    body.margins = WIDE
    run.go(3.0)
    assert run.loop.r[0] == pytest.approx(SPEED, rel=1e-2)


def test_without_caution_it_is_the_command_whatever_the_margins() -> None:
    run = walking(speed=SPEED, inhibition=InhibitionParameters(caution=False))
    told(run).margins = narrow(run, 0.0)
    run.go(2.0)
    assert run.loop.r[0] == pytest.approx(SPEED, rel=1e-2)


@pytest.mark.parametrize('share', [0.0, 0.5])
def test_what_a_disturbed_robot_promises_it_keeps(share: float) -> None:
    """Of a stop, and of a start: the body's margins decide nothing of them."""
    run = walking(speed=SPEED, inhibition=InhibitionParameters(push_recovery=False))
    told(run).margins = narrow(run, share)
    run.go(0.3)
    bound, predicted = run.loop.time_to_rest(), run.loop.request(True)
    run.until('at_rest')
    assert run.loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)
    assert predicted <= bound
    predicted = run.loop.request(False)
    run.until('walking', 'free')
    assert run.loop.stop.measured_s == pytest.approx(predicted, abs=1e-9)
