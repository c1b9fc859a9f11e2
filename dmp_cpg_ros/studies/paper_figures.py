# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draws the paper's figures from simulations: oscillators by themselves, and the walking robot.

Figures 5 and 7 are those of the report.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, FancyBboxPatch, Patch

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.figures.gait import canonical_states, target_kinematics
from dmp_cpg_ros.analysis.recording import Array, Recording
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.core.canonical.coupling import graph_from_edges, topology
from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.loop import Tick, WalkingLoop
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.files import writable
from dmp_cpg_ros.paper.network import EdgeCoupling, OscillatorNetwork
from dmp_cpg_ros.paper.oscillators import HopfOscillators, VanDerPolOscillators
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import recording_of
from dmp_cpg_ros.suite import Suite, load_suite

VAN_DER_POL_OMEGA = (0.8, 1.0, 1.25, 1.5)
VAN_DER_POL_MU = (0.5, 1.0, 1.5, 2.0)
"""Frequencies [rad/s] and nonlinearities [1/s] of figure vdp; the paper does not print its own."""

VAN_DER_POL_GAIN = np.diag((4.0, 4.0))
"""K_ij of figure vdp, as in its caption [1/s]."""

LOCAL_OMEGA, LOCAL_RHO, LOCAL_GAIN, LOCAL_REGION = 3.0, 2.0, 30.0, 0.3
"""ω [rad/s], ρ [1/s], k_inh [1/s] and r0 of figure localDynamics; only r0 is the paper's."""

COLOURS = tuple(style.LEG_COLOURS.values())

WIDTHS = (3.4, 2.4, 1.5, 0.8)
"""Line widths, so that lines on top of one another all show [pt]."""

SHOWN = 25.0
"""Time from the start that figure vdp shows [s]."""

CYCLE: Any = {'linestyle': (0, (4, 3)), 'color': '#777777'}


class VanDerPolData(NamedTuple):
    """Heterogeneous Van der Pol oscillators without and with coupling.

    Attributes
    ----------
    time : ndarray (n,)
        [s]
    uncoupled, coupled : ndarray (n, N, 2)
        States.
    """

    time: Array
    uncoupled: Array
    coupled: Array


class LocalDynamics(NamedTuple):
    """One Andronov-Hopf oscillator without or with switched inhibition.

    Attributes
    ----------
    trajectories : ndarray (m, n, 2)
        Trajectories from m initial states.
    grid : ndarray (k,)
        Where the field is given, along both axes.
    field : ndarray (k, k, 2)
        ẋ at (x₁, x₂) = (grid[j], grid[i]) [1/s].
    target : ndarray (2,)
        x_d.
    region_radius : float
        r0 of the region C, zero without inhibition.
    """

    trajectories: Array
    grid: Array
    field: Array
    target: Array
    region_radius: float


def van_der_pol_data(duration: float = 60.0, dt: float = 0.01) -> VanDerPolData:
    """Simulate the Van der Pol oscillators of figure vdp for a duration [s] with a step [s]."""
    size, steps = len(VAN_DER_POL_OMEGA), round(duration / dt)
    family = VanDerPolOscillators(size, VAN_DER_POL_OMEGA, VAN_DER_POL_MU)
    graph = graph_from_edges(size, topology('all_to_all', size), VAN_DER_POL_GAIN)
    start = np.array([[2.0, 0.0], [-2.0, 0.0], [0.5, -1.5], [-0.5, 2.5]])
    free = Inhibition(False, np.zeros(size), 0.0)
    return VanDerPolData(np.arange(steps + 1, dtype=float) * dt, *(
        _simulated(OscillatorNetwork(family, coupling), free, start, steps, dt)
        for coupling in (None, EdgeCoupling(graph))))


