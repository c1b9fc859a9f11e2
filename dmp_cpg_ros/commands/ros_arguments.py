# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the command lines of commands share: ``--ros-args``, and how bad input is refused."""

from __future__ import annotations

import argparse
import logging
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from dmp_cpg_ros.commands.ending_signals import is_unread, leave_output
from dmp_cpg_ros.core.errors import DmpCpgError, ParameterError
from dmp_cpg_ros.strict_yaml import parse_yaml

BAD_INPUT = 2
"""Exit status of a command whose arguments or files cannot be used."""

UNREAD = 128 + 13
"""Exit status of a command whose output nobody reads: that of a shell for SIGPIPE."""

LONGEST_LINE = 5000
"""Length of an error on the terminal; the names of all parameters fit."""

LONGEST_NAMESPACE = 160
"""Length of a namespace with which the longest names of topics and services still fit."""

LEVELS = ('debug', 'info', 'warn', 'error', 'fatal')
"""Log levels of ROS; Python's have the same names."""

VALUED = {'-p': '--param', '-r': '--remap', '-e': '--enclave', '--param': '--param',
          '--remap': '--remap', '--params-file': '--params-file', '--log-level': '--log-level',
          '--log-config-file': '--log-config-file', '--enclave': '--enclave'}
"""Flags of ROS with a value, by their long form."""

SWITCHES = tuple(f'--{able}-{what}-logs' for able in ('enable', 'disable')
                 for what in ('rosout', 'stdout', 'external-lib'))


@dataclass
class RosArguments:
    """What stood after ``--ros-args``.

    Attributes
    ----------
    parameters : dict of str to value
        Of ``-p NAME:=VALUE``.
    parameters_file : str or None
        Of ``--params-file``.
    remappings : list of (str, str)
        Of ``-r FROM:=TO``, without ``__ns``.
    namespace : str
        Of ``-r __ns:=NAMESPACE``; empty without.
    others : list of str
        Flags that concern logging and security, as given.
    """

    parameters: dict[str, Any] = field(default_factory=dict)
    parameters_file: str | None = None
    remappings: list[tuple[str, str]] = field(default_factory=list)
    namespace: str = ''
    others: list[str] = field(default_factory=list)


def run_command(parser: argparse.ArgumentParser, arguments: Sequence[str] | None,
                run: Callable[[argparse.Namespace, RosArguments], int], *,
                parameters: bool = False) -> int:
    """Body of a command: parse, run, say in one line what cannot be used.

    Parameters
    ----------
    parser, arguments, parameters
        As for :func:`parse_arguments`.
    run : callable (options, ros arguments) → int
        What the command does; returns the exit status.

    Returns
    -------
    int
        Exit status: ``BAD_INPUT`` after a DmpCpgError or OSError; ``UNREAD`` where the reader of
        a pipe has gone, as that of ``certify | head``.
    """
    options, ros = parse_arguments(parser, arguments, parameters=parameters)
    try:
        status = run(options, ros)
        print(end='', flush=True)
        return status
    except DmpCpgError as error:
        problem = str(error)
    except OSError as error:
        if isinstance(error, BrokenPipeError) and is_unread():
            leave_output()
            return UNREAD
        problem = f"cannot write '{error.filename or 'output'}': {error.strerror}"
    print(f'{parser.prog}: {one_line(problem)}', file=sys.stderr)
    return BAD_INPUT


def one_line(text: str) -> str:
    """Text of libraries, or from files, as one line that changes nothing in a terminal."""
    words = '; '.join(line.strip() for line in text.splitlines() if line.strip())
    shown = ''.join(c if c.isprintable() else ascii(c)[1:-1] for c in words[:LONGEST_LINE])
    return shown if len(words) <= LONGEST_LINE else f'{shown}...'


def parse_arguments(parser: argparse.ArgumentParser, arguments: Sequence[str] | None, *,
                    parameters: bool = False) -> tuple[argparse.Namespace, RosArguments]:
    """Parse a command line with ``--ros-args``; exits with status 2 where it is wrong.

    Parameters
    ----------
    parser : ArgumentParser
        For the arguments that are not ROS's.
    arguments : sequence of str, optional
        Default: those of the process.
    parameters : bool
        Whether the command has the parameters of the suite; others refuse all parameters.
    """
    own, ros = _split(list(sys.argv[1:] if arguments is None else arguments))
    parser.add_argument_group('ROS').add_argument(
        '--ros-args', nargs='...',
        help='[-r __ns:=NAMESPACE] [-r __node:=NAME] [--log-level LEVEL]'
        + (' [-p NAME:=VALUE] [--params-file FILE]' if parameters else '')
        + '; ends at the end of the line or at --')
    options = parser.parse_args(own)
    try:
        read = _read(ros)
        if not parameters and (read.parameters or read.parameters_file):
            what = next(iter(read.parameters), f'--params-file {read.parameters_file}')
            raise ParameterError(
                f"there is no parameter '{what}': {parser.prog} has none; valid after --ros-args "
                'are -r __ns:=NAMESPACE, -r __node:=NAME and --log-level LEVEL')
    except DmpCpgError as error:
        parser.error(str(error))
    return options, read


