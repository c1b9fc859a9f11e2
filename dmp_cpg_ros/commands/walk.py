# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``walk``: the whole suite in one command, from nothing to a report."""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.facts import facts
from dmp_cpg_ros.commands.analyze import MARKS, analyze_run
from dmp_cpg_ros.commands.run_folder import make_run_folder, resolved_parameters, write_parameters
from dmp_cpg_ros.configuration import find_config, load_yaml
from dmp_cpg_ros.core.certificates.certify import Certificate, certify
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.primitive_files import motion_overrides
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import Suite, load_suite

OK, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit statuses: a run that ended well, a fall or a dead node, bad input, Ctrl-C."""

DEFAULT_SCENARIO = 'scenarios/start_stop.yaml'


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    options = _parser().parse_args(arguments)
    begin = time.monotonic()
    try:
        scenario = load_scenario(options.scenario)
        motion = motion_overrides(options.motion or '')
        overrides = {**scenario.parameters, **motion, **_pairs(options.set)}
        if options.robot is not None:
            overrides['robot'] = str(find_config(options.robot).resolve())
        if options.rate is not None:
            overrides['control_rate'] = options.rate
        suite = load_suite(options.parameters, overrides)
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
        folder = make_run_folder(options.out)
    except DmpCpgError as error:
        print(f'walk: {error}', file=sys.stderr)
        return BAD_INPUT
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
    status = _run(scenario, suite, overrides, folder, options)
    if (folder / 'bag').is_dir():
        status = max(status, _analyze(scenario, suite, certificate, overrides, folder, options))
    if options.video is not None and (folder / 'bag').is_dir():
        _film(folder, film_path(options.video, folder))
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
) -> int:
    """Bring the suite up, play, bring it down; returns the exit status."""
    from dmp_cpg_ros.commands.suite_run import InterruptedRunError, RunPlan, run_suite

    shared = {**overrides, 'lock_step': options.lock_step, 'gated': True}
    resolved = resolved_parameters(
        suite.file, {name: value for name, value in shared.items() if name != 'lock_step'}
    )
    for values in resolved.values():
        values['lock_step'] = options.lock_step
        values['expected_nodes'] = [*KINDS, 'bag_recorder']
    parameters = write_parameters(
        folder, resolved, {'output': str(folder / 'bag'), 'expected_nodes': list(KINDS)}
    )
    plan = RunPlan(
        scenario, suite.tick_ns, parameters, folder / 'logs', options.lock_step, options.composed
    )
    try:
        run_suite(plan, _say)
        return OK
    except InterruptedRunError:
        print('walk: interrupted; the recording up to here is complete', file=sys.stderr)
        return INTERRUPTED
    except DmpCpgError as error:
        print(f'walk: {error}; see {folder / "logs"}', file=sys.stderr)
        return FAILED


KINDS = (
    'reference_filter',
    'canonical_oscillators',
    'leg_transformation',
    'inhibition',
    'posture_control',
    'mujoco_robot',
)
"""Kinds of nodes that a run has besides its recorder."""


def _analyze(
    scenario: Scenario,
    suite: Suite,
    certificate: Certificate,
    overrides: dict[str, Any],
    folder: Path,
    options: argparse.Namespace,
) -> int:
    """Write the run's folder and print what it says; returns the exit status."""
    try:
        results = analyze_run(
            folder,
            robot_file=suite.robot_file,
            parameters=resolved_parameters(suite.file, overrides),
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
    if votes and not suite.parameters.inhibition.voting:
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
    return certify(network, p.inhibition, p.reference, p.leg, p.posture, suite.tick_ns * 1e-9)


def _say(time_s: float, text: str) -> None:
    stamp = '        ' if math.isnan(time_s) else f'{time_s:7.2f} s'
    print(f'{stamp}  {text}', flush=True)


def _pairs(texts: Sequence[str]) -> dict[str, Any]:
    """Values given as ``NAME:=VALUE``, as ROS does."""
    import yaml

    pairs = {}
    for text in texts:
        name, separator, value = text.partition(':=')
        if not separator or not name:
            raise ParameterError(f"'{text}' must be NAME:=VALUE, such as gait:=trot")
        pairs[name] = yaml.safe_load(value)
    return pairs


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='walk',
        description='Bring the suite up, play a scenario, record, report, shut everything down.',
        epilog='Exit status: 0 when all went well, 1 when the robot fell or a node died, 2 for '
        'bad input, 130 for Ctrl-C.',
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
        help='the robot waits for every target: no run depends on the speed of the machine',
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
