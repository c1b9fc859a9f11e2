# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's figures, each from data to a Figure.

Figures 5 and 7 are those of the report, in :mod:`~dmp_cpg_ros.analysis.figures.over_time`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, FancyBboxPatch, Patch

from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.paper_data import LocalDynamics, VanDerPolData
from dmp_cpg_ros.core.gait.gait import Gait

COLOURS = tuple(style.LEG_COLOURS.values())

WIDTHS = (3.4, 2.4, 1.5, 0.8)
"""Line widths, so that lines on top of one another all show [pt]."""

SHOWN = 25.0
"""Time from the start that figure vdp shows [s]."""


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
    early = data.time <= SHOWN
    late = data.time >= data.time[-1] - 0.4 * SHOWN
    for column, (states, title) in enumerate(
            ((data.uncoupled, 'uncoupled'), (data.coupled, r'coupled, $K_{ij}$ = diag(4, 4)'))):
        over_time, plane = axes[:, column]
        widths = WIDTHS if column else [1.2] * len(COLOURS)
        for i, (colour, width) in enumerate(zip(COLOURS, widths, strict=True)):
            over_time.plot(data.time[early], states[early, i, 0], color=colour, linewidth=width)
            plane.plot(*states[late, i].T, color=colour, linewidth=width)
        over_time.set(title=title, xlabel='time [s]', xlim=(0.0, SHOWN), ylim=(-2.9, 2.9))
        plane.set(xlabel='$x_{i1}$ [–]', xlim=(-2.6, 2.6), ylim=(-5.2, 5.2))
    axes[0, 0].set_ylabel('$x_{i1}$ [–]')
    axes[1, 0].set_ylabel('$x_{i2}$ [1/s]')
    figure.align_ylabels()
    style.legend(figure, [style.key(label, color=colour)
                          for colour, label in zip(COLOURS, labels, strict=True)])
    return figure


def local_dynamics_figure(free: LocalDynamics, inhibited: LocalDynamics) -> Figure:
    """Andronov-Hopf without and with switched inhibition (paper, figure localDynamics)."""
    figure, axes = style.new_figure(3.75, 1, 2, sharey=True)
    for panel, data, title in zip(axes[0], (free, inhibited), (
            'Andronov-Hopf', 'with switched inhibition'), strict=True):
        panel.streamplot(data.grid, data.grid, data.field[..., 0], data.field[..., 1],
                         color='#C3C8CF', linewidth=0.6, arrowsize=0.6, density=1.3)
        if data.region_radius:
            panel.add_patch(Circle(tuple(data.target), data.region_radius, facecolor='#DCE8F5',
                                   edgecolor='#3B6EA8', linewidth=1.0, zorder=1.5))
        panel.add_patch(Circle((0.0, 0.0), 1.0, fill=False, linestyle=(0, (4, 3)),
                               linewidth=0.9, edgecolor='#777777', zorder=2))
        for trajectory in data.trajectories:
            panel.plot(*trajectory.T, color=style.MEASURED, linewidth=0.9, zorder=3)
            panel.plot(*trajectory[0], marker='o', markersize=2.5, color=style.MEASURED, zorder=3)
            if data.region_radius:
                panel.plot(*trajectory[-1], marker='o', markersize=4.5, color='#D55E00', zorder=4)
        panel.set(title=title, xlabel='$x_1$ [–]', xlim=(-1.6, 1.6), ylim=(-1.6, 1.6))
        panel.set_aspect('equal')
    axes[0, 0].set_ylabel('$x_2$ [–]')
    rest = style.key('at rest', color='#D55E00', marker='o', linestyle='')
    style.legend(figure, [
        style.key('trajectories', color=style.MEASURED, marker='o', markersize=2.5),
        style.key('free limit cycle', color='#777777', linestyle=(0, (4, 3))),
        Patch(facecolor='#DCE8F5', edgecolor='#3B6EA8', label='region C'),
        rest])
    return figure


def gait_figure(gait: Gait, duty: float) -> Figure:
    """Stance of the four feet over two cycles (paper, figure gait_amble).

    Parameters
    ----------
    gait : Gait
        Lags of the legs.
    duty : float
        Duty factor β at the speed that is drawn.
    """
    figure, axes = style.new_figure(1.9)
    panel: Axes = axes[0, 0]
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
    figure, axes = style.new_figure(1.7)
    panel: Axes = _blank(axes[0, 0], (0.0, 10.0), (0.0, 2.6))
    rows = ((1.9, 'discrete', 'contracting'), (0.7, 'rhythmic', 'transverse contracting'))
    for y, kind, canonical in rows:
        panel.text(0.1, y, kind, va='center', fontweight='bold')
        properties = ('contracting', canonical, 'contracting')
        for i, (system, what) in enumerate(zip(
                ('reference  r', 'canonical  x', 'transformation  y'), properties, strict=True)):
            _box(panel, (2.6 + 2.7 * i, y), f'{system}\n{what}',
                 '#F6E8B1' if what.startswith('transverse') else '#DCE8F5')
            if i < 2:
                _arrow(panel, (3.65 + 2.7 * i, y), (4.25 + 2.7 * i, y))
    return figure


def network_figure() -> Figure:
    """Four coupled rhythmic primitives with a common reference (paper, figure coupledDMPS)."""
    figure, axes = style.new_figure(2.9)
    panel: Axes = _blank(axes[0, 0], (-4.6, 4.6), (-1.9, 1.9))
    corners = {'fl': (-1.5, 1.2), 'fr': (1.5, 1.2), 'rl': (-1.5, -1.2), 'rr': (1.5, -1.2)}
    places = list(corners.values())
    for i, a in enumerate(places):
        for b in places[i + 1:]:
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


def _blank(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> Axes:
    axes.set(xlim=x, ylim=y)
    axes.set_axis_off()
    return axes


def _box(axes: Axes, centre: tuple[float, float], text: str, colour: str) -> None:
    x, y = centre
    axes.add_patch(FancyBboxPatch((x - 0.95, y - 0.4), 1.9, 0.8, boxstyle='round,pad=0.08',
                                  facecolor=colour, edgecolor='#555555', linewidth=0.7))
    axes.text(x, y, text, ha='center', va='center', fontsize=7.5)


def _node(axes: Axes, centre: tuple[float, float], text: str, colour: str) -> None:
    axes.plot(*centre, marker='o', markersize=19, markerfacecolor='white', markeredgecolor=colour,
              markeredgewidth=1.4, zorder=3)
    axes.text(*centre, text, ha='center', va='center', zorder=4)


def _arrow(axes: Axes, tail: tuple[float, float], head: tuple[float, float], kind: str = '-|>',
           shrink: float = 0.0, colour: str = '#555555', bend: float = 0.0) -> None:
    axes.add_patch(FancyArrowPatch(tail, head, arrowstyle=kind, mutation_scale=8, shrinkA=shrink,
                                   shrinkB=shrink, color=colour, linewidth=0.9, zorder=2,
                                   connectionstyle=f'arc3,rad={bend}'))
