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
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.gait import GRAVITY
from dmp_cpg_ros.core.rotations import rotation_matrix, turned

Array = NDArray[np.float64]

TILT, VELOCITY, GYRO_BIAS, ACCELEROMETER_BIAS = (slice(3 * i, 3 * i + 3) for i in range(4))
"""Places in the error state."""

_STAYING, _DIAGONAL = np.eye(12), np.arange(3)


@dataclass(frozen=True)
class FilterNoise:
    """What the filter believes of its sensors.

    Attributes
    ----------
    gyro, accelerometer : float
        Noise densities [rad/s/√Hz], [m/s²/√Hz].
    gyro_walk, accelerometer_walk : float
        Random walks of the biases [rad/s²/√Hz], [m/s³/√Hz].
    foot : float
        Deviation of a standing foot's velocity [m/s].
    freedom : float
        Degrees of freedom ν of a foot's velocity.
    """

    gyro: float
    accelerometer: float
    gyro_walk: float
    accelerometer_walk: float
    foot: float
    freedom: float


@dataclass(frozen=True)
class FilterState:
    """State of the filter.

    Attributes
    ----------
    quaternion : ndarray (4,)
        Orientation of the base in the world, x, y, z, w.
    velocity_in_base : ndarray (3,)
        [m/s]
    gyro_bias, accelerometer_bias : ndarray (3,)
        [rad/s], [m/s²]
    covariance : ndarray (12, 12)
        Of the error state.
    """

    quaternion: Array
    velocity_in_base: Array
    gyro_bias: Array
    accelerometer_bias: Array
    covariance: Array


def transition(state: FilterState, R: Array, rate: Array, dt: float) -> Array:
    """Jacobian F of one prediction with respect to the error state.

    Parameters
    ----------
    state : FilterState
        State before.
    R : ndarray (3, 3)
        Its rotation.
    rate : ndarray (3,)
        ω̃ − b_ω [rad/s].
    dt : float
        [s]

    Returns
    -------
    ndarray (12, 12)
        I + A dt.
    """
    a, b, c = (rate * dt).tolist()
    d, e, f = (R[2] * (-GRAVITY * dt)).tolist()
    g, h, i = (state.velocity_in_base * -dt).tolist()
    F = _STAYING.copy()
    F[TILT, TILT] = F[VELOCITY, VELOCITY] = ((1.0, c, -b), (-c, 1.0, a), (b, -a, 1.0))
    F[VELOCITY, TILT] = ((0.0, -f, e), (f, 0.0, -d), (-e, d, 0.0))
    F[VELOCITY, GYRO_BIAS] = ((0.0, -i, h), (i, 0.0, -g), (-h, g, 0.0))
    F[_DIAGONAL, _DIAGONAL + 6] = F[_DIAGONAL + 3, _DIAGONAL + 9] = -dt
    return F


def predict(
    state: FilterState, rate: Array, specific_force: Array, dt: float, noise: FilterNoise
) -> FilterState:
    """Predict by the IMU's readings.

    Parameters
    ----------
    state : FilterState
        State before.
    rate, specific_force : ndarray (3,)
        ω̃ [rad/s] and f̃ [m/s²], means over the interval.
    dt : float
        Length of the interval [s].
    noise : FilterNoise
        Noise.

    Returns
    -------
    FilterState
    """
    R = rotation_matrix(state.quaternion)
    rate = rate - state.gyro_bias
    force = specific_force - state.accelerometer_bias
    v = state.velocity_in_base
    turn = rate * dt
    upward = R[2] - 0.5 * _cross(turn, R[2])  # in the base half-way, as the mean force is
    change = (force - GRAVITY * upward) * dt
    # The new velocity is seen from the new orientation.
    moved = v + change - _cross(turn, v + 0.5 * change) + 0.5 * _cross(turn, _cross(turn, v))
    F = transition(state, R, rate, dt)
    P = F @ state.covariance @ F.T
    P.ravel()[::13] += _spread(noise) * dt
    return FilterState(
        turned(state.quaternion, turn), moved, state.gyro_bias, state.accelerometer_bias, P
    )


