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
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.rotations import turned
from dmp_cpg_ros.core.maths.vec3 import Matrix, Triple, cross, inverse, triple, upward

Array = NDArray[np.float64]

TILT, VELOCITY, GYRO_BIAS, ACCELEROMETER_BIAS = (slice(3 * i, 3 * i + 3) for i in range(4))
"""Places in the error state."""

_STAYING = np.eye(12)

_TURNING = (
    *(12 * i + j for i in range(3) for j in range(3) if i != j),  # of the tilt
    *(12 * (i + 3) + j + 3 for i in range(3) for j in range(3) if i != j),  # of the velocity
    *(12 * (i + 3) + j for i in range(3) for j in range(3) if i != j),  # gravity
    *(12 * (i + 3) + j + 6 for i in range(3) for j in range(3) if i != j),  # bias of gyroscope
    *(12 * i + i + 6 for i in range(6)),  # biases
)
"""Places in the transition's matrix, read by rows, of what is neither 0 nor 1."""


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

    @cached_property
    def spread(self) -> Array:
        """Diagonal of the process noise per second (12,)."""
        densities = (self.gyro, self.accelerometer, self.gyro_walk, self.accelerometer_walk)
        return np.repeat(np.square(densities), 3)


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
    a, b, c = rate[0] * dt, rate[1] * dt, rate[2] * dt
    fall = -GRAVITY * dt
    d, e, f = up_in_base[0] * fall, up_in_base[1] * fall, up_in_base[2] * fall
    g, h, i = velocity[0] * -dt, velocity[1] * -dt, velocity[2] * -dt
    F = _STAYING.copy()
    F.put(_TURNING, (
        c, -b, -c, a, b, -a, c, -b, -c, a, b, -a, -f, e, f, -d, -e, d, -i, h, i, -g, -h, g,
        -dt, -dt, -dt, -dt, -dt, -dt))  # fmt: skip
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
    up = upward(state.quaternion.tolist())
    v = triple(state.velocity_in_base.tolist())
    rate, specific_force = rate - state.gyro_bias, specific_force - state.accelerometer_bias
    turning, force = triple(rate.tolist()), triple(specific_force.tolist())
    turn = (turning[0] * dt, turning[1] * dt, turning[2] * dt)
    # in the base half-way, as the mean force is
    tilted, fallen = cross(turn, up), GRAVITY * dt
    change = (
        force[0] * dt - fallen * (up[0] - 0.5 * tilted[0]),
        force[1] * dt - fallen * (up[1] - 0.5 * tilted[1]),
        force[2] * dt - fallen * (up[2] - 0.5 * tilted[2]),
    )
    # The new velocity is seen from the new orientation.
    back = cross(turn, (v[0] + 0.5 * change[0], v[1] + 0.5 * change[1], v[2] + 0.5 * change[2]))
    twice = cross(turn, cross(turn, v))
    moved = np.array((
        v[0] + change[0] - back[0] + 0.5 * twice[0],
        v[1] + change[1] - back[1] + 0.5 * twice[1],
        v[2] + change[2] - back[2] + 0.5 * twice[2],
    ))
    F = transition(v, up, turning, dt)
    P = F.dot(state.covariance).dot(F.T)
    P.ravel()[::13] += noise.spread * dt
    return FilterState(
        turned(state.quaternion, np.array(turn)), moved, state.gyro_bias,
        state.accelerometer_bias, P,
    )


def update(
    state: FilterState,
    rate: Array,
    contact_in_base: Sequence[Triple],
    velocity_in_base: Sequence[Triple],
    trust: Sequence[float],
    noise: FilterNoise,
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
    rate : ndarray (3,)
        ω̃ at the time of the state [rad/s].
    contact_in_base, velocity_in_base : sequence of n tuples of float
        Contact points r [m] and measured v + ω × r [m/s] of the feet.
    trust : sequence of n floats
        In [0, 1]: the deviation of a foot is ``noise.foot / trust``; one of no trust measures
        nothing.
    noise : FilterNoise
        Noise.

    Returns
    -------
    state : FilterState
    distance_squared : tuple of n floats
        Of the feet before their weights; 0 for those without trust.
    """
    P = state.covariance
    predicted = P[VELOCITY, VELOCITY].tolist()
    turning = triple((rate - state.gyro_bias).tolist())
    v_x, v_y, v_z = state.velocity_in_base.tolist()
    nu, total, x, y, z = noise.freedom, 0.0, 0.0, 0.0, 0.0
    distances = []
    for contact, measured, share in zip(contact_in_base, velocity_in_base, trust, strict=True):
        if share <= 0.0:
            distances.append(0.0)
            continue
        around = cross(turning, contact)
        off_x, off_y, off_z = (
            measured[0] - v_x - around[0], measured[1] - v_y - around[1],
            measured[2] - v_z - around[2])
        variance = (noise.foot / share) ** 2
        distance = (
            off_x * off_x / (predicted[0][0] + variance)
            + off_y * off_y / (predicted[1][1] + variance)
            + off_z * off_z / (predicted[2][2] + variance))
        distances.append(distance)
        weight = 1.0 / (variance * max((nu + distance) / (nu + 3.0), 1.0))
        total += weight
        x, y, z = x + weight * off_x, y + weight * off_y, z + weight * off_z
    if total == 0.0:
        return state, tuple(distances)
    HP = P[VELOCITY]
    KT = np.array(inverse(_with_diagonal(predicted, 1.0 / total))).dot(HP)  # (3, 12)
    error = np.array((x / total, y / total, z / total)).dot(KT)
    return _corrected(state, error, P - HP.T.dot(KT)), tuple(distances)


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
    rows = P[GYRO_BIAS]
    S = _with_diagonal(rows[:, GYRO_BIAS].tolist(), deviation * deviation)
    left = np.array(inverse(S)) * (deviation * deviation)  # I − K = I − P S⁻¹ = (S − P) S⁻¹
    after = left.dot(rows)
    P[GYRO_BIAS] = after
    P[:, GYRO_BIAS] = after.T
    bias = rate - left.dot(rate - state.gyro_bias)
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


def _with_diagonal(M: list[list[float]], more: float) -> Matrix:
    """A matrix (3, 3) with a number added to its diagonal."""
    (a, b, c), (d, e, f), (g, h, i) = M
    return (a + more, b, c), (d, e + more, f), (g, h, i + more)
