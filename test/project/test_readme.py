# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the documents promise a reader: their code runs, their links lead somewhere."""

from __future__ import annotations

import io
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from checkout import PACKAGE, ROOT, recipe, setup_constant

DOCUMENTS = (ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', ROOT / 'QUALITY_DECLARATION.md',
             ROOT / 'SECURITY.md',
             *sorted((ROOT / 'doc').rglob('*.md')))
"""What a reader reads."""

BLOCK = """
import sys
for name in ('rclpy', 'mujoco', 'yaml'):
    sys.modules[name] = None
"""


TYPED = """
import code, sys
sys.modules['rclpy'] = None
console = code.InteractiveConsole()
for block in {codes!r}:
    for line in [*block.splitlines(), '']:
        console.push(line)
    print({mark!r}, end='')
"""
"""Types blocks line by line, as a reader does."""


def tables_of_parameters() -> dict[str, Any]:
    """Parameters of every kind of node; needs ROS."""
    from dmp_cpg_ros.commands import reference

    return reference.tables_of_parameters()


def text(document: Path) -> str:
    return document.read_text(encoding='utf-8')


def blocks(document: Path, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf'```{language}\n(.*?)```', text(document), re.DOTALL)


def test_the_library_runs_without_ros_and_without_mujoco(tmp_path: Path) -> None:
    (code,) = blocks(ROOT / 'doc' / 'library.md', 'python')
    script = tmp_path / 'library.py'
    script.write_text(BLOCK + code, encoding='utf-8')
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True,
                          check=True, cwd=ROOT, env={'PYTHONPATH': str(ROOT)})
    walking, resting = done.stdout.splitlines()
    assert walking.startswith('lags [0.   0.5  0.75 0.25]')
    assert float(walking.split('speed')[1]) > 5.0
    assert float(resting.split('speed')[1]) < 0.01


def test_the_tutorial_prints_what_it_shows(tmp_path: Path) -> None:
    pytest.importorskip('mujoco')
    document = ROOT / 'doc' / 'tutorial.md'
    codes, shown = blocks(document, 'python'), blocks(document, 'text')
    assert len(codes) == len(shown) == 5
    script, mark = tmp_path / 'tutorial.py', '-- next block --\n'
    script.write_text(TYPED.format(codes=codes, mark=mark), encoding='utf-8')
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True,
                          check=True, cwd=tmp_path, env={'PYTHONPATH': str(ROOT)})
    assert done.stderr == ''
    assert done.stdout.split(mark)[:-1] == shown


def files(document: Path) -> dict[str, str]:
    """Contents of the files that it shows, by the title of the block."""
    return dict(re.findall(r'```\w+ title="([^"]+)"\n(.*?)```', text(document), re.DOTALL))


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


def shell_lines(document: Path) -> list[str]:
    """What it types into a shell, of its own environment."""
    return [*''.join(blocks(document, 'sh')).splitlines(),
            *(command for command, _ in transcript(document))]


def sourced_lines(document: Path) -> list[str]:
    """What it types where ROS is sourced, or other tools are; not run as it stands."""
    return [line for block in blocks(document, 'bash') for line in block.splitlines()
            if not line.startswith('#')]


OF_RCL = {'--params-file', '--enclave'}
"""Options behind ``--ros-args`` that every node has from ROS, whatever its help shows."""


def commands(line: str) -> list[list[str]]:
    """Words of each command of a line."""
    words = shlex.split(line.rstrip(' &'), comments=True)
    found: list[list[str]] = [[]]
    for word in words:
        if word in ('&&', '|'):
            found.append([])
        else:
            found[-1].append(word)
    return found


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda document: document.name)
def test_commands_in_the_documents_are_executables_of_the_package(document: Path) -> None:
    executables = setup_constant('EXECUTABLES')
    assert isinstance(executables, tuple)
    for line in shell_lines(document):
        first = commands(line)[0][0]
        assert first in {*executables, PACKAGE, 'pip', 'make', 'python', '.'}, line


@cache
def help_of(name: str, *words: str) -> str:
    from ros_processes import Processes

    process = Processes(0).executable(name, *words, '--help')  # in no domain: it starts no node
    assert process.wait() == 0, process
    return process.output


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda document: document.name)
def test_options_and_parameters_of_commands_exist(document: Path) -> None:
    pytest.importorskip('rclpy')
    executables = setup_constant('EXECUTABLES')
    assert isinstance(executables, tuple)
    every_parameter = {name for table in tables_of_parameters().values() for name in table.fields}
    inline = re.findall(rf"`((?:{'|'.join(executables)}) [^`]+)`", text(document))
    for line in [*shell_lines(document), *sourced_lines(document), *inline]:
        for command in commands(line):
            words = command[command.index(PACKAGE) + 1 if PACKAGE in command else 0:]
            if not words or words[0] not in executables:
                continue
            shown = help_of(words[0])
            if words[0] == 'robot_client':
                shown += help_of(*words[:2]) if words[1] in shown and '-' not in words[1] else ''
            for option in words[1:]:
                name, _, assigned = option.partition(':=')
                if re.fullmatch(r'--[a-z-]+', option):
                    assert option in shown or (
                        option in OF_RCL and '--ros-args' in words), line
                elif assigned:
                    assert name in every_parameter, line


