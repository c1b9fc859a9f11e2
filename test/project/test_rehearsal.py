# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The driver is rehearsed with a low-level robot, as doc/how_to/hardware.md says.

These run in real time on a machine that does other things, so that the robot waits for its
commands; what it does on its own clock is in ``test_driver.py``.
"""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy')
pytest.importorskip('mujoco')

import ros_processes
import yaml
from checkout import ROOT as CHECKOUT
from ros_processes import SHARED_HZ, Processes, Ros
from std_msgs.msg import Float64MultiArray
from test_how_to import example
from test_readme import blocks

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.nodes.messages.interfaces import COMMAND_INTERFACES, commands_of, interface
from dmp_cpg_ros.strict_yaml import load_yaml
from dmp_cpg_ros.studies import rehearsal

processes, ros, ros_domain = (
    ros_processes.processes, ros_processes.ros, ros_processes.ros_domain)

PATIENT = ('--longest-lag', '10')
"""Options of the robot for a machine that does other things."""

CLIENT, ROBOT = 'robot_client', 'low_level_robot'

PATIENCE_S = 240.0
"""How long a command may take [s]."""


THEN = {'enable': {'drive_mode': 'following'}, 'stand_up': {'body_mode': 'standing'}}
"""What a reader waits for behind a command, as the page says."""


def typed() -> list[list[str]]:
    """Words of the lines of the page's rehearsal."""
    (block,) = (block for block in blocks(CHECKOUT / 'doc' / 'how_to' / 'hardware.md', 'bash')
                if block.startswith(ROBOT))
    return [shlex.split(line, comments=True) for line in block.splitlines()]


def files_of_the_page(folder: Path) -> None:
    """The robot's file and that of the suite, as the page says; at a rate that costs less."""
    robot = find_config('robots/mini_quadruped').read_text(encoding='utf-8')
    (folder / 'my_robot.yaml').write_text(robot, encoding='utf-8')
    content = load_yaml(find_config('suite.yaml'))
    given = yaml.safe_load(example('hardware.md', '/**'))['/**']['ros__parameters']
    content['/**']['ros__parameters'] |= given | {'control_rate': SHARED_HZ}
    (folder / 'my_suite.yaml').write_text(yaml.safe_dump(content), encoding='utf-8')


def test_the_rehearsal_of_the_page_walks(
        processes: Processes, ros: Ros, tmp_path: Path) -> None:
    files_of_the_page(tmp_path)
    heard: dict[str, str] = {}
    for topic in map(interface, ('drive_mode', 'body_mode')):
        ros.node.create_subscription(topic.type, topic.name, lambda message, of=topic.name: (
            heard.update({of: message.data})), topic.reader_qos)
    lines = typed()
    assert [words[0] for words in lines[:4]] == [
        ROBOT, 'ros2_control_driver', 'composed_suite', CLIENT]
    running = [processes.executable(name, *words, *(PATIENT if name == ROBOT else ()),
                                    folder=str(tmp_path))
               for name, *words in lines if name != CLIENT]

    def asked(*words: str) -> bool:
        """Whether a client was answered; the driver refuses as long as it has heard nothing."""
        client = processes.executable(CLIENT, '--wait', '60', *words)
        ros.spin_until(lambda: not client.running, PATIENCE_S, what=lambda: f'{client}{running}')
        assert client.wait() == 0 or rehearsal.UNHEARD in client.output, f'{client}{running}'
        return client.wait() == 0

    for name, *words in lines:
        if name == CLIENT:
            ros.spin_until(lambda words=words: asked(*words), PATIENCE_S)
            for topic, state in THEN.get(words[0], {}).items():
                ros.spin_until(lambda topic=topic, state=state: heard.get(topic) == state,
                               PATIENCE_S, what=lambda: f'{heard}{running}')
    for process in running:
        process.interrupt()
        assert process.wait(PATIENCE_S) == 0, process
    output = running[0].output
    assert re.search(r'[1-9][\d.]* states and [1-9][\d.]* commands per second', output), output
    assert 'refused; it is ' in output and ', 0 commands refused' in output


