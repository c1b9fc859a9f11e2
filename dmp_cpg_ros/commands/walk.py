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
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dmp_cpg_ros.commands import ros_arguments, run_folder
from dmp_cpg_ros.commands.certify import running
from dmp_cpg_ros.commands.ending_signals import InterruptedRunError, hang_up
from dmp_cpg_ros.configuration import (
    ROBOTS,
    SCENARIOS,
    config_folders,
    find_config,
    unused_sections,
)
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.errors import DmpCpgError, MissingFileError, ParameterError
from dmp_cpg_ros.core.maths.rounding import no_less
from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.core.suite_parameters import REFERENCE
from dmp_cpg_ros.primitive_files import motion_overrides
from dmp_cpg_ros.strict_yaml import load_yaml, naming
from dmp_cpg_ros.suite import Suite, load_suite, return_times
from dmp_cpg_ros.suite_table import KINDS, RECORDED_WALK, RECORDER, WALKING, namespace_rules

if TYPE_CHECKING:
    from dmp_cpg_ros.commands.fork_server import ForkServer

OK, FAILED, INTERRUPTED = 0, 1, 128
"""Exit statuses: a run that ended well, a fall or a dead node; plus the number of the signal that
ended it.
"""

VIEWED_S = 3600.0
"""Longest run of a live view without a scenario [s]."""


SHARED = {'each': 'a process per node', 'blocks': 'a process per block', 'composed': 'one process'}
"""What is said of the processes of a run."""


@dataclass(frozen=True)
class _Plan:
    """A run that nothing speaks against."""

    scenario: Scenario
    suite: Suite
    certificate: Certificate
    overrides: dict[str, Any]
    options: argparse.Namespace
    ros: ros_arguments.RosArguments

    def failures(self) -> dict[str, Any]:
        """What the scenario lets fail, for the manifest and the report."""
        listed = [{'at_s': event.at, **event.value.as_mapping()}
                  for event in self.scenario.events if event.kind == 'fail']
        return {'failures': listed} if listed else {}

    def resolved(self, **more: Any) -> dict[str, dict[str, Any]]:
        """Every parameter of every node that walks, by the node's name."""
        overrides = {**self.overrides, **more}
        return run_folder.resolved_parameters(self.suite.file, overrides, self.ros.namespace)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    return ros_arguments.run_command(_parser(), arguments, _main, parameters=True)


def _main(options: argparse.Namespace, ros: ros_arguments.RosArguments) -> int:
    ros.namespace = ros_arguments.checked_namespace(options.namespace or ros.namespace)
    if '__node' in dict(ros.remappings):
        raise ParameterError('walk runs several nodes, which cannot all have the name '
                             f"'{dict(ros.remappings)['__node']}'; valid is -r __ns:=NAMESPACE")
    from dmp_cpg_ros.commands.fork_server import ForkServer

    with ForkServer() as server:  # imports what nodes need while this process does
        from dmp_cpg_ros.commands.suite_domain import alone_in_domain

        with alone_in_domain(ros.namespace, lambda: _planned(options, ros)) as plan:
            return _walk(plan, server)


def _planned(options: argparse.Namespace, ros: ros_arguments.RosArguments) -> _Plan:
    """Read everything; raises DmpCpgError for what cannot be run."""
    _take_robot(options)
    # In lock-step nobody may command, and an hour would pass without anything to see.
    stands_by = options.view and options.scenario is None and not options.lock_step
    default = 'stand_by' if stands_by else 'start_stop'
    named = default if options.scenario is None else options.scenario
    scenario = load_scenario(named)
    if stands_by:
        scenario = replace(scenario, duration_s=VIEWED_S)
    overrides = _overrides(scenario, options, ros)
    file = ros_arguments.given_file(options.parameters, ros, '--parameters')
    if scenario.parameters:
        load_suite(file, None, ros.namespace)  # what is wrong in it is not the scenario's
        with naming(find_config(named, SCENARIOS)):
            load_suite(file, scenario.parameters, ros.namespace)
    suite = load_suite(file, overrides, ros.namespace)
    _check_events(scenario, suite, named)
    certificate = running(suite).certificate(whole=True)
    if not certificate.holds and not overrides.get('allow_uncertified', False):
        raise ParameterError(
            f'the gait is not certified to stop: {certificate.explained()} (certify --suggest '
            'proposes gains that hold; --set allow_uncertified:=true walks all the same)')
    for section in unused_sections(suite.file, ros.namespace, KINDS):
        print(f"walk: '{suite.file}': section '{section}' means no node in namespace "
              f"'{ros.namespace or '/'}'; '/**/{section.rpartition('/')[2]}' would",
              file=sys.stderr)
    if options.video:
        from dmp_cpg_ros.commands import film

        film.checked_film_path(Path(options.video))
    return _Plan(scenario, suite, certificate, overrides, options, ros)


def _take_robot(options: argparse.Namespace) -> None:
    """Take a robot of the package that stands in the place of a scenario for what it is."""
    if options.robot is None and options.scenario in robots():
        try:
            find_config(options.scenario, SCENARIOS)
        except MissingFileError:
            options.robot, options.scenario = options.scenario, None


