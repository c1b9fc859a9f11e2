# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The result of counting votes: which inhibition they are, and whether it stops the gait."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.voting_parameters import SUM
from dmp_cpg_ros.core.robot_model.state import LEGS

Array = NDArray[np.float64]


def _nothing() -> Array:
    return np.zeros(len(LEGS))


@dataclass(frozen=True)
class Ballot:
    """Votes at one tick.

    Attributes
    ----------
    weights : ndarray (4,)
        Clamped weights α_i of the legs.
    gains : ndarray (4,)
        Gains k_inh α_i that they make act [1/s]; the largest alone where the winner takes all.
    stops : bool
        Whether these gains overcome the threshold.
    causes : tuple of str
        What each leg's vote comes from; empty without a vote.
    """

    weights: Array = field(default_factory=_nothing)
    gains: Array = field(default_factory=_nothing)
    stops: bool = False
    causes: tuple[str, ...] = ('',) * len(LEGS)

    @property
    def alive(self) -> bool:
        """Whether any leg votes."""
        return bool(self.weights.any())

    @property
    def cause(self) -> str:
        """Who votes and why, such as ``fl footing, rr footing+user``; ``none`` without votes."""
        told = [f'{leg} {cause}' for leg, cause in zip(LEGS, self.causes, strict=True) if cause]
        return ', '.join(told) or 'none'


NO_VOTES = Ballot()
"""Nobody votes."""


def acting_gains(weights: Array, inhibition_gain: float, rule: str) -> Array:
    """Gains that the weights make act.

    Parameters
    ----------
    weights : ndarray (N,)
        Clamped weights α_i.
    inhibition_gain : float
        k_inh [1/s].
    rule : str
        ``sum``: every leg's vote acts on its own oscillator. ``winner_take_all``: the largest
        alone gets its gain, the first of equal ones (the stable state of a winner-take-all
        network; Rutishauser, Douglas and Slotine 2010).

    Returns
    -------
    ndarray (N,)
        [1/s]
    """
    gains: Array = inhibition_gain * weights
    if rule == SUM:
        return gains
    return np.where(np.arange(len(gains)) == np.argmax(gains), gains, 0.0)
