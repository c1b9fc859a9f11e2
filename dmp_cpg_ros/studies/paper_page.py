# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes the paper as a page one can touch: one HTML file with Python, NumPy and the core in it.

Pyodide comes from npm. Its lock file names the sum of the NumPy wheel that belongs to it.
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
import urllib.request
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path

from dmp_cpg_ros.commands.ros_arguments import RosArguments, run_command
from dmp_cpg_ros.configuration import find_config, load_yaml
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_suite

PYODIDE = '0.27.4'
"""Version of the npm package ``pyodide``."""

WHEELS = f'https://cdn.jsdelivr.net/pyodide/v{PYODIDE}/full/'
"""Where the wheels of that version are; npm has none of them."""

LOCK = 'pyodide-lock.json'
TAKEN = ('pyodide.js', 'pyodide.asm.js', 'pyodide.asm.wasm', 'python_stdlib.zip', LOCK)


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the page; returns the exit status."""
    parser = argparse.ArgumentParser(prog='paper_page', description=__doc__)
    parser.add_argument('--out', type=Path, default=Path('build/paper'), metavar='DIR',
                        help='folder for index.html and what is downloaded (default: build/paper)')
    parser.add_argument('--numpy', type=Path, metavar='WHEEL',
                        help='NumPy for this Pyodide, taken unchecked instead of the one that its '
                             'lock file names')
    return run_command(parser, arguments, _build)


def _build(options: argparse.Namespace, _: RosArguments) -> int:
    options.out.mkdir(parents=True, exist_ok=True)
    parts = pyodide(options.out)
    parts['numpy.whl'] = options.numpy.read_bytes() if options.numpy else wheel(
        parts[LOCK], options.out)
    file = options.out / 'index.html'
    file.write_text(page(parts), encoding='utf-8')
    print(f'{file}: {file.stat().st_size / 1e6:.1f} MB, open it in any browser')
    return 0


def pyodide(folder: Path) -> dict[str, bytes]:
    """Files of Pyodide by name, downloaded by npm, which checks them, where they are not there.

    Raises
    ------
    DataError
        If npm is not there or fails.
    """
    archive = folder / f'pyodide-{PYODIDE}.tgz'
    if not archive.is_file():
        try:
            subprocess.run(['npm', 'pack', '--silent', f'pyodide@{PYODIDE}'], cwd=folder,
                           check=True, capture_output=True, text=True)
        except (OSError, subprocess.CalledProcessError) as error:
            raise DataError(f'npm pack pyodide@{PYODIDE}: {getattr(error, "stderr", error)}'
                            ) from error
    with tarfile.open(archive) as packed:
        found = {name: packed.extractfile(f'package/{name}') for name in TAKEN}
        return {name: file.read() for name, file in found.items() if file is not None}


def wheel(lock: bytes, folder: Path) -> bytes:
    """NumPy of a lock file, downloaded where it is not there.

    Raises
    ------
    DataError
        If it cannot be had or is not the one whose sum the lock file names.
    """
    wanted = json.loads(lock)['packages']['numpy']
    file = folder / wanted['file_name']
    if not file.is_file():
        try:
            with urllib.request.urlopen(WHEELS + file.name, timeout=60) as answer:
                file.write_bytes(answer.read())
        except OSError as error:
            raise DataError(f"{WHEELS}{file.name}: {error}; put it into '{folder}', or name "
                            'another with --numpy') from error
    content = file.read_bytes()
    if hashlib.sha256(content).hexdigest() != wanted['sha256']:
        raise DataError(f"'{file}' is not the wheel that Pyodide {PYODIDE} names: delete it")
    return content


def page(parts: Mapping[str, bytes]) -> str:
    """The page with its parts in it; it fetches nothing."""
    sources = files('dmp_cpg_ros') / 'page'
    css, panels, script, html = (sources.joinpath(name).read_text(encoding='utf-8') for name in (
        'live.css', 'panels.js', 'paper.js', 'paper.html'))
    blocks = '\n'.join(
        f'<script type="text/plain" id="{name}">'
        f'{base64.b64encode(gzip.compress(content, mtime=0)).decode()}</script>'
        for name, content in {**parts, 'core.zip': core(), 'given.json': given()}.items())
    for mark, text in {'/* live.css */': css, '<!-- parts -->': blocks,
                       '/* script */': panels.replace('\nexport ', '\n') + script}.items():
        html = html.replace(mark, text)
    return html


def core() -> bytes:
    """The core and what the page calls, as a ZIP archive to be unpacked where packages are."""
    package, packed = Path(str(files('dmp_cpg_ros'))), io.BytesIO()
    with zipfile.ZipFile(packed, 'w') as archive:
        for path in sorted([*package.glob('*__init__.py'), *package.glob('core/**/*.py'),
                            *package.glob('paper/__init__.py'), package / 'paper/interactive.py']):
            name = f'dmp_cpg_ros/{path.relative_to(package).as_posix()}'
            archive.writestr(zipfile.ZipInfo(name), path.read_bytes())
    return packed.getvalue()


def given() -> bytes:
    """Arguments of :class:`~dmp_cpg_ros.paper.interactive.Page` as JSON: gaits, robot, tick."""
    suite = load_suite()
    return json.dumps({'gaits': load_yaml(find_config('gaits.yaml'))['gaits'],
                       'scale': asdict(body_scale(load_description(suite.robot_file))),
                       'tick_s': suite.tick_ns * 1e-9}).encode()


if __name__ == '__main__':
    sys.exit(main())