def local_dynamics(inhibited: bool, duration: float = 6.0, dt: float = 0.005) -> LocalDynamics:
    """Simulate the oscillator of figure localDynamics, each trajectory on its own."""
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False) + 0.3
    start = np.concatenate([state_at(angles, 1.55), state_at(angles[::2], 0.08)])
    trajectories = _simulated(
        *_alone(len(start), inhibited), start, round(duration / dt), dt).swapaxes(0, 1)
    grid = np.linspace(-1.6, 1.6, 161)
    states = np.stack(np.meshgrid(grid, grid), axis=-1)
    x = states.reshape(-1, 2)
    network, inhibition = _alone(len(x), inhibited)
    field = network.field(x, inhibition.acting_gains(x, network.target))
    return LocalDynamics(trajectories, grid, field.reshape(states.shape), network.target[0],
                         LOCAL_REGION * inhibited)


def _alone(count: int, inhibited: bool) -> tuple[OscillatorNetwork, Inhibition]:
    """Some oscillators without coupling, each inhibited on its own: this is no stop of a network,
    in which inhibited nodes act together.
    """
    network = OscillatorNetwork(HopfOscillators(count, LOCAL_OMEGA, LOCAL_RHO),
                                target=state_at(np.zeros(count)))
    return network, Inhibition(False, np.full(count, LOCAL_GAIN * inhibited), LOCAL_REGION)


def _simulated(network: OscillatorNetwork, inhibition: Inhibition, x: Array, steps: int,
               dt: float) -> Array:
    """States (steps + 1, N, 2) from x on."""
    rows = [x]
    for _ in range(steps):
        rows.append(network.step(rows[-1], dt, inhibition.acting_gains(rows[-1], network.target)))
    return np.array(rows)


def van_der_pol_figure(data: VanDerPolData, labels: Sequence[str]) -> Figure:
    """Heterogeneous Van der Pol oscillators, uncoupled and coupled (paper, figure vdp).

    Parameters
    ----------
    data : VanDerPolData
        Simulated states.
    labels : sequence of str
        What tells each oscillator apart.
    """
    figure, axes = style.new_figure(4.6, 2, 2, height_ratios=(1.0, 1.5))
    early, late = data.time <= SHOWN, data.time >= data.time[-1] - 0.4 * SHOWN
    for (over_time, plane), states, title, widths in (
            (axes[:, 0], data.uncoupled, 'uncoupled', [1.2] * len(COLOURS)),
            (axes[:, 1], data.coupled, r'coupled, $K_{ij}$ = diag(4, 4)', WIDTHS)):
        for i, (colour, width) in enumerate(zip(COLOURS, widths, strict=True)):
            over_time.plot(data.time[early], states[early, i, 0], color=colour, linewidth=width)
            plane.plot(*states[late, i].T, color=colour, linewidth=width)
        over_time.set(title=title, xlabel='time [s]', xlim=(0.0, SHOWN), ylim=(-2.9, 2.9))
        plane.set(xlabel='$x_{i1}$ [–]', xlim=(-2.6, 2.6), ylim=(-5.2, 5.2))
    axes[0, 0].set_ylabel('$x_{i1}$ [–]')
    axes[1, 0].set_ylabel('$x_{i2}$ [1/s]')
    figure.align_ylabels()
    return style.legend(figure, style.keys(labels, COLOURS))


