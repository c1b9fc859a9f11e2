# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draws the paper's figures from simulations: oscillators by themselves, and the walking robot."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis import paper_figures
from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import drawings, style
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import recording_of
from dmp_cpg_ros.suite import Suite, load_suite

SPEED = 0.5
"""Speed of the amble [m/s]."""

INHIBITED_AT, RELEASED_AT, END = 4.0, 8.1, 11.0
"""Times of the experiment [s]: the inhibition lasts the paper's 4.1 s."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw and write; returns the exit status."""
    parser = argparse.ArgumentParser(prog='paper_figures', description=__doc__)
    parser.add_argument('file', nargs='?', help="parameter file; the package's own without")
    parser.add_argument('--out', type=Path, default=Path('paper_figures'), metavar='DIR',
                        help='folder for the PNG files (default: paper_figures)')
    return run_command(parser, arguments, _draw)


def _draw(options: argparse.Namespace, _: RosArguments) -> int:
    suite = load_suite(options.file, {'cmd_vel_timeout': 0.0})
    options.out.mkdir(parents=True, exist_ok=True)
    with style.applied():
        for name, figure in figures(suite):
            FigureCanvasAgg(figure).print_png(options.out / f'{name}.png')
            print(options.out / f'{name}.png')
    return 0


def figures(suite: Suite) -> Iterator[tuple[str, Figure]]:
    """All figures with their names, in the order of the paper."""
    yield 'contraction_of_dmps', paper_figures.hierarchy_figure()
    yield 'coupled_dmps', paper_figures.network_figure()
    labels = [f'$\\omega$ = {omega:g}, $\\mu$ = {mu:g}' for omega, mu in zip(
        paper_figures.VAN_DER_POL_OMEGA, paper_figures.VAN_DER_POL_MU, strict=True)]
    yield 'van_der_pol', paper_figures.van_der_pol_figure(paper_figures.van_der_pol_data(), labels)
    robot = MujocoRobot(suite.robot_file, suite.tick_ns)
    scale = body_scale(robot.description)
    yield 'gait', paper_figures.gait_figure(suite.gait, suite.gait.duty(SPEED, scale))
    context = RunContext(robot.description, suite.gait, suite.parameters.inhibition,
                         suite.parameters.canonical.radius)
    recording = experiment(suite, robot)
    for draw in (drawings.target_kinematics, drawings.canonical_states):
        figure = draw(recording, context)
        if figure is not None:
            yield draw.__name__, figure
    yield 'local_dynamics', paper_figures.local_dynamics_figure(
        paper_figures.local_dynamics(False), paper_figures.local_dynamics(True))


def experiment(suite: Suite, robot: MujocoRobot) -> Recording:
    """Amble, inhibit, release: the paper's experiment in the plain loop."""
    loop, state = WalkingLoop(robot.description, suite.gait, suite.parameters), robot.reset()
    loop.command(SPEED)
    states, ticks = [], []
    for stopped, seconds in ((None, INHIBITED_AT), (True, RELEASED_AT - INHIBITED_AT),
                             (False, END - RELEASED_AT)):
        if stopped is not None:
            loop.request(stopped)
        for _ in range(round(seconds * 1e9 / suite.tick_ns)):
            states.append(state)
            ticks.append(loop.tick(state))
            state = robot.step(ticks[-1].targets)
    return recording_of(states, ticks)


if __name__ == '__main__':
    sys.exit(main())
