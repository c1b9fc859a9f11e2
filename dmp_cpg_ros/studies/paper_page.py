# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the paper as a page one can touch: one HTML file with Python, NumPy and the core in it.

Pyodide and a NumPy for it come from npm. The second is a package of conda, made by
https://emscripten-forge.org for the compiler (Emscripten 3.1.58) that Pyodide is made with.
"""

from __future__ import annotations

import argparse
import base64
import gzip
import hashlib
import io
import json
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.files import readable, writable
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite import load_suite

PACKAGES = {
    'pyodide': (
        'pyodide', '0.27.8',
        'XDy8yQAloO0fSaJ6F5aQad0IqcBKvU4MgGjN3LrjOPW6J4xHT5PBiBzCnApxjuerWl33BiyuPQG1uIHHAQnkkg=='),
    'numpy': (
        '@emscripten-forge/numpy', '2.0.1-py312h4e66579-0',
        '64iP3tolNhBnKJBHs2b5Mg9s17BL8Bp9Ev2+U0fSCO3/zQlWQRCrExw2MgmfwjhNz+mwbKPG2eBsBcpBWV2xbA=='),
}
"""Packages of npm: name, version, and SHA-512 in base64 as npm states it (``dist.integrity``)."""

TAKEN = ('pyodide.js', 'pyodide.asm.js', 'pyodide.asm.wasm', 'python_stdlib.zip',
         'pyodide-lock.json')
"""Files of Pyodide that a page needs."""

WHEEL = 'numpy-2.0.1-cp312-cp312-pyodide_2024_0_wasm32.whl'
"""What the NumPy is called that Pyodide is to load."""

CONTENTS = (f'Pyodide {PACKAGES["pyodide"][1]} (MPL-2.0) with CPython (PSF-2.0), '
            f'NumPy {WHEEL.split("-")[1]} (BSD-3-Clause, built by emscripten-forge)')
"""What is in a page besides the core (Apache-2.0), with the licences."""

COMPRESSION = 6
"""Level of gzip; 9 takes three times as long and makes a page smaller by 1 %."""

PATIENCE_S = 300.0
"""How long npm may take for a package [s]."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the page; returns the exit status."""
    parser = argparse.ArgumentParser(prog='paper_page', description=__doc__)
    parser.add_argument('--out', type=Path, default=Path('build/paper'), metavar='DIR',
                        help='folder for index.html and what is downloaded (default: build/paper)')
    return run_command(parser, arguments, _build)


def _build(options: argparse.Namespace, _: RosArguments) -> int:
    options.out.mkdir(parents=True, exist_ok=True)
    file = writable(options.out / 'index.html')
    file.write_text(page(parts(download(options.out))), encoding='utf-8')
    print(f'{file}: {file.stat().st_size / 1e6:.1f} MB, open it in any browser')
    return 0


def download(folder: Path, patience_s: float = PATIENCE_S) -> dict[str, Path]:
    """Archives of :data:`PACKAGES`, taken from npm where the folder has them not.

    Parameters
    ----------
    folder : Path
        Where they are, or come to be.
    patience_s : float
        How long npm may take for each [s].

    Raises
    ------
    DataError
        If npm is not there or fails.
    """
    archives = {}
    for part, (name, version, _) in PACKAGES.items():
        archives[part] = folder / f'{name.strip("@").replace("/", "-")}-{version}.tgz'
        if not archives[part].is_file():
            command = ['npm', 'pack', '--silent', '--prefer-offline', f'{name}@{version}']
            print(f'fetching {name}@{version} from npm', file=sys.stderr)
            try:
                subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True,
                               timeout=patience_s)
            except (OSError, subprocess.SubprocessError) as error:
                said = getattr(error, 'stderr', None) or error
                raise DataError(f'{" ".join(command)}: {said}') from error
    return archives


def parts(archives: Mapping[str, Path]) -> dict[str, bytes]:
    """Files that a page needs, by name, from the archives of :data:`PACKAGES`.

    Raises
    ------
    DataError
        If an archive is not the one whose sum is named there.
    """
    for part, archive in archives.items():
        found = base64.b64encode(hashlib.sha512(readable(archive).read_bytes()).digest()).decode()
        if found != PACKAGES[part][2]:
            raise DataError(f"'{archive}' is not the archive that is meant: delete it")
    files_ = _unpacked(archives['pyodide'].read_bytes())
    (conda,) = _unpacked(archives['numpy'].read_bytes(), '.tar.gz').values()
    return {**{name: files_[f'package/{name}'] for name in TAKEN}, WHEEL: wheel(_unpacked(conda))}


def _unpacked(archive: bytes, ending: str = '') -> dict[str, bytes]:
    """Files of a TAR archive whose names end so."""
    with tarfile.open(fileobj=io.BytesIO(archive)) as packed:
        return {member.name: packed.extractfile(member).read()  # type: ignore[union-attr]
                for member in packed if member.isfile() and member.name.endswith(ending)}


def wheel(conda: Mapping[str, bytes]) -> bytes:
    """What a package of conda puts into ``site-packages``, without tests, as a wheel."""
    inside = {name.partition('/site-packages/')[2]: content for name, content in conda.items()
              if '/site-packages/' in name and '/tests/' not in name}
    return _zipped(inside)


def _zipped(contents: Mapping[str, bytes]) -> bytes:
    """A ZIP archive that is the same whenever and wherever it is made."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, 'w') as archive:
        for name in sorted(contents):
            archive.writestr(zipfile.ZipInfo(name), contents[name])
    return packed.getvalue()


def page(parts: Mapping[str, bytes]) -> str:
    """The page with its parts in it; it fetches nothing."""
    sources = files('dmp_cpg_ros') / 'page'
    css, panels, script, html = (sources.joinpath(name).read_text(encoding='utf-8') for name in (
        'live.css', 'panels.js', 'paper.js', 'paper.html'))
    blocks = '\n'.join(
        f'<script type="text/plain" id="{name}">'
        f'{base64.b64encode(gzip.compress(content, COMPRESSION, mtime=0)).decode()}</script>'
        for name, content in {**parts, 'core.zip': core(), 'given.json': given()}.items())
    for mark, text in {'/* live.css */': css, '<!-- contents -->': CONTENTS,
                       '<!-- parts -->': blocks,
                       '/* script */': panels.replace('\nexport ', '\n') + script}.items():
        html = html.replace(mark, text)
    return html


def core() -> bytes:
    """The core and what the page calls, as a ZIP archive to be unpacked where packages are."""
    package = Path(str(files('dmp_cpg_ros')))
    return _zipped({
        f'dmp_cpg_ros/{path.relative_to(package).as_posix()}': path.read_bytes()
        for path in (*package.glob('*__init__.py'), *package.glob('core/**/*.py'),
                     *package.glob('paper/__init__.py'), package / 'paper/interactive.py')})


def given() -> bytes:
    """Arguments of :class:`~dmp_cpg_ros.paper.interactive.Page` as JSON: gaits, robot, tick."""
    suite = load_suite()
    return json.dumps({'gaits': load_yaml(find_config('gaits.yaml'))['gaits'],
                       'scale': asdict(body_scale(load_description(suite.robot_file))),
                       'tick_s': suite.tick_ns * 1e-9}).encode()


if __name__ == '__main__':
    sys.exit(main())
