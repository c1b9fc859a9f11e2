# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A push against a stop: when it releases the gait, so that the feet are placed, and when the stop
is taken up again.

The measure is the least margin of the capture point in the support polygon
(:mod:`~dmp_cpg_ros.core.balance.capture_point`), in lengths of the leg.

- Below ``PUSHED`` for ``CERTAIN_NS`` standing legs will soon not bear it: the gait is released.
- Once it has started and the margin has been above ``CALM`` for ``CALM_CYCLES``, or after
  ``LONGEST_CYCLES``, the stop is taken up again.

It ends. One release lasts ``LONGEST_CYCLES`` at most and the stop after it is bounded; after
``MOST_RELEASES`` no other follows until the robot has been at rest with a margin above ``CALM``.
From there the margin falls below ``PUSHED`` only if somebody changes the body's speed by
(``CALM`` − ``PUSHED``) l ω₀ at least: at rest ξ does not move by itself inside of the polygon.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.canonical.phase import scalar_phase
from dmp_cpg_ros.core.clock import carried
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.maths import Array

PUSHED = 0.12
"""Margin below which a push releases the gait, in lengths of the leg: 0.02 for three standard
deviations of the estimated velocity, over ω₀, and what ξ moves in 25 ms of a push of 10 m/s²:
until it is certain and acts on the oscillators.
"""

CERTAIN_NS = 8_000_000
"""Time for which the margin must be below it, since no body gets its velocity in one tick [ns]."""

CALM = 0.2
"""Margin above which the body can come to rest on standing legs, in lengths of the leg."""

CALM_CYCLES = 2
"""Cycles for which it must be above: one brings the feet under the body, one more the body to rest
over them, so that they end where they stand widest.
"""

LONGEST_CYCLES = 10
"""Length of a release, in cycles of the gait on the spot."""

MOST_RELEASES = 5
"""Releases between two rests."""

_LEFT, _RIGHT = (0, 2), (1, 3)


class PushState(NamedTuple):
    """What a push has done to a stop.

    Attributes
    ----------
    acts : bool
        Whether the gait is released, although a stop is asked for.
    opposite : bool
        Whether the resting oscillators are turned by half a cycle for it.
    since_ns : int
        Stamp of the release [ns].
    low_ns, calm_ns : int
        Stamps since which the margin has been below ``PUSHED`` and above ``CALM`` [ns]; −1 while
        it is not.
    releases : int
        Releases since the last rest.
    """

    acts: bool = False
    opposite: bool = False
    since_ns: int = -1
    low_ns: int = -1
    calm_ns: int = -1
    releases: int = 0

    def carried(self, last_ns: int, now_ns: int) -> PushState:
        """The same on a clock that was set back, see :func:`~dmp_cpg_ros.core.clock.carried`."""
        since_ns, low_ns, calm_ns = (carried(stamp, last_ns, now_ns) for stamp in (
            self.since_ns, self.low_ns, self.calm_ns))
        return self._replace(since_ns=since_ns, low_ns=low_ns, calm_ns=calm_ns)


NO_PUSH = PushState()


def push_step(state: PushState, time_ns: int, word: str, network: GaitNetwork, x: Array,
              margins: Sequence[float] | None) -> PushState:
    """Advance by one tick of a stop that is in force.

    Parameters
    ----------
    state : PushState
        After the last tick; returned where nothing changes.
    time_ns : int
        Stamp [ns].
    word : str
        State of the supervisor after the last tick.
    network : GaitNetwork
        That acts.
    x : ndarray (4, 2)
        States.
    margins : sequence of four floats, or None
        To the front, right, rear and left edge of the support polygon [m], where they are known.
    """
    if margins is None:
        return state
    least = min(margins) / network.scale.leg_length
    if not state.acts:
        if least >= PUSHED:
            calm = word == 'at_rest' and least > CALM or not state.releases
            return NO_PUSH if calm else state._replace(low_ns=-1)
        if state.releases == MOST_RELEASES or state.low_ns < 0:
            return state._replace(low_ns=time_ns)
        if time_ns - state.low_ns < CERTAIN_NS:
            return state
        opposite = word == 'at_rest' and _better_half_a_cycle_later(network.gait, x, margins)
        return PushState(True, opposite, time_ns, releases=state.releases + 1)
    calm_ns = -1 if least <= CALM else time_ns if state.calm_ns < 0 else state.calm_ns
    cycle_ns = 2e9 * pi / network.omega(np.zeros(3))
    over = time_ns - state.since_ns >= LONGEST_CYCLES * cycle_ns or (
        word == 'stepping' and 0 <= calm_ns <= time_ns - CALM_CYCLES * cycle_ns)
    return state._replace(acts=not over, opposite=state.opposite and not over, calm_ns=calm_ns)


def _better_half_a_cycle_later(gait: GaitInForce, x: Array, margins: Sequence[float]) -> bool:
    """Whether both legs on the side to which the body falls would have swung earlier then."""
    _, right, _, left = margins
    waits = [-gait.scalar_cycle_position(scalar_phase(*x[leg].tolist()))
             for leg in (_RIGHT if right < left else _LEFT)]
    return max((wait + 0.5) % 1.0 for wait in waits) < max(wait % 1.0 for wait in waits) - 1e-3
