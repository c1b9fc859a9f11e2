# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever bytes stand in a file, reading it succeeds or ends in an error of one line."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from checkout import ROOT
from ros_processes import reserved_domain

from dmp_cpg_ros.commands.walk import load_scenario, main
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.learning.discrete import learn_discrete
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.primitive_files import load_primitive, save_primitive
from dmp_cpg_ros.robot.robot_file import load_robot_file
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.suite import load_gaits, load_suite

LONGEST_S = 5.0
"""A file that takes longer is one that hangs."""

WORDS = (b'\x00', b'\xff', b'\xc3(', b'\xef\xbb\xbf', b'[', b']', b'{', b'}', b':', b': ', b'- ',
         b'\n', b'\n  ', b'\t', b'&a ', b'*a', b'<<: *a', b'!!binary ', b'!!set ', b'!x ', b'? ',
         b'|', b'>', b'%', b'"', b"'", b'#', b'---\n', b'...', b'.nan', b'.inf', b'-1', b'1e400',
         b'9' * 30, b'null', b'~', b'true', b'0', b'[]', b'{}', b'\\', b'\xf0\x9f\xa6\xbf',
         b'~x/y')
VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1, 2**62, 1e-300, 1e300, float('nan'), float('inf'), '', 'x', '~nobody/x',
    'package://__main__/x', 'a' * 5000, [], {}, [1.0], [None], [[1]], {'x': 1}, {'': None},
    [0.5] * 4, '\x00', 'two\nlines')


def garbled(data: bytes, chance: random.Random) -> bytes:
    """A file with some of its bytes removed, repeated, replaced or put in."""
    for _ in range(chance.randint(1, 4)):
        at, end = sorted(chance.choices(range(len(data) + 1), k=2))
        end = min(end, at + chance.choice((0, 1, 3, 20, 200)))
        data = data[:at] + chance.choice((b'', data[at:end] * 2, *[chance.choice(WORDS)] * 3)
                                         ) + data[end:]
    return data


def changed(content: Any, chance: random.Random) -> Any:
    """A file's content with another value, or none, or one too many, somewhere in it."""
    if not isinstance(content, (dict, list)) or not content or chance.random() < 0.1:
        return chance.choice(VALUES)
    place = chance.choice(list(content) if isinstance(content, dict) else range(len(content)))
    new = content.copy()
    if chance.random() < 0.1:
        del new[place]
    elif chance.random() < 0.1 and isinstance(new, dict):
        new[chance.choice(('x', '', 'a\nb', 'kind', 'world_height'))] = chance.choice(VALUES)
    else:
        new[place] = changed(content[place], chance)
    return new


def a_primitive(folder: Path) -> Path:
    times = np.linspace(0.0, 1.0, 20)
    path = folder / 'learned.yaml'
    save_primitive(learn_discrete(Demonstration(times, np.sin(times)[:, None]), 3), path)
    return path


def a_suite(folder: Path) -> Path:
    path = folder / 'small.yaml'
    path.write_text('/**:\n  ros__parameters:\n    gait: trot\n'
                    '    world: blocks\n    world_height: 0.1\n'
                    'inhibition: {ros__parameters: {inhibition_gain: 200.0}}\n'
                    'mujoco_robot: {ros__parameters: {robot: robots/mini_quadruped.yaml}}\n')
    return path


KINDS: dict[str, tuple[Callable[[Path], Any], Callable[[Path], Path], int]] = {
    'suite': (load_suite, a_suite, 150),
    'gaits': (load_gaits, lambda _: ROOT / 'config' / 'gaits.yaml', 150),
    'robot': (load_robot_file, lambda _: find_config('robots/mini_quadruped'), 600),
    'scenario': (load_scenario, lambda _: find_config('scenarios/rough_ground'), 400),
    'primitive': (load_primitive, a_primitive, 600),
}


@pytest.mark.parametrize('kind', KINDS)
def test_any_file_is_read_or_refused_in_one_line(kind: str, tmp_path: Path) -> None:
    load, source, count = KINDS[kind]
    chance, file = random.Random(kind), source(tmp_path)
    data, content, path = file.read_bytes(), load_yaml(file), tmp_path / 'file.yaml'
    refused = 0
    for _ in range(count):
        for new in (garbled(data, chance),
                    yaml.safe_dump(changed(content, chance), sort_keys=False).encode()):
            path.write_bytes(new)
            begin = time.process_time()  # a loaded machine is no failure
            try:
                load(path)
            except DmpCpgError as error:
                refused += 1
                assert '\n' not in str(error), str(error)
            assert time.process_time() - begin < LONGEST_S, new
    assert 0 < refused < 2 * count


BOMB = b'a: &a [x, x, x, x, x, x, x, x, x]\n' + b''.join(
    b'%c: &%c [%s]\n' % (i + 1, i + 1, b', '.join([b'*%c' % i] * 9)) for i in range(97, 110))


@pytest.mark.parametrize('kind', KINDS)
def test_aliases_that_stand_for_billions_of_values_are_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / 'file.yaml'
    path.write_bytes(BOMB)
    with pytest.raises(DmpCpgError, match='alias'):
        KINDS[kind][0](path)


@pytest.mark.parametrize('value', ['*a', '[' * 1000, '\x00', '!!binary x', '{a: [}', '9' * 5000])
def test_values_on_the_command_line_are_read_as_strictly(
        value: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with reserved_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        assert main(['--set', f'gait:={value}']) == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1 and "'gait', line 1" in told[0]
