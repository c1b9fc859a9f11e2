# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The style that ruff.toml and mypy.ini describe holds."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest
from checkout import ROOT


@pytest.mark.parametrize('command', [['ruff', 'check', '--output-format=concise'], ['mypy']],
                         ids=lambda command: command[0])
def test_lint(command: list[str]) -> None:
    if importlib.util.find_spec(command[0]) is None:
        pytest.skip(f'{command[0]} is not installed')
    done = subprocess.run([sys.executable, '-m', *command], cwd=ROOT, capture_output=True,
                          text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
