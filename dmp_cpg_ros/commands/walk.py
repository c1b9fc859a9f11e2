# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``walk``: the whole suite in one command, from nothing to a report."""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.commands.analyze import MARKS, analyze_run
from dmp_cpg_ros.commands.ros_arguments import (
    RosArguments,
    checked_namespace,
    parse_arguments,
    read_parameter,
)
from dmp_cpg_ros.commands.run_folder import make_run_folder, resolved_parameters, write_parameters
from dmp_cpg_ros.configuration import (
    config_folders,
    find_config,
    load_yaml,
    unused_sections,
)
from dmp_cpg_ros.core.certificates.certify import Certificate, certify
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.primitive_files import motion_overrides
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import Suite, load_suite
from dmp_cpg_ros.suite_table import KINDS, WALKING, namespace_rules

OK, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 128
"""Exit statuses: a run that ended well, a fall or a dead node, bad input; plus the number of the
signal that ended it.
"""

DEFAULT_SCENARIO = 'scenarios/start_stop.yaml'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    options, ros = parse_arguments(_parser(), arguments, parameters=True)
    try:
        scenario = load_scenario(options.scenario)
        overrides = {
            **scenario.parameters, **motion_overrides(options.motion or ''), **ros.parameters,
            **dict(map(read_parameter, options.set))}
        ros.namespace = checked_namespace(options.namespace or ros.namespace)
        if options.parameters and ros.parameters_file:
            raise ParameterError('give --parameters or --params-file, not both')
        if options.robot is not None:
            overrides['robot'] = str(find_config(options.robot).resolve())
        if options.rate is not None:
            overrides['control_rate'] = options.rate
        file = options.parameters or ros.parameters_file
        suite = load_suite(file, overrides, ros.namespace)
        if suite.robot.physics != 'mujoco' and any(e.kind == 'push' for e in scenario.events):
            raise ParameterError(f'pushes need physics: mujoco, not {suite.robot.physics}')
        _check_votes(scenario, suite)
        certificate = _certificate(suite)
        if not certificate.holds and not overrides.get('allow_uncertified', False):
            raise ParameterError(
                f'the gait is not certified to stop: {certificate.explained()} (certify --suggest '
                'proposes gains that hold; --set allow_uncertified:=true walks all the same)'
            )
        if options.video:
            film_path(options.video, Path())
        for section in unused_sections(suite.file, ros.namespace, KINDS):
            print(f"walk: '{suite.file}': section '{section}' means no node in namespace "
                  f"'{ros.namespace or '/'}'; '/**/{section.rpartition('/')[2]}' would",
                  file=sys.stderr)
        from dmp_cpg_ros.commands.suite_run import alone_in_domain

        with alone_in_domain(ros.namespace):
            return _walk(scenario, suite, certificate, overrides, options, ros)
    except DmpCpgError as error:
        print(f'walk: {error}', file=sys.stderr)
        return BAD_INPUT


def _walk(
    scenario: Scenario,
    suite: Suite,
    certificate: Certificate,
    overrides: dict[str, Any],
    options: argparse.Namespace,
    ros: RosArguments,
) -> int:
    """Run, record and report; returns the exit status."""
    begin = time.monotonic()
    folder = make_run_folder(options.out)
    print(
        f'{scenario.name}: {scenario.duration_s:g} s, {suite.gait.name}, '
        f'{"lock-step" if options.lock_step else "real time"}, '
        f'{"one process" if options.composed else "a process per node"}, '
        f'{1e9 / suite.tick_ns:g} Hz',
        flush=True,
    )
    print(
        f'certificate: {certificate.explained()}; {certificate.contraction_grade} grade; '
        f'at rest at most {certificate.time_to_rest:.3f} s after a request',
        flush=True,
    )
    status = _run(scenario, suite, overrides, folder, options, ros)
    recorded = (folder / 'bag').is_dir()
    try:
        if recorded and status > INTERRUPTED:
            print('walk: making the report, which a second Ctrl-C skips', file=sys.stderr)
        if recorded:
            found = _analyze(scenario, suite, certificate, overrides, folder, options, ros)
            status = max(status, found)
        if recorded and options.video is not None:
            _film(folder, film_path(options.video, folder))
    except KeyboardInterrupt:
        print(f'walk: report skipped; make it with: analyze {folder}', file=sys.stderr)
        status = INTERRUPTED + signal.SIGINT
    print(f'{folder.name}: {time.monotonic() - begin:.0f} s in all')
    return status