def test_the_study_walks_and_says_what_was_held(
        ros_domain: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / 'measured.json'
    status = rehearsal.main(['--seconds', '2', '--rate', str(SHARED_HZ), *PATIENT,
                             '--json', str(file), '--logs', str(tmp_path / 'logs')])
    said = capsys.readouterr()
    assert status == 0, said
    measured = json.loads(file.read_text(encoding='utf-8'))
    # it is commanded for a time of the wall clock, in which a loaded machine does little
    assert measured['moved_m'] > 0.1 * measured['real_time_factor'] and measured['refused'] == 0
    assert measured['refused_step'] == ''
    assert measured['states_hz'] > 0.0 and measured['commands_hz'] > 0.0
    assert set(measured['cores']) == {ROBOT, 'ros2_control_driver', 'composed_suite'}
    assert 'real-time factor' in said.out and 'body_mode: standing' in said.out
    assert {log.stem for log in (tmp_path / 'logs').iterdir()} == set(measured['cores'])


def test_a_step_that_is_refused_costs_no_figure(
        ros_domain: int, tmp_path: Path, capsys: pytest.CaptureFixture[str],
        monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / 'measured.json'
    becomes = rehearsal.Rehearsal.becomes

    def flying(robot: rehearsal.Rehearsal, topic: str, state: str) -> None:
        becomes(robot, topic, state)
        monkeypatch.setattr(rehearsal, 'COMES_WITHIN_S', 0.0)
        becomes(robot, topic, 'flying')

    monkeypatch.setattr(rehearsal.Rehearsal, 'becomes', flying)
    assert rehearsal.main([*PATIENT, '--rate', str(SHARED_HZ), '--json', str(file)]) == 1
    said, measured = capsys.readouterr(), json.loads(file.read_text(encoding='utf-8'))
    assert 'drive_mode is not flying' in said.err and 'real-time factor' in said.out
    assert 'flying' in measured['refused_step'] and measured['states_hz'] > 0.0


def test_what_is_no_command_is_refused_and_the_robot_goes_on(
        processes: Processes, ros: Ros) -> None:
    robot = processes.executable(ROBOT, '--timeout', '10')
    publishers = {name: ros.node.create_publisher(Float64MultiArray, commands_of(name), 10)
                  for name in COMMAND_INTERFACES}
    ros.spin_until(lambda: all(of.get_subscription_count() for of in publishers.values()))
    wrong = [('position', [np.nan] * 12), ('effort', [1.0] * 11), ('kp', [-1.0] * 12)]
    for name, values in wrong:
        publishers[name].publish(Float64MultiArray(data=values))
    robot.wait_for_output('was refused: ')
    for _ in range(2):
        for name in COMMAND_INTERFACES:
            publishers[name].publish(Float64MultiArray(data=[0.0] * 12))
    ros.spin_until(lambda: all(of.wait_for_all_acked() for of in publishers.values()))
    robot.interrupt()
    assert robot.wait() == 0, robot
    assert f'{len(wrong)} commands refused' in robot.output


@pytest.mark.parametrize(('options', 'said'), [
    (['--robot', 'no_robot.yaml'], 'no_robot.yaml'), (['--interfaces', 'torque'], 'valid are'),
    (['--timeout', 'nan'], 'finite'), (['--timeout', '0'], 'from 0.004 to 10'),
    (['--longest-lag', '-1'], 'from 0 to 10'), (['--seconds', '0'], 'positive'),
    (['--ros-args', '-r', '__ns:=1'], 'namespace')])
def test_what_cannot_be_used_ends_with_status_2_and_a_reason(
        processes: Processes, options: list[str], said: str) -> None:
    robot = processes.executable(ROBOT, *options)
    assert robot.wait() == 2 and said in robot.output, robot
    assert 'Traceback' not in robot.output, robot
