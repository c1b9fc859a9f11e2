# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m dmp_cpg_ros.commands.nav2_limits``: what the suite can follow, for Nav2.

Printed as a parameter file for Nav2's nodes; ``nav2.launch.py`` gives them the same.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from math import floor
from typing import Any

import numpy as np
import yaml

from dmp_cpg_ros.commands.ros_arguments import RosArguments, given_file, run_command
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.filter import CommandGate
from dmp_cpg_ros.core.reference.governor import Governor
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import Suite, load_suite

CRUISE = 0.5
"""Share of the largest speeds with which paths are followed; the rest is for corrections."""

SPEEDS = 21
"""Speeds from rest to the largest at which the governor is asked."""

SMOOTHING_S = 0.05
"""Period of Nav2's velocity smoother [s]: its commands are stairs, and the filter takes each step
of them with up to 1 + α_r times this of the acceleration that they have on average.
"""

LARGE = 1e3
"""More than anything that can be asked for."""


def axis_limits(suite: Suite) -> tuple[list[float], list[float]]:
    """Largest speeds and accelerations along x, y and about z, each alone, rounded down.

    Speeds are those that the gate of commands lets pass. Accelerations are the least that the
    governor allows between rest and that speed, less what the stairs of the smoother add; about z
    it has no limit, and the reference filter itself makes α_r times the largest turn rate.

    Returns
    -------
    speeds, accelerations : list of float
        [m/s, m/s, rad/s], [m/s^2, m/s^2, rad/s^2].

    Raises
    ------
    ParameterError
        If the gait is chosen by speed.
    """
    p = suite.parameters
    if p.gait_choice.auto_gait:
        raise ParameterError('auto_gait: the limits are those of one gait; choose it')
    scale = body_scale(load_description(suite.robot_file))
    gate = CommandGate(p.reference, scale, (suite.gait,))
    governor = Governor((suite.gait,), scale)
    speeds, accelerations = [], []
    for axis, unit in enumerate(np.eye(3)):
        gate.accept(*(LARGE * unit))
        speed = gate.at(0)[axis]
        speeds.append(_down(speed))
        allowed = p.reference.alpha_r * speed if axis == 2 else min(
            _allowed(governor, share * speed * unit, unit[:2], p.reference.max_acceleration)
            for share in np.linspace(0.0, 1.0, SPEEDS))
        accelerations.append(_down(allowed / (1.0 + p.reference.alpha_r * SMOOTHING_S)))
    return speeds, accelerations


def _allowed(governor: Governor, r: Array, direction: Array, largest: float) -> float:
    return LARGE * governor.share(r, LARGE * direction, 1.0, largest)


def _down(value: float) -> float:
    return floor(1e3 * value) / 1e3


def nav2_limits(suite: Suite) -> dict[str, dict[str, Any]]:
    """Parameters of Nav2's nodes by their names, for the robot and the gait of a suite."""
    speeds, accelerations = axis_limits(suite)
    (forward, _, turning), (ahead, _, about) = speeds, accelerations
    cruise = _down(CRUISE * forward)
    return {
        'velocity_smoother': {
            'max_velocity': speeds, 'min_velocity': [-speed for speed in speeds],
            'max_accel': accelerations, 'max_decel': [-most for most in accelerations]},
        'controller_server': {'FollowPath': {
            'desired_linear_vel': cruise,
            'approach_velocity_scaling_dist': _down(
                cruise * cruise / (2.0 * ahead) + cruise / suite.parameters.reference.alpha_r),
            'rotate_to_heading_angular_vel': _down(CRUISE * turning),
            'max_angular_accel': about}},
        'behavior_server': {
            'max_rotational_vel': _down(CRUISE * turning), 'rotational_acc_lim': about}}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = argparse.ArgumentParser(prog='nav2_limits', description=(
        'Print what the reference filter can follow as parameters of Nav2.'))
    parser.add_argument('file', metavar='FILE', nargs='?',
                        help="parameter file of the suite (default: the package's)")
    return run_command(parser, arguments, _print, parameters=True)


def _print(options: argparse.Namespace, ros: RosArguments) -> int:
    file = given_file(options.file, ros, 'FILE')
    suite = load_suite(file, ros.parameters, ros.namespace)
    print(f'# Limits of {suite.gait.name}, {suite.robot_file.name}')
    print(yaml.safe_dump({node: {'ros__parameters': values}
                          for node, values in nav2_limits(suite).items()}, sort_keys=False,
                         default_flow_style=None), end='')
    return 0


if __name__ == '__main__':
    sys.exit(main())
