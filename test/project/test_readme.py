# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the README promises a reader: its code runs, its links lead somewhere."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from checkout import ROOT

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
