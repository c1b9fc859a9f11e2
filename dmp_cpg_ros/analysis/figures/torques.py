# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Joint torques of a few cycles, and how near the whole run came to the limits."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.analysis.figures.footfall import steady_window
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS


def draw(recording: Recording, context: RunContext) -> Figure | None:
    """Draw the torques; None when none were measured."""
    joints = recording.joints
    if not joints.time.size or not np.isfinite(joints.effort).any():
        return None
    window = steady_window(recording, 3) or style.stop_window(recording)
    rows = style.rows_in(joints.time, window)
    limits = None
    if context.robot is not None:
        limits = np.array([leg.torque_limit for leg in context.robot.legs])
    figure, axes = style.new_figure(4.6, 3, 1 if limits is None else 2, sharex='col',
                                    width_ratios=None if limits is None else (3.0, 1.0))
    for k, joint in enumerate(JOINTS_OF_LEG):
        panel = axes[k, 0]
        style.plot_legs(panel, joints.time[rows], joints.effort[rows, k::3])
        panel.set_ylabel(f'{joint} [N m]')
        style.limit_view(panel, window)
        if limits is not None:
            _limits(panel, float(limits[:, k].min()))
            _shares(axes[k, 1], np.abs(joints.effort[:, k::3]) / limits[:, k])
    axes[-1, 0].set_xlabel('time [s]')
    if limits is not None:
        axes[-1, 1].set_xlabel('share of limit [%]')
    style.leg_legend(figure)
    figure.align_ylabels()
    return figure


def _limits(axes: Axes, limit: float) -> None:
    low, high = axes.get_ylim()
    for value in (-limit, limit):
        if low <= value <= high:
            axes.axhline(value, color=style.GREY, linewidth=0.9, linestyle=style.DASHED)


def _shares(axes: Axes, share: np.ndarray) -> None:
    for leg, y, of in zip(LEGS, range(len(LEGS) - 1, -1, -1), 100.0 * share.T, strict=True):
        axes.barh(y, np.nanpercentile(of, 99.0), height=0.62, color=style.LEG_COLOURS[leg],
                  alpha=0.75)
        axes.plot([np.nanmax(of)] * 2, [y - 0.31, y + 0.31], color=style.INK, linewidth=1.2)
    axes.axvline(100.0, color=style.GREY, linewidth=0.9, linestyle=style.DASHED)
    axes.set(xlim=(0.0, 108.0), yticks=range(len(LEGS)),
             yticklabels=[leg.upper() for leg in reversed(LEGS)])
    axes.grid(visible=False, axis='y')