def robots() -> set[str]:
    """Names of the robots in the package's config folders."""
    return {path.stem for folder in config_folders() for path in (folder / ROBOTS).glob('*.yaml')}


def _overrides(scenario: Scenario, options: argparse.Namespace, ros: ros_arguments.RosArguments
               ) -> dict[str, Any]:
    """Parameters in place of the file's; those that are named later win."""
    overrides = {**scenario.parameters, **motion_overrides(options.motion or ''),
                 **ros.parameters, **dict(map(ros_arguments.read_parameter, options.set))}
    if options.robot is not None:
        overrides['robot'] = str(find_config(options.robot, ROBOTS).resolve())
    if options.rate is not None:
        overrides['control_rate'] = options.rate
    return overrides


def _check_events(scenario: Scenario, suite: Suite, named: str) -> None:
    """Raise DmpCpgError for an event that the suite cannot have."""
    with naming(named):
        scenario.timeline(suite.tick_ns)
    for event in scenario.events:
        gait = event.value if event.kind == 'gait' else (
            event.value.get('gait') if event.kind == 'set' else None)
        if gait is not None:
            with naming(f'{named}, event at {event.at:g} s'):
                suite.gaits.named(gait)
    events = {event.kind for event in scenario.events}
    if 'push' in events and suite.robot.physics != 'mujoco':
        raise ParameterError(f'pushes need physics: mujoco, not {suite.robot.physics}')
    if 'fail' in events and not suite.robot.failures_allowed:
        raise ParameterError(f"scenario '{scenario.name}' lets components fail, which needs "
                             'failures_allowed:=true')
    if 'votes' in events and not suite.parameters.voting.voting:
        raise ParameterError(f"scenario '{scenario.name}' votes, which needs voting:=true")


def _walk(plan: _Plan, server: ForkServer) -> int:
    """Run, record and report; returns the exit status."""
    begin, options = time.monotonic(), plan.options
    folder = run_folder.make_run_folder(options.out)
    print(f'{plan.scenario.name}: {plan.scenario.duration_s:g} s, {plan.suite.gait.name}, '
          f'{"lock-step" if options.lock_step else "real time"}, '
          f'{SHARED[options.processes]}, '
          f'{1e9 / plan.suite.tick_ns:g} Hz', flush=True)
    bound = plan.certificate.time_to_rest + (
        0.0 if options.lock_step else running(plan.suite).time_ahead(plan.suite.request_lead_s))
    print(f'certificate: {plan.certificate.explained()}; {plan.certificate.contraction_grade} '
          f'grade; at rest at most {no_less(bound)} s after a request', flush=True)
    made = 'metrics' if options.no_report else 'report'
    status, ending = _run(plan, folder, server)
    try:
        if (folder / 'bag').is_dir():
            if status > INTERRUPTED:
                print(f'walk: making the {made}, which a second Ctrl-C skips', file=sys.stderr)
            status = max(status, _analyze(plan, folder))
            if options.video is not None:
                _film(folder, options.video)
    except KeyboardInterrupt:
        print(f'walk: {made} skipped; to make the {made}: analyze {folder}', file=sys.stderr)
        status = INTERRUPTED + signal.SIGINT
    for told in ending:
        print(f'walk: {told}', file=sys.stderr)
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
    try:
        path = find_config(name, SCENARIOS)
    except MissingFileError as error:
        hint = f'{name} is a robot: walk --robot {name}; ' if str(name) in robots() else ''
        raise MissingFileError(f'{hint}{error}') from error
    return Scenario.from_mapping(load_yaml(path), f"'{path}'")


def _run(plan: _Plan, folder: Path, server: ForkServer) -> tuple[int, list[str]]:
    """Bring the suite up, play, bring it down; returns the exit status and what to say at the
    end.
    """
    from dmp_cpg_ros.commands.suite_run import run_suite

    options, ros = plan.options, plan.ros
    resolved = plan.resolved(gated=True)
    for values in resolved.values():
        values.update(lock_step=options.lock_step, expected_nodes=list(RECORDED_WALK))
    returns = return_times(plan.suite.file, resolved, options.respawn and not options.lock_step,
                           ros.namespace)
    for name, seconds in returns.items():
        resolved[name]['return_time'] = seconds
    stamped = resolved[REFERENCE]['stamped_cmd_vel']
    resolved[RECORDER] = {'output': str(folder / 'bag'), 'stamped_cmd_vel': stamped,
                          'expected_nodes': [kind.name for kind in WALKING]}
    rules = [*ros.remappings, *namespace_rules(ros.namespace)]
    file = run_folder.write_parameters(folder, resolved)
    arguments = ['--ros-args', '--params-file', str(file), *ros.others,
                 *(word for name, to in rules for word in ('-r', f'{name}:={to}'))]
    try:
        whole, told = run_suite(
            plan.scenario, plan.suite.tick_ns, arguments, folder / 'logs', _say, server,
            lock_step=options.lock_step, processes=options.processes, stamped=stamped,
            view=options.view, visualization=options.visualization, respawn=options.respawn)
        return OK if whole else FAILED, told
    except InterruptedRunError as error:
        print(f'walk: {error}; the recording up to here is complete', file=sys.stderr)
        return INTERRUPTED + error.signal, []
    except DmpCpgError as error:
        print(f'walk: {error}; see {folder / "logs"}', file=sys.stderr)
        return FAILED, []


