# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The middleware and its start: profile, range, domain, arguments, and what ROS refuses."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import rclpy
from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import get_default_context, get_rmw_implementation_identifier, remove_ros_args

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.process import give_back_memory

if TYPE_CHECKING:
    pass

PROFILES = ('fastdds.xml', 'fastdds_localhost.xml')
"""Profiles of Fast DDS in the config folder, for all interfaces and for this machine alone; they
say why they are there.
"""

RANGE, LOCALHOST_ONLY = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_LOCALHOST_ONLY'
"""Environment variables of ROS 2 for where nodes look for others; 1 for the second, older one
means ``LOCALHOST`` for the first.
"""

VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
"""Environment variables that name a profile: of Fast DDS 2 (Jazzy has it) and of 3."""

FROM_PROFILE = 'RMW_FASTRTPS_USE_QOS_FROM_XML'
"""Environment variable that lets a profile say how a reader keeps its messages."""

_IN_WORKING_FOLDER = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')


def prepare_middleware() -> None:
    """Name our profile to Fast DDS unless the user has one; call before ``rclpy.init``.

    Where nodes of this machine alone are asked for, that is what the profile does, and the range
    of rmw_fastrtps is another. Processes that are started later inherit the variables.
    """
    subnet, local = (str(find_config(name)) for name in PROFILES)
    chosen = {os.environ.get(name, '') for name in VARIABLES} - {'', subnet, local}
    if chosen or any(Path(name).is_file() for name in _IN_WORKING_FOLDER):
        return
    if not get_rmw_implementation_identifier().startswith('rmw_fastrtps'):
        return
    os.environ.setdefault(FROM_PROFILE, '1')
    if os.environ.get(LOCALHOST_ONLY) == '1' or os.environ.get(RANGE) == 'LOCALHOST':
        os.environ.pop(LOCALHOST_ONLY, None)
        os.environ.update({RANGE: 'SUBNET', **dict.fromkeys(VARIABLES, local)})
    elif os.environ.get(VARIABLES[0]) != local:  # which this has named before
        os.environ.update(dict.fromkeys(VARIABLES, subnet))


LARGE_MESSAGE = 2**20
"""Memory that no node keeps when it has read the message of a stranger [bytes]."""

MOST_DOMAIN = 232
"""The highest ROS domain: beyond it the middleware has no ports, and ends the process."""

_ADVICE = {'logging': '; set ROS_LOG_DIR to a folder that can be written',
           'ROS_DOMAIN_ID': f'; valid are 0 to {MOST_DOMAIN}'}
"""What to do, by a word of what ROS says."""


def start_ros(arguments: Sequence[str], context: Context | None = None) -> None:
    """Start ROS 2 without its signal handlers.

    Parameters
    ----------
    arguments : sequence of str
        Program and command line.
    context : Context, optional
        Default: the global one.

    Raises
    ------
    ParameterError
        If ROS refuses its environment, such as ``ROS_DOMAIN_ID``.
    """
    give_back_memory(LARGE_MESSAGE)
    with cannot_start():
        rclpy.init(args=[*arguments], context=context,
                   signal_handler_options=SignalHandlerOptions.NO)
    context = context or get_default_context()
    domain = context.get_domain_id()
    if domain > MOST_DOMAIN:
        context.shutdown()
        raise ParameterError(f'ROS_DOMAIN_ID = {domain} must be in [0, {MOST_DOMAIN}]')


def without_ros_arguments(arguments: Sequence[str]) -> list[str]:
    """Arguments of a command line that are not for ROS; raises ParameterError for what ROS cannot
    read.
    """
    with cannot_start():
        try:
            return remove_ros_args(arguments)
        except rclpy_implementation.UnknownROSArgsError as error:
            raise ParameterError(f'unknown arguments after --ros-args: {error}') from error


@contextlib.contextmanager
def cannot_start() -> Iterator[None]:
    """Raise ParameterError for what ROS refuses, in a line."""
    try:
        yield
    except rclpy_implementation.RCLError as error:
        reason = ' '.join(str(error).partition(', at /')[0].split())
        advice = (text for word, text in _ADVICE.items() if word in reason)
        raise ParameterError(f'ROS 2 cannot start: {reason}{next(advice, "")}') from error
