# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Margins of the capture point, compared with pendulums that brake as hard as they can."""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dmp_cpg_ros.core.balance.capture_point import EDGES, support_margins

G = 9.81
FRONT, RIGHT, REAR, LEFT = range(len(EDGES))


def feet_at(length: float, width: float) -> list[tuple[float, float, float]]:
    return [(x, y, -0.3) for x in (length, -length) for y in (width, -width)]


def comes_to_rest(distance: float, speed: float, height: float, friction: float) -> bool:
    """Whether a pendulum stops before its centre of pressure, which an edge at a distance and the
    friction cone hold back, lets it over the edge.
    """
    c, v, dt = 0.0, speed, 1e-4
    while v > 0.0 and c < distance:
        p = min(distance, c + friction * height)
        v += dt * G / height * (c - p)
        c += dt * v
    return v <= 0.0


@given(st.floats(0.05, 0.5), st.floats(0.15, 0.6), st.floats(0.2, 1.0))
def test_the_margin_is_what_a_pendulum_can_bear(
        distance: float, height: float, friction: float) -> None:
    still = support_margins(feet_at(distance, 9.0), (0.0, 0.0), (0.0, 0.0), height, friction, 9.0)
    fastest = still[FRONT] * sqrt(G / height)
    assert comes_to_rest(distance, 0.98 * fastest, height, friction)
    assert not comes_to_rest(distance, 1.02 * fastest, height, friction)


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(0.0, 6.3))
def test_margins_turn_with_everything(v_x: float, v_y: float, angle: float) -> None:
    R = np.array(((cos(angle), -sin(angle)), (sin(angle), cos(angle))))
    feet, under, velocity = feet_at(0.2, 0.11), np.array((0.02, 0.01)), np.array((v_x, v_y))
    turned = [(*(R @ foot[:2]), foot[2]) for foot in feet]
    np.testing.assert_allclose(
        support_margins(turned, tuple(R @ under), tuple(R @ velocity), 0.27, 0.45, 0.3),
        support_margins(feet, tuple(under), tuple(velocity), 0.27, 0.45, 0.3), atol=1e-9)


def test_a_velocity_takes_from_the_edge_that_it_leads_to() -> None:
    feet = feet_at(0.2, 0.11)
    still = support_margins(feet, (0.0, 0.0), (0.0, 0.0), 0.27, 0.45, 0.3)
    right = support_margins(feet, (0.0, 0.0), (0.0, -0.6), 0.27, 0.45, 0.3)
    assert right[RIGHT] < still[RIGHT] and right[LEFT] > still[LEFT]
    assert right[FRONT] == still[FRONT] and right[REAR] == still[REAR]
    assert max(support_margins(feet, (0.0, 0.0), (0.0, 0.0), 0.27, 0.45, 0.05)) == 0.05
