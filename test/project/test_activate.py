# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``. .venv/bin/activate``: the shell that ``make`` leaves its users with."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT

VENV = ROOT / '.venv'
pytestmark = pytest.mark.skipif(Path(sys.prefix) != VENV, reason='runs in the environment of make')

SHELLS = [shell for shell in ('sh', 'bash', 'zsh') if shutil.which(shell)]
CLEAN = {'PATH': '/usr/bin:/bin', 'HOME': '/nonexistent'}
ROS = """
export ROS_DISTRO=jazzy
export AMENT_PREFIX_PATH="/opt/ros/jazzy${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}"
"""
"""What sourcing a ROS 2 does to the shell, as far as it concerns us."""


def environments(shell: str, *scripts: str, **given: str) -> list[dict[str, str]]:
    """Environment of a shell after each script, one after the other; errors end it."""
    command = '\n'.join(f'{script}\nprintf "#\\0"; env -0' for script in scripts)
    path = shutil.which(shell)
    assert path is not None
    done = subprocess.run([path, '-euc', command], env={**CLEAN, **given}, cwd=ROOT, check=True,
                          capture_output=True, text=True, timeout=60)
    shells = [dict(entry.split('=', 1) for entry in text.split('\0') if entry)
              for text in done.stdout.split('#\0')[1:]]
    return [{name: value for name, value in variables.items() if name not in ('_', 'SHLVL', 'PS1')}
            for variables in shells]


@pytest.mark.parametrize('shell', SHELLS)
def test_it_gives_commands_domain_and_prefix_and_takes_them_back(shell: str) -> None:
    before, active, again, after = environments(
        shell, ':', '. .venv/bin/activate', '. .venv/bin/activate', 'deactivate')
    assert active['PATH'].split(':')[0] == str(VENV / 'bin')
    for command in ('walk', 'robot_client', 'certify'):
        assert shutil.which(command, path=active['PATH']) == str(VENV / 'bin' / command)
    assert active['AMENT_PREFIX_PATH'] == str(VENV)
    assert active['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
    assert 0 < int(active['ROS_DOMAIN_ID']) <= 101
    assert again == active
    assert after == before


@pytest.mark.parametrize('shell', SHELLS)
def test_what_the_user_has_set_stays(shell: str) -> None:
    own = {'ROS_DOMAIN_ID': '5', 'MUJOCO_GL': 'osmesa', 'AMENT_PREFIX_PATH': '/home/me/install'}
    active, after = environments(shell, '. .venv/bin/activate', 'deactivate', **own)
    assert {**active, **own, 'AMENT_PREFIX_PATH': f'{VENV}:/home/me/install'} == active
    assert {**after, **own} == after


@pytest.mark.parametrize('shell', SHELLS)
def test_ros_may_be_sourced_before_or_after(shell: str) -> None:
    before, after = (environments(shell, *scripts, 'deactivate') for scripts in (
        (ROS, '. .venv/bin/activate'), ('. .venv/bin/activate', ROS)))
    for _, both, left in (before, after):
        assert set(both['AMENT_PREFIX_PATH'].split(':')) == {'/opt/ros/jazzy', str(VENV)}
        assert left['AMENT_PREFIX_PATH'] == '/opt/ros/jazzy'


def test_an_environment_of_the_other_kind_is_noticed() -> None:
    sourced = (VENV / '.dependencies-sourced').exists()
    done = subprocess.run(['sh', '-c', '. .venv/bin/activate'], cwd=ROOT, check=True, text=True,
                          env=CLEAN if sourced else {**CLEAN, 'ROS_DISTRO': 'jazzy'},
                          capture_output=True, timeout=60)
    assert 'dmp_cpg_ros: .venv was made' in done.stderr


def test_the_commands_of_make_run_in_that_shell() -> None:
    done = subprocess.run(['make', '--dry-run', 'demo', 'test'], cwd=ROOT, check=True, text=True,
                          capture_output=True, timeout=60)
    for command in ('walk', 'cd test'):
        assert f'. {VENV}/bin/activate && {command}' in done.stdout
    assert (VENV / 'bin' / 'activate').read_text().count('environment.sh') == 1
