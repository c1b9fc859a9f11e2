# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``analyze``: from a recorded bag to figures, metrics and a report; needs no ROS."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.bag import find_bag, payload_digests
from dmp_cpg_ros.analysis.context import find_parameter
from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.manifest import build_manifest
from dmp_cpg_ros.analysis.run import RunResults, write_results
from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.commands.run_folder import picture_taker, read_json, run_context

BAG_ALONE = {'note': 'made from a bag alone: versions, commit and host are those of the analysis'}


def analyze_run(
        run_dir: Path | str, *, out: Path | str | None = None,
        robot_file: Path | str | None = None, parameters: Mapping[str, Any] | None = None,
        certificate: Sequence[Any] | None = None, seeds: Mapping[str, int] | None = None,
        lock_step: bool | None = None, pictures: bool = True, report: bool = True,
        **manifest_facts: Any) -> RunResults:
    """Analyze a run and write its folder.

    Parameters
    ----------
    run_dir : path-like
        Run's folder with ``bag/`` inside, or a bag.
    out : path-like, optional
        Where to write; without, the run's folder, or ``NAME_analysis`` beside a bare bag ``NAME``.
        A bag is bare unless it is named by the folder around it, or a run's manifest is beside it.
    robot_file : path-like, optional
        The robot that walked; without, the one that the parameters name, else the package's own.
    parameters : mapping, optional
        Parameters of the nodes, nested as they like. Without, an earlier ``manifest.json`` stays
        as it is and its parameters are used.
    certificate : sequence, optional
        The inequalities; without, those of an earlier ``metrics.json``.
    seeds : mapping, optional
        Seeds by name.
    lock_step : bool, optional
        Whether the run was in lock-step; its manifest then has digests.
    pictures, report : bool
        Whether to take pictures of the robot; whether to draw figures and write the report at all.
    **manifest_facts
        More for the manifest, such as ``scenario``.

    Returns
    -------
    RunResults

    Raises
    ------
    MissingFileError, DataError, ParameterError
        If there is no readable bag, or ``robot_file`` cannot be used.
    """
    bag = find_bag(run_dir)
    run = _run_of(bag, Path(run_dir))
    earlier = {} if run is None or parameters is not None else read_json(run / 'manifest.json')
    if certificate is None and run is not None:
        certificate = read_json(run / 'metrics.json').get('certificate')
    recording = load_recording(bag, only={'joint_targets': ('position',)})
    if parameters is None:
        parameters = earlier.get('parameters')
    context, robot_path = run_context(parameters, robot_file)
    manifest = earlier or build_manifest(
        parameters, seeds, payload_digests(bag) if lock_step else None, lock_step=lock_step,
        robot=find_parameter(parameters, 'robot') if context.robot is None else context.robot.name,
        **(BAG_ALONE if parameters is None else {}), **manifest_facts)
    drawn = pictures and report and context.robot is not None
    draw = picture_taker(robot_path, context.world) if drawn else None
    bag = bag.resolve()
    beside = bag.with_name(f'{bag.name if bag.is_dir() else bag.stem}_analysis')
    folder = Path(out) if out is not None else run or beside
    return write_results(folder, recording, context, manifest, certificate, draw, report)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    logging.basicConfig(format='%(levelname)s: %(message)s', level=logging.WARNING)
    parser = argparse.ArgumentParser(
        prog='analyze',
        description='Make figures, metrics.json, manifest.json and report.html of a recorded run.')
    add = parser.add_argument
    add('bag', metavar='BAG_OR_RUN', type=Path,
        help="rosbag2 folder or file (MCAP or SQLite), or a run's folder with bag/ inside")
    add('--out', metavar='DIR', type=Path,
        help="where to write (default: the run's folder; for a bare bag NAME_analysis beside it)")
    add('--robot', metavar='FILE', type=Path,
        help="the robot's YAML file (default: the one that the run's manifest names, else the "
        "package's own)")
    add('--no-pictures', action='store_true', help='take no pictures of the robot')
    return run_command(parser, arguments, _analyze)


def _analyze(options: argparse.Namespace, _: RosArguments) -> int:
    results = analyze_run(options.bag, out=options.out, robot_file=options.robot,
                          pictures=not options.no_pictures)
    print_facts(results, results.manifest.get('lock_step'))
    print(f'report: {results.report}')
    return 0


def print_facts(results: RunResults, lock_step: bool | None) -> None:
    """Print what a run's metrics say, marked where it holds or does not."""
    marks = {True: '[ok]', False: '[NO]', None: '[--]'}
    for fact in facts(results.metrics, lock_step):
        print(f'{marks[fact.holds]} {fact.statement}: {fact.finding}')


def _run_of(bag: Path, given: Path) -> Path | None:
    """Run's folder around a bag; None for a bare bag."""
    if bag == given / 'bag':
        return given
    folder = bag.resolve() if bag.is_dir() else bag.resolve().parent
    is_run = folder.name == 'bag' and (folder.parent / 'manifest.json').is_file()
    return folder.parent if is_run else None


if __name__ == '__main__':
    sys.exit(main())