def local_dynamics_figure(free: LocalDynamics, inhibited: LocalDynamics) -> Figure:
    """Andronov-Hopf without and with switched inhibition (paper, figure localDynamics)."""
    figure, axes = style.new_figure(3.75, 1, 2, sharey=True)
    titles = ('Andronov-Hopf', 'with switched inhibition')
    for panel, data, title in zip(axes[0], (free, inhibited), titles, strict=True):
        panel.streamplot(data.grid, data.grid, data.field[..., 0], data.field[..., 1],
                         color='#C3C8CF', linewidth=0.6, arrowsize=0.6, density=1.3)
        if data.region_radius:
            panel.add_patch(Circle(
                tuple(data.target), data.region_radius, linewidth=1.0, zorder=1.5, **style.REGION))
        panel.add_patch(Circle((0.0, 0.0), 1.0, fill=False, linewidth=0.9, zorder=2, **CYCLE))
        for trajectory in data.trajectories:
            panel.plot(*trajectory.T, color=style.MEASURED, linewidth=0.9, zorder=3)
            panel.plot(*trajectory[0], marker='o', markersize=2.5, color=style.MEASURED, zorder=3)
            if data.region_radius:
                panel.plot(*trajectory[-1], marker='o', markersize=4.5, color=style.VERMILION,
                           zorder=4)
        panel.set(title=title, xlabel='$x_1$ [–]', xlim=(-1.6, 1.6), ylim=(-1.6, 1.6))
        panel.set_aspect('equal')
    axes[0, 0].set_ylabel('$x_2$ [–]')
    return style.legend(figure, [
        style.key('trajectories', color=style.MEASURED, marker='o', markersize=2.5),
        style.key('free limit cycle', **CYCLE), Patch(label='region C', **style.REGION),
        style.key('at rest', color=style.VERMILION, marker='o', linestyle='')])


def gait_figure(gait: Gait, duty: float) -> Figure:
    """Stance of the four feet over two cycles (paper, figure gait_amble).

    Parameters
    ----------
    gait : Gait
        Lags of the legs.
    duty : float
        Duty factor β at the speed that is drawn.
    """
    figure, [[panel]] = style.new_figure(1.9)
    cycle = np.linspace(0.0, 2.0, 2001)
    swing = 0.5 * (1.0 - duty)
    position = (cycle[:, None] - np.array(gait.lag) + swing + 0.5) % 1.0 - 0.5  # fl lands at 0
    style.leg_bars(panel, cycle, np.abs(position) >= swing, 0.7)
    style.leg_rows(panel)
    panel.set(xlabel='cycle', xlim=(0.0, 2.0),
              title=f'{gait.name}: feet on the ground, duty factor {duty:.2f}')
    return figure


def hierarchy_figure() -> Figure:
    """Discrete and rhythmic primitives as hierarchies (paper, figure ContractionOfDMPs)."""
    figure, [[panel]] = style.new_figure(1.7)
    _blank(panel, (0.0, 10.0), (0.0, 2.6))
    for y, kind, canonical, colour in (
            (1.9, 'discrete', 'contracting', style.REGION['facecolor']),
            (0.7, 'rhythmic', 'transverse contracting', style.SHADES['stop requested'])):
        panel.text(0.1, y, kind, va='center', fontweight='bold')
        _box(panel, (2.6, y), 'reference  r\ncontracting', style.REGION['facecolor'])
        _arrow(panel, (3.65, y), (4.25, y))
        _box(panel, (5.3, y), f'canonical  x\n{canonical}', colour)
        _arrow(panel, (6.35, y), (6.95, y))
        _box(panel, (8.0, y), 'transformation  y\ncontracting', style.REGION['facecolor'])
    return figure


def network_figure() -> Figure:
    """Four coupled rhythmic primitives with a common reference (paper, figure coupledDMPS)."""
    figure, [[panel]] = style.new_figure(2.9)
    _blank(panel, (-4.6, 4.6), (-1.9, 1.9))
    corners = {'fl': (-1.5, 1.2), 'fr': (1.5, 1.2), 'rl': (-1.5, -1.2), 'rr': (1.5, -1.2)}
    for a, b in combinations(corners.values(), 2):
        diagonal = a[1] != b[1] and np.sign(b[0] - a[0])  # both bend below R
        _arrow(panel, a, b, '<|-|>', 14.0, bend=0.32 * float(diagonal))
    for leg, (x, y) in corners.items():
        colour = style.LEG_COLOURS[leg]
        _arrow(panel, (0.0, 0.0), (x, y), '-|>', 14.0, style.GREY)
        _arrow(panel, (x, y), (2.2 * x, y), '-|>', 14.0, colour)
        _node(panel, (x, y), 'C', colour)
        _node(panel, (2.2 * x, y), 'T', colour)
        panel.text(2.2 * x + np.sign(x) * 0.45, y, leg, va='center', ha='center', color=colour)
    _node(panel, (0.0, 0.0), 'R', style.INK)
    return figure


