# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``dmp_cpg_ros``: lists the executables and runs them; all console scripts begin here.

Nothing but the standard library is imported before an executable is chosen, so that Ctrl-C ends
quietly from the first moment on.
"""

from __future__ import annotations

import ast
import io
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from dmp_cpg_ros import __version__

PACKAGE = 'dmp_cpg_ros'

COMMANDS = ('walk', 'certify', 'analyze', 'learn', 'inspect_robot', 'robot_client',
            'live_view', 'composed_suite', 'low_level_robot')
STUDIES = ('study_stops', 'benchmark_walking', 'study_recovery')
"""Executables that are no nodes; those that are stand in :mod:`dmp_cpg_ros.suite_table`."""

BAD_INPUT, INTERRUPTED, UNREAD = 2, 130, 128 + 13
"""Exit statuses."""

ON_THE_INDEX = {
    'numpy': 'numpy', 'scipy': 'scipy', 'mujoco': 'mujoco', 'rosbags': 'rosbags', 'mcap': 'mcap',
    'lz4': 'lz4', 'zstandard': 'zstandard', 'yaml': 'PyYAML', 'matplotlib': 'matplotlib',
    'PIL': 'pillow'}
"""Requirements by the name that is imported, with that on the Python package index: where a
distribution has no package of one, the suite is installed without it.
"""

WITHOUT_REQUIREMENT = ('{} needs from the Python package index what this Python ({}) does not '
                       'find: {} {}')

INSTALL, INSTALL_BESIDE = 'pip install', 'pip install --user --break-system-packages'
"""How to install it: where the packages are a distribution's, pip refuses the usual way."""

WITHOUT_ROS = ("{} needs ROS 2 Jazzy, which this Python ({}) does not find: source it, or "
               "pip install 'WHEEL[ros]', the wheel of this package (x86-64, Python 3.10 to 3.13)")

OTHER_ROS = ("{} cannot import the rclpy of '{}' with this Python ({}): a sourced ROS 2 comes "
             "before the environment's packages: use a terminal where none is sourced, or unset "
             "PYTHONPATH, or that ROS 2's own Python")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run ``dmp_cpg_ros [NAME ...]``; returns the exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given == ['--version']:
        print(f'{PACKAGE} {__version__}')
        return 0
    if given and not given[0].startswith('-'):
        sys.argv = given
        return run(given[0])
    try:
        print('\n'.join(_listing()), flush=True)
    except BrokenPipeError:  # as in dmp_cpg_ros | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return UNREAD
    return BAD_INPUT if given and given[0] not in ('-h', '--help') else 0


def _listing() -> Iterator[str]:
    """What is printed without a name: how to begin, and what there is."""
    from dmp_cpg_ros.suite_table import KINDS

    yield 'usage: dmp_cpg_ros NAME [...], or NAME [...] alone; NAME --help says more; --version'
    yield 'to begin: dmp_cpg_ros walk --view, and open the address that it prints in a browser'
    for title, names in (('commands', COMMANDS), ('studies', STUDIES), ('nodes', tuple(KINDS))):
        yield f'\n{title}:'
        for name in names:
            yield f'  {name:22}{_summary(name)}'


def run(name: str) -> int:
    """Run an executable with the process's arguments; returns the exit status."""
    try:
        if find_spec(_module(name)) is None:
            from difflib import get_close_matches

            from dmp_cpg_ros.suite_table import KINDS

            names = (*COMMANDS, *STUDIES, *KINDS)
            near = get_close_matches(name, names, n=1)
            guess = f'did you mean {near[0]}? ' if near else ''
            print(f"dmp_cpg_ros: there is no '{name}'; {guess}valid are {', '.join(names)}",
                  file=sys.stderr)
            return BAD_INPUT
        if isinstance(sys.stdout, io.TextIOWrapper):  # a terminal need not have every character
            with suppress(OSError):  # whoever is forked may have a pipe where a file was
                sys.stdout.reconfigure(errors='backslashreplace')
        with _quiet_ctrl_c():
            module = import_module(_module(name))
            if _folder(name) == 'nodes':
                module = import_module(f'{PACKAGE}.nodes.framework.execution')
        return _to_the_end(module.run_node, name) if _folder(name) == 'nodes' else (
            _to_the_end(module.main))
    except KeyboardInterrupt:
        return INTERRUPTED
    except ImportError as error:
        text = _lacking(name, error)
        if not text:
            raise
        print(f'dmp_cpg_ros: {text}', file=sys.stderr)
        return BAD_INPUT


def _lacking(name: str, error: ImportError) -> str:
    """What an executable cannot import and what to do, in a line; empty for its own errors."""
    missing = str(error.name).partition('.')[0] if isinstance(error, ModuleNotFoundError) else ''
    if missing in ON_THE_INDEX:
        wanted = [index for module, index in ON_THE_INDEX.items() if find_spec(module) is None]
        return WITHOUT_REQUIREMENT.format(
            name, sys.executable, INSTALL_BESIDE if _of_distribution() else INSTALL,
            ' '.join(wanted))
    ros = find_spec('rclpy')
    if ros is None:
        return WITHOUT_ROS.format(name, sys.executable) if missing not in ('', PACKAGE) else ''
    folder = Path(ros.origin or '').parent
    if Path(sys.prefix) in folder.parents:
        return ''
    try:
        import_module('rclpy')
    except ImportError:
        return OTHER_ROS.format(name, folder, sys.executable)
    return ''


def _of_distribution() -> bool:
    """Whether a distribution manages the packages of this Python (PEP 668), as where the suite
    lies below ``/opt/ros``.
    """
    import sysconfig

    return sys.prefix == sys.base_prefix and os.path.isfile(
        os.path.join(sysconfig.get_path('stdlib'), 'EXTERNALLY-MANAGED'))


def _to_the_end(body: Callable[..., int], *arguments: str) -> int:
    """Exit status of a body, which a Ctrl-C that comes after it does not change: Python gives
    signals back to Linux before it has ended, and Linux would end the process by this one.
    """
    try:
        try:
            return int(body(*arguments))
        finally:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:  # in the body, or just after it
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        return INTERRUPTED


@contextmanager
def _quiet_ctrl_c() -> Iterator[None]:
    """Let Ctrl-C end the process at once: compiled modules make other errors of an exception that
    reaches them while they are imported.
    """
    former = signal.getsignal(signal.SIGINT)
    if former is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)


def __getattr__(name: str) -> Callable[[], int]:
    """Entry point of a console script: a function without arguments for every executable."""
    if name.startswith('_') or find_spec(_module(name)) is None:
        raise AttributeError(name)
    return partial(run, name)


def _folder(name: str) -> str:
    return 'commands' if name in COMMANDS else 'studies' if name in STUDIES else 'nodes'


def _module(name: str) -> str:
    return f'{PACKAGE}.{_folder(name)}.{name}'


def _summary(name: str) -> str:
    """First line of an executable's module, read without importing what it needs."""
    spec = find_spec(_module(name))
    assert spec is not None and spec.origin is not None
    text = ast.get_docstring(ast.parse(Path(spec.origin).read_text(encoding='utf-8'))) or ''
    return text.split('\n\n')[0].replace('\n', ' ').removeprefix(f'``{name}``: ')


if __name__ == '__main__':
    sys.exit(main())
