# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Geometry, mass and limits of a robot for the controllers, read from its model."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, Array


@dataclass(frozen=True)
class LegGeometry:
    """Geometry of one leg: abduction about x, then hip and knee about y.

    The foot in the base frame is
    ``hip_in_base + Rx(s0 q0) (hip_offset + Ry(s1 q1) (thigh + Ry(s2 q2) shank))``.

    Attributes
    ----------
    name : str
        ``fl``, ``fr``, ``rl`` or ``rr``.
    hip_in_base : ndarray (3,)
        Anchor of the abduction joint in ``base_link`` [m].
    hip_offset, thigh, shank : ndarray (3,)
        Abduction joint → hip joint, hip joint → knee joint, knee joint → centre of the foot's
        contact sphere, each in the frame of its link with all joints at zero [m].
    axis_sign : ndarray (3,)
        +1 or −1: whether each joint turns about +x / +y or −x / −y.
    knee_sign : int
        Sign of the rotation about +y that takes the thigh's direction to the shank's in the home
        pose: −1 for knees that bend backwards (the shank swung forwards), +1 for the other way.
    position_lower, position_upper : ndarray (3,)
        Joint limits [rad].
    torque_limit, velocity_limit : ndarray (3,)
        [N m], [rad/s].
    rotor_inertia : ndarray (3,)
        Reflected rotor inertia at the joint [kg m^2] (the paper's J).
    foot_radius : float
        Distance from the centre of the contact sphere to where it touches the ground while the
        robot stands: its radius, less the compression of soft feet [m].
    rolling_radius : tuple of float, optional
        The same in the mean over a stance, with a quarter and with half of the weight on the foot
        [m]; None where it is the same.
    damping : ndarray (3,)
        Viscous friction of the joints, which their drives may make up for [N m s/rad].
    swing_inertia : float
        Of the leg about its hip joint while the robot stands, with the rotor [kg m^2]; 0 where it
        is not known.
    width : float
        Of the lower leg, across the body, while the robot stands [m]; 0 where the legs of one side
        cannot touch each other.
    """

    name: str
    hip_in_base: Array
    hip_offset: Array
    thigh: Array
    shank: Array
    axis_sign: Array
    knee_sign: int
    position_lower: Array
    position_upper: Array
    torque_limit: Array
    velocity_limit: Array
    rotor_inertia: Array
    foot_radius: float
    damping: Array = field(default_factory=lambda: np.zeros(3))
    swing_inertia: float = 0.0
    rolling_radius: tuple[float, float] | None = None
    width: float = 0.0

    @property
    def walking_radius(self) -> float:
        """Radius on which the foot rolls under half of the weight, as in most gaits [m]."""
        return self.foot_radius if self.rolling_radius is None else self.rolling_radius[1]


@dataclass(frozen=True)
class RobotDescription:
    """A quadruped as the controllers see it.

    Attributes
    ----------
    name : str
        Name of the model.
    legs : tuple of LegGeometry
        Four legs in the order fl, fr, rl, rr.
    mass : float
        Total mass [kg].
    base_inertia : ndarray (3, 3)
        Inertia of the whole robot about its centre of mass in the home pose, in ``base_link`` [kg
        m^2].
    com_in_base : ndarray (3,)
        Centre of mass in ``base_link`` in the home pose [m].
    stance_height : float
        Height of ``base_link`` over the ground when standing [m].
    kp, kd : ndarray (3,)
        Gains of the low-level joint drive, per joint of a leg [N m/rad], [N m s/rad].
    belly_depth : float
        How far the base's shape reaches below ``base_link`` [m]: the height of ``base_link`` when
        the robot lies on its belly.
    joint_names : tuple of str
        Names of the joints in messages, in the order of ``JOINT_NAMES``.
    """

    name: str
    legs: tuple[LegGeometry, ...]
    mass: float
    base_inertia: Array
    com_in_base: Array
    stance_height: float
    kp: Array
    kd: Array
    belly_depth: float = 0.0
    joint_names: tuple[str, ...] = JOINT_NAMES