def foot_jacobian(contact_in_base: Array) -> Array:
    """Jacobians H of v + (ω̃ − b_ω) × r with respect to the error state: (n, 3) → (n, 3, 12).

    The derivative with respect to b_ω is left out on purpose: feet that pivot under load measure
    a turn rate that is off by about one part in a hundred, which is no bias. (The biases of roll
    and pitch are still seen, through gravity; that of yaw is seen in standing, :func:`settle`.)
    """
    H = np.zeros((len(contact_in_base), 3, 12))
    H[:, (0, 1, 2), (3, 4, 5)] = 1.0
    return H


def update(
    state: FilterState,
    rate: Array,
    contact_in_base: Array,
    velocity_in_base: Array,
    trust: Array,
    noise: FilterNoise,
) -> tuple[FilterState, Array]:
    """Correct by the velocities that standing feet measure.

    Parameters
    ----------
    state : FilterState
        Predicted state.
    rate : ndarray (3,)
        ω̃ at the time of the state [rad/s].
    contact_in_base, velocity_in_base : ndarray (n, 3)
        Contact points r [m] and measured v + ω × r [m/s] of the feet that stand.
    trust : ndarray (n,)
        In (0, 1]: the deviation of a foot is ``noise.foot / trust``.
    noise : FilterNoise
        Noise.

    Returns
    -------
    state : FilterState
    distance_squared : ndarray (n,)
        Of the feet before their weights.
    """
    n = len(trust)
    H = foot_jacobian(contact_in_base).reshape(3 * n, 12)
    P = state.covariance
    y = velocity_in_base - state.velocity_in_base - _cross(rate - state.gyro_bias, contact_in_base)
    HP = H @ P
    S = HP @ H.T
    variance = (noise.foot / trust) ** 2
    spread = S.diagonal().reshape(n, 3) + variance[:, None]
    distance_squared = (y * y / spread).sum(axis=1)
    nu = noise.freedom
    variance *= np.maximum((nu + distance_squared) / (nu + 3.0), 1.0)
    S.ravel()[:: 3 * n + 1] += np.repeat(variance, 3)
    gain = np.linalg.solve(S, HP)  # (3n, 12), the transpose of K
    return _corrected(state, y.ravel() @ gain, P - HP.T @ gain), distance_squared


def settle(state: FilterState, rate: Array, deviation: float) -> FilterState:
    """Correct the gyroscope's bias by the knowledge that the body does not turn.

    Nothing else is corrected (Schmidt's consider filter): what yaw should have been all the while
    that the bias was not known is not to be guessed from how a robot sways that has just stopped.

    Parameters
    ----------
    state : FilterState
        State of a robot that stands still.
    rate : ndarray (3,)
        ω̃, which is the bias then [rad/s].
    deviation : float
        Of the turn rate of a robot that stands still [rad/s].

    Returns
    -------
    FilterState
    """
    P = state.covariance.copy()
    S = P[GYRO_BIAS, GYRO_BIAS].copy()
    S.ravel()[::4] += deviation * deviation
    left = np.eye(3) - np.linalg.solve(S, P[GYRO_BIAS, GYRO_BIAS]).T  # I − K
    after = left @ P[GYRO_BIAS]
    P[GYRO_BIAS] = after
    P[:, GYRO_BIAS] = after.T
    bias = rate - left @ (rate - state.gyro_bias)
    return FilterState(
        state.quaternion, state.velocity_in_base, bias, state.accelerometer_bias, 0.5 * (P + P.T)
    )


def _corrected(state: FilterState, error: Array, covariance: Array) -> FilterState:
    return FilterState(
        turned(state.quaternion, error[TILT]),
        state.velocity_in_base + error[VELOCITY],
        state.gyro_bias + error[GYRO_BIAS],
        state.accelerometer_bias + error[ACCELEROMETER_BIAS],
        0.5 * (covariance + covariance.T),
    )


def _spread(noise: FilterNoise) -> Array:
    """Diagonal of the process noise per second (12,)."""
    densities = (noise.gyro, noise.accelerometer, noise.gyro_walk, noise.accelerometer_walk)
    return np.repeat(np.square(densities), 3)


def _cross(a: Array, b: Array) -> Array:
    """Cross product of a (3,) with each row of b (..., 3); np.cross costs ten times as much."""
    ax, ay, az = a.tolist()
    matrix = np.array(((0.0, az, -ay), (-az, 0.0, ax), (ay, -ax, 0.0)))
    return b @ matrix
