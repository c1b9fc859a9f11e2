# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An error-state Kalman filter for attitude and velocity of a legged body.

Bloesch, Gehring, Fankhauser, Hutter, Hoepflinger, Siegwart: "State estimation for legged robots on
unstable and slippery terrain" (IROS 2013): the IMU predicts, and each standing foot measures the
velocity of the body; no foothold is a state, so a foot that slides spoils nothing for longer than
it slides. With the attitude R (base in the world), the velocity v in the base, the biases b_ω, b_f
of gyroscope and accelerometer and the readings ω̃, f̃,

    Ṙ = R (ω̃ − b_ω)^× ,    v̇ = f̃ − b_f + Rᵀ g − (ω̃ − b_ω) × v ,    ḃ_ω = ḃ_f = noise .

Error state δ = (φ, δv, δb_ω, δb_f) with R_true = R exp(φ^×). Roll, pitch, velocity and the biases
are observable; yaw and position are not, whatever the sensors of this kind (Bloesch et al. 2013,
"Consistent fusion of leg kinematics and IMU", RSS), so yaw drifts with what is left of b_ω.
A foot that does not agree with the prediction is weighted down as under Student's t distribution
(Roth, Özkan, Gustafsson 2013; one iteration): by (ν + 3)/(ν + d²), with d² the squares of its
innovations over their variances.

All feet measure the same three numbers, each with a noise of its own that has no direction. In
the information form of the update they therefore add up to a single measurement: the mean of the
feet's, weighted by the inverse variances w_i, with the variance 1/Σ w_i. A correction costs one
inverse (3, 3), however many feet stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.core.maths import Array, vec3
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import made_often, replace_unchecked
from dmp_cpg_ros.core.maths.rotations import Quaternion, turned
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, cross, minus, moved, plus, triple

TILT, VELOCITY, GYRO_BIAS, ACCELEROMETER_BIAS = (slice(3 * i, 3 * i + 3) for i in range(4))
"""Places in the error state."""

_IDENTITY = np.eye(12)


def _places(rows: slice, columns: slice, diagonal: bool) -> tuple[int, ...]:
    """Places of a block's diagonal, or of all else in it, in a matrix (12, 12) read by rows."""
    return tuple(12 * (rows.start + i) + columns.start + j
                 for i in range(3) for j in range(3) if (i == j) == diagonal)


_TRANSITION = np.array((
    *_places(TILT, TILT, False), *_places(VELOCITY, VELOCITY, False),
    *_places(VELOCITY, TILT, False), *_places(VELOCITY, GYRO_BIAS, False),
    *_places(TILT, GYRO_BIAS, True), *_places(VELOCITY, ACCELEROMETER_BIAS, True)))
"""Places in the transition's matrix of what is neither 0 nor 1, block by block."""


@made_often
@dataclass(frozen=True)
class FilterState:
    """State of the filter.

    Attributes
    ----------
    quaternion : tuple of four floats
        Orientation of the base in the world, x, y, z, w.
    velocity_in_base : tuple of float
        [m/s]
    gyro_bias, accelerometer_bias : tuple of float
        [rad/s], [m/s²]
    covariance : ndarray (12, 12)
        Of the error state.
    """

    quaternion: Quaternion
    velocity_in_base: Triple
    gyro_bias: Triple
    accelerometer_bias: Triple
    covariance: Array


def transition(velocity: Triple, up_in_base: Triple, rate: Triple, dt: float) -> Array:
    """Jacobian F of one prediction with respect to the error state.

    Parameters
    ----------
    velocity : tuple of float
        Of the state before, in the base [m/s].
    up_in_base : tuple of float
        Its vertical, seen in the base.
    rate : tuple of float
        ω̃ − b_ω [rad/s].
    dt : float
        [s]

    Returns
    -------
    ndarray (12, 12)
        I + A dt.
    """
    F, turning = _IDENTITY.copy(), _skew(rate, -dt)
    gravity, transport = _skew(up_in_base, -GRAVITY * dt), _skew(velocity, -dt)
    F.put(_TRANSITION, (*turning, *turning, *gravity, *transport, *[-dt] * 6))
    return F


def _skew(v: Triple, scale: float) -> tuple[float, ...]:
    """Off-diagonal entries, by rows, of the matrix of the cross product with v times a scale."""
    x, y, z = v[0] * scale, v[1] * scale, v[2] * scale
    return -z, y, z, -x, -y, x


def predict(state: FilterState, rate: Triple, specific_force: Triple, dt: float,
            noise: EstimationParameters, guessed: bool = False) -> FilterState:
    """Predict by the IMU's readings.

    Parameters
    ----------
    state : FilterState
        State before.
    rate, specific_force : tuple of float
        ω̃ [rad/s] and f̃ [m/s²], means over the interval.
    dt : float
        Length of the interval [s].
    noise : EstimationParameters
        What the filter believes of its sensors.
    guessed : bool
        Whether the readings are guesses of a body that does not accelerate: what it does all the
        same comes from no error of the vertical or of a bias.

    Returns
    -------
    FilterState
    """
    up, v = vec3.upward(state.quaternion), state.velocity_in_base
    turning = minus(rate, state.gyro_bias)
    force = minus(specific_force, state.accelerometer_bias)
    turn = (turning[0] * dt, turning[1] * dt, turning[2] * dt)
    # in the base half-way, as the mean force is
    tilted, fallen = cross(turn, up), GRAVITY * dt
    change = (force[0] * dt - fallen * (up[0] - 0.5 * tilted[0]),
              force[1] * dt - fallen * (up[1] - 0.5 * tilted[1]),
              force[2] * dt - fallen * (up[2] - 0.5 * tilted[2]))
    # The new velocity is seen from the new orientation.
    back, twice = cross(turn, moved(v, change, 0.5)), cross(turn, cross(turn, v))
    velocity = moved(minus(plus(v, change), back), twice, 0.5)
    F = _IDENTITY if guessed else transition(v, up, turning, dt)
    P = F.dot(state.covariance).dot(F.T)
    variances = P.ravel()[::13]
    variances += noise.spread * dt
    return FilterState(turned(state.quaternion, turn), velocity, state.gyro_bias,
                       state.accelerometer_bias, P)