def studies(document: Path) -> Iterator[list[str]]:
    """Words of the studies that a document runs, by ``python -m`` or ``make`` with arguments."""
    module = rf'{PACKAGE}\.studies\.'
    for command in re.findall(rf'`(python -m {module}[^`]*)`', text(document)):
        yield shlex.split(command)[2:]
    for line in sourced_lines(document):
        if re.match(rf'python3? -m {PACKAGE}\.', line):
            yield shlex.split(line, comments=True)[2:]
    for target, variable, words in re.findall(
            r"`make ([a-z-]+) ([A-Z_]+)='([^']*)'`", text(document)):
        line = given(target, variable).partition('GIVEN')[0].split()
        name = line[line.index('-m') + 1] if '-m' in line else line[-1]
        if name != 'pytest':
            yield [name, *shlex.split(words)]


@cache
def given(target: str, variable: str) -> str:
    """Line that make runs with arguments, in whose place it says so."""
    return recipe(target, f'{variable}=GIVEN')


@cache
def options_of(module: str) -> str:
    """What a module of the package answers to ``--help``, in one process with the others."""
    shown = io.StringIO()
    with redirect_stdout(shown), pytest.raises(SystemExit):
        import_module(module).main(['--help'])
    return shown.getvalue()


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda document: document.name)
def test_options_of_studies_exist(document: Path) -> None:
    """They run for hours; that they run at all is seen in ``test/studies``."""
    pytest.importorskip('rclpy')
    for name, *words in studies(document):
        shown = (help_of(name) if '.' not in name else options_of(name)) + ' --help'
        tables = [word for flag, word in pairwise(words) if flag == '--tables']
        for word in [*(word for word in words if word.startswith('--')), *tables]:
            assert re.search(rf'{re.escape(word)}\b', shown), (name, words)


@pytest.mark.parametrize('document', DOCUMENTS, ids=lambda document: document.name)
def test_names_in_commands_of_ros2_exist(document: Path) -> None:
    """They are not run: ``test_ros2_commands.py`` has those that speak with a suite."""
    pytest.importorskip('rclpy')
    from dmp_cpg_ros.suite_table import WALKING_NODES

    executables = setup_constant('EXECUTABLES')
    assert isinstance(executables, tuple)
    tables = tables_of_parameters()
    launch = (ROOT / 'launch' / 'suite.launch.py').read_text(encoding='utf-8')
    for line in [*sourced_lines(document), *re.findall(r'`(ros2 [^`]+)`', text(document))]:
        for file in re.findall(r'(?<= DIR/)\S+', line):
            assert (ROOT / file).is_file(), line
        match [word for word in shlex.split(line, comments=True)
               if not re.fullmatch(r'--once|-r|\d+', word)]:
            case ['ros2', 'run', package, name, *arguments] if package == PACKAGE:
                assert name in {*executables, 'NAME'}, line
                given = [word.partition(':=')[0] for flag, word in pairwise(arguments)
                         if flag == '-p']
                assert set(given) <= set(tables[name].fields if name in tables else given), line
                if name == 'composed_suite':
                    named = arguments[:arguments.index('--ros-args')]
                    assert named and set(named) <= set(WALKING_NODES), line
            case ['ros2', 'launch', package, file, *arguments] if package == PACKAGE:
                assert (ROOT / 'launch' / file).is_file(), line
                for argument in arguments:
                    name = argument.partition(':=')[0]
                    assert f"'{name}'" in launch or f'{name.upper()},' in launch, line


def test_the_readme_and_the_usage_have_transcripts() -> None:
    assert {document.name for document in TRANSCRIPTS} >= {'README.md', 'usage.md'}


def test_a_wildcard_stands_for_text_of_one_line_and_all_else_is_literal() -> None:
    assert as_shown('at rest in 1.2 s (a)\n', f'at rest in {WILD} s (a)\n')
    for other in ('at rest in 1.2 s a\n', 'at rest in  s (a)\n', 'at rest in 1\n2 s (a)\n'):
        assert not as_shown(other, f'at rest in {WILD} s (a)\n')
