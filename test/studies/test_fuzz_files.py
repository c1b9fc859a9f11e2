# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Spoiled files of every kind end in one line with status 2, and what is found wrong is told."""

from __future__ import annotations

import io
import json
import random
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dmp_cpg_ros.studies import fuzz_samples
from dmp_cpg_ros.studies.fuzz_files import Outcome, fuzz, main, table

FILES_PER_KIND = 15


def test_spoiled_files_are_taken_or_refused_in_one_line(
        capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['--count', '5', '--kinds', 'csv', '--workers', '1']) == 0
    assert '5 files' in capsys.readouterr().out
    outcomes = fuzz(FILES_PER_KIND * len(fuzz_samples.KINDS), seed=11, workers=2)
    assert [outcome for outcome in outcomes if not outcome.is_good] == []
    for kind in fuzz_samples.KINDS:
        assert sum(outcome.kind == kind for outcome in outcomes) == FILES_PER_KIND
    assert sum(outcome.verdict == 'refused' for outcome in outcomes) > len(outcomes) // 4


@pytest.fixture(scope='module')
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fuzz_samples.make(tmp_path_factory.mktemp('samples'))


@pytest.mark.parametrize('kind', fuzz_samples.KINDS)
def test_the_samples_themselves_are_taken(
        kind: str, samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for path in sorted((samples / kind).iterdir()):
        assert fuzz_samples.read(kind, path, tmp_path / path.name) == 0, path


def test_the_same_seed_spoils_in_the_same_way(samples: Path, tmp_path: Path) -> None:
    for kind in fuzz_samples.KINDS:
        content = []
        for attempt in ('a', 'b'):
            path = fuzz_samples.mutated(samples, kind, tmp_path / kind / attempt,
                                        random.Random(7))
            content.append([of.read_bytes() for of in sorted((path, *path.rglob('*')))
                            if of.is_file()])
        assert content[0] == content[1]


def test_what_is_wrong_is_in_the_table() -> None:
    rows = table([Outcome('csv', 0, 'refused', 'x'), Outcome('csv', 1, 'hung', '-27')])
    assert rows.splitlines()[-1].split('|')[1:6] == [
        ' csv  ', ' 2     ', ' 0     ', ' 1       ', ' 1 hung        ']


def refused(path: Path, kind: str, capsys: pytest.CaptureFixture[str]) -> str:
    """The one line with which a file is refused."""
    assert fuzz_samples.read(kind, path, path.parent / 'out') == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(path) in line
    return line


def test_a_header_takes_no_memory(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for shape in ('(10000000000000, 3)', '(-4, 3)'):
        path = tmp_path / 'huge.npy'
        head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}\n".encode()
        path.write_bytes(b'\x93NUMPY\x01\x00' + len(head).to_bytes(2, 'little') + head)
        assert 'shape' in refused(path, 'numpy', capsys)


def test_an_archive_is_not_unpacked_without_a_limit(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, times = tmp_path / 'bomb.npz', io.BytesIO()
    np.save(times, np.arange(3.0))
    with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as archive:
        archive.writestr('times.npy', times.getvalue())
        archive.writestr('positions.npy', bytes(2**26))
    assert path.stat().st_size < 2**17
    assert '32 MiB' in refused(path, 'numpy', capsys)


def test_nothing_is_unpickled(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'objects.npy'
    np.save(path, np.array([[0.0, object()]], dtype=object), allow_pickle=True)
    assert 'object' in refused(path, 'numpy', capsys)


def test_a_number_of_a_proof_has_a_length(samples: Path, tmp_path: Path,
                                          capsys: pytest.CaptureFixture[str]) -> None:
    proof = json.loads((samples / 'proof' / 'proof.json').read_text(encoding='utf-8'))
    proof['parameters']['rho'] = '1e999999999'
    path = tmp_path / 'proof.json'
    path.write_text(json.dumps(proof), encoding='utf-8')
    assert fuzz_samples.read('proof', path, tmp_path) == fuzz_samples.NO_PROOF
    assert 'is no fraction' in capsys.readouterr().err
    path.write_text('[' * 100_000, encoding='utf-8')
    assert fuzz_samples.read('proof', path, tmp_path) == fuzz_samples.NO_PROOF
    assert 'is refused' in capsys.readouterr().err
