# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A walk whose slip, drift, duty factor and stop are prescribed, not simulated."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.recording import (
    CanonicalSeries,
    FootForceSeries,
    JointSeries,
    OdometrySeries,
    Recording,
    StatusEvent,
    VelocitySeries,
)
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.robot_model.description import LegGeometry, RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import LegKinematics

Array = NDArray[np.float64]

HEIGHT = 0.30
MASS = 9.0
ALPHA_R = 3.0


def robot(foot_radius: float = 0.0) -> RobotDescription:
    """Return a small quadruped with point feet (rolling feet where a radius is given)."""
    legs = tuple(
        LegGeometry(
            name=name,
            hip_in_base=np.array([x, y, 0.0]),
            hip_offset=np.array([0.0, side * 0.06, 0.0]),
            thigh=np.array([0.0, 0.0, -0.21]),
            shank=np.array([0.0, 0.0, -0.2]),
            axis_sign=np.ones(3),
            knee_sign=-1,
            position_lower=np.full(3, -3.0),
            position_upper=np.full(3, 3.0),
            torque_limit=np.array([17.0, 17.0, 26.0]),
            velocity_limit=np.array([40.0, 40.0, 25.0]),
            rotor_inertia=np.full(3, 0.01),
            foot_radius=foot_radius,
        )
        for name, x, y, side in (
            ('fl', 0.19, 0.05, 1),
            ('fr', 0.19, -0.05, -1),
            ('rl', -0.19, 0.05, 1),
            ('rr', -0.19, -0.05, -1),
        )
    )
    return RobotDescription(
        name='point-footed',
        legs=legs,
        mass=MASS,
        base_inertia=np.diag([0.05, 0.2, 0.22]),
        com_in_base=np.zeros(3),
        stance_height=HEIGHT,
        kp=np.full(3, 50.0),
        kd=np.full(3, 1.0),
    )


def amble(duty_factor: float = 0.7) -> Gait:
    """Return a four-beat gait."""
    return Gait(
        'amble',
        np.array([0.0, 0.5, 0.75, 0.25]),
        np.array([0.0]),
        np.array([0.3]),
        np.array([duty_factor]),
    )


BELIEVED: dict[str, float | tuple[float, ...]] = {
    'velocity': (0.01, -0.02, 0.03),
    'pitch': 0.01,
    'yaw_rate': 0.002,
    'position_share': 0.05,
    'start': (3.0, 2.0, 0.0),
}
"""How the estimate differs from the truth: constant error of velocity [m/s] and pitch [rad], yaw
error that grows [rad/s], a way that is too long, from another place [m]."""


