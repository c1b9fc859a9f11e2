# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documents promise a reader: their code runs, their links lead somewhere."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT, setup_constant

DOCUMENTS = (ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', ROOT / 'QUALITY_DECLARATION.md',
             *sorted((ROOT / 'doc').glob('*.md')))
"""What a reader reads."""

BLOCK = """
import sys
for name in ('rclpy', 'mujoco', 'yaml'):
    sys.modules[name] = None
"""


def text(document: Path) -> str:
    return document.read_text(encoding='utf-8')


def blocks(document: Path, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf'```{language}\n(.*?)```', text(document), re.DOTALL)


def test_the_library_runs_without_ros_and_without_mujoco(tmp_path: Path) -> None:
    (code,) = (code for document in DOCUMENTS for code in blocks(document, 'python'))
    script = tmp_path / 'library.py'
    script.write_text(BLOCK + code, encoding='utf-8')
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True,
                          check=True, cwd=ROOT, env={'PYTHONPATH': str(ROOT)})
    walking, resting = done.stdout.splitlines()
    assert walking.startswith('lags [0.   0.5  0.75 0.25]')
    assert float(walking.split('speed')[1]) > 5.0
    assert float(resting.split('speed')[1]) < 0.01


def anchors(document: Path) -> set[str]:
    """What links to its headings end with."""
    headings = re.findall(r'^#+ (.*)$', re.sub(r'```.*?```', '', text(document), flags=re.DOTALL),
                          re.MULTILINE)
    return {re.sub(r'[^\w -]', '', heading).strip().lower().replace(' ', '-')
            for heading in headings}


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda document: document.name)
def test_links_into_the_repository_lead_somewhere(document: Path) -> None:
    for link in re.findall(r'\]\(([^)]+)\)', text(document)):
        if not link.startswith('http'):
            name, _, anchor = link.partition('#')
            target = (document.parent / name).resolve() if name else document
            assert target.exists(), link
            assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda document: document.name)
def test_commands_of_make_exist(document: Path) -> None:
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    for target in re.findall(r'(?:`|^)make ([a-z-]+)', text(document), re.MULTILINE):
        assert re.search(rf'^{target}:', makefile, re.MULTILINE), target


# --- transcripts ----------------------------------------------------------------------------

WILD = '…'
"""Stands for any text in the documents' outputs."""


def transcript(document: Path) -> list[tuple[str, str]]:
    """Every command of the console blocks, in order, with the output that is shown."""
    return [(command.strip(), output) for block in blocks(document, 'console')
            for command, output in re.findall(
                r'^\$ (.*)\n((?:(?!\$ ).*\n)*)', block, re.MULTILINE)]


TRANSCRIPTS = tuple(document for document in DOCUMENTS if transcript(document))
"""Documents with console blocks; each begins with a suite of its own."""


def as_shown(output: str, shown: str) -> bool:
    """Whether an output is the one that is shown, literally but for the wildcard."""
    pattern = '.+'.join(re.escape(part) for part in shown.split(WILD))
    return re.fullmatch(pattern, output) is not None


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda document: document.name)
def test_commands_in_the_documents_are_executables_of_the_package(document: Path) -> None:
    executables = setup_constant('EXECUTABLES')
    assert isinstance(executables, tuple)
    lines = ''.join(blocks(document, 'sh')).splitlines()
    for line in [*lines, *(command for command, _ in transcript(document))]:
        assert shlex.split(line, comments=True)[0] in {*executables, 'pip', 'make', '.'}, line


def test_the_readme_and_the_usage_have_transcripts() -> None:
    assert {document.name for document in TRANSCRIPTS} >= {'README.md', 'usage.md'}


def test_a_wildcard_stands_for_text_of_one_line_and_all_else_is_literal() -> None:
    assert as_shown('at rest in 1.2 s (a)\n', f'at rest in {WILD} s (a)\n')
    for other in ('at rest in 1.2 s a\n', 'at rest in  s (a)\n', 'at rest in 1\n2 s (a)\n'):
        assert not as_shown(other, f'at rest in {WILD} s (a)\n')
