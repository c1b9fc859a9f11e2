# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stands robots up, lays them down, and lets them recover from many falls; tabulates the outcome.

A fall is any orientation and any joint angles within the limits, drawn from a seed, dropped and
come to rest. The robot is the MuJoCo one with noisy sensors in the plain loop, which is identical
to the nodes in lock-step. Exit status 1 when the first robot failed anywhere, 2 when the arguments
cannot be used.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import LoopRun
from dmp_cpg_ros.studies.output import markdown_table, parser_of, percent, write_results
from dmp_cpg_ros.studies.workers import Workers
from dmp_cpg_ros.suite import load_suite

OWN_ROBOT = 'robots/mini_quadruped.yaml'

SETTLING_S, STANDING_S, LONGEST_S = 0.1, 0.5, 60.0
"""Time before a request, after it has ended well, and until it has failed [s]."""

COLUMNS = ('robot', 'stood up', 'lay down', 'falls', 'recovered', 'rolls 0 / 1 / 2 / more',
           'seconds, median / worst')


@dataclass(frozen=True)
class Recovery:
    """What became of one fall.

    Attributes
    ----------
    seed : int
        Of the fall.
    stands : bool
        Whether the robot stood in the end.
    tries : int
        How often it rolled.
    seconds : float
        From the request to standing, or to giving up [s].
    reason : str
        Why it is as it is.
    """

    seed: int
    stands: bool
    tries: int
    seconds: float
    reason: str


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table; returns the exit status."""
    parser = parser_of('study_recovery', __doc__, 'every fall and outcome')
    parser.add_argument('robots', nargs='*', default=[OWN_ROBOT], metavar='ROBOT',
                        help=f'robot files (default: {OWN_ROBOT})')
    parser.add_argument('--seeds', type=int, default=50, metavar='N',
                        help='falls of each robot (default: 50)')
    return run_command(parser, arguments, _study)


def _study(options: argparse.Namespace, _: RosArguments) -> int:
    rows, outcomes, fine = [], {}, []
    with Workers(options.workers, options.cluster) as workers:
        for robot in options.robots:
            up, down = up_and_down(robot)
            falls = list(workers.map(partial(recovery, robot), range(options.seeds)))
            rows.append(row(robot, up, down, falls))
            outcomes[robot] = falls
            fine.append(up and down and all(fall.stands for fall in falls))
    print(markdown_table(COLUMNS, rows))
    write_results(options.json, outcomes)
    return int(not fine[0])


def run_of(robot: str, start_pose: str, start_mode: str, seed: int = 0) -> LoopRun[WalkingLoop]:
    """Make a robot that lies or has fallen and has come to rest, and its loop."""
    suite = load_suite(None, {'robot': robot, 'start_mode': start_mode})
    body = MujocoRobot(
        suite.robot_file, suite.tick_ns, seed, sensors=suite.sensors, start_pose=start_pose)
    run = LoopRun(body, WalkingLoop(body.description, suite.gait, suite.parameters))
    run.tick(SETTLING_S)
    return run


def up_and_down(robot: str) -> tuple[bool, bool]:
    """Whether a robot stands up from its belly, and lies down again."""
    run = run_of(robot, 'lying', 'lying')
    stands = _reaches(run, 'stand_up', 'standing')
    return stands, stands and _reaches(run, 'lie_down', 'lying')


def recovery(robot: str, seed: int) -> Recovery:
    """Let a robot fall by a seed, and recover."""
    run = run_of(robot, 'fallen', 'damped', seed)
    begin = run.state.time_ns
    stands = _reaches(run, 'recover', 'standing')
    mode, seconds = run.loop.mode, (run.state.time_ns - begin) * 1e-9
    return Recovery(seed, stands, mode.tries, seconds, mode.reason)


def _reaches(run: LoopRun[WalkingLoop], request: str, mode: str) -> bool:
    """Request and tick until a mode lasts; return whether it does, and what stands is upright."""
    run.loop.request_mode(request)
    end = run.state.time_ns + round(LONGEST_S * 1e9)
    run.tick(run.tick_s)
    while run.loop.mode.mode not in (mode, 'damped') and run.state.time_ns < end:
        run.tick(run.tick_s)
    if run.loop.mode.mode == mode:
        run.tick(STANDING_S)
    return run.loop.mode.mode == mode and (mode != 'standing' or not run.fell())


def row(robot: str, up: bool, down: bool, falls: Sequence[Recovery]) -> tuple[str, ...]:
    """Cells of one robot's row."""
    stood = [fall for fall in falls if fall.stands]
    rolls = np.bincount([min(fall.tries, 3) for fall in stood], minlength=4)
    seconds, yes = [fall.seconds for fall in stood], ('no', 'yes')
    return (Path(robot).stem, yes[up], yes[down], str(len(falls)),
            f'{len(stood)} ({percent(len(stood), len(falls))})', ' / '.join(map(str, rolls)),
            f'{np.median(seconds):.1f} / {max(seconds):.1f}' if seconds else '-')


if __name__ == '__main__':
    sys.exit(main())
