# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``certify``: the certificate of a parameter file, with exit status 1 when it fails."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from dmp_cpg_ros.analysis.strict_json import to_json, write_json
from dmp_cpg_ros.commands.ros_arguments import RosArguments, given_file, run_command
from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core.certificates import inequality, suggest, votes
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.inequality import Certificate
from dmp_cpg_ros.core.certificates.network import Setting, split_premises
from dmp_cpg_ros.core.contraction.delays import Premise
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.maths.rounding import no_less
from dmp_cpg_ros.core.proofs import proof
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.suite import Suite, load_suite

HOLDS, FAILS = 0, 1
"""Exit statuses."""

_EXAMPLES = """\
exit status:
  0 every required inequality holds    1 one fails, and is named    2 the input cannot be used

examples:
  certify
  certify my_suite.yaml --gait trot --suggest
  certify --json | python3 -m json.tool
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    return run_command(_parser(), arguments, _certify, parameters=True)


def _certify(options: argparse.Namespace, ros: RosArguments) -> int:
    file = given_file(options.file, ros, 'FILE')
    overrides = dict(ros.parameters)
    if options.gait is not None:
        overrides['gait'] = options.gait
    if options.robot is not None:
        overrides['robot'] = str(find_config(options.robot, ROBOTS).resolve())
    suite = load_suite(file, overrides, ros.namespace)
    p, of, of_gait = suite.parameters, running(suite), running_setting(suite)
    needed = votes.votes_needed(of_gait.network, p.inhibition, p.voting, of_gait.span)
    certificate = of.certificate(whole=True)
    suggestion = suggest.suggest_gains(of) if options.suggest else None
    if options.proof is not None and certificate.holds:
        if p.voting.voting or p.canonical.contact_feedback or of.others:
            raise ParameterError('voting, contact_feedback and auto_gait have no exact proof; '
                                 '--proof needs all of them to be off')
        write_json(options.proof, proof.proof_of(of_gait))
    if options.json:
        content = _mapping(suite, certificate, needed) | {
            'split_couplings': [
                {**premise._asdict(), 'holds': premise.holds, 'kept_by': keeper}
                for keeper, each in _premises(of_gait, certificate).items() for premise in each]}
        if options.suggest:
            content['suggestion'] = suggestion and {
                name: getattr(suggestion, name) for name in ('coupling_gain', 'inhibition_gain')}
        print(to_json(content), end='')
    else:
        lines = [*_report(suite, of, certificate, needed)]
        lines[-2:-2] = ['', *_told_premises(_premises(of_gait, certificate))]
        print('\n'.join([*lines, '', *_suggested(suggestion)] if options.suggest else lines))
    for entry in certificate.failing:
        print(f'certify: fails: {entry.explained()}', file=sys.stderr)
    return HOLDS if certificate.holds else FAILS


def running(suite: Suite) -> Running:
    """What the nodes of a suite compute their certificate from, other gaits included that they
    choose among; raises ParameterError for one that there is not.
    """
    from dmp_cpg_ros.robot.model_reader import load_description

    scale = body_scale(load_description(suite.robot_file))
    others = tuple(gait for gait in suite.gaits.chosen(suite.parameters.gait_choice)
                   if gait.name != suite.gait.name)
    return Running(suite.parameters, suite.gait, scale, suite.tick_ns * 1e-9, others)


def running_setting(suite: Suite) -> Setting:
    """What the certificate of the gait that a suite names is computed from."""
    from dmp_cpg_ros.robot.model_reader import load_description

    p, scale = suite.parameters, body_scale(load_description(suite.robot_file))
    return Setting.of(GaitNetwork(p.canonical, suite.gait, scale), p, suite.tick_ns * 1e-9)


def _report(suite: Suite, of: Running, certificate: Certificate, needed: votes.VotesNeeded
            ) -> list[str]:
    gaits, lead = ', '.join(gait.name for gait in (of.gait, *of.others)), suite.request_lead_s
    lines = [f'{suite.file}: {gaits} at up to {certificate.omega_max:.4g} rad/s, '
             f'{1e9 / suite.tick_ns:g} Hz', '', *_table(certificate.inequalities)]
    if certificate.rest_phase:
        at_rest = ', '.join(
            f'{leg} {math.degrees(ahead):.1f} deg at {radius:.3f}' for leg, ahead, radius
            in zip(LEGS, certificate.rest_phase, certificate.rest_radius, strict=True))
        lines += ['', f'at rest, phase ahead of its place and radius: {at_rest}']
    verdict = ('FAILS: ' + ', '.join(entry.name for entry in certificate.failing)
               if certificate.failing else
               f'holds; contraction under inhibition is of {certificate.contraction_grade} grade; '
               f"sampled, not proved: {', '.join(certificate.sampled) or 'nothing'}; of the "
               f"equation, not the step: {', '.join(certificate.continuous) or 'nothing'}")
    voting = 'on' if suite.parameters.voting.voting else 'off'
    enough, too_weak = (', '.join(f'{gain:.4g}' for gain in gains)
                        for gains in (needed.enough, needed.too_weak))
    if suite.parameters.inhibition.auto:
        others = [leg for leg in LEGS if leg not in certificate.legs]
        lines += ['', f"auto takes one of {', '.join(certificate.legs)}, each of them certified"
                  + (f"; {', '.join(others)} cannot hold the gait alone" if others else '')]
    return [*lines, '', f'from a request on the reference goes at most '
            f'{no_less(certificate.distance_to_rest)} m, at its largest speed',
            f'in real time {lead:g} s later, and time_to_rest is '
            f'{of.time_ahead(lead):.4g} s longer, '
            f'time_to_walking {lead:g} s: request_lead, of the request and of arming', '',
            f'voting is {voting}; {_votes(needed)}',
            f'gains of each from which 1, 2, ... votes certainly stop it: {enough} 1/s; below '
            f'which they cannot: {too_weak} 1/s', '', f'certificate: {verdict}']


def _table(inequalities: Sequence[inequality.Inequality]) -> list[str]:
    """Two lines for each inequality: both sides with the margin, and what it means."""
    rows = [('inequality', '', 'left side', 'right side', 'margin', 'unit', 'grade')]
    rows += [(entry.name,
              'holds' if entry.holds else 'FAILS' if entry.required else 'no (not required)',
              f'{entry.left_is} = {entry.left:.4g}', f'{entry.right_is} = {entry.right:.4g}',
              f'{entry.margin:.4g}', entry.unit or '-', entry.grade) for entry in inequalities]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    head, *lines = ('  '.join(map(str.ljust, row, widths)).rstrip() for row in rows)
    told = (f'    {entry.sentence}' for entry in inequalities)
    return [head, *(line for pair in zip(lines, told, strict=True) for line in pair)]


def _premises(s: Setting, certificate: Certificate) -> dict[str, list[Premise]]:
    """Premises of ``carried_coupling`` by who keeps them; of ``auto``, with the first leg."""
    inhibition = replace(s.parameters.inhibition, inhibited_legs=certificate.legs[:1]) if (
        s.parameters.inhibition.auto) else s.parameters.inhibition
    kept, asked = split_premises(
        replace(s, parameters=replace(s.parameters, inhibition=inhibition)), certificate.contact)
    return {'parameters': kept, 'nobody': asked}


def _told_premises(premises: dict[str, list[Premise]]) -> list[str]:
    """Two lines for each premise, as in the table."""
    rows = [(premise.name, {'nobody': 'is asked for'}.get(
        keeper, 'holds' if premise.holds else 'no'), f'{premise.value:.4g} <= {premise.limit:.4g}',
        premise.unit or '-', premise.sentence) for keeper, each in premises.items()
        for premise in each]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)][:-1]
    return ['carried_coupling is for couplings that are split over nodes, as the suite does not; '
            'it takes for granted', *(line for *cells, sentence in rows for line in (
                '  '.join(map(str.ljust, cells, widths)).rstrip(), f'    {sentence}'))]


def _votes(needed: votes.VotesNeeded) -> str:
    """How many legs can stop the gait by their votes."""
    alone = ('certainly stops' if needed.certain == 1 else
             'may stop' if needed.powerless == 0 else 'cannot stop')
    number = ('no number of legs is certain to be enough' if needed.certain is None else
              f'votes needed: {needed.certain} of {len(LEGS)}')
    return (f'a full vote has the weight {needed.clamp.limit:.4g}, a gain of '
            f'{needed.clamp.gain:.4g} 1/s: {number}; {needed.powerless} or fewer cannot stop the '
            f'gait, one leg alone {alone} it')


def _suggested(suggestion: suggest.Suggestion | None) -> list[str]:
    if suggestion is None:
        return ['no coupling and inhibition gains within their ranges make it hold: change what '
                'the failing inequality names']
    if not suggestion.changed:
        return ['the present gains hold']
    return ['these gains hold:', f'    coupling_gain: {suggestion.coupling_gain:g}    # [1/s]',
            f'    inhibition_gain: {suggestion.inhibition_gain:g}    # [1/s]']


def _mapping(suite: Suite, certificate: Certificate, needed: votes.VotesNeeded) -> dict[str, Any]:
    return {'file': str(suite.file), 'gait': suite.gait.name, 'tick_s': suite.tick_ns * 1e-9,
            **certificate.as_mapping(),
            'votes': {'limit': needed.clamp.limit, 'gain': needed.clamp.gain,
                      'needed': needed.certain, 'powerless': needed.powerless,
                      'enough': needed.enough, 'too_weak': needed.too_weak}}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='certify', epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
        description='Print what the parameters of the suite guarantee: that the legs synchronise, '
                    'that the gait can be stopped, and when.')
    add = parser.add_argument
    add('file', metavar='FILE', nargs='?', help='ROS 2 parameter file (default: suite.yaml)')
    add('--gait', metavar='NAME', help='gait instead of the one that the file names')
    add('--robot', metavar='FILE', help='robot file instead of the one that the file names')
    add('--json', action='store_true', help='print JSON instead of a table')
    add('--proof', metavar='FILE', type=Path,
        help='write witnesses that check_proof.py and, of the step that runs, check_step.py and '
        'check_rest.py check exactly, when it holds')
    add('--suggest', action='store_true', help='propose coupling and inhibition gains that hold')
    return parser


if __name__ == '__main__':
    sys.exit(main())
