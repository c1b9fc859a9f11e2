# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Configuration is found wherever it is installed, and bad files are named with their line."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import PACKAGE, ROOT

from dmp_cpg_ros.configuration import (
    MOTIONS,
    ROBOTS,
    config_folders,
    find_config,
    node_parameters,
    unused_sections,
)
from dmp_cpg_ros.core.errors import DataError, MissingFileError
from dmp_cpg_ros.files import readable, writable
from dmp_cpg_ros.strict_yaml import DEEPEST, LARGEST_FILE, load_yaml


def written(folder: Path, text: str) -> Path:
    path = folder / 'file.yaml'
    path.write_text(text, encoding='utf-8')
    return path


def test_an_existing_path_is_taken_as_it_is(tmp_path: Path,
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, 'a: 1')
    monkeypatch.chdir(tmp_path)
    assert find_config(path) == find_config('file.yaml') == path


@pytest.mark.parametrize('name', ['gaits.yaml', 'gaits', 'robots/mini_quadruped.yaml'])
def test_the_packages_files_are_found_by_name(name: str, tmp_path: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = find_config(name)
    assert found.is_absolute() and found.is_file()
    assert found.with_suffix('').as_posix().endswith(f"config/{name.removesuffix('.yaml')}")


def test_a_missing_name_lists_the_places_and_the_names() -> None:
    with pytest.raises(MissingFileError) as error:
        find_config('gates.yaml')
    for text in ('gates.yaml', str(config_folders()[0]), 'suite.yaml', 'did you mean gaits?'):
        assert text in str(error.value)
    with pytest.raises(MissingFileError, match='did you mean scenarios/start_stop') as error:
        find_config('scenarios/startstop')
    assert 'robots/' not in str(error.value)


def test_a_name_of_a_kind_of_file_is_looked_for_among_those() -> None:
    assert find_config('go2', ROBOTS) == find_config('robots/go2.yaml', ROBOTS)
    with pytest.raises(MissingFileError, match='did you mean robots/go2') as error:
        find_config('goo2', ROBOTS)
    assert 'robots/mini_quadruped.yaml' in str(error.value)
    assert 'suite.yaml' not in str(error.value)
    with pytest.raises(MissingFileError, match='/config/motions$'):
        find_config('my_walk.yaml', MOTIONS)


@pytest.mark.parametrize('name', ['', Path()])
def test_an_empty_name_is_refused(name: str | Path) -> None:
    with pytest.raises(MissingFileError, match='is no name of a file'):
        find_config(name)


def test_a_missing_absolute_path_is_not_searched_elsewhere(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match='does not exist$'):
        find_config(tmp_path / 'gaits.yaml')


def test_what_is_no_file_is_called_what_it_is(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / 'queue')
    (tmp_path / 'walks').mkdir()
    (tmp_path / 'go2').mkdir()
    monkeypatch.chdir(tmp_path)
    assert find_config('go2', ROBOTS).is_file()  # whatever lies in the working folder
    for name, kind in (('walks', 'a folder'), (tmp_path / 'walks', 'a folder'),
                       ('robots', 'a folder'), ('queue', 'a pipe'), ('/dev/null', 'a device')):
        with pytest.raises(MissingFileError, match=f"{name}' is {kind}, not a file$"):
            find_config(name)


def test_what_has_no_end_is_not_read_and_what_waits_is_not_written(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / 'queue')
    (tmp_path / 'link').symlink_to('queue')
    (tmp_path / 'zeros').symlink_to('/dev/zero')
    for name in ('queue', 'link', 'zeros', ''):
        with pytest.raises(MissingFileError, match='is a (pipe|device|folder), not a file$'):
            readable(tmp_path / name)
        with pytest.raises(MissingFileError, match='is a (pipe|device|folder), not a file$'):
            load_yaml(tmp_path / name)
    for name in ('queue', 'link', ''):
        with pytest.raises(MissingFileError, match='is a (pipe|folder), not a file to write$'):
            writable(tmp_path / name)
    for path in (tmp_path / 'new', Path('/dev/null'), Path(__file__)):
        assert writable(path) == path
    assert readable(tmp_path / 'new') == tmp_path / 'new'


@pytest.mark.parametrize(('package', 'config', 'prefix_path'), [
    ('checkout/dmp_cpg_ros', 'checkout/config', ''),
    ('venv/lib/python3.99/site-packages/dmp_cpg_ros', 'venv/share/dmp_cpg_ros/config', ''),
    ('elsewhere/dmp_cpg_ros', 'ws/install/share/dmp_cpg_ros/config', 'other:ws/install'),
])
def test_every_kind_of_install(package: str, config: str, prefix_path: str,
                               tmp_path: Path) -> None:
    (tmp_path / package / 'core').mkdir(parents=True)
    for module in ('__init__.py', 'configuration.py', 'files.py', 'strict_yaml.py',
                   'core/__init__.py', 'core/errors.py', 'core/parameters.py'):
        shutil.copy(ROOT / PACKAGE / module, tmp_path / package / module)
    (tmp_path / config).mkdir(parents=True)
    (tmp_path / config / 'only_here.yaml').touch()
    (tmp_path / 'checkout').mkdir(exist_ok=True)
    (tmp_path / 'checkout' / 'package.xml').touch()
    program = ('import os, sys\n'
               f'sys.path.insert(0, {str((tmp_path / package).parent)!r})\n'
               "os.environ['AMENT_PREFIX_PATH'] = sys.argv[1]\n"
               'from dmp_cpg_ros.configuration import find_config\n'
               "print(find_config('only_here'))\n")
    prefixes = ':'.join(str(tmp_path / part) for part in prefix_path.split(':') if part)
    done = subprocess.run([sys.executable, '-c', program, prefixes], cwd=tmp_path,
                          capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.strip() == str(tmp_path / config / 'only_here.yaml'), done.stderr


def test_numbers_are_read_as_ros_reads_them(tmp_path: Path) -> None:
    text = 'a: 1e-3\nb: -2.5E2\nc: .5e1\nd: 3\ne: 1e3x\nf: 1.0\ng: 010\nh: 0x1F\n'
    text += 'i: 1:30\nj: .inf\n'
    content = load_yaml(written(tmp_path, text))
    assert content == {'a': 0.001, 'b': -250.0, 'c': 5.0, 'd': 3, 'e': '1e3x', 'f': 1.0, 'g': 8,
                       'h': 31, 'i': '1:30', 'j': float('inf')}
    assert isinstance(content['d'], int) and isinstance(content['a'], float)


def test_an_empty_file_is_an_empty_mapping(tmp_path: Path) -> None:
    assert load_yaml(written(tmp_path, '# nothing yet\n')) == {}


@pytest.mark.parametrize(('text', 'said'), [
    ('a: 1\nb: [1, 2\nc: 3\n', r'line 3'),
    ('a: 1\n\na: 2\n', r"line 3, column 1: the key 'a' stands twice"),
    ('outer:\n  b: 1\n  b: 1\n', r"line 3, column 3: the key 'b' stands twice"),
    ('- 1\n- 2\n', r'must be a mapping \(name: value\), not list'),
    ('a: !!python/object/apply:os.getcwd []\n', r'line 1'),
    ('a: \x07\n', r'not YAML'),
])
def test_bad_content_is_named_with_its_line(text: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(DataError, match=said) as error:
        load_yaml(path)
    assert str(path) in str(error.value)


def test_what_cannot_be_read_is_a_missing_file(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / 'nothing.yaml'):
        with pytest.raises(MissingFileError, match=str(path)):
            load_yaml(path)
    (tmp_path / 'latin.yaml').write_bytes(b'a: \xe4')
    with pytest.raises(DataError, match='UTF-8'):
        load_yaml(tmp_path / 'latin.yaml')


@pytest.mark.parametrize(('text', 'said'), [
    ('a: &a [x]\nb: *a\n', r'line 2, column 4: an alias \(\*name\) is not valid'),
    ('a: &a [*a]\n', 'line 1, column 8: an alias'),
    ('a: &a {x: 1}\nb: {<<: *a}\n', 'line 2, column 9: an alias'),
    ('- ' * 10000, f'nested deeper than {DEEPEST}'),
    ('[' * 100000, f'nested deeper than {DEEPEST}'),
    ('a: ' + 'b' * LARGEST_FILE, 'longer than'),
    ('a: ' + '9' * 5000, 'at most 64 bits'),
    ('[a, b]: 1', 'line 1, column 1: a name must be'),
    ('a: !!binary AAAA', "line 1, column 4: the tag .*binary' is not valid"),
    ('a: !!int b', 'line 1, column 4: no value of type int'),
    ('a: 1\nb: "\x00"', 'line 2: not YAML'),
])
def test_what_would_explode_or_hang_is_refused(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=said) as error:
        load_yaml(written(tmp_path, text))
    assert '\n' not in str(error.value)


PARAMETERS = """
/**: {ros__parameters: {gain: 2.0, rate: 250.0, group: {a: 1, b: {c: [1, 2]}}}}
leg_fl: {ros__parameters: {leg: fl, gain: 1.0}}
/robot_1:
  leg_fl: {ros__parameters: {gain: 3.0}}
/robot_1/leg_fr: {ros__parameters: {gain: 4.0}}
/*/leg_rl: {ros__parameters: {gain: 5.0}}
/**/leg_rr: {ros__parameters: {gain: 6.0}}
"""


@pytest.mark.parametrize(('node', 'gain'), [
    ('leg_fl', 1.0), ('/leg_fl', 1.0), ('posture_control', 2.0), ('/robot_1/leg_fl', 3.0),
    ('/robot_1/leg_fr', 4.0), ('leg_fr', 2.0), ('/robot_7/leg_rl', 5.0), ('/a/b/leg_rl', 2.0),
    ('leg_rl', 2.0), ('leg_rr', 6.0), ('/a/b/leg_rr', 6.0),
])
def test_a_nodes_own_section_overrides_the_shared_one(node: str, gain: float,
                                                      tmp_path: Path) -> None:
    path = written(tmp_path, PARAMETERS)
    parameters = node_parameters(load_yaml(path), node, path)
    assert parameters['gain'] == gain
    assert parameters['rate'] == 250.0
    assert (parameters['group.a'], parameters['group.b.c']) == (1, [1, 2])
    assert ('leg' in parameters) == (node.strip('/') == 'leg_fl')


@pytest.mark.parametrize(('text', 'said'), [
    ('leg_fr: {ros__parameters: {a: 1}}', "no parameters for node 'leg_fl'.*/leg_fr"),
    ('gain: 1.0', "'/gain' must be a mapping with 'ros__parameters:'"),
    ('leg_fl: {ros__parameters: 3}', "'ros__parameters' of '/leg_fl' must be a mapping"),
    ('', 'sections for no node'),
])
def test_what_is_no_parameter_file_says_so(text: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(DataError, match=said):
        node_parameters(load_yaml(path), 'leg_fl', path)


def test_a_section_that_means_no_node_in_the_namespace_is_found(tmp_path: Path) -> None:
    path = written(tmp_path, """
/**: {ros__parameters: {a: 1}}
robot: {ros__parameters: {a: 1}}
/**/leg_fl: {ros__parameters: {a: 1}}
/robot_1/leg_fr: {ros__parameters: {a: 1}}
other: {ros__parameters: {a: 1}}
""")
    kinds = ('robot', 'leg')
    assert unused_sections(path, '/robot_1', kinds) == ['/robot']
    assert unused_sections(path, '', kinds) == ['/robot_1/leg_fr']
