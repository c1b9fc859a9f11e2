# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Legs vote by what their feet feel: no load in stance, a load in swing.

Planned and real touchdown differ by a few hundredths of a cycle on any ground, and by more on
rough ground, so that only the central share of stance and swing is judged, and nothing until the
gait has run for a while.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.voting_parameters import VoteSourceParameters
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
Mask = NDArray[np.bool_]

NEVER = -1
"""Stamp of what is not the case."""


@dataclass(frozen=True)
class ContactState:
    """Since when the feet feel what they should not.

    Attributes
    ----------
    lost_ns : ndarray (4,) of int
        Stamp since which a standing foot bears nothing [ns]; −1 while it does.
    hit_ns : ndarray (4,) of int
        Stamp since which a swinging foot bears something [ns]; −1 while it does not.
    walking_ns : int
        Stamp since which the gait runs [ns]; −1 while it does not.
    """

    lost_ns: Stamps
    hit_ns: Stamps
    walking_ns: int = NEVER

    @classmethod
    def initial(cls) -> ContactState:
        """Nothing felt yet."""
        return cls(np.full(len(LEGS), NEVER), np.full(len(LEGS), NEVER))


def judge_contact(
    state: ContactState,
    parameters: VoteSourceParameters,
    time_ns: int,
    walking: bool,
    position: Array,
    duty: float,
    omega: float,
    load: Array,
) -> tuple[ContactState, Mask, Mask]:
    """Compare what the feet feel with where their legs are in the cycle.

    Parameters
    ----------
    state : ContactState
        Before this tick.
    parameters : VoteSourceParameters
        Loads, times, shares.
    time_ns : int
        Stamp of this tick [ns].
    walking : bool
        Whether the gait runs, its legs in their places and swinging.
    position : ndarray (4,)
        Cycle positions, 0 at mid-swing, in [−1/2, 1/2).
    duty : float
        Planned duty factor.
    omega : float
        Cadence [rad/s].
    load : ndarray (4,)
        Normal force as a fraction of the weight; NaN where it is not known.

    Returns
    -------
    state : ContactState
    lost, hit : ndarray (4,) of bool
        Legs that have had no footing in stance, or a load in swing, for long enough.
    """
    p = parameters
    walking_ns = (time_ns if state.walking_ns == NEVER else state.walking_ns) if walking else NEVER
    judged = walking and time_ns - walking_ns >= round(p.judged_after * 1e9)
    from_swing = np.abs(position)
    standing = judged & (0.5 - from_swing < 0.5 * p.judged_share * duty)
    swinging = judged & (from_swing < 0.5 * p.judged_share * (1.0 - duty))
    lost = _since(state.lost_ns, standing & (load < p.footing_load), time_ns)
    hit = _since(state.hit_ns, swinging & (load > p.collision_load), time_ns)
    stance_ns = 2e9 * pi * duty / omega
    return (
        ContactState(lost, hit, walking_ns),
        (lost != NEVER) & (time_ns - lost >= p.footing_share * stance_ns),
        (hit != NEVER) & (time_ns - hit >= round(p.collision_time * 1e9)),
    )


def _since(before: Stamps, now: Mask, time_ns: int) -> Stamps:
    """Stamps since which something is the case."""
    return np.where(now, np.where(before == NEVER, time_ns, before), NEVER)
