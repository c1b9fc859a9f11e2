# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A test that is skipped is seen, and why."""

from __future__ import annotations

import os
import subprocess
import sys

from checkout import ROOT


def test_the_end_of_a_run_says_why_tests_were_skipped() -> None:
    away = {name: value for name, value in os.environ.items() if name != 'FRESH_INSTALL'}
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'no:xdist', '-p', 'no:cacheprovider',
         'project/test_packaging.py', '-k', 'fresh_environment'], cwd=ROOT / 'test',
        capture_output=True, text=True, timeout=120, check=False, env=away)
    assert '\n1 x installs 0.7 GB, which takes minutes: make test-install\n' in done.stdout