def _blank(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    axes.set(xlim=x, ylim=y)
    axes.set_axis_off()


def _box(axes: Axes, centre: tuple[float, float], text: str, colour: str) -> None:
    x, y = centre
    axes.add_patch(FancyBboxPatch((x - 0.95, y - 0.4), 1.9, 0.8, boxstyle='round,pad=0.08',
                                  facecolor=colour, edgecolor=style.FRAME, linewidth=0.7))
    axes.text(x, y, text, ha='center', va='center', fontsize=7.5)


def _node(axes: Axes, centre: tuple[float, float], text: str, colour: str) -> None:
    axes.plot(*centre, marker='o', markersize=19, markerfacecolor='white', markeredgecolor=colour,
              markeredgewidth=1.4, zorder=3)
    axes.text(*centre, text, ha='center', va='center', zorder=4)


def _arrow(axes: Axes, tail: tuple[float, float], head: tuple[float, float], kind: str = '-|>',
           shrink: float = 0.0, colour: str = style.FRAME, bend: float = 0.0) -> None:
    axes.add_patch(FancyArrowPatch(tail, head, arrowstyle=kind, mutation_scale=8, shrinkA=shrink,
                                   shrinkB=shrink, color=colour, linewidth=0.9, zorder=2,
                                   connectionstyle=f'arc3,rad={bend}'))


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
            FigureCanvasAgg(figure).print_png(writable(options.out / f'{name}.png'))
            print(options.out / f'{name}.png')
    return 0


def figures(suite: Suite) -> Iterator[tuple[str, Figure]]:
    """All figures with their names, in the order of the paper."""
    yield 'contraction_of_dmps', hierarchy_figure()
    yield 'coupled_dmps', network_figure()
    labels = [f'$\\omega$ = {omega:g}, $\\mu$ = {mu:g}' for omega, mu in zip(
        VAN_DER_POL_OMEGA, VAN_DER_POL_MU, strict=True)]
    yield 'van_der_pol', van_der_pol_figure(van_der_pol_data(), labels)
    robot = MujocoRobot(suite.robot_file, suite.tick_ns)
    scale = body_scale(robot.description)
    yield 'gait', gait_figure(suite.gait, suite.gait.duty(SPEED, scale))
    context = RunContext(robot.description, suite.gait, suite.parameters.inhibition,
                         suite.parameters.canonical.radius)
    recording = experiment(suite, robot, Progress())
    for draw in (target_kinematics, canonical_states):
        figure = draw(recording, context)
        if figure is not None:
            yield draw.__name__, figure
    yield 'local_dynamics', local_dynamics_figure(
        local_dynamics(False), local_dynamics(True))


def experiment(suite: Suite, robot: MujocoRobot,
               tell: Callable[[str], None] = lambda _: None) -> Recording:
    """Amble, inhibit, release: the paper's experiment in the plain loop; says how far it is."""
    loop, state = WalkingLoop(robot.description, suite.gait, suite.parameters), robot.reset()
    loop.command(SPEED)
    states, ticks = list[RobotState](), list[Tick]()
    for stopped, seconds in ((None, INHIBITED_AT), (True, RELEASED_AT - INHIBITED_AT),
                             (False, END - RELEASED_AT)):
        if stopped is not None:
            loop.request(stopped)
        for _ in range(round(seconds * 1e9 / suite.tick_ns)):
            tell(f'walked {1e-9 * suite.tick_ns * len(states):.0f} of {END:g} s')
            states.append(state)
            ticks.append(loop.tick(state))
            state = robot.step(ticks[-1].targets)
    return recording_of(states, ticks)


if __name__ == '__main__':
    sys.exit(main())
