# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of stopping by vote: how votes are counted, and what makes the legs vote.

A weight α_i is a fraction of ``inhibition_gain``: the vote of leg i acts on its own oscillator
with the gain k_inh α_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from dmp_cpg_ros.core.parameters import Parameters, parameter

SUM, WINNER_TAKE_ALL = 'sum', 'winner_take_all'
"""Rules by which votes become inhibition."""

_weight = partial(parameter, minimum=0.0, maximum=10.0)
_share = partial(parameter, minimum=0.0, maximum=1.0)


@dataclass(frozen=True)
class VotingSwitch(Parameters):
    """Whether there is voting; the robot must know who reads its sensors."""

    voting: bool = parameter(
        False, 'whether legs, sensors and other nodes can stop the gait by their votes')


@dataclass(frozen=True)
class VotingParameters(VotingSwitch):
    """How votes are counted; the certificate depends on these."""

    vote_rule: str = parameter(
        SUM, 'whether every vote acts on its own oscillator, or only the largest vote acts',
        choices=(SUM, WINNER_TAKE_ALL))
    vote_majority: int = parameter(
        3, 'number of voting legs that stops the gait; one leg fewer does not', 1, 4)
    vote_limit: float = _weight(
        0.0, 'largest weight of one leg, as a fraction of inhibition_gain; 0: computed such that '
        'vote_majority legs are needed')
    vote_fade: float = parameter(
        1.0, 'time over which a vote that is not renewed fades to zero', 0.01, 60.0, unit='s')
    vote_resume: bool = parameter(
        False, 'whether a stop by votes ends by itself when the votes have faded; else the '
        'service resumes')

    @property
    def majority(self) -> int:
        """Number of legs that stop the gait: one alone where the winner takes all."""
        return 1 if self.vote_rule == WINNER_TAKE_ALL else self.vote_majority


@dataclass(frozen=True)
class VoteSourceParameters(Parameters):
    """What makes the legs vote; a weight of zero silences a source."""

    footing_weight: float = _weight(1.0, 'weight of a leg that has lost its footing in stance')
    footing_load: float = _share(
        0.02, 'load below which a standing foot has no footing, as a fraction of the weight')
    footing_share: float = _share(
        0.5, 'fraction of a stance without footing after which the leg votes')
    collision_weight: float = _weight(1.0, 'weight of a leg that hits something in its swing')
    collision_load: float = _weight(
        0.3, 'load above which a swinging foot has hit something, as a fraction of the weight')
    collision_time: float = parameter(
        0.03, 'time of such a load after which the leg votes', 0.0, 10.0, unit='s')
    judged_share: float = _share(
        0.7, 'central fraction of stance and swing in which contact is evaluated')
    judged_after: float = parameter(
        1.0, 'time of walking after which contact is evaluated', 0.0, 60.0, unit='s')
    tilt_weight: float = _weight(1.0, 'weight with which every leg votes when the body tilts')
    tilt_limit: float = parameter(
        0.6, "angle between the vertical and the body's z axis beyond which all legs vote", 0.01,
        3.1, unit='rad')
    silence_weight: float = _weight(
        1.0, 'weight of a leg without contact sensor, and of every leg without imu')
    silence_time: float = parameter(
        0.5, 'time without a valid value after which a sensor counts as dead', 0.02, 60.0,
        unit='s')