def number(text: str) -> float:
    """Type of an argument: a finite number."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'{text} must be finite')
    return value


def positive(text: str) -> float:
    """Type of an argument: a finite number above zero."""
    value = number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f'{text} must be positive')
    return value


def within(least: float, most: float) -> Callable[[str], float]:
    """Type of an argument: a number between two others, or one of them."""
    def limited(text: str) -> float:
        value = number(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f'{text} must be from {least:g} to {most:g}')
        return value

    return limited


def whole_within(least: int, most: int) -> Callable[[str], int]:
    """Type of an argument: a whole number between two others, or one of them."""
    def limited(text: str) -> int:
        value = within(least, most)(text)
        if not value.is_integer():
            raise argparse.ArgumentTypeError(f'{text} must be a whole number')
        return int(value)

    return limited


def read_pair(text: str) -> tuple[str, str]:
    """Read ``NAME:=VALUE``; raises ParameterError when it is no such pair."""
    name, separator, value = text.partition(':=')
    if not separator or not name or not value:
        raise ParameterError(f"'{text}' must be NAME:=VALUE, such as gait:=trot")
    return name, value


def read_parameter(text: str) -> tuple[str, Any]:
    """Read ``NAME:=VALUE`` with a value in YAML."""
    name, value = read_pair(text)
    if ':' in name:
        raise ParameterError(f"'{text}' is for one node; values here hold for every node that has "
                             f'the parameter: {text.rpartition(":")[0].rpartition(":")[2]}:=...')
    return name, parse_yaml(value, f"'{name}'")


def given_file(own: str | None, ros: RosArguments, option: str) -> str | None:
    """Parameter file, of a command's own option or of ROS's; raises ParameterError for both."""
    if own is not None and ros.parameters_file is not None:
        raise ParameterError(f'give {option} or --params-file, not both')
    return ros.parameters_file if own is None else own


def checked_namespace(text: str) -> str:
    """Return a namespace as ROS writes it, such as ``/robot1``; empty for the root's."""
    words = text.strip('/')
    if not words:
        return ''
    if not all(word.isidentifier() and word.isascii() and '__' not in word
               for word in words.split('/')) or len(words) > LONGEST_NAMESPACE:
        raise ParameterError(f"'{text}' is no namespace; valid are words of letters, digits and "
                             "single underscores with '/' between, such as /robot1, of up to "
                             f'{LONGEST_NAMESPACE} characters in all')
    return f'/{words}'


def _split(arguments: list[str]) -> tuple[list[str], list[str]]:
    """What is the command's own, and what stands between ``--ros-args`` and ``--`` or the end."""
    own: list[str] = []
    ros: list[str] = []
    into = own
    for argument in arguments:
        if argument == '--ros-args' or (argument == '--' and into is ros):
            into = own if argument == '--' else ros
        else:
            into.append(argument)
    return own, ros


def _read(arguments: list[str]) -> RosArguments:
    read, waiting = RosArguments(), iter(arguments)
    for given in waiting:
        if given in SWITCHES:
            read.others.append(given)
            continue
        flag, value = VALUED.get(given), next(waiting, None)
        if flag is None:
            raise ParameterError(f"unknown ROS argument '{given}'; valid are "
                                 f"{', '.join([*VALUED, *SWITCHES])}")
        if value is None:
            raise ParameterError(f"'{given}' needs a value")
        if flag == '--param':
            read.parameters.update([read_parameter(value)])
        elif flag == '--params-file':
            if read.parameters_file is not None:
                raise ParameterError('only one --params-file can be taken')
            read.parameters_file = value
        elif flag == '--remap':
            name, target = read_pair(value)
            if name == '__ns':
                read.namespace = checked_namespace(target)
            else:
                read.remappings.append((name, target))
        else:
            read.others += [flag, value]
        if flag == '--log-level':
            level = value.rpartition(':=')[2].lower()
            if level not in LEVELS:
                raise ParameterError(f"'{value}' is no log level; valid are {', '.join(LEVELS)}")
            logging.getLogger().setLevel(level.upper())
    return read
