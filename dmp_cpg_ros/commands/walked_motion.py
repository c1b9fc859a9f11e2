# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How the feet of a robot walked in a run, as demonstrations of their motion."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis import bag, episodes, motion
from dmp_cpg_ros.analysis.context import find_parameter
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.analysis.strict_json import read_json
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.run_folder import run_context, run_of
from dmp_cpg_ros.core.canonical.phase import phase, phase_rate
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.spring_damper import SpringDamper
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES
from dmp_cpg_ros.core.transformation.learned_motion import FootSamples
from dmp_cpg_ros.core.transformation.leg import LegParameters, body_scale, nominal_foothold

SLOWEST = 0.1
"""Speed of the reference from which the robot walks [m/s]."""

STRAIGHT = 0.05
"""Turn rate of the reference below which it walks straight on [rad/s]."""

STEADY = 0.03
"""Largest change of the reference in 0.1 s, and of the phase rate from the cadence, as shares."""

SETTLING, SHORTEST = 1.0, 2.0
"""Time after which a steady walk is taken as a demonstration, and its least duration [s]."""


def read_motion(path: Path, topic: str = 'joint_targets', robot_file: Path | None = None
                ) -> tuple[list[list[FootSamples]], RobotDescription]:
    """Steady walking in a recording.

    Parameters
    ----------
    path : Path
        Run's folder, or a bag, which is then taken for one of the package's robot and gaits.
    topic : str
        ``joint_targets`` or ``joint_states``.
    robot_file : Path, optional
        Robot that walked; the one that the run names without.

    Returns
    -------
    feet : list (4,) of lists of FootSamples
        For every foot, one entry per stretch.
    robot : RobotDescription

    Raises
    ------
    DmpCpgError
        If there is no such recording, joints or canonical states are not in it, or the robot
        nowhere walks steadily straight on.
    """
    if topic not in ('joint_targets', 'joint_states'):
        raise DataError(f"a motion is learned from joint_targets or joint_states, not '{topic}'")
    run = run_of(bag.find_bag(path), path)
    told = {} if run is None else read_json(run / 'manifest.json')
    parameters = told.get('parameters') or {}
    context, _ = run_context(parameters, robot_file)
    recording = load_recording(path, joint_names=context.joint_names, tell=Progress(f'{path}: '))
    joints = recording.targets if topic == 'joint_targets' else recording.joints
    canonical = recording.canonical
    walked = next((gait.before for gait in canonical.gaits if not gait.after), 'amble')
    if not parameters:
        parameters = {'gait': walked}
        context, _ = run_context(parameters, robot_file)
    rows, at, attitude = motion.common_rows(joints.time, canonical.time, recording.odometry.time)
    nowhere = DataError(f"'{path}': no stamp has all of {topic}, canonical_state and "
                        'ground_truth or odom')
    if not len(rows):
        raise nowhere
    known = ~np.isnan(joints.position[rows])  # (n, 12)
    missing = [JOINT_NAMES[j] for j in np.flatnonzero(~known.any(axis=0))]
    if missing:
        raise DataError(f"'{path}': {topic} lacks the joints {', '.join(missing)}")
    whole = known.all(axis=1)  # messages are lost, and the end comes within a tick
    if not whole.any():
        raise nowhere
    rows, at, attitude = rows[whole], at[whole], attitude[whole]
    if context.robot is None or context.gait is None:
        raise DataError(f"'{path}': the robot or the gait that walked is not known here")
    gaits = episodes.gait_rows(recording, context)
    if gaits is None or not recording.reference.time.size:
        raise DataError(f"'{path}': the reference or the gait in force was not recorded")
    times, scale = canonical.time[at], body_scale(context.robot)
    planned = _planned(recording, gaits, at, scale)
    angles = joints.position[rows]
    if topic == 'joint_targets':
        angles = _goals(times, angles, joints.velocity[rows], parameters)
    up = motion.rotations(recording.odometry.quaternion[attitude])[:, 2]
    feet = _samples(context.robot, times, angles, up, *planned)
    if not feet[0]:
        raise DataError(
            f"'{path}': the robot nowhere walks straight on for {SETTLING + SHORTEST:g} s at one "
            f'speed of at least {SLOWEST:g} m/s')
    return feet, context.robot


def _planned(recording: Recording, gaits: list[episodes.GaitRow], at: NDArray[np.int64],
             scale: BodyScale) -> tuple[Array, Array, Array, Array, NDArray[np.bool_]]:
    """Cycle positions (m, 4), duty, cycle, bounce (m, 4) that the gaits plan at rows of the
    canonical states, and whether the robot does so steadily; NaN within changes of gait.
    """
    canonical, reference = recording.canonical, recording.reference
    in_force = [entry.gait for entry in gaits for _ in range(entry.rows.start, entry.rows.stop)]
    times = canonical.time[at]
    r, before = (motion.held(reference.time, reference.value, times - ago) for ago in (0.0, 0.1))
    speed = np.array([scale.foot_speed(*row) for row in r])
    phi, rate = phase(canonical.x[at]), phase_rate(canonical.x[at], canonical.x_dot[at])
    omega, duty = np.full((2, len(at)), np.nan)
    c, bounce = np.full((2, len(at), 4), np.nan)
    for k, row in enumerate(at):
        gait = in_force[row]
        if isinstance(gait, Gait):
            omega[k], duty[k] = gait.omega(speed[k], scale), gait.duty(speed[k], scale)
            c[k] = gait.cycle_position(phi[k])
            bounce[k] = [gait.bounce(float(p), duty[k], omega[k]).height for p in c[k]]
    steady = ((np.hypot(r[:, 0], r[:, 1]) > SLOWEST) & (np.abs(r[:, 2]) < STRAIGHT)
              & (np.abs(r - before).max(axis=1) < STEADY * speed)
              & (np.abs(rate - omega[:, None]).max(axis=1) < STEADY * omega))
    return c, duty, 2.0 * np.pi / omega, bounce, steady


def _samples(robot: RobotDescription, times: Array, angles: Array, up: Array, position: Array,
             duty: Array, cycle: Array, bounce: Array, steady: NDArray[np.bool_]
             ) -> list[list[FootSamples]]:
    """Samples of every foot in the steady stretches that are long enough, once settled."""
    feet: list[list[FootSamples]] = [[] for _ in robot.legs]
    for first, past in motion.stretches(steady):
        part = slice(int(np.searchsorted(times, times[first] + SETTLING)), past)
        if times[past - 1] - times[first] < SETTLING + SHORTEST:
            continue
        for i, leg in enumerate(robot.legs):
            foot = motion.feet_in_base(leg, angles[part, 3 * i : 3 * i + 3])
            away = foot - nominal_foothold(robot, leg.name)
            away[:, 2] = np.sum(up[part] * foot, axis=1) + bounce[part, i]
            feet[i].append(FootSamples(position[part, i], duty[part], cycle[part], away))
    return feet


def _goals(times: Array, angles: Array, rates: Array, parameters: Mapping[str, Any]) -> Array:
    """Goals that the targets of the joints followed: targets lag behind, and a goal that is
    learned shall not be filtered twice.
    """
    usual = LegParameters()
    stiffness, damping = (
        np.full(len(JOINT_NAMES), find_parameter(parameters, name, getattr(usual, name)))
        for name in ('stiffness', 'damping'))
    goals = SpringDamper(stiffness, damping).goals(angles, rates, np.diff(times))
    return np.vstack([angles[:1], goals])
