# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``analyze``: from a recorded bag to figures, metrics and a report; needs no ROS."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.bag import find_bag, payload_digests
from dmp_cpg_ros.analysis.context import RunContext, find_parameter
from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.analysis.loading import load_recording
from dmp_cpg_ros.analysis.manifest import build_manifest
from dmp_cpg_ros.analysis.other_tables import OTHER_TABLES, other_tables
from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.analysis.run import RunResults, write_results
from dmp_cpg_ros.analysis.strict_json import read_json, write_json
from dmp_cpg_ros.analysis.tables import (
    as_text,
    markdown_table,
    side_by_side,
    write_csv,
    write_parquet,
)
from dmp_cpg_ros.commands.progress import Progress
from dmp_cpg_ros.commands.ros_arguments import BAD_INPUT, RosArguments, one_line, run_command
from dmp_cpg_ros.commands.run_folder import picture_taker, run_context, run_of
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.files import writable
from dmp_cpg_ros.process import give_back_memory
from dmp_cpg_ros.strict_yaml import naming

PARTLY = 1
"""Exit status where some of several runs could not be used."""

BAG_ALONE = {'note': 'made from a bag alone: versions, commit and host are those of the analysis'}


def analyze_run(
        run_dir: Path | str, *, out: Path | str | None = None,
        robot_file: Path | str | None = None, parameters: Mapping[str, Any] | None = None,
        certificate: Sequence[Any] | None = None, seeds: Mapping[str, int] | None = None,
        lock_step: bool | None = None, pictures: bool = True, report: bool = True,
        export: Callable[[Recording], None] | None = None,
        tell: Callable[[str], None] = lambda text: None, **manifest_facts: Any) -> RunResults:
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
    export : callable (Recording), optional
        Gets the recording with everything that is in it.
    tell : callable (str), optional
        Is told how far it is.
    **manifest_facts
        More for the manifest, such as ``scenario``.

    Returns
    -------
    RunResults

    Raises
    ------
    MissingFileError, DataError, ParameterError
        If there is no readable bag, an earlier result cannot be read, or ``robot_file`` cannot be
        used.
    """
    bag = find_bag(run_dir)
    run = run_of(bag, Path(run_dir))
    earlier = {} if run is None or parameters is not None else read_json(run / 'manifest.json')
    if certificate is None and run is not None:
        certificate = read_json(run / 'metrics.json').get('certificate')
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
    return write_results(folder, _recording(bag, context, export, tell), context, manifest,
                         certificate, draw, report, tell)


LARGE_ARRAY = 4 << 20
"""Memory that goes back to the system with an array; that of an hour's arrays, which come one
after the other, otherwise adds up [bytes].
"""

SHOWN = {'joint_targets': ('position',), 'canonical_state': ('position',)}
"""Fields that a report shows of topics of which it does not show all."""


def _recording(bag: Path, context: RunContext, export: Callable[[Recording], None] | None,
               tell: Callable[[str], None]) -> Recording:
    """Recording of which nobody but the caller keeps the arrays."""
    recording = load_recording(bag, joint_names=context.joint_names,
                               only=None if export else SHOWN, tell=tell)
    if export is not None:
        tell('tables')
        export(recording)
    return recording


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    logging.basicConfig(format='%(levelname)s: %(message)s', level=logging.WARNING)
    parser = argparse.ArgumentParser(
        prog='analyze',
        description='Make figures, metrics.json, manifest.json and report.html of a recorded run; '
        'of several runs metrics.json and manifest.json of each, and one table with the runs side '
        'by side.',
        epilog='Exit status: 0 when all went well, 1 when some of several runs could not be used, '
        '2 for bad input.')
    add = parser.add_argument
    add('bags', metavar='BAG_OR_RUN', type=Path, nargs='+',
        help="rosbag2 folder or file (MCAP or SQLite), or a run's folder with bag/ inside")
    add('--out', metavar='DIR', type=Path,
        help="where to write (default: the run's folder; for a bare bag NAME_analysis beside it); "
        'of several runs, the table as comparison.md and comparison.json')
    add('--robot', metavar='FILE', type=Path,
        help="the robot's YAML file (default: the one that the run's manifest names, else the "
        "package's own)")
    add('--no-pictures', action='store_true', help='take no pictures of the robot')
    add('--csv', metavar='DIR', type=Path,
        help='write what was recorded as tables in DIR: NAME.csv, named as what Recording holds, '
        f'and {", ".join(OTHER_TABLES)}. Units are in the names of the columns, but those of '
        "inhibition_gains and posture_feedback, which have the topics' rows by name, in the "
        'reference')
    add('--parquet', metavar='DIR', type=Path, help='the same as NAME.parquet; needs pyarrow')
    return run_command(parser, arguments, _analyze)


def _analyze(options: argparse.Namespace, _: RosArguments) -> int:
    give_back_memory(LARGE_ARRAY)

    def export(recording: Recording) -> None:
        tables = recording.tables() | other_tables(find_bag(options.bags[0]), recording)
        for folder, write in ((options.csv, write_csv), (options.parquet, write_parquet)):
            if folder is not None:
                write(tables, folder)

    if len(options.bags) > 1:
        return _compare(options)
    results = analyze_run(options.bags[0], out=options.out, robot_file=options.robot,
                          pictures=not options.no_pictures, tell=Progress(),
                          export=export if options.csv or options.parquet else None)
    print_facts(results, results.manifest.get('lock_step'))
    print(f'report: {results.report}')
    return 0


def _compare(options: argparse.Namespace) -> int:
    """Several runs side by side."""
    if options.csv or options.parquet:
        raise ParameterError('--csv and --parquet write the tables of one run')
    runs, problems = {}, []
    parent = Path(os.path.commonpath([path.absolute().parent for path in options.bags]))
    for path in options.bags:
        tell, run = Progress(f'{path}: '), str(path.absolute().relative_to(parent))
        others = (f'{run} ({k})' for k in count(2))
        name = run if run not in runs else next(of for of in others if of not in runs)
        try:
            with naming(path):
                results = analyze_run(path, robot_file=options.robot, report=False, tell=tell)
            runs[name] = results.metrics
        except DmpCpgError as error:  # the others are compared all the same
            problems.append(one_line(str(error)))
    if runs:
        _tell_side_by_side(runs, options.out)
    for problem in problems:
        print(f'analyze: left out: {problem}', file=sys.stderr)
    return (PARTLY if runs else BAD_INPUT) if problems else 0


def _tell_side_by_side(runs: Mapping[str, Mapping[str, Any]], out: Path | None) -> None:
    head, rows = side_by_side(runs)
    table = markdown_table(head, [[as_text(cell) for cell in row] for row in rows])
    print(table)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        writable(out / 'comparison.md').write_text(f'{table}\n', encoding='utf-8')
        write_json(out / 'comparison.json', runs)


def print_facts(results: RunResults, lock_step: bool | None) -> None:
    """Print what a run's metrics say, marked where it holds or does not."""
    marks = {True: '[ok]', False: '[NO]', None: '[--]'}
    for fact in facts(results.metrics, lock_step):
        print(f'{marks[fact.holds]} {fact.statement}: {fact.finding}')


if __name__ == '__main__':
    sys.exit(main())
