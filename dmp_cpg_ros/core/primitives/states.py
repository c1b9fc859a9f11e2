# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""States and inputs of primitives: what a step takes and returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DiscreteInput:
    """What may change while the movement runs; held during a step.

    Attributes
    ----------
    goal : ndarray (n,)
        External goal g_ext.
    tau : float
        Commanded τ_ext > 0; 2 makes the movement twice as slow.
    """

    goal: Array
    tau: float = 1.0


@dataclass(frozen=True, eq=False)
class DiscreteState:
    """State of reference, canonical and transformation system.

    Attributes
    ----------
    position, velocity : ndarray (n,)
        y and ẏ, in the demonstration's unit and per second.
    x : float
        Phase, 1 at the start, falling to 0.
    goal : ndarray (n,)
        Filtered goal g.
    tau : float
        Filtered τ.
    """

    position: Array
    velocity: Array
    x: float
    goal: Array
    tau: float


@dataclass(frozen=True, eq=False)
class RhythmicInput:
    """What may change while the movement runs; held during a step.

    Attributes
    ----------
    centre : ndarray (n,)
        External centre of the oscillation g_ext.
    amplitude : float
        External amplitude r_ext > 0; 1 is the demonstration's.
    tau : float
        Commanded τ_ext > 0; 2 makes the movement twice as slow.
    """

    centre: Array
    amplitude: float = 1.0
    tau: float = 1.0


@dataclass(frozen=True, eq=False)
class RhythmicState:
    """State of reference, canonical and transformation system.

    Attributes
    ----------
    position, velocity : ndarray (n,)
        y and ẏ.
    x : ndarray (2,)
        State of the oscillator.
    centre : ndarray (n,)
        Filtered centre g.
    amplitude, tau : float
        Filtered r and τ.
    """

    position: Array
    velocity: Array
    x: Array
    centre: Array
    amplitude: float
    tau: float
