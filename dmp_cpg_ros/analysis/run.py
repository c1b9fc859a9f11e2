# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a bag to a run's folder: metrics, manifest, figures, pictures and report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.figures.catalogue import write_figures
from dmp_cpg_ros.analysis.metrics.summary import compute_metrics
from dmp_cpg_ros.analysis.pictures import Draw, write_pictures
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.analysis.report import render
from dmp_cpg_ros.analysis.strict_json import plain, write_json


@dataclass(frozen=True)
class RunResults:
    """What an analysis found and wrote.

    Attributes
    ----------
    folder : Path
        Where everything is.
    metrics, manifest : dict
        As in ``metrics.json`` and ``manifest.json``.
    report : Path or None
        None when no report was asked for.
    pictures : dict of str to (Path, str)
        PNG files and captions by name.
    """

    folder: Path
    metrics: dict[str, Any]
    manifest: dict[str, Any]
    report: Path | None = None
    pictures: dict[str, tuple[Path, str]] = field(default_factory=dict)


def write_results(
        folder: Path, recording: Recording, context: RunContext, manifest: Mapping[str, Any],
        certificate: Sequence[Any] | None = None, draw: Draw | None = None,
        report: bool = True) -> RunResults:
    """Write everything that a run's folder holds besides its bag.

    Parameters
    ----------
    folder : Path
        Made when missing.
    recording : Recording
        The run.
    context : RunContext
        What is known besides.
    manifest : mapping
        As from :func:`~dmp_cpg_ros.analysis.manifest.build_manifest`; written as
        ``manifest.json``.
    certificate : sequence, optional
        The inequalities, passed through.
    draw : callable, optional
        Draws the robot (see :mod:`dmp_cpg_ros.analysis.pictures`); no pictures without.
    report : bool
        Whether to draw figures and write the report; the two JSON files are written in any case,
        and first.

    Returns
    -------
    RunResults
    """
    folder.mkdir(parents=True, exist_ok=True)
    metrics: dict[str, Any] = plain(compute_metrics(recording, context, certificate))
    facts: dict[str, Any] = plain(manifest)
    write_json(folder / 'metrics.json', metrics)
    write_json(folder / 'manifest.json', facts)
    if not report:
        return RunResults(folder, metrics, facts)
    figures = write_figures(recording, context, folder / 'figures')
    pictures = {} if draw is None else write_pictures(recording, context, folder / 'figures', draw)
    page = folder / 'report.html'
    page.write_text(render(*_headings(recording, context, facts), metrics, facts, figures,
                           pictures), encoding='utf-8')
    return RunResults(folder, metrics, facts, page, pictures)


def _headings(recording: Recording, context: RunContext, manifest: Mapping[str, Any],
              ) -> tuple[str, str]:
    """Title and subtitle of the report."""
    scenario, (start, end) = manifest.get('scenario'), recording.span
    name = scenario.get('name') if isinstance(scenario, Mapping) else scenario
    gait = 'Walk' if context.gait is None else context.gait.name.capitalize()
    title = f'{gait}: {name}' if isinstance(name, str) and name else (
        f'{gait} with sparse inhibition')
    lock_step = manifest.get('lock_step')
    pace = [] if lock_step is None else ['lock-step' if lock_step else 'real time']
    robot = [] if context.robot is None else [context.robot.name]
    return title, ' · '.join([*robot, f'{end - start:.1f} s of robot time', *pace,
                              f'{sum(recording.counts.values()):,} messages'])
