# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A Debian package of a wheel, for a system on which ROS 2 Jazzy is installed from packages.

Everything lies below the prefix of ROS, executables in ``lib/dmp_cpg_ros`` only, as colcon has
them. What has no Debian package is no dependency: whoever misses it is told what to install.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import textwrap
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from configparser import ConfigParser
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZipFile

from dmp_cpg_ros.commands.ros_arguments import run_command
from dmp_cpg_ros.core.errors import MissingFileError
from dmp_cpg_ros.files import readable

DISTRIBUTION, PREFIX, PYTHON = 'jazzy', 'opt/ros/jazzy', 'python3.12'
"""Of ROS 2 on Ubuntu 24.04."""

FROM_INDEX = {'python3-mujoco-pip': ('mujoco',), 'python3-rosbags-pip': ('rosbags',),
              'mcap-ros2-support': ('mcap',)}
"""rosdep keys that only the Python package index serves, and what Debian has not of them."""

OF_DEBIAN = ('python3-lz4', 'python3-zstandard')
"""What the last of them brings, and Debian has too."""

COPYRIGHT = """\
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: {name}
Upstream-Contact: {contact}

Files: *
Copyright: {notice}
License: {licence}
 On Debian systems the full text of this licence is in /usr/share/common-licenses/{licence}.
"""
"""What Debian wants to be told of every package's licence."""

SCRIPT = """\
#!/usr/bin/{python}
import sys
from {module} import {function}
sys.exit({function}())
"""


def python_versions() -> list[str]:
    """Debian's Python, of the one version whose folder the package is in."""
    major, minor = PYTHON.removeprefix('python').split('.')
    return [f'python3 (>= {major}.{minor})', f'python3 (<< {major}.{int(minor) + 1})']


def dependencies(manifest: ElementTree.Element) -> list[str]:
    """Debian packages of the ``exec_depend`` of a package.xml, less those that are none."""
    keys = [entry.text or '' for entry in manifest.findall('exec_depend')]
    return sorted([*OF_DEBIAN, *python_versions(), *(key if key.startswith('python3-') else
                                 f'ros-{DISTRIBUTION}-{key.replace("_", "-")}'
                                 for key in keys if key not in FROM_INDEX)])


def control(manifest: ElementTree.Element) -> str:
    """What dpkg is told of the package, from its package.xml."""
    def text(tag: str) -> str:
        return ' '.join((manifest.findtext(tag) or '').split())

    names = [name for found in FROM_INDEX.values() for name in found]
    summary, _, rest = text('description').partition(':')
    rest = rest.strip()
    told = textwrap.wrap(
        f'{rest[:1].upper()}{rest[1:]} Not in Debian and wanted at run time, from the Python '
        f'package index: {", ".join(names)}.', 76)
    return '\n'.join([
        f'Package: ros-{DISTRIBUTION}-{text("name").replace("_", "-")}',
        f'Version: {text("version")}-1', 'Section: misc', 'Priority: optional',
        'Architecture: all', f'Maintainer: {maintainer(manifest)}',
        *(f'Homepage: {url}' for url in homepage(manifest)),
        f'Depends: {", ".join(dependencies(manifest))}',
        f'Description: {summary}', *(f' {line}' for line in told), ''])


def maintainer(manifest: ElementTree.Element) -> str:
    """Name and address of who maintains the package."""
    person = manifest.find('maintainer')
    assert person is not None
    return f'{person.text} <{person.get("email")}>'


def homepage(manifest: ElementTree.Element) -> list[str]:
    """The website of a package.xml, else its repository, if it names one; without a type an url
    is a website.
    """
    urls = {url.get('type', 'website'): (url.text or '').strip() for url in manifest.iter('url')}
    return [urls[kind] for kind in ('website', 'repository') if kind in urls][:1]


def copyright_of(manifest: ElementTree.Element, source: str) -> str:
    """What Debian is told of the licence, from package.xml and the notice of a source file."""
    notice = source.partition('\n')[0].removeprefix('# Copyright ')
    return COPYRIGHT.format(
        name=manifest.findtext('name'), contact=maintainer(manifest), notice=notice,
        licence=manifest.findtext('license'))


def lay_out(wheel: Path, root: Path) -> ElementTree.Element:
    """Write a package's files as they are to lie below a root; returns its package.xml."""
    prefix = root / PREFIX
    with ZipFile(readable(wheel)) as archive:
        names = archive.namelist()
        (info,) = {name.split('/')[0] for name in names if '.dist-info/' in name}
        (package,) = archive.read(f'{info}/top_level.txt').decode().split()
        scripts = ConfigParser()
        scripts.read_string(archive.read(f'{info}/entry_points.txt').decode())
        for name in names:
            place = (f'lib/{PYTHON}/site-packages/{name}' if '.data/' not in name
                     else name.partition('.data/data/')[2])
            path = prefix / place
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(archive.read(name))
        for name, target in scripts['console_scripts'].items():
            path = prefix / 'lib' / package / name
            module, _, function = target.partition(':')
            path.write_text(SCRIPT.format(python=PYTHON, module=module, function=function),
                            encoding='utf-8')
            path.chmod(0o755)
    return ElementTree.parse(prefix / 'share' / package / 'package.xml').getroot()


def debian_package(wheel: Path, folder: Path) -> Path:
    """Make the Debian package of a wheel; returns its file.

    Parameters
    ----------
    wheel : path
        Wheel of this package.
    folder : path
        Where to write.

    Raises
    ------
    MissingFileError
        If there is no wheel, or no ``dpkg-deb``.
    """
    if not wheel.is_file():
        raise MissingFileError(f'there is no wheel {wheel}')
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as temporary:
        root = Path(temporary)
        root.chmod(0o755)
        manifest = lay_out(wheel, root)
        text = control(manifest)
        fields = dict(line.split(': ', 1) for line in text.splitlines() if line[0] != ' ')
        source = f'lib/{PYTHON}/site-packages/{manifest.findtext("name")}/__init__.py'
        notice = copyright_of(manifest, (root / PREFIX / source).read_text(encoding='utf-8'))
        for place, content in (('DEBIAN/control', text),
                               (f'usr/share/doc/{fields["Package"]}/copyright', notice)):
            (root / place).parent.mkdir(parents=True, exist_ok=True)
            (root / place).write_text(content, encoding='utf-8')
        deb = folder / f'{fields["Package"]}_{fields["Version"]}_all.deb'
        try:
            subprocess.run(['dpkg-deb', '--build', '--root-owner-group', str(root), str(deb)],
                           check=True, stdout=subprocess.DEVNULL)
        except FileNotFoundError:
            raise MissingFileError('there is no dpkg-deb here; it is of Debian') from None
    return deb


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog='debian_package', description='Make a Debian package of a wheel of dmp_cpg_ros.')
    parser.add_argument('wheel', metavar='WHEEL', type=Path)
    parser.add_argument('--out', metavar='DIR', type=Path, default=Path('build'),
                        help='where to write (default: build)')

    def run(options: argparse.Namespace, _: Any) -> int:
        print(debian_package(options.wheel, options.out))
        return 0

    return run_command(parser, arguments, run)


if __name__ == '__main__':
    sys.exit(main())
