# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No command waits at a pipe that it is given for a file, or reads a device without an end, or
minds who reads what it prints.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from synthetic_bag import write_bag
from synthetic_walk import SyntheticWalk

from dmp_cpg_ros.analysis.strict_json import write_json
from dmp_cpg_ros.commands import analyze, certify, film, inspect_robot, learn
from dmp_cpg_ros.core.errors import MissingFileError
from dmp_cpg_ros.core.proofs import check_proof
from dmp_cpg_ros.robot.robot_file import own_robot_file

Main = Callable[[Sequence[str]], int]
TABLE = 'time,hip\n' + ''.join(f'{t},{t * t}\n' for t in np.linspace(0.0, 1.0, 50))


@pytest.fixture(autouse=True)
def never_waits() -> Iterator[None]:
    """What waits for ever, or takes all memory, ends in an error."""
    def tell(*_: object) -> None:
        pytest.fail('it waits')

    before, usual = signal.signal(signal.SIGALRM, tell), resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path('/proc/self/statm').read_text(encoding='utf-8').split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 2**31, usual[1]))
    signal.alarm(120)
    yield
    signal.alarm(0)
    resource.setrlimit(resource.RLIMIT_AS, usual)
    signal.signal(signal.SIGALRM, before)


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to('/dev/zero')


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('run')
    return write_bag(SyntheticWalk(end_s=2.0).recording(), folder / 'bag')


def refused(run: Main, arguments: Sequence[object], capsys: pytest.CaptureFixture[str]) -> str:
    """What a command says that refuses its arguments."""
    assert run([str(of) for of in arguments]) == 2
    said = capsys.readouterr().err
    assert said.count('\n') == 1
    return said


@pytest.mark.parametrize('make', [pipe, device])
@pytest.mark.parametrize('name', ['reach.csv', 'reach.npy', 'reach.npz', 'reach.mcap'])
def test_a_demonstration_is_a_file(name: str, make: Callable[[Path], None], tmp_path: Path,
                                   capsys: pytest.CaptureFixture[str]) -> None:
    make(tmp_path / name)
    said = refused(learn.main, [tmp_path / name, '--out', tmp_path / 'out.yaml'], capsys)
    assert f"{name}' is a " in said and 'not a file' in said


@pytest.mark.parametrize('make', [pipe, device])
@pytest.mark.parametrize('name', ['bag/part.mcap', 'manifest.json', 'metrics.json'])
def test_what_a_run_is_read_from_are_files(name: str, make: Callable[[Path], None], tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'bag').mkdir()
    if not name.startswith('bag'):
        (tmp_path / 'bag' / 'bag_0.mcap').touch()
    make(tmp_path / name)
    said = refused(analyze.main, [tmp_path], capsys)
    assert f"{name}' is a " in said or f"{name}' cannot be read: " in said
    assert 'not a file' in said
    if name == 'manifest.json':
        assert 'not a file' in refused(film.main, [tmp_path, tmp_path / 'film.gif'], capsys)


@pytest.mark.parametrize('make', [pipe, device])
def test_a_bag_is_read_without_metadata_that_are_no_file(
        make: Callable[[Path], None], bag: Path, tmp_path: Path) -> None:
    (tmp_path / 'bag').mkdir()
    for file in bag.glob('*.mcap'):
        (tmp_path / 'bag' / file.name).symlink_to(file)
    make(tmp_path / 'bag' / 'metadata.yaml')
    assert analyze.analyze_run(tmp_path, report=False).metrics


def test_a_bag_that_is_a_pipe_is_called_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                            ) -> None:
    pipe(tmp_path / 'a.mcap')
    assert "a.mcap' is a pipe, not a file" in refused(analyze.main, [tmp_path / 'a.mcap'], capsys)


def test_nothing_is_written_into_a_pipe_by_name(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'reach.csv').write_text(TABLE)
    for ending in ('json', 'yaml', 'gif', 'urdf', 'png'):
        pipe(tmp_path / f'out.{ending}')
    model = own_robot_file().model
    runs: list[tuple[Main, list[object]]] = [
        (certify.main, ['--proof', tmp_path / 'out.json']),
        (learn.main, [tmp_path / 'reach.csv', '--out', tmp_path / 'out.yaml']),
        (film.main, [tmp_path, tmp_path / 'out.gif']),
        (inspect_robot.main, [model, '--output', tmp_path / 'out.yaml']),
        (inspect_robot.main, [model, '--output', os.devnull, '--urdf', tmp_path / 'out.urdf']),
        (inspect_robot.main, [model, '--output', os.devnull, '--picture', tmp_path / 'out.png'])]
    for run, arguments in runs:
        assert 'is a pipe, not a file to write' in refused(run, arguments, capsys)


def test_a_pipe_that_is_open_is_written_into() -> None:
    """As by ``certify --proof /dev/stdout | ...``."""
    program = ('from pathlib import Path\n'
               'from dmp_cpg_ros.analysis.strict_json import write_json\n'
               "write_json(Path('/dev/stdout'), {})\n")
    ended = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                           timeout=60, check=False)
    assert (ended.stdout, ended.stderr) == ('{}\n', '')


def command(*arguments: object, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, '-m', 'dmp_cpg_ros', *map(str, arguments)], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, env={**os.environ, **environment})


@pytest.mark.parametrize('name', [(), ('--help',), ('certify',)])
def test_who_reads_no_further_ends_a_command_quietly(name: Sequence[str]) -> None:
    """As ``certify | head``."""
    with command(*name) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        assert (process.wait(60.0), process.stderr.read()) == (141, '')


def test_an_output_without_room_is_an_error() -> None:
    with Path('/dev/full').open('w', encoding='utf-8') as full:
        ended = subprocess.run([sys.executable, '-m', 'dmp_cpg_ros', 'certify'], stdout=full,
                               stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert 'No space left' in ended.stderr and ended.stderr.count('\n') == 1


def test_a_terminal_need_not_have_every_character(bag: Path) -> None:
    with command('analyze', bag, bag, PYTHONIOENCODING='ascii') as process:
        said, errors = process.communicate(timeout=60.0)
    assert process.returncode == 0, errors
    assert '\\u0394' in said  # Δ


def test_a_folder_is_no_file_to_write(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match='is a folder, not a file to write'):
        write_json(tmp_path, {})


@pytest.mark.parametrize('make', [pipe, device])
def test_the_checker_of_proofs_reads_files(make: Callable[[Path], None], tmp_path: Path) -> None:
    make(tmp_path / 'proof.json')
    ended = subprocess.run([sys.executable, '-I', check_proof.__file__, tmp_path / 'proof.json'],
                           capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert 'it is a pipe or a device' in ended.stderr and ended.stderr.count('\n') == 1
