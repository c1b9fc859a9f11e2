# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's figures show what the paper says they show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from core_examples import GAITS
from matplotlib.collections import PolyCollection
from PIL import Image

from dmp_cpg_ros.analysis.figures import style
from dmp_cpg_ros.core.robot_model.state import LEGS

pytest.importorskip('mujoco')
from dmp_cpg_ros.studies import paper_figures

FREE = paper_figures.local_dynamics(False)
HELD = paper_figures.local_dynamics(True)


def test_coupling_brings_the_van_der_pol_oscillators_together() -> None:
    data = paper_figures.van_der_pol_data(duration=40.0)
    late = data.time > 20.0

    def apart(states: np.ndarray) -> float:
        return float(np.ptp(states[late, :, 0], axis=1).max())

    assert apart(data.uncoupled) > 3.0 and apart(data.coupled) < 0.2
    assert np.abs(data.coupled[late, :, 0]).max() > 1.5  # and they still oscillate
    with style.applied():
        figure = paper_figures.van_der_pol_figure(data, ['a', 'b', 'c', 'd'])
    drawn = figure.axes[1].get_lines()[0].get_ydata()
    assert np.array_equal(drawn, data.coupled[data.time <= paper_figures.SHOWN, 0, 0])


def test_without_inhibition_all_trajectories_end_on_the_limit_cycle() -> None:
    assert np.allclose(np.hypot(*FREE.trajectories[:, -1].T), 1.0, atol=1e-3)
    assert np.ptp(FREE.trajectories[:, -1], axis=0).min() > 1.0


def test_switched_inhibition_takes_every_trajectory_to_one_point_in_the_region() -> None:
    ends = HELD.trajectories[:, -1]
    assert np.ptp(ends, axis=0).max() < 1e-3
    assert np.hypot(*(ends[0] - HELD.target)) < HELD.region_radius


def test_the_fields_differ_in_the_region_only() -> None:
    states = np.stack(np.meshgrid(HELD.grid, HELD.grid), axis=-1)
    inside = np.hypot(*np.moveaxis(states - HELD.target, -1, 0)) <= HELD.region_radius
    differ = np.abs(HELD.field - FREE.field).max(axis=-1) > 1e-12
    assert not np.any(differ & ~inside)
    assert np.mean(differ[inside]) > 0.99
    with style.applied():
        titles = [axes.get_title(loc='left') for axes in
                  paper_figures.local_dynamics_figure(FREE, HELD).axes]
    assert titles == ['Andronov-Hopf', 'with switched inhibition']


@pytest.mark.parametrize('name', ['amble', 'trot'])
def test_the_gait_diagram_has_bars_of_the_duty_factor_at_the_lags(name: str) -> None:
    gait, duty = GAITS[name], 0.6
    with style.applied():
        axes = paper_figures.gait_figure(gait, duty).axes[0]
    rows = [bars for bars in axes.collections if isinstance(bars, PolyCollection)]
    assert len(rows) == len(LEGS)
    for lag, bars in zip(gait.lag, rows, strict=True):
        spans = np.array([(path.vertices[:, 0].min(), path.vertices[:, 0].max())
                          for path in bars.get_paths()])
        assert (spans[:, 1] - spans[:, 0]).sum() == pytest.approx(2.0 * duty, abs=0.01)
        starts = spans[spans[:, 0] > 0.0, 0]
        assert np.allclose(starts % 1.0, lag, atol=0.01) or np.allclose(
            starts % 1.0, (lag - 1.0) % 1.0, atol=0.01)


def test_the_command_writes_every_figure(tmp_path: Path) -> None:
    from dmp_cpg_ros.studies.paper_figures import main

    assert main(['--out', str(tmp_path)]) == 0
    names = {path.stem for path in tmp_path.glob('*.png')}
    assert names == {'contraction_of_dmps', 'coupled_dmps', 'van_der_pol', 'gait',
                     'target_kinematics', 'canonical_states', 'local_dynamics'}
    for path in tmp_path.glob('*.png'):
        assert len(Image.open(path).convert('L').getcolors()) > 20, path.name


def test_a_file_that_is_not_there_ends_with_status_2(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from dmp_cpg_ros.studies.paper_figures import main

    assert main(['none.yaml', '--out', str(tmp_path)]) == 2
    assert 'none.yaml' in capsys.readouterr().err
