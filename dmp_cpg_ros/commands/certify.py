# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``certify``: the certificate of a parameter file, with exit status 1 when it fails."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dmp_cpg_ros.commands.ros_arguments import parse_arguments
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.certificates.certify import Certificate, certify
from dmp_cpg_ros.core.certificates.inequality import Inequality
from dmp_cpg_ros.core.certificates.proof import proof_of
from dmp_cpg_ros.core.certificates.suggest import Suggestion, suggest_gains
from dmp_cpg_ros.core.certificates.votes import VotesNeeded, votes_needed
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.suite import Suite, load_suite

HOLDS, FAILS, BAD_INPUT = 0, 1, 2
"""Exit statuses."""

_EXAMPLES = """\
exit status:
  0 every required inequality holds    1 one fails, and is named    2 the input cannot be used

examples:
  certify
  certify my_suite.yaml --gait trot --suggest
  certify --json | python3 -m json.tool
"""


@dataclass(frozen=True)
class Certified:
    """A parameter file with its certificate.

    Attributes
    ----------
    suite : Suite
        What the file says.
    certificate : Certificate
        Of its parameters.
    suggestion : Suggestion or None
        Gains that hold, when asked for and found.
    votes : VotesNeeded
        How many legs can stop the gait, whether they may vote or not.
    """

    suite: Suite
    certificate: Certificate
    suggestion: Suggestion | None
    votes: VotesNeeded


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    options, ros = parse_arguments(_parser(), arguments, parameters=True)
    try:
        if options.file and ros.parameters_file:
            raise ParameterError('give FILE or --params-file, not both')
        overrides = dict(ros.parameters)
        if options.gait is not None:
            overrides['gait'] = options.gait
        if options.robot is not None:
            overrides['robot'] = str(find_config(options.robot).resolve())
        suite = load_suite(options.file or ros.parameters_file, overrides, ros.namespace)
        certified = certify_suite(suite, options.suggest)
        if options.proof is not None and certified.certificate.holds:
            options.proof.write_text(json.dumps(_proof(suite), indent=1) + '\n', encoding='utf-8')
    except OSError as error:
        print(f'certify: {options.proof}: {error.strerror}', file=sys.stderr)
        return BAD_INPUT
    except DmpCpgError as error:
        print(f'certify: {error}', file=sys.stderr)
        return BAD_INPUT
    if options.json:
        print(json.dumps(_as_mapping(certified, options.suggest), indent=2, allow_nan=False))
    else:
        print('\n'.join(_report(certified, options.suggest)))
    for entry in certified.certificate.failing:
        print(f'certify: fails: {entry.explained()}', file=sys.stderr)
    return HOLDS if certified.certificate.holds else FAILS


def _proof(suite: Suite) -> dict[str, Any]:
    """Exact witnesses; raises DmpCpgError where there are none."""
    from dmp_cpg_ros.robot.model_reader import load_description

    p = suite.parameters
    if p.voting.voting or p.canonical.contact_feedback:
        raise ParameterError('voting and contact_feedback have no exact proof; --proof needs both '
                             'to be off')
    network = GaitNetwork(p.canonical, suite.gait, body_scale(load_description(suite.robot_file)))
    return proof_of(network, p.inhibition, p.reference, p.leg, p.posture, suite.tick_ns * 1e-9)


def certify_suite(suite: Suite, suggest: bool = False) -> Certified:
    """Certify what a parameter file says.

    Parameters
    ----------
    suite : Suite
        What it says.
    suggest : bool
        Whether to look for gains that hold.

    Raises
    ------
    DmpCpgError
        If the robot's model cannot be read.
    """
    from dmp_cpg_ros.robot.model_reader import load_description

    p = suite.parameters
    network = GaitNetwork(p.canonical, suite.gait, body_scale(load_description(suite.robot_file)))
    running = (network, p.inhibition, p.reference, p.leg, p.posture, suite.tick_ns * 1e-9)
    votes = votes_needed(network, p.inhibition, p.voting,
                         operating_range(network, p.inhibition, p.reference))
    suggestion = suggest_gains(*running, p.voting) if suggest else None
    return Certified(suite, certify(*running, voting=p.voting), suggestion, votes)


