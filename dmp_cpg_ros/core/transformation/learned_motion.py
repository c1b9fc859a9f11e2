# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feet that play a rhythmic primitive, and the demonstrations from which it is learned.

A demonstration is reduced to numbers that know neither robot nor speed nor gait. With c a leg's
position in its cycle (0 at mid-swing) and β the duty factor, the phase ψ is c stretched so that
swing and stance take half a turn each. Three functions of ψ describe one foot:

- ``stride``: y = u − ψ/2π, where u tells how far the foot has stepped over the ground, −1/2 before
  and 1/2 after the swing, as a fraction of the way that the body makes in a cycle; constant in
  stance, so that y is smooth for every duty factor,
- ``side``: departure sideways, as a fraction of the standing height,
- ``lift``: height over the ground, as a fraction of the standing height.

Played, the foot is where a standing foot of the present reference would be (c − u) cycles after
mid-stance: stance is exact at every speed and in every curve, and the step grows with v/ω. The
clock of the primitive is ψ itself, s = ψ/ω: a stopped phase stops the foot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.core.primitives.rhythmic import RhythmicInput, RhythmicPrimitive, RhythmicState
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.foot_path import FootPath

MOTION_NAMES = tuple(f'{leg}_{part}' for leg in LEGS for part in ('stride', 'side', 'lift'))
"""Names of a motion's degrees of freedom, in order."""

LARGEST = (0.75, 0.5, 0.6)
"""Largest stride (in cycles), side and lift (in standing heights) of a foot that can walk."""

LEAST_LIFT = 0.01
"""Least height of a swing, as a fraction of the standing height."""

JUMP = 0.5
"""Change of the phase in one tick that is no motion: the foot begins anew there [rad]."""

PHASE_STEP = 2.0 * pi / 4096
"""The primitive goes on by multiples of this phase, so that the propagators of its spring are few
[rad].
"""

_NODES = np.array((0.0, 0.5, 1.0))


@dataclass(frozen=True, eq=False)
class PlayedFoot:
    """State of one foot.

    Attributes
    ----------
    psi : float
        Phase ψ to which the primitive has come [rad].
    primitive : RhythmicState
        Velocities are per s.
    """

    psi: float
    primitive: RhythmicState


class LearnedMotion:
    """A rhythmic primitive for all feet.

    Parameters
    ----------
    primitive : RhythmicPrimitive
        With the degrees of freedom ``MOTION_NAMES``.

    Attributes
    ----------
    clearance : float
        Height of the highest swing as a fraction of the standing height.

    Raises
    ------
    DataError
        If it has other degrees of freedom, or no robot could walk with it.
    """

    def __init__(self, primitive: RhythmicPrimitive) -> None:
        """Check."""
        if primitive.names != MOTION_NAMES:
            raise DataError(
                f'a motion has the degrees of freedom {", ".join(MOTION_NAMES)}, not '
                f'{", ".join(primitive.names) or "nameless ones"}')
        cycle = primitive.centre + primitive.on_cycle(np.linspace(-pi, pi, 200))[0]
        for name, column, most in zip(MOTION_NAMES, cycle.T, LARGEST * len(LEGS), strict=True):
            if not np.abs(column).max() <= most:
                raise DataError(f'{name} exceeds {most:g}; no foot can walk so')
        lifts = cycle[:, 2::3].max(axis=0)
        if lifts.min() < LEAST_LIFT:
            raise DataError(f'{LEGS[int(lifts.argmin())]}_lift never rises above '
                            f'{lifts.min():.3g}; a foot that swings needs {LEAST_LIFT:g}')
        self.primitive, self.clearance = primitive, float(lifts.max())

    def of_leg(self, leg: str, description: RobotDescription) -> LearnedFoot:
        """Motion of one foot, scaled to a robot."""
        dofs = slice(3 * LEGS.index(leg), 3 * LEGS.index(leg) + 3)
        return LearnedFoot(self.primitive.part(dofs), self.clearance, description.stance_height)


class LearnedFoot:
    """One foot of a learned motion; state in, state out.

    Parameters
    ----------
    primitive : RhythmicPrimitive
        Stride, side and lift of this foot.
    clearance, stance_height : float
        Height of the motion's swing as a fraction of the standing height, and the latter [m].
        The swing is scaled to the height that the path asks.
    """

    def __init__(self, primitive: RhythmicPrimitive, clearance: float,
                 stance_height: float) -> None:
        """Keep."""
        self._primitive, self._height = primitive, stance_height
        self._full = clearance * stance_height
        self._held = RhythmicInput(primitive.centre)

    def step(self, state: PlayedFoot | None, path: FootPath, cycle_position: float, rate: float,
             dt: float) -> tuple[PlayedFoot, Triple, Triple]:
        """Foot at the present phase, as :meth:`FootMotion.step`."""
        psi, stretch = warped(cycle_position, path.duty)
        began, on = (psi, 0.0) if state is None else (
            state.psi, (psi - state.psi + pi) % (2.0 * pi) - pi)
        if state is None or abs(on) > JUMP:
            began, on, played = psi, 0.0, self._primitive.initial_state(psi)
        else:  # the primitive has no way back; a phase that recedes is at most a tremor
            steps, played = int(max(on, 0.0) / PHASE_STEP), state.primitive
            if steps:
                far = steps * PHASE_STEP
                nodes = state_at(began + far * _NODES)
                played = self._primitive.follow(
                    played, nodes, self._held, far / self._primitive.omega)
                began, on = began + far, on - far
        place = played.position.tolist()
        per_psi = [value / self._primitive.omega for value in played.velocity.tolist()]
        stride, side, lift = (p + max(on, 0.0) * v for p, v in zip(place, per_psi, strict=True))
        psi_rate = stretch * rate
        stride_rate, side_rate, lift_rate = (value * psi_rate for value in per_psi)
        cycle = 2.0 * pi / path.omega
        apart = cycle_position - stride - psi / (2.0 * pi)
        x, y, x_dot, y_dot = path.stance(apart * cycle)
        slower = (rate - psi_rate) / (2.0 * pi) - stride_rate
        active = path.clearance / self._full
        height = active * self._height
        return (
            PlayedFoot(began, played),
            (x, y + height * side, path.foothold_in_base[2] + height * lift),
            (x_dot * slower * cycle, y_dot * slower * cycle + height * side_rate,
             height * lift_rate))


