# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``certify``: its table, its JSON, its suggestions and its exit status."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip('mujoco')  # the robot's geometry is read from its model

from dmp_cpg_ros.commands.certify import main
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.proofs.check_rest import check


def file_with(folder: Path, **changes: object) -> str:
    """The suite's file with other values."""
    text = find_config('suite.yaml').read_text(encoding='utf-8')
    for name, value in changes.items():
        lines = text.splitlines()
        text = '\n'.join(line.split(name)[0] + f'{name}: {value}'
                         if line.strip().startswith(f'{name}:') else line for line in lines)
    path = folder / 'changed.yaml'
    path.write_text(text, encoding='utf-8')
    return str(path)


def test_the_packages_own_parameters_hold(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    out = capsys.readouterr().out
    assert 'certificate: holds' in out and 'capture' in out and 'k_inh = 400' in out


def test_gaits_that_are_chosen_are_certified_together_as_the_nodes_do(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chosen = ['--ros-args', '-p', 'gait:=walk', '-p', 'auto_gaits:=[walk, bound]', '-p']
    assert main([*chosen, 'inhibition_gain:=210.0']) == 0
    assert ': walk at up to' in capsys.readouterr().out
    assert main([*chosen, 'inhibition_gain:=210.0', '-p', 'auto_gait:=true']) == 1
    told = capsys.readouterr()
    assert ': walk, bound at up to' in told.out and 'fails: capture' in told.err
    assert main(['--proof', str(tmp_path / 'proof.json'), *chosen, 'auto_gait:=true']) == 2
    assert 'auto_gait' in capsys.readouterr().err
    assert main(['--ros-args', '-p', 'auto_gait:=true', '-p', 'auto_gaits:=[walk, gallop]',
                 '-p', 'auto_speeds:=[0.5]']) == 2
    assert "auto_gaits: there is no gait 'gallop'; valid are amble" in capsys.readouterr().err


@pytest.mark.parametrize('legs', ['[fl]', '[auto]'])
def test_what_split_couplings_take_for_granted_is_told_with_its_numbers(
        legs: str, capsys: pytest.CaptureFixture[str]) -> None:
    given = ['--ros-args', '-p', f'inhibited_legs:={legs}']
    assert main(['--json', *given]) == 0
    found = json.loads(capsys.readouterr().out)
    premises = {premise['name']: premise for premise in found['split_couplings']}
    assert {name: premise['holds'] for name, premise in premises.items()} == {
        'not_backwards': True, 'length_of_c': True, 'older_samples': True,
        'places_before': False, 'armed_before': False}
    assert all(premise['holds'] == (premise['kept_by'] == 'parameters')
               for premise in premises.values())
    age = found['inequalities']['carried_coupling']['left']
    assert premises['armed_before']['value'] == pytest.approx(
        age * premises['not_backwards']['limit'], rel=1e-6)      # of a radius of 1
    assert main(given) == 0
    told = capsys.readouterr().out
    for name, premise in premises.items():
        word = 'holds' if premise['holds'] else 'is asked for'
        assert f'{name:<13}  {word:<12}  {premise["value"]:.4g} <= ' in told


@pytest.mark.parametrize('gait', ['walk', 'trot', 'pace', 'bound', 'pronk'])
def test_every_gait_can_be_certified(gait: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['--ros-args', '-p', f'gait:={gait}']) == 0
    assert f': {gait} at up to' in capsys.readouterr().out


def test_a_required_inequality_that_fails_is_named_with_status_1(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([file_with(tmp_path, inhibition_gain=120.0)]) == 1
    captured = capsys.readouterr()
    assert 'fails: capture:' in captured.err and 'is not < k_inh = 120' in captured.err
    assert 'certificate: FAILS' in captured.out


def test_json_has_every_inequality_and_the_suggestion(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = file_with(tmp_path, inhibition_gain=120.0, coupling_gain=6.0)
    assert main([path, '--json', '--suggest']) == 1
    found = json.loads(capsys.readouterr().out)
    assert not found['holds'] and 'capture' in found['failing']
    better = file_with(tmp_path, **{name: float(value)
                                    for name, value in found['suggestion'].items()})
    assert main([better]) == 0


def test_the_file_and_the_namespace_of_the_ros_arguments_are_certified(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = file_with(tmp_path, inhibition_gain=120.0)
    assert main(['--ros-args', '--params-file', path]) == 1
    assert 'is not < k_inh = 120' in capsys.readouterr().err
    path = file_with(tmp_path)
    with Path(path).open('a', encoding='utf-8') as file:
        file.write('\n/robot1/canonical_oscillators: {ros__parameters: {gait: trot}}\n')
    for namespace, gait in (('', 'amble'), ('/robot1', 'trot')):
        assert main([path, '--ros-args', '-r', f'__ns:={namespace or "/"}']) == 0
        assert f': {gait} at up to' in capsys.readouterr().out


@pytest.mark.parametrize(('arguments', 'said'), [
    (['there_is_none.yaml'], 'does not exist'),
    (['--gait', 'gallop'], 'valid are amble'),
    (['--robot', 'robots/horse.yaml'], 'does not exist'),
    (['--ros-args', '-p', 'gate:=trot'], "no parameter 'gate'"),
    (['a.yaml', '--ros-args', '--params-file', 'b.yaml'], 'not both'),
])
def test_bad_input_has_status_2(arguments: list[str], said: str,
                                capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    assert said in capsys.readouterr().err


def test_names_and_values_that_are_wrong_have_status_2(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'typo.yaml'
    path.write_text('/**:\n  ros__parameters:\n    inhibition_gian: 400.0\n', encoding='utf-8')
    assert main([str(path)]) == 2
    assert "no parameter 'inhibition_gian'" in capsys.readouterr().err
    assert main([file_with(tmp_path, region_radius=-1.0)]) == 2
    assert "'region_radius' = -1.0" in capsys.readouterr().err


def test_a_proof_is_written_where_one_exists(tmp_path: Path,
                                             capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'proof.json'
    assert main(['--proof', str(path)]) == 0
    assert 'step_time_to_rest' in check(json.loads(path.read_text(encoding='utf-8')))
    assert main([file_with(tmp_path, voting='true'), '--proof', str(path)]) == 2
    assert 'voting' in capsys.readouterr().err
    assert main(['--proof', str(tmp_path)]) == 2