@dataclass(frozen=True)
class SyntheticWalk:
    """What is prescribed; a test asks the metrics for the same numbers."""

    rate_hz: float = 100.0
    walk_s: float = 1.0  # standing before
    stop_s: float = 9.0  # inhibition is requested
    release_s: float = 12.0
    end_s: float = 18.0
    speed: float = 0.4  # [m/s]
    turn_rate: float = 0.0  # commanded [rad/s]
    yaw_drift_deg_per_m: float = 0.0  # on top of the command
    speed_ratio: float = 1.0  # real speed over reference
    slip_speed: float = 0.0  # of every foot in stance while walking, along world x [m/s]
    duty_factor: float = 0.7
    cadence_hz: float = 1.6
    phase_offset_error: Array = field(default_factory=lambda: np.zeros(4))
    time_to_rest_s: float = 0.8
    time_to_walk_s: float = 0.5

    @property
    def time(self) -> Array:
        """Stamps [s]."""
        return np.arange(round(self.end_s * self.rate_hz)) / self.rate_hz

    @property
    def gait(self) -> Gait:
        """The gait that is prescribed."""
        return amble(self.duty_factor)

    def walking(self) -> Array:
        """Whether the oscillators turn, boolean ndarray (n,)."""
        t = self.time
        return (t >= self.walk_s) & (
            (t < self.stop_s + self.time_to_rest_s) | (t >= self.release_s)
        )

    def reference(self) -> Array:
        """Return the filtered command, ndarray (n, 3)."""
        r, value = [], np.zeros(3)
        gain = 1.0 - np.exp(-ALPHA_R / self.rate_hz)
        for t in self.time:
            moving = t >= self.walk_s and not self.stop_s <= t < self.release_s
            value = value + gain * (np.array([self.speed, 0.0, self.turn_rate]) * moving - value)
            r.append(value)
        return np.array(r)

    def phases(self) -> Array:
        """Oscillator phases, ndarray (n, 4)."""
        omega = 2.0 * np.pi * self.cadence_hz * self.walking()
        phi = np.concatenate([[0.0], np.cumsum(omega)[:-1]]) / self.rate_hz
        return phi[:, None] + self.gait.phases + self.phase_offset_error

    def body(self) -> tuple[Array, Array, Array]:
        """Position (n, 3), yaw (n,) and speed (n,) of the base."""
        reference = self.reference()
        speed = self.speed_ratio * reference[:, 0]
        rate = reference[:, 2] + np.deg2rad(self.yaw_drift_deg_per_m) * speed
        yaw = np.concatenate([[0.0], np.cumsum(rate)[:-1]]) / self.rate_hz
        step = speed[:, None] * np.stack([np.cos(yaw), np.sin(yaw)], axis=1) / self.rate_hz
        xy = np.concatenate([np.zeros((1, 2)), np.cumsum(step, axis=0)[:-1]])
        return np.column_stack([xy, np.full(len(xy), HEIGHT)]), yaw, speed

    def stance(self) -> Array:
        """Whether each foot stands, boolean ndarray (n, 4)."""
        position = np.abs(self.gait.cycle_position(self.phases()))
        return (position >= 0.5 * (1.0 - self.duty_factor)) | ~self.walking()[:, None]

    def feet_in_world(self) -> Array:
        """Feet that stay where they were put (but for the slip), ndarray (n, 4, 3)."""
        position, yaw, _ = self.body()
        stance, walking = self.stance(), self.walking()
        home = np.array(
            [
                [leg.hip_in_base[0], leg.hip_in_base[1] + leg.hip_offset[1], -HEIGHT]
                for leg in robot().legs
            ]
        )
        c, s = np.cos(yaw), np.sin(yaw)
        under_hip = position[:, None] + np.stack(
            [
                c[:, None] * home[:, 0] - s[:, None] * home[:, 1],
                s[:, None] * home[:, 0] + c[:, None] * home[:, 1],
                np.broadcast_to(home[:, 2], (len(yaw), 4)),
            ],
            axis=-1,
        )
        feet = under_hip.copy()
        for k in range(1, len(yaw)):
            slipped = feet[k - 1] + np.array(
                [self.slip_speed * walking[k] / self.rate_hz, 0.0, 0.0]
            )
            swing = under_hip[k] + np.array([0.0, 0.0, 0.03])
            held = stance[k] & stance[k - 1]
            feet[k] = np.where(
                held[:, None], slipped, np.where(stance[k][:, None], under_hip[k], swing)
            )
        return feet

    def recording(self) -> Recording:
        """Everything as it would be loaded from a bag."""
        t = self.time
        position, yaw, speed = self.body()
        reference, stance, phases = self.reference(), self.stance(), self.phases()
        q = self._joint_angles(position, yaw)
        dq = np.gradient(q, 1.0 / self.rate_hz, axis=0)
        quaternion = np.column_stack([np.zeros((len(t), 2)), np.sin(yaw / 2), np.cos(yaw / 2)])
        rate = np.column_stack([np.zeros((len(t), 2)), np.gradient(yaw, 1.0 / self.rate_hz)])
        x = state_at(phases)
        force = stance * MASS * 9.81 / np.maximum(stance.sum(axis=1, keepdims=True), 1)
        effort = np.tile([0.5, -1.0, 6.0], 4) * np.repeat(stance, 3, axis=1)
        velocity = np.column_stack([speed, np.zeros((len(t), 2))])
        return Recording(
            joints=JointSeries(t, q, dq, effort),
            targets=JointSeries(t, q, dq, 0.1 * effort),
            canonical=CanonicalSeries(t, x, np.gradient(x, 1.0 / self.rate_hz, axis=0)),
            reference=VelocitySeries(t, reference),
            commands=self.commands(),
            odometry=OdometrySeries(t, position, quaternion, velocity, rate),
            estimate=self._estimate(position, yaw, velocity, rate),
            feet=FootForceSeries(t, force),
            inhibition=self.events(),
            statuses=self.statuses(),
        )

    def _estimate(
        self, position: Array, yaw: Array, velocity: Array, rate: Array
    ) -> OdometrySeries:
        """What the robot believes: at every fifth stamp, wrong by what ``BELIEVED`` says."""
        t, few = self.time, slice(None, None, 5)
        wrong = yaw + BELIEVED['yaw_rate'] * t
        pitch = np.full(len(t), BELIEVED['pitch'])
        sy, cy, sp, cp = np.sin(wrong / 2), np.cos(wrong / 2), np.sin(pitch / 2), np.cos(pitch / 2)
        quaternion = np.column_stack([-sy * sp, cy * sp, sy * cp, cy * cp])
        position = position * (1.0 + BELIEVED['position_share']) + BELIEVED['start']
        velocity = velocity + BELIEVED['velocity']
        return OdometrySeries(
            t[few], position[few], quaternion[few], velocity[few], rate[few]
        )

    def _joint_angles(self, position: Array, yaw: Array) -> Array:
        feet = self.feet_in_world() - position[:, None]
        c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        in_base = np.stack(
            [
                c * feet[..., 0] + s * feet[..., 1],
                -s * feet[..., 0] + c * feet[..., 1],
                feet[..., 2],
            ],
            axis=-1,
        )
        solvers = [LegKinematics(leg) for leg in robot().legs]
        return np.array(
            [
                np.concatenate(
                    [solver.inverse(foot) for solver, foot in zip(solvers, row, strict=True)]
                )
                for row in in_base
            ]
        )

    def commands(self) -> VelocitySeries:
        """Commands at 10 Hz, between the ticks."""
        t = np.arange(0.0, self.end_s - 0.1, 0.1)
        moving = t >= self.walk_s
        return VelocitySeries(t, moving[:, None] * np.array([self.speed, 0.0, self.turn_rate]))

    def events(self) -> tuple[StatusEvent, ...]:
        """What the inhibition node says around the stop and the start."""
        stop = {
            'requested': 'true',
            'request_stamp': repr(self.stop_s),
            'predicted_s': '0.78',
            'bound_s': '1.5',
        }
        start = {
            'requested': 'false',
            'request_stamp': repr(self.release_s),
            'predicted_s': '0.45',
            'bound_s': '0.9',
        }
        rest_s, walk_s = self.stop_s + self.time_to_rest_s, self.release_s + self.time_to_walk_s
        return (
            StatusEvent(0.0, 0, 'free', {'requested': 'false'}),
            StatusEvent(self.stop_s, 0, 'waiting', stop),
            StatusEvent(self.stop_s + 0.3, 0, 'captured', stop),
            StatusEvent(rest_s, 0, 'at_rest', {**stop, 'measured_s': repr(self.time_to_rest_s)}),
            StatusEvent(self.release_s, 0, 'releasing', start),
            StatusEvent(walk_s, 0, 'walking', {**start, 'measured_s': repr(self.time_to_walk_s)}),
        )

    def statuses(self) -> dict[str, tuple[StatusEvent, ...]]:
        """What the robot says about its timing, once a second."""
        return {
            'mujoco_robot: timing': tuple(
                StatusEvent(
                    float(second),
                    0,
                    'running',
                    {
                        'rate_hz': repr(self.rate_hz),
                        'real_time_factor': '0.998',
                        'latency_ms_p50': repr(1.25 + 0.01 * second),
                        'latency_ms_p99': '3.5',
                        'deadline_misses': str(second // 4),
                    },
                )
                for second in range(1, int(self.end_s))
            )
        }
