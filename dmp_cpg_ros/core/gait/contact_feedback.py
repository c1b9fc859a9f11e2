# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Touchdown and phase: a foot that lands early advances the phase, one that is late holds it back.

Oscillators that are reset or held at touchdown carry the timing of the body into the rhythm (Aoi &
Tsuchiya 2006: the phase is reset at touchdown; Righetti & Ijspeert 2008: the transition to stance
waits for contact, and contact speeds it up; Owaki et al. 2013: the load itself is fed back). Here
the feedback must not cost the certificate, so it is neither a jump nor a stop but an offset of the
legs' frequencies, bounded by what the certificate leaves free:

    ω_i = ω + c + d_i,    |d_i| ≤ δ̄,    (1 − hold) ω ≤ ω_i ≤ max(ω, ω_max)

- c is common to all legs: what the legs ask for together. A frequency that all legs share does not
  pull them apart (it leaves x_i − x_j to the couplings), whatever it is and however it jumps.
- d_i is what is left of the leg's own request. δ̄ is a share of the margin for unequal frequencies
  (:func:`~dmp_cpg_ros.core.certificates.network.contact_margin`): within it phases, radii and
  distances stay inside what phase lock and capture assume, under every sequence of contacts.
- While a stop is requested, and after a release until the legs are certified to be in their
  places, there is no feedback: capture, rest and start, their bounds and their predictions are
  those without it. A stop begins with legs that are as far from their places as δ̄ allows, and one
  tick late. While a gait changes, which takes the frequencies up to their limits, there is none
  either.

For the theorems the contacts are a bounded input; nothing is assumed of the body that makes them.
The hierarchy of Theorem 4 holds for each given sequence of contacts.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import phase
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.transition import BlendedGait
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.sensor_readings import LARGEST_FORCE
from dmp_cpg_ros.core.robot_model.state import LEGS

PUNCTUAL = 0.02
"""Fraction of the cycle by which a touchdown may be early or late without any feedback: a foot
takes its load gradually."""

PATIENCE = 0.15
"""Fraction of the cycle for which a foot that is late is waited for."""


@dataclass(frozen=True)
class ContactLimits:
    """What feedback may do.

    Attributes
    ----------
    own : float
        δ̄: largest |d_i| [rad/s].
    omega_max : float
        Highest frequency that is certified [rad/s].
    after : float
        Time after a release from which it acts [s].
    """

    own: float
    omega_max: float
    after: float


@made_often
@dataclass(frozen=True)
class ContactState:
    """Memory of the feedback.

    Attributes
    ----------
    stands : ndarray (4,) of bool
        Which feet stand.
    released : float
        Time since the oscillators were released [s]; 0 while a stop is requested.
    """

    stands: NDArray[np.bool_]
    released: float


def contact_feedback(state: ContactState, force: Array, quarter: float,
                     limits: ContactLimits | None, network: GaitNetwork, x: Array, r: Array,
                     inhibition: Inhibition, dt: float) -> tuple[ContactState, Array]:
    """Frequency offsets of one tick from the contacts of the feet.

    Parameters
    ----------
    state : ContactState
        State one tick before.
    force : ndarray (4,)
        Normal force of each foot now [N]; a foot without a number gives no feedback.
    quarter : float
        Force on each foot of the standing robot [N].
    limits : ContactLimits or None
        What feedback may do; None, before a certificate says so: nothing.
    network : GaitNetwork
        Oscillators with the gait and the parameters that act.
    x : ndarray (4, 2)
        Canonical states before the step that the feedback will act on.
    r : ndarray (3,)
        Reference of the step.
    inhibition : Inhibition
        That acts during the step.
    dt : float
        Time since the last tick [s].

    Returns
    -------
    state : ContactState
    feedback : ndarray (4,)
        Added to ω of each leg [rad/s].
    """
    free = not (inhibition.requested or np.any(inhibition.gains))
    released = state.released + dt if free else 0.0
    state = ContactState(standing(state.stands, force, quarter), released)
    changing = isinstance(network.gait, BlendedGait)
    if limits is None or changing or not (free and released > limits.after):
        return state, np.zeros(len(LEGS))
    p, gait, scale = network.parameters, network.gait, network.scale
    omega = network.omega(r)
    duty = gait.duty(scale.foot_speed(float(r[0]), float(r[1]), float(r[2])), scale)
    error = touchdown_error(gait.cycle_position(phase(x)), duty, state.stands)
    wanted = 2.0 * pi * p.contact_gain * np.where(np.isfinite(force), error, 0.0)
    fastest = max(0.0, limits.omega_max - omega)
    return state, bounded(wanted, limits.own, -p.contact_hold * omega, fastest)


def initial_contact_state() -> ContactState:
    """State of a robot that stands."""
    return ContactState(np.ones(len(LEGS), dtype=bool), 0.0)


def bounded(wanted: Array, own: float, slowest: float, fastest: float) -> Array:
    """Split what the legs want into c and d_i, and bound both.

    Parameters
    ----------
    wanted : ndarray (n,)
        Offset that each leg asks for [rad/s].
    own : float
        δ̄ ≥ 0 [rad/s].
    slowest, fastest : float
        Bounds of every offset, around zero [rad/s].

    Returns
    -------
    ndarray (n,)
        Offsets within δ̄ of a common one.
    """
    common = min(max(float(wanted.sum()), slowest), fastest)
    return np.clip(common + np.clip(wanted - wanted.mean(), -own, own), slowest, fastest)


def touchdown_error(cycle_position: Array, duty: float, stands: NDArray[np.bool_]) -> Array:
    """How far each leg is ahead of its phase, as its foot tells.

    Parameters
    ----------
    cycle_position : ndarray (n,)
        0 at mid-swing, in [−1/2, 1/2).
    duty : float
        Duty factor β: touchdown is planned at (1 − β)/2.
    stands : ndarray (n,) of bool
        Which feet stand.

    Returns
    -------
    ndarray (n,)
        Positive for a foot that stands before its touchdown, in the second half of its swing;
        negative for one that hangs after it [cycles].
    """
    late = cycle_position - 0.5 * (1.0 - duty)
    early = stands & (cycle_position > 0.0) & (late < -PUNCTUAL)
    waiting = ~stands & (late > PUNCTUAL) & (late < PATIENCE)
    return np.where(early, -late - PUNCTUAL, 0.0) - np.where(waiting, late - PUNCTUAL, 0.0)


LOADED, UNLOADED = 0.25, 0.1
"""Share of a quarter of the weight above which a foot has touched down, and below which it has
left the ground. In a trot a standing foot bears two of these quarters."""


def quarter_weight(description: RobotDescription) -> float:
    """Force on each foot of a robot that stands evenly [N]."""
    return description.mass * GRAVITY / len(LEGS)


def believed(force: Array) -> list[float]:
    """Forces (n,) [N], with 0 for those that no contact sensor can have measured, as numbers."""
    return [value if -LARGEST_FORCE <= value <= LARGEST_FORCE else 0.0 for value in force.tolist()]


def standing(before: NDArray[np.bool_], force: Array, quarter: float) -> NDArray[np.bool_]:
    """Which feet stand.

    Parameters
    ----------
    before : ndarray (n,) of bool
        Which stood at the last tick.
    force : ndarray (n,)
        Normal forces [N]; where one is not a number, the foot counts as it did before.
    quarter : float
        As from :func:`quarter_weight` [N].

    Returns
    -------
    ndarray (n,) of bool
    """
    return (force > LOADED * quarter) | (before & ~(force < UNLOADED * quarter))
