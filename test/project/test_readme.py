# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the README promises a reader: its code runs, its links lead somewhere."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

from checkout import ROOT, setup_constant

README = (ROOT / 'README.md').read_text(encoding='utf-8')

BLOCK = """
import sys
for name in ('rclpy', 'mujoco', 'yaml'):
    sys.modules[name] = None
"""


def test_the_quick_start_runs_without_ros_and_without_mujoco(tmp_path: Path) -> None:
    (code,) = re.findall(r'```python\n(.*?)```', README, re.DOTALL)
    script = tmp_path / 'quick_start.py'
    script.write_text(BLOCK + code, encoding='utf-8')
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True,
                          check=True, cwd=ROOT, env={'PYTHONPATH': str(ROOT)})
    walking, resting = done.stdout.splitlines()
    assert walking.startswith('lags [0.   0.5  0.75 0.25]')
    assert float(walking.split('speed')[1]) > 5.0
    assert float(resting.split('speed')[1]) < 0.01


def test_links_into_the_repository_lead_somewhere() -> None:
    for target in re.findall(r'\]\(([^)#]+)\)', README):
        if not target.startswith('http'):
            assert (ROOT / target).exists(), target


def test_commands_of_make_exist() -> None:
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    for target in re.findall(r'`?make ([a-z-]+)', README):
        assert re.search(rf'^{target}:', makefile, re.MULTILINE), target


# --- transcripts ----------------------------------------------------------------------------

WILD = '…'
"""Stands for any text in the README's outputs."""


def transcripts() -> list[tuple[str, str]]:
    """Every command of the console blocks, in order, with the output that is shown."""
    blocks = re.findall(r'```console\n(.*?)```', README, re.DOTALL)
    return [(command.strip(), output) for block in blocks
            for command, output in re.findall(
                r'^\$ (.*)\n((?:(?!\$ ).*\n)*)', block, re.MULTILINE)]


def as_shown(output: str, shown: str) -> bool:
    """Whether an output is the one that is shown, literally but for the wildcard."""
    pattern = '.+'.join(re.escape(part) for part in shown.split(WILD))
    return re.fullmatch(pattern, output) is not None


def test_commands_in_the_readme_are_executables_of_the_package() -> None:
    blocks = ''.join(re.findall(r'```sh\n(.*?)```', README, re.DOTALL)).splitlines()
    executables = setup_constant('EXECUTABLES')
    assert isinstance(executables, dict)
    for line in [*blocks, *(command for command, _ in transcripts())]:
        assert shlex.split(line, comments=True)[0] in {*executables, 'pip'}, line


def test_a_wildcard_stands_for_text_of_one_line_and_all_else_is_literal() -> None:
    assert as_shown('at rest in 1.2 s (a)\n', f'at rest in {WILD} s (a)\n')
    for other in ('at rest in 1.2 s a\n', 'at rest in  s (a)\n', 'at rest in 1\n2 s (a)\n'):
        assert not as_shown(other, f'at rest in {WILD} s (a)\n')