def warped(cycle_position: float, duty: float) -> tuple[float, float]:
    """Phase ψ [rad] of a cycle position at a duty factor, and dψ/dφ."""
    swing = 0.5 * (1.0 - duty)
    if abs(cycle_position) < swing:
        return 0.5 * pi * cycle_position / swing, 0.25 / swing
    rest = pi * (0.5 - abs(cycle_position)) / duty
    return (pi - rest if cycle_position > 0.0 else rest - pi), 0.5 / duty


@dataclass(frozen=True, eq=False)
class FootSamples:
    """How one foot moved in a demonstration, while the robot walked steadily.

    Attributes
    ----------
    cycle_position, duty : ndarray (m,)
        c and β.
    cycle : ndarray (m,)
        Period of the gait [s].
    foot : ndarray (m, 3)
        From its foothold, in the base; z upwards instead, without the planned bounce of the body,
        from anywhere [m].
    """

    cycle_position: Array
    duty: Array
    cycle: Array
    foot: Array


def learn_motion(feet: Sequence[Sequence[FootSamples]], stance_height: float, bases: int = 25,
                 stiffness: float = 6400.0,
                 damping: float = 160.0) -> tuple[RhythmicPrimitive, Array]:
    """Learn one primitive for all feet.

    Parameters
    ----------
    feet : sequence (4,) of sequences of FootSamples
        For fl, fr, rl, rr: stretches of steady walking.
    stance_height : float
        Of the robot that walked [m].
    bases : int
        Number of basis functions.
    stiffness, damping : float
        k [1/s²] and b [1/s] of the primitive; those of the legs' joints without.

    Returns
    -------
    primitive : RhythmicPrimitive
        With the degrees of freedom ``MOTION_NAMES``.
    errors : ndarray (12,)
        Root mean square of what the primitive leaves, in the units of the names.

    Raises
    ------
    DataError
        If a foot hardly moves over the ground or its demonstration holds no whole cycles.
    """
    from dmp_cpg_ros.core.learning.rhythmic import learn_rhythmic

    period = float(np.median(np.concatenate([part.cycle for part in feet[0]])))
    made, errors = [], []
    for leg, stretches in zip(LEGS, feet, strict=True):
        recorded = [_normalised(leg, samples, stance_height) for samples in stretches]
        demonstrations = [Demonstration(psi * period / (2.0 * pi), values)
                          for psi, values in recorded]
        centre = np.vstack([values for _, values in recorded]).mean(axis=0)
        made.append(learn_rhythmic(
            demonstrations, bases, period=period, leads=[float(psi[0]) for psi, _ in recorded],
            centres=[centre] * len(recorded), stiffness=stiffness, damping=damping))
        left = [centre + made[-1].on_cycle(psi)[0] - values for psi, values in recorded]
        errors.append(np.sqrt(np.mean(np.vstack(left) ** 2, axis=0)))
    return RhythmicPrimitive.joined(made, MOTION_NAMES), np.concatenate(errors)


def _normalised(leg: str, samples: FootSamples, stance_height: float) -> tuple[Array, Array]:
    """Increasing phases ψ (m,), and stride, side and lift (m, 3)."""
    c, duty = samples.cycle_position, samples.duty
    psi = np.unwrap([warped(*at)[0] for at in zip(c.tolist(), duty.tolist(), strict=True)])
    keep = np.append(True, np.diff(np.maximum.accumulate(psi)) > 1e-9)
    if (cycles := (psi[-1] - psi[0]) / (2.0 * pi)) < 2.0:
        raise DataError(f'{leg} walks {cycles:.2g} cycles steadily; two are needed')
    standing = np.abs(c) >= 0.5 * (1.0 - duty)
    since = (c - np.copysign(0.5, c)) * samples.cycle  # time after mid-stance [s]
    line = np.stack([np.ones(len(c)), since], axis=1)
    (middle, velocity), *_ = np.linalg.lstsq(line[standing], samples.foot[standing], rcond=None)
    speed = float(np.hypot(*velocity[:2]))
    if not speed > 0.05:
        raise DataError(f'{leg} moves at {speed:.2g} m/s; a robot walks, at 0.05 m/s or more')
    away, direction = samples.foot - middle, velocity[:2] / speed
    time = away[:, :2] @ direction / speed  # of a standing foot that would be there [s]
    stride = c - time / samples.cycle - psi / (2.0 * pi)
    side = (away[:, 1] - (away[:, :2] @ direction) * direction[1]) / stance_height
    values = np.stack([stride - np.round(stride), side, away[:, 2] / stance_height], axis=1)
    return psi[keep], values[keep]