def load_scenario(name: str | Path) -> Scenario:
    """Read a scenario file.

    Parameters
    ----------
    name : str or Path
        File by its path, in the config folder, or in its ``scenarios``.

    Raises
    ------
    MissingFileError, DataError
        If it is not there or cannot be used.
    """
    known = Path(name)
    if not known.is_file() and known.parent == Path('.'):
        known = Path('scenarios') / known
    path = find_config(known)
    return Scenario.from_mapping(load_yaml(path), f"'{path}'")


def _run(
    scenario: Scenario,
    suite: Suite,
    overrides: dict[str, Any],
    folder: Path,
    options: argparse.Namespace,
    ros: RosArguments,
) -> int:
    """Bring the suite up, play, bring it down; returns the exit status."""
    from dmp_cpg_ros.commands.suite_run import InterruptedRunError, RunPlan, run_suite

    shared = {**overrides, 'lock_step': options.lock_step, 'gated': True}
    resolved = resolved_parameters(
        suite.file, {name: value for name, value in shared.items() if name != 'lock_step'},
        ros.namespace,
    )
    for values in resolved.values():
        values['lock_step'] = options.lock_step
        values['expected_nodes'] = list(KINDS)
    parameters = write_parameters(
        folder,
        resolved,
        {'output': str(folder / 'bag'), 'expected_nodes': [kind.name for kind in WALKING]},
    )
    rules = [*ros.remappings, *namespace_rules(ros.namespace)]
    remapped = [word for name, to in rules for word in ('-r', f'{name}:={to}')]
    plan = RunPlan(
        scenario, suite.tick_ns, parameters, folder / 'logs', options.lock_step, options.composed,
        [*ros.others, *remapped],
    )
    try:
        run_suite(plan, _say)
        return OK
    except InterruptedRunError as error:
        print(f'walk: {error}; the recording up to here is complete', file=sys.stderr)
        return INTERRUPTED + error.signal
    except DmpCpgError as error:
        print(f'walk: {error}; see {folder / "logs"}', file=sys.stderr)
        return FAILED


def _analyze(
    scenario: Scenario,
    suite: Suite,
    certificate: Certificate,
    overrides: dict[str, Any],
    folder: Path,
    options: argparse.Namespace,
    ros: RosArguments,
) -> int:
    """Write the run's folder and print what it says; returns the exit status."""
    try:
        results = analyze_run(
            folder,
            robot_file=suite.robot_file,
            parameters=resolved_parameters(suite.file, overrides, ros.namespace),
            seeds={'robot': suite.robot.seed},
            lock_step=options.lock_step,
            report=not options.no_report,
            scenario=scenario.name,
            composed=options.composed,
            certificate=[entry.as_mapping() for entry in certificate.inequalities],
        )
    except DmpCpgError as error:
        print(f'walk: cannot analyze the recording: {error}', file=sys.stderr)
        return FAILED
    for fact in facts(results.metrics, options.lock_step):
        print(f'{MARKS[fact.holds]} {fact.statement}: {fact.finding}')
    if results.report is not None:
        print(f'report: {os.path.relpath(results.report)}')
    return FAILED if results.metrics['robot']['fell'] else OK