def _analyze(plan: _Plan, folder: Path) -> int:
    """Write the run's folder and print what it says; returns the exit status."""
    # Late: figures and films cost a second of imports, which who is refused need not wait for.
    from dmp_cpg_ros.commands.analyze import analyze_run, print_facts
    from dmp_cpg_ros.commands.progress import Progress

    lock_step = plan.options.lock_step
    try:
        results = analyze_run(
            folder, robot_file=plan.suite.robot_file, parameters=plan.resolved(),
            certificate=[entry.as_mapping() for entry in plan.certificate.inequalities],
            seeds={'robot': plan.suite.robot.seed}, lock_step=lock_step,
            report=not plan.options.no_report, scenario=plan.scenario.name,
            **plan.failures(), processes=plan.options.processes, tell=Progress())
    except (DmpCpgError, OSError) as error:  # such as a full disk
        print(f'walk: cannot analyze the recording: {error}', file=sys.stderr)
        return FAILED
    print_facts(results, lock_step)
    if results.report is not None:
        print(f'report: {os.path.relpath(results.report)}')
    return FAILED if results.metrics['robot']['fell'] else OK


def _film(folder: Path, given: str) -> None:
    """Film the run; one that cannot be drawn here is no failure of the run."""
    from dmp_cpg_ros.commands import film
    from dmp_cpg_ros.commands.progress import Progress

    path = Path(given) if given else folder / f'walk.{"mp4" if film.has_encoder() else "gif"}'
    try:
        frames = film.film_run(folder, path, tell=Progress('video: '))
        print(f'video: {os.path.relpath(path)}, {frames} frames')
    except (DmpCpgError, OSError) as error:
        print(f'walk: no video: {error}', file=sys.stderr)


def _say(time_s: float, text: str) -> None:
    stamp = '        ' if math.isnan(time_s) else f'{time_s:7.2f} s'
    try:
        print(f'{stamp}  {text}', flush=True)
    except BrokenPipeError:  # as in walk | head
        hang_up()


def _parser() -> argparse.ArgumentParser:
    scenarios = {path.stem for folder in config_folders()
                 for path in (folder / 'scenarios').glob('*.yaml')}
    parser = argparse.ArgumentParser(
        prog='walk',
        description='Bring the suite up, play a scenario, record, report, shut everything down.',
        epilog='Exit status: 0 when all went well, 1 when the robot fell or a node died, 2 for '
        'bad input or where a suite is running already, 130 for Ctrl-C. '
        f'Scenarios: {", ".join(sorted(scenarios))}.')
    add = parser.add_argument
    add('scenario', nargs='?',
        help='scenario file, by its path or in config/scenarios (default: start_stop, and with '
        '--view, but for --lock-step, an hour for your commands); a robot of config/robots, such '
        'as go2, stands for --robot')
    add('--lock-step', action='store_true',
        help='wait for every target, so that the run does not depend on the speed of the machine')
    sharing = parser.add_mutually_exclusive_group()
    sharing.add_argument(
        '--processes', choices=('each', 'blocks'), default='each',
        help='a process for every node (default), or for every block: gait, supervision, '
        'legs, robot')
    sharing.add_argument('--composed', dest='processes', action='store_const', const='composed',
                         help='all nodes in one process and one executor')
    add('--respawn', action='store_true',
        help='start processes that end before their time again, all but the robot and what only '
        'looks on')
    add('--robot', metavar='FILE',
        help='robot file, by its path or in config/robots (default: that of the parameter file)')
    add('--motion', metavar='FILE', help='motion of the feet, from learn --motion')
    add('--parameters', metavar='FILE', help='parameter file (default: config/suite.yaml)')
    add('--set', metavar='NAME:=VALUE', action='append', default=[],
        help='parameter of every node that has it; may be repeated')
    add('--namespace', metavar='NS', default='',
        help='namespace of all nodes and topics, /clock and /diagnostics included')
    add('--rate', metavar='HZ', type=float, help='control rate (default: 250)')
    add('--out', metavar='DIR', type=Path, help="the run's folder (default: a new one in runs)")
    add('--video', metavar='FILE', nargs='?', const='',
        help='draw the run as FILE.gif or, with imageio-ffmpeg, FILE.mp4, after its end '
        "(default: walk.mp4 or walk.gif in the run's folder)")
    add('--view', action='store_true',
        help='serve a page that shows and drives the robot, on this machine only, and print its '
        'address')
    add('--visualization', action='store_true',
        help='publish markers and the path of the body, for RViz and Foxglove')
    add('--no-report', action='store_true', help='write metrics and manifest only')
    return parser


if __name__ == '__main__':
    sys.exit(main())
