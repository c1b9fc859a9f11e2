# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gains of the body's feedback, in dimensionless form.

Rates are given in units of sqrt(g / l) and times in sqrt(l / g), with l the standing height of the
hips (dynamic similarity; Alexander & Jayes 1983), and act per unit of mass or inertia. One set
therefore serves robots of any size.
"""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.parameters import Parameters, parameter


@dataclass(frozen=True)
class PostureParameters(Parameters):
    """Gains of virtual model, force distribution, foot placement and speed keeping."""

    height_stiffness: float = parameter(
        2.3, 'virtual spring of the height, per mass, in g/l', 0.0, 100.0)
    height_damping: float = parameter(
        2.0, 'virtual damper of the height, per mass, in sqrt(g/l)', 0.0, 100.0)
    attitude_stiffness: float = parameter(
        4.3, 'virtual spring of roll and pitch, per inertia, in g/l', 0.0, 100.0)
    attitude_damping: float = parameter(
        2.5, 'virtual damper of roll and pitch, per inertia, in sqrt(g/l)', 0.0, 100.0)
    velocity_gain: float = parameter(
        0.7, 'force per mass and error of horizontal velocity, in sqrt(g/l)', 0.0, 100.0)
    yaw_rate_gain: float = parameter(
        1.35, 'moment per inertia and error of the turn rate, in sqrt(g/l)', 0.0, 100.0)
    friction: float = parameter(
        0.45, 'coefficient of the friction cones of the stance forces', 0.05, 2.0)
    load_transfer: float = parameter(
        0.08, 'fraction of the cycle over which the load of a foot rises after touchdown and '
        'falls before lift-off', 0.001, 0.3)
    placement_gain: float = parameter(
        0.7, 'foot placement per error of the velocity over the foot, in sqrt(l/g)', 0.0, 10.0)
    slope_following: float = parameter(
        1.0, "fraction of the ground's estimated slope that the body follows; 0: the body stays "
        'level', 0.0, 1.0)
    slope_lean: float = parameter(
        1.0, 'fraction of the downhill foothold shift that puts the body over its feet', 0.0, 1.5)
    reach: float = parameter(
        0.95, 'largest distance of a foothold from its hip, as a fraction of the straight leg',
        0.1, 1.0)
    yielding: float = parameter(
        0.5, 'fraction of the velocity error that is added to the velocity of the standing feet',
        0.0, 1.0)
    levelling: float = parameter(
        1.0, 'fraction of the tilt that the height of swinging feet compensates', 0.0, 1.0)
    climbing: bool = parameter(
        True, 'whether all legs step over what one foot has felt, and stand where the ground is')
    speed_integral: float = parameter(
        0.135, 'rate at which the stance velocity is corrected by the velocity error, in '
        'sqrt(g/l)', 0.0, 10.0)
    speed_correction_limit: float = parameter(
        0.2, 'largest correction of the stance velocity, as a fraction of the speed, at least of '
        '0.3 sqrt(g l)', 0.0, 1.0)
    speed_mismatch_limit: float = parameter(
        0.6, 'largest correction of the stance velocity while the reference stands still, as a '
        'fraction of the speed as well', 0.0, 1.0)
    offset_rate: float = parameter(
        0.05, 'rate at which a displacement of the centre of mass is found by a tilt that stays, '
        'in sqrt(g/l)', 0.0, 10.0)
    offset_limit: float = parameter(
        0.2, 'largest displacement of the centre of mass that is made up for, as a fraction of '
        'the standing height of the hips', 0.0, 0.5)
    heading_gain: float = parameter(
        0.25, 'turn rate per error of heading, in sqrt(g/l)', 0.0, 20.0)
    heading_limit: float = parameter(
        0.3, 'limit of the integrated heading error', 0.0, 1.5, unit='rad')
    activity_rate: float = parameter(
        12.0, 'rate at which the planned body motion fades when the phase stops', 0.1, 1e3,
        unit='1/s')
    target_lead: float = parameter(
        0.0, 'time after its tick at which a target acts, for which it is computed', 0.0, 0.06,
        unit='s')
