# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Models that ask for more than there is, or are read for ever, are refused before MuJoCo."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import pytest

from dmp_cpg_ros.commands.inspect_robot import main
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.robot.model_loader import load_model
from dmp_cpg_ros.robot.model_text import MOST, check_text

FREE = '<body><freejoint/><geom size="0.1"/></body>'
GEOM = '<geom size="0.1"/>'


def world(inside: str, assets: str = '') -> str:
    return f'<mujoco><asset>{assets}</asset><worldbody>{inside}</worldbody></mujoco>'


def copies(inside: str, count: object) -> str:
    return f'<replicate count="{count}" offset="1 0 0">{inside}</replicate>'


def asset(tag: str) -> str:
    return world('', tag)


def file_of(folder: Path, text: str, name: str = 'model.xml') -> Path:
    path = folder / name
    path.write_text(text, encoding='utf-8')
    return path


@pytest.mark.parametrize(('text', 'element', 'what'), [
    (world(copies(copies(GEOM, 1000), 1000)), 'replicate', 'elements by multiplication'),
    (world(copies(copies(FREE, 100), 200)), 'replicate', 'bodies'),
    (world(FREE * 1001), 'body', 'bodies'),
    (world(copies(GEOM, '&#49;00000')), 'replicate', 'elements by multiplication'),
    (world(copies(GEOM, 'inf')), 'replicate', 'elements by multiplication'),
    (world(copies(GEOM, 'nan')), 'replicate', 'elements by multiplication'),
    (world(copies(GEOM, 10**5)).replace('<mujoco>', '<mujoco xmlns="any">'), 'replicate',
     'elements by multiplication'),
    (world('<flexcomp name="f" count="200 200 200" dim="3"/>'), 'flexcomp', 'bodies'),
    (world(GEOM * 50_001), 'geom', 'elements'),
    (asset('<texture builtin="flat" type="2d" width="30000" height="30000"/>'), 'texture',
     'bytes of memory'),
    (asset('<texture builtin="flat" width="30000" height="1"/>'), 'texture', 'bytes of memory'),
    (asset('<hfield nrow="10000" ncol="10000"/>'), 'hfield', 'bytes of memory'),
    (asset('<mesh builtin="supersphere" params="3000 1 1"/>'), 'mesh', 'bytes of memory'),
    ('<mujoco><size nkey="10000000"/></mujoco>', 'size', 'bytes of memory'),
    ('<mujoco><size nuser_body="10000000"/></mujoco>', 'size', 'bytes of memory'),
    ('<mujoco><custom><numeric name="n" size="100000000"/></custom></mujoco>', 'numeric',
     'bytes of memory'),
    ('<mujoco><default><motor nsample="100000000"/></default></mujoco>', 'nsample',
     'bytes of memory'),
    (f'<mujoco><!--{" " * 2**23}--></mujoco>', 'file', 'bytes of XML'),
])
def test_a_model_that_asks_for_too_much_is_refused_by_element_and_limit(
        text: str, element: str, what: str, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(file_of(tmp_path, text))]) == 2
    said = capsys.readouterr().err
    assert said.count('\n') == 1
    assert said.endswith(f'{what} with <{element}>; valid are at most {MOST[what]}\n')


def test_what_is_included_and_attached_is_multiplied(tmp_path: Path) -> None:
    file_of(tmp_path, f'<mujocoinclude>{copies(GEOM, 100)}</mujocoinclude>', 'part.txt')
    within = file_of(tmp_path, world(copies('<include file="part.txt"/>', 100)))
    with pytest.raises(ParameterError, match='multiplication with <replicate>'):
        check_text(within)
    # twice the one that is twice the one ...
    for i in range(20):
        attach = ''.join(f'<attach model="m" body="x" prefix="{p}"/>' for p in 'pq')
        inside = f'<body name="x">{attach if i < 19 else GEOM}</body>'
        file_of(tmp_path, world(inside, f'<model name="m" file="part{i + 1}.xml"/>'),
                f'part{i}.xml')
    with pytest.raises(ParameterError, match='bodies with <attach>; valid are at most'):
        check_text(tmp_path / 'part0.xml')
    for name, tag in (('self.xml', 'model name="m"'), ('again.xml', 'include')):
        path = file_of(tmp_path, f'<mujoco><{tag} file="{name}"/></mujoco>', name)
        with pytest.raises(ParameterError, match='to itself|deeper than'):
            check_text(path)


def test_a_picture_that_unpacks_into_too_much_is_refused(tmp_path: Path) -> None:
    head = b'\x89PNG\r\n\x1a\n' + struct.pack('>I4sII', 13, b'IHDR', 30_000, 30_000)
    (tmp_path / 'bomb.png').write_bytes(head)
    with pytest.raises(ParameterError, match='bytes of memory with <texture>'):
        check_text(file_of(tmp_path, asset('<texture type="2d" file="bomb.png"/>')))


@pytest.mark.parametrize('names', [
    '<include file="queue.txt"/>', '<include file="q&#117;eue.txt"/>',
    '<compiler meshdir="parts"/><asset><mesh file="../queue.txt"/></asset>',
    '<compiler strippath="true"/><asset><mesh file="any/queue.txt"/></asset>',
    '<asset><model name="m" file="queue.txt"/></asset>'])
def test_a_pipe_of_any_name_is_refused(names: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / 'queue.txt')
    (tmp_path / 'parts').mkdir()
    with pytest.raises(ParameterError, match='names .*, which is a pipe, not a file'):
        check_text(file_of(tmp_path, f'<mujoco>{names}</mujoco>'))


@pytest.mark.parametrize(('text', 'said'), [
    ('<mujoco><worldbody></mujoco>', 'is not well-formed XML: mismatched tag'),
    ('<!DOCTYPE a [<!-- > <replicate count="9999"> --> ]><mujoco/>', 'DOCTYPE> is not valid'),
    (world(copies(GEOM, 'many')), "count of <replicate> must be numbers, not 'many'")])
def test_text_that_mujoco_might_read_otherwise_is_refused(text: str, said: str, tmp_path: Path
                                                          ) -> None:
    with pytest.raises(ParameterError, match=said):
        check_text(file_of(tmp_path, text))


def test_what_is_usual_is_loaded(tmp_path: Path) -> None:
    """Floors of textures, stairs of copies, a height field, an included part, an attached one."""
    file_of(tmp_path, f'<mujocoinclude>{FREE}</mujocoinclude>', 'part.txt')
    file_of(tmp_path, world(f'<body name="x">{GEOM}</body>'), 'arm.xml')
    model = load_model(file_of(tmp_path, world(
        copies('<geom type="box" size="0.1 1 0.1"/>', 50) + '<include file="part.txt"/>'
        '<attach model="m" body="x" prefix="p"/>',
        '<texture type="skybox" builtin="gradient" width="512" height="3072"/>'
        '<texture name="t" type="2d" builtin="checker" width="1024" height="1024"/>'
        '<hfield name="h" nrow="200" ncol="200" size="1 1 1 1"/>'
        '<model name="m" file="arm.xml"/>')), '')
    assert (model.nbody, model.nhfield) == (3, 1) and model.ngeom >= 52