def update(state: FilterState, rate: Triple, contact_in_base: Sequence[Triple],
           velocity_in_base: Sequence[Triple], trust: Sequence[float], noise: EstimationParameters
           ) -> tuple[FilterState, tuple[float, ...]]:
    """Correct by the velocities that standing feet measure.

    A foot measures v + (ω̃ − b_ω) × r, of which the derivative with respect to b_ω is left out on
    purpose: feet that pivot under load measure a turn rate that is off by about one part in a
    hundred, which is no bias. (The biases of roll and pitch are still seen, through gravity; that
    of yaw is seen in standing, :func:`settle`.)

    Parameters
    ----------
    state : FilterState
        Predicted state.
    rate : tuple of float
        ω̃ at the time of the state [rad/s].
    contact_in_base, velocity_in_base : sequence of n tuples of float
        Contact points r [m] and measured v + ω × r [m/s] of the feet.
    trust : sequence of n floats
        In [0, 1]: the deviation of a foot is ``foot_noise / trust``; one of no trust measures
        nothing.
    noise : EstimationParameters
        What the filter believes of its sensors.

    Returns
    -------
    state : FilterState
    distance_squared : tuple of n floats
        Of the feet before their weights; 0 for those without trust.
    """
    P = state.covariance
    predicted = P[VELOCITY, VELOCITY].tolist()
    spread_x, spread_y, spread_z = predicted[0][0], predicted[1][1], predicted[2][2]
    turning, v, nu = minus(rate, state.gyro_bias), state.velocity_in_base, noise.foot_freedom
    total = pull_x = pull_y = pull_z = 0.0
    distances = []
    for i, share in enumerate(trust):
        if share <= 0.0:
            distances.append(0.0)
            continue
        x, y, z = minus(minus(velocity_in_base[i], v), cross(turning, contact_in_base[i]))
        variance = (noise.foot_noise / share) ** 2
        distance = (x * x / (spread_x + variance) + y * y / (spread_y + variance)
                    + z * z / (spread_z + variance))
        distances.append(distance)
        weight = 1.0 / (variance * max((nu + distance) / (nu + 3.0), 1.0))
        total += weight
        pull_x, pull_y, pull_z = pull_x + x * weight, pull_y + y * weight, pull_z + z * weight
    if total == 0.0:
        return state, tuple(distances)
    HP = P[VELOCITY]
    KT = np.array(vec3.inverse(_with_diagonal(predicted, 1.0 / total))).dot(HP)  # (3, 12)
    error = np.array((pull_x / total, pull_y / total, pull_z / total)).dot(KT).tolist()
    P = P - HP.T.dot(KT)
    return FilterState(
        turned(state.quaternion, error[TILT]), plus(state.velocity_in_base, error[VELOCITY]),
        plus(state.gyro_bias, error[GYRO_BIAS]),
        plus(state.accelerometer_bias, error[ACCELEROMETER_BIAS]), 0.5 * (P + P.T)
    ), tuple(distances)


def settle(state: FilterState, rate: Triple, deviation: float) -> FilterState:
    """Correct the gyroscope's bias by the knowledge that the body does not turn.

    Nothing else is corrected (Schmidt's consider filter): what yaw should have been all the while
    that the bias was not known is not to be guessed from how a robot sways that has just stopped.

    Parameters
    ----------
    state : FilterState
        State of a robot that stands still.
    rate : tuple of float
        ω̃, which is the bias then [rad/s].
    deviation : float
        Of the turn rate of a robot that stands still [rad/s].

    Returns
    -------
    FilterState
    """
    P = state.covariance.copy()
    rows = P[GYRO_BIAS]
    S = _with_diagonal(rows[:, GYRO_BIAS].tolist(), deviation * deviation)
    left = np.array(vec3.inverse(S)) * (deviation * deviation)  # I − K = I − P S⁻¹ = (S − P) S⁻¹
    after = left.dot(rows)
    P[GYRO_BIAS] = after
    P[:, GYRO_BIAS] = after.T
    off = triple(left.dot(np.subtract(rate, state.gyro_bias)).tolist())
    return replace_unchecked(state, gyro_bias=minus(rate, off), covariance=0.5 * (P + P.T))


def _with_diagonal(M: list[list[float]], more: float) -> Matrix:
    """A matrix (3, 3) with a number added to its diagonal."""
    (a, b, c), (d, e, f), (g, h, i) = M
    return (a + more, b, c), (d, e + more, f), (g, h, i + more)