def _check_votes(scenario: Scenario, suite: Suite) -> None:
    """Raise ParameterError when a scenario votes where nobody counts."""
    votes = any(event.kind == 'votes' for event in scenario.events)
    if votes and not suite.parameters.voting.voting:
        raise ParameterError(f"scenario '{scenario.name}' votes, which needs voting:=true")


def film_path(given: str, folder: Path) -> Path:
    """Return the film's file, by default in the run's folder; raises ParameterError before the
    run when it could not be written after it.
    """
    from dmp_cpg_ros.commands.film_files import checked_film_path, has_encoder

    return checked_film_path(
        Path(given) if given else folder / f'walk.{"mp4" if has_encoder() else "gif"}'
    )


def _film(folder: Path, path: Path) -> None:
    """Film the run; one that cannot be drawn here is no failure of the run."""
    from dmp_cpg_ros.commands.film import film_run

    try:
        frames = film_run(folder, path)
        print(f'video: {os.path.relpath(path)}, {frames} frames')
    except (DmpCpgError, OSError) as error:
        print(f'walk: no video: {error}', file=sys.stderr)


def _certificate(suite: Suite) -> Certificate:
    """Certificate of the parameters that the nodes will run with."""
    p = suite.parameters
    network = GaitNetwork(p.canonical, suite.gait, body_scale(load_description(suite.robot_file)))
    return certify(network, p.inhibition, p.reference, p.leg, p.posture, suite.tick_ns * 1e-9,
                   voting=p.voting)


def _say(time_s: float, text: str) -> None:
    stamp = '        ' if math.isnan(time_s) else f'{time_s:7.2f} s'
    print(f'{stamp}  {text}', flush=True)


def scenario_names() -> list[str]:
    """Names of the scenarios of the package."""
    return sorted({path.stem for folder in config_folders()
                   for path in (folder / 'scenarios').glob('*.yaml')})


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='walk',
        description='Bring the suite up, play a scenario, record, report, shut everything down.',
        epilog='Exit status: 0 when all went well, 1 when the robot fell or a node died, 2 for '
        'bad input or where a suite is running already, 130 for Ctrl-C. '
        f'Scenarios: {", ".join(scenario_names())}.',
    )
    parser.add_argument(
        'scenario',
        nargs='?',
        default=DEFAULT_SCENARIO,
        help=f'scenario file, by its path or in config/scenarios (default: {DEFAULT_SCENARIO})',
    )
    parser.add_argument(
        '--lock-step',
        action='store_true',
        help='wait for every target, so that the run does not depend on the speed of the machine',
    )
    parser.add_argument(
        '--composed', action='store_true', help='all nodes in one process and one executor'
    )
    parser.add_argument(
        '--robot', metavar='FILE', help='robot file (default: the one of the parameter file)'
    )
    parser.add_argument(
        '--motion', metavar='FILE', help='motion of the feet, from learn --motion'
    )
    parser.add_argument(
        '--parameters', metavar='FILE', help='parameter file (default: config/suite.yaml)'
    )
    parser.add_argument(
        '--set',
        metavar='NAME:=VALUE',
        action='append',
        default=[],
        help='parameter of every node that has it; may be repeated',
    )
    parser.add_argument(
        '--namespace',
        metavar='NS',
        default='',
        help='namespace of all nodes and topics, /clock and /diagnostics included',
    )
    parser.add_argument('--rate', metavar='HZ', type=float, help='control rate (default: 250)')
    parser.add_argument(
        '--out', metavar='DIR', type=Path, help="the run's folder (default: a new one in runs)"
    )
    parser.add_argument(
        '--video',
        metavar='FILE',
        nargs='?',
        const='',
        help='draw the run as FILE.gif or, with imageio-ffmpeg, FILE.mp4, after its end (default: '
        "walk.mp4 or walk.gif in the run's folder)",
    )
    parser.add_argument('--no-report', action='store_true', help='write metrics and manifest only')
    return parser


if __name__ == '__main__':
    sys.exit(main())