def _report(certified: Certified, suggest: bool) -> list[str]:
    suite, certificate = certified.suite, certified.certificate
    lines = [f'{suite.file}: {suite.gait.name} at up to {certificate.omega_max:.4g} rad/s, '
             f'{1e9 / suite.tick_ns:g} Hz', '']
    lines += _table(certificate.inequalities)
    if certificate.rest_phase:
        at_rest = ', '.join(
            f'{leg} {math.degrees(ahead):.1f} deg at {radius:.3f}' for leg, ahead, radius
            in zip(LEGS, certificate.rest_phase, certificate.rest_radius, strict=True))
        lines += ['', f'at rest, phase ahead of its place and radius: {at_rest}']
    lines += ['', f'from a request on the reference goes at most '
              f'{certificate.distance_to_rest:.4g} m, at its largest speed',
              '', *_votes(certified)]
    lines += ['', 'certificate: ' + (
        f'holds; contraction under inhibition is of {certificate.contraction_grade} grade; '
        f"sampled, not proved: {', '.join(certificate.sampled) or 'nothing'}"
        if certificate.holds else 'FAILS: ' + ', '.join(
            entry.name for entry in certificate.failing))]
    return lines + (['', *_suggested(certified)] if suggest else [])


def _table(inequalities: Sequence[Inequality]) -> list[str]:
    """Two lines for each inequality: both sides with the margin, and what it means."""
    rows = [('inequality', '', 'left side', 'right side', 'margin', 'unit', 'grade')]
    for entry in inequalities:
        rows.append((entry.name, _verdict(entry), f'{entry.left_is} = {entry.left:.4g}',
                     f'{entry.right_is} = {entry.right:.4g}', f'{entry.margin:.4g}',
                     entry.unit or '-', entry.grade))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ['  '.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
             for row in rows]
    told = [f'    {entry.sentence}' for entry in inequalities]
    return [lines[0], *(line for pair in zip(lines[1:], told, strict=True) for line in pair)]


def _votes(certified: Certified) -> list[str]:
    """How many legs can stop the gait by their votes."""
    votes, voting = certified.votes, certified.suite.parameters.voting
    alone = ('certainly stops' if votes.certain == 1 else
             'may stop' if votes.powerless == 0 else 'cannot stop')
    needed = 'no number of legs is certain to be enough' if votes.certain is None else (
        f'votes needed: {votes.certain} of {len(LEGS)}')
    return [
        f'voting is {"on" if voting.voting else "off"}; a full vote has the weight '
        f'{votes.clamp.limit:.4g}, a gain of {votes.clamp.gain:.4g} 1/s: {needed}; '
        f'{votes.powerless} or fewer cannot stop the gait, one leg alone {alone} it',
        'gains of each from which 1, 2, ... votes certainly stop it: '
        + ', '.join(f'{gain:.4g}' for gain in votes.enough)
        + ' 1/s; below which they cannot: '
        + ', '.join(f'{gain:.4g}' for gain in votes.too_weak) + ' 1/s']


def _verdict(entry: Inequality) -> str:
    if entry.holds:
        return 'holds'
    return 'FAILS' if entry.required else 'no (not required)'


def _suggested(certified: Certified) -> list[str]:
    suggestion = certified.suggestion
    if suggestion is None:
        return ['no coupling and inhibition gains within their ranges make it hold: change what '
                'the failing inequality names']
    if not suggestion.changed:
        return ['the present gains hold']
    return ['these gains hold:', f'    coupling_gain: {suggestion.coupling_gain:g}    # [1/s]',
            f'    inhibition_gain: {suggestion.inhibition_gain:g}    # [1/s]']


def _as_mapping(certified: Certified, suggest: bool) -> dict[str, Any]:
    suite = certified.suite
    mapping: dict[str, Any] = {'file': str(suite.file), 'gait': suite.gait.name,
                               'tick_s': suite.tick_ns * 1e-9,
                               **certified.certificate.as_mapping(),
                               'votes': _votes_mapping(certified.votes)}
    if suggest:
        found = certified.suggestion
        mapping['suggestion'] = None if found is None else {
            'coupling_gain': found.coupling_gain, 'inhibition_gain': found.inhibition_gain}
    return mapping


def _votes_mapping(votes: VotesNeeded) -> dict[str, Any]:
    def finite(gains: Sequence[float]) -> list[float | None]:
        return [gain if math.isfinite(gain) else None for gain in gains]

    return {'limit': votes.clamp.limit, 'gain': votes.clamp.gain, 'needed': votes.certain,
            'powerless': votes.powerless, 'enough': finite(votes.enough),
            'too_weak': finite(votes.too_weak)}


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
        help='write witnesses that check_proof.py checks exactly, when it holds')
    add('--suggest', action='store_true', help='propose coupling and inhibition gains that hold')
    return parser


if __name__ == '__main__':
    sys.exit(main())
