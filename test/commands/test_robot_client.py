# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``robot_client`` against a running suite: every command over DDS, the keyboard in a terminal,
and a joystick.
"""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

import ros_processes
import yaml
from ros_processes import (
    NodeProcess,
    Processes,
    Ros,
    composed_suite,
    reserved_domain,
    wait_until,
)

from dmp_cpg_ros.commands import live_view, robot_client
from dmp_cpg_ros.commands.joystick import AXIS, BUTTON, EVENT, FULL, INITIAL
from dmp_cpg_ros.commands.teleop import AXES, HELD
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.layouts import GAIN_ROWS
from dmp_cpg_ros.nodes.messages.inhibition import InhibitionGainsReader, read_state_word
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.joint_targets import DRIVE_MODES, read_drive_mode
from dmp_cpg_ros.nodes.messages.posture_feedback import read_body_mode
from dmp_cpg_ros.suite_table import WALKING_NODES

shared_domain, shared_suite, ros = (
    ros_processes.shared_domain, ros_processes.shared_suite, ros_processes.shared_ros)

CLIENT = ('robot_client', '--wait', '20')


@pytest.fixture(scope='module')
def lookers(shared_suite: Processes) -> dict[str, NodeProcess]:
    """Clients that look for what is not there, for the twenty seconds in which others are asked:
    the tests at the end read what they have printed.
    """
    return {kind: shared_suite.executable(*CLIENT, *words) for kind, words in {
        'recorder': ('nodes',), 'node': ('param', 'get', 'oscillators', 'rho'),
        'topic': ('echo', 'joint_stats', '--once')}.items()}


def unread(processes: Processes, *words: str) -> subprocess.Popen[str]:
    """A client whose output nobody reads."""
    client = subprocess.Popen(
        [sys.executable, '-m', 'dmp_cpg_ros', *CLIENT, *words], stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, env=processes.environment)
    assert client.stdout is not None
    client.stdout.close()
    return client


def assert_ends_quietly(client: subprocess.Popen[str]) -> None:
    with client:
        assert client.wait(90.0) == -signal.SIGPIPE
        assert client.stderr is not None and client.stderr.read() == ''


@pytest.fixture(scope='module')
def unread_looker(shared_suite: Processes) -> Iterator[subprocess.Popen[str]]:
    """One that looks for the recorder, for as long, before it lists the nodes."""
    client = unread(shared_suite, 'nodes')
    yield client
    client.kill()
    client.wait()


@pytest.fixture(scope='module')
def suite(shared_suite: Processes, lookers: dict[str, NodeProcess],
          unread_looker: subprocess.Popen[str]) -> Processes:
    """A suite that all tests use."""
    return shared_suite


def said(processes: Processes, *arguments: str, status: int = 0) -> str:
    """What the client prints, by default when all goes well."""
    return told(processes.executable(*CLIENT, *arguments), status)


def refused(processes: Processes, *arguments: str, status: int = 1) -> str:
    """What the client prints when it does not go well."""
    return said(processes, *arguments, status=status)


def told(process: NodeProcess, status: int = 1) -> str:
    """What a client has printed at its end; some look for what is not there for ten seconds, in
    which others are asked.
    """
    assert process.wait(90.0) == status, str(process)
    assert 'Traceback' not in process.output, process
    return process.output.strip()


def await_stop(ros: Ros, word: str, name: str = 'inhibition_state') -> None:
    """Wait for a state of the stop."""
    topic = interface('inhibition_state')
    states = ros.collect(topic.type, name, topic.reader_qos)
    ros.spin_until(lambda: states and read_state_word(states[-1]) == word,
                   what=lambda: word)


def await_following(ros: Ros, name: str = 'drive_mode') -> None:
    """Wait until the robot follows its legs, which come up after it has begun to wait for them."""
    topic = interface('drive_mode')
    drives = ros.collect(topic.type, name, topic.reader_qos)
    ros.spin_until(lambda: drives and read_drive_mode(drives[-1]) == DRIVE_MODES[0],
                   what=lambda: f'{drives}')


def await_mode(ros: Ros, mode: str) -> None:
    """Wait for a mode of the body."""
    topic = interface('body_mode')
    modes = ros.collect(topic.type, topic.name, topic.reader_qos)
    ros.spin_until(lambda: modes and read_body_mode(modes[-1]) == mode, what=lambda: mode)


def test_without_a_suite_it_says_where_it_looked() -> None:
    with reserved_domain() as empty:
        process = subprocess.run(
            [sys.executable, '-m', 'dmp_cpg_ros', CLIENT[0], '--wait', '0.5', 'inhibit'],
            check=False, text=True, capture_output=True, timeout=60,
            env={**os.environ, 'ROS_DOMAIN_ID': str(empty)})
    assert process.returncode == 1
    assert f'no suite answers in ROS domain {empty}: nobody offers' in process.stderr
    assert 'start one with walk' in process.stderr
    assert 'Traceback' not in process.stderr


def test_a_suite_in_a_namespace_is_found_there_and_elsewhere_named(
        shared_domain: int, tmp_path: Path, ros: Ros) -> None:
    references = ros.collect(interface('reference').type, 'robot1/reference',
                             interface('reference').reader_qos)
    with composed_suite(shared_domain, tmp_path, '-r', '__ns:=/robot1',
                        control_rate=ros_processes.SHARED_HZ) as suite:
        await_stop(ros, 'at_rest', 'robot1/inhibition_state')
        await_following(ros, 'robot1/drive_mode')
        elsewhere, nodes = (suite.executable(*CLIENT, '--wait', '10', *words) for words in (
            ('inhibit',), ('--namespace', '/robot1', 'nodes')))
        answer = said(suite, 'resume', '--ros-args', '-r', '__ns:=/robot1')
        assert 'walking in' in answer
        suite.executable(*CLIENT, '--namespace', 'robot1', 'cmd_vel', '0.3')
        ros.spin_until(lambda: any(entry.twist.linear.x > 0.2 for entry in references))
        assert '--namespace /robot1' in told(elsewhere)
        assert 'ready' in told(nodes, 0)


def test_a_request_is_asked_once_and_its_answer_printed(
        suite: Processes, ros: Ros, request: pytest.FixtureRequest) -> None:
    # A command starts the gait, and keeps the automatic stop away.
    driving = suite.executable(*CLIENT, 'cmd_vel', '0.2')
    request.addfinalizer(driving.kill)
    await_stop(ros, 'walking')
    for command, other, verb, word in (
            ('inhibit', 'resume', 'at rest', 'at_rest'),
            ('resume', 'inhibit', 'walking', 'walking')):
        answer = said(suite, command)
        while re.search('already|another request', answer):  # it has come to a stand by itself
            said(suite, other)
            answer = said(suite, command)
        found = re.match(rf'{verb} in (\S+) s, at most (\S+) s; certificate holds', answer)
        assert found, answer
        assert 0.0 < float(found[1]) <= float(found[2])
        await_stop(ros, word)
    wait_until(lambda: said(suite, 'resume') == 'already walking')


def test_a_velocity_reaches_the_reference_and_ends_with_zero(suite: Processes, ros: Ros) -> None:
    sent = ros.collect(interface('cmd_vel').type, 'cmd_vel')
    references = ros.collect(interface('reference').type, 'reference',
                             interface('reference').reader_qos)
    said(suite, 'resume')
    client = suite.executable(*CLIENT, 'cmd_vel', '-0.2', '0.05', '0.1', '--rate', '20')
    ros.spin_until(
        lambda: sent and references and abs(references[-1].twist.linear.x + 0.2) < 0.01
        and abs(references[-1].twist.linear.y - 0.05) < 0.01
        and abs(references[-1].twist.angular.z - 0.1) < 0.01, what=lambda: f'{references[-1:]}')
    client.signal(signal.SIGTERM)
    assert client.wait() == 0, str(client)
    ros.spin_until(lambda: sent[-1].linear.x == sent[-1].angular.z == 0.0)
    assert said(suite, 'cmd_vel', '0.1', '--for', '0.5') == ''
    await_stop(ros, 'at_rest')


def test_a_stamped_command_to_a_suite_that_reads_plain_ones_is_an_error(
        suite: Processes) -> None:
    assert 'it is read as geometry_msgs/msg/Twist' in refused(suite, 'cmd_vel', '0.5',
                                                              '--stamped')


def test_it_lies_down_refuses_to_walk_and_stands_up(suite: Processes, ros: Ros) -> None:
    await_mode(ros, 'standing')
    assert re.match(r'lying \S+ s|lowering', said(suite, 'lie_down'))
    await_mode(ros, 'lying')
    assert 'the robot is lying, not standing; call stand_up' in refused(suite, 'resume')
    assert 'standing in' in said(suite, 'stand_up')
    await_mode(ros, 'standing')
    assert said(suite, 'stand_up')
    assert 'robot_client:' in refused(suite, 'recover')


def test_a_push_is_taken_once(suite: Processes, ros: Ros) -> None:
    taken = interface('~/commands_taken')
    told = ros.collect(taken.type, 'mujoco_robot/commands_taken', taken.reader_qos)

    def pushes() -> float:
        return dict(zip(told[-1].name, told[-1].position, strict=True))['push'] if told else 0.0

    before = pushes()
    said(suite, 'push', '0', '10', '0')
    ros.spin_until(lambda: pushes() == before + 1)


def test_parameters_are_read_set_and_refused_with_the_reason(suite: Processes) -> None:
    owner = 'canonical_oscillators'
    assert 'cadence_scale' in said(suite, 'param', 'list', owner).splitlines()
    assert said(suite, 'param', 'set', owner, 'rho', '9') == 'Set parameter successful'
    assert said(suite, 'param', 'get', f'/{owner}', 'rho') == '9.0'
    fault = '{component: encoder, kind: stuck, for_s: 0.5, leg: fl}'
    asked = [(suite.executable(*CLIENT, 'param', *words), status, why) for words, status, why in (
        (('set', owner, 'cadence_scale', '3.0'), 1, 'cadence_scale = 3.0 would lose the certif'),
        (('get', owner, 'rhoo'), 1, "has no parameter 'rhoo'"),
        (('get', owner), 2, 'param takes'),
        (('set', owner, 'rho', "'x"), 2, "'rho', line 1"),
        (('set', 'mujoco_robot', 'seed', '9' * 30), 2, '64 bits'),
        (('set', owner, 'rho', '[1, a]'), 1, 'failed'),
        (('set', 'mujoco_robot', 'fail', fault), 1, 'failures_allowed'))]
    for client, status, why in asked:
        assert why in told(client, status)
    assert said(suite, 'param', 'get', owner, 'cadence_scale') == '1.0'


def test_a_message_is_printed_as_yaml(suite: Processes) -> None:
    (message, _) = yaml.safe_load_all(said(suite, 'echo', 'joint_states', '--once'))
    assert len(message['name']) == len(message['position']) == 3 * len(LEGS)


def test_what_is_not_finite_is_bad_input(suite: Processes) -> None:
    assert 'finite' in refused(suite, 'cmd_vel', 'nan', status=2)
    assert 'finite' in refused(suite, 'push', '0', 'inf', '0', status=2)
    assert 'at most 15000 N' in refused(suite, 'push', '1e6', '0', '0', status=2)


def test_who_reads_no_further_ends_a_list_quietly(suite: Processes) -> None:
    assert_ends_quietly(unread(suite, 'param', 'list', 'inhibition'))


@pytest.mark.parametrize(('words', 'namespace', 'wait'), [
    ('inhibit', None, 10.0), ('inhibit --wait 2', None, 2.0), ('--wait 2 inhibit', None, 2.0),
    ('--namespace a --wait 3 param get b c --wait 2', 'a', 2.0),
    ('push 0 -60 0 --namespace b', 'b', 10.0)])
def test_where_to_look_is_said_before_the_command_or_after_it(
        words: str, namespace: str | None, wait: float) -> None:
    options = robot_client._parser().parse_args(words.split())
    assert (options.namespace, options.wait) == (namespace, wait)


@pytest.mark.parametrize(('main', 'arguments', 'text'), [
    (robot_client.main, ['cmd_vel', 'fast'], "'fast' is no number"),
    (robot_client.main, ['--namespace', '9x y', 'nodes'], "'9x y' is no namespace"),
    (live_view.main, ['--namespace', '9x y'], "'9x y' is no namespace"),
    (live_view.main, ['--ros-args', '-r', '__ns:=/9x'], "remap rule: '-r __ns:=/9x'"),
    (robot_client.main, ['nodes', '--ros-args', 'fast'], "unknown arguments after --ros-args: ['"),
    (live_view.main, ['--port', '99999'], "'99999' is no port"),
    (live_view.main, ['--port', '-1'], "'-1' is no port"),
    (live_view.main, ['--wait', 'nan'], 'nan must be finite'),
])
def test_bad_arguments_are_refused_in_plain_words(
        main: Callable[[list[str]], int], arguments: list[str], text: str,
        capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert text in capsys.readouterr().err


class Terminal:
    """The client in a terminal of its own."""

    def __init__(self, processes: Processes, *arguments: str) -> None:
        self.end, inside = pty.openpty()
        self.inside = inside
        self.output = ''
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'dmp_cpg_ros', *CLIENT, *arguments],
            stdin=inside, stdout=inside, stderr=inside, env=processes.environment,
            start_new_session=True)

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self.end)
        os.close(self.inside)

    def read(self) -> None:
        if select.select([self.end], [], [], 0.02)[0]:
            self.output += os.read(self.end, 4096).decode()

    def wait_for(self, text: str) -> None:
        wait_until(lambda: text in self.output, between=self.read, what=lambda: self.output)

    def press(self, keys: str) -> None:
        os.write(self.end, keys.encode())

    def status(self) -> int:
        wait_until(lambda: self.process.poll() is not None, between=self.read,
                   what=lambda: self.output)
        return self.process.returncode


@pytest.fixture
def terminal(suite: Processes) -> Iterator[Terminal]:
    with closing(Terminal(suite, 'teleop')) as opened:
        yield opened


def forge_walking(ros: Ros, terminal: Terminal) -> None:
    """Say to those who know the suite that nobody has asked for a stop, once a second, until the
    terminal names who does, and leave: on a busy machine it hears later, and of names later still.
    """
    topic, values = interface('inhibition_gains'), {
        **dict.fromkeys(GAIN_ROWS, 0.0), 'region_radius': 0.3, 'share': 1.0, 'quickness': 1.0}
    message = topic.type(name=list(values), position=list(values.values()))
    assert not InhibitionGainsReader().read(message).requested
    forged = ros.node.create_publisher(topic.type, topic.name, topic.publisher_qos)
    ends = ros.node.get_subscriptions_info_by_topic
    ros.spin_until(lambda: forged.get_subscription_count() == len(ends(topic.name)) > 0)
    named, due = 'inhibition_gains is published by /test too', [time.monotonic()]

    def say() -> None:
        if time.monotonic() >= due[0]:
            forged.publish(message)
            due[0] += 1.0
        terminal.read()

    wait_until(lambda: named in terminal.output, between=say, what=lambda: terminal.output)
    ros.node.destroy_publisher(forged)


def test_keys_drive_stop_and_quit_and_the_terminal_is_as_it_was(
        terminal: Terminal, suite: Processes, ros: Ros) -> None:
    before = termios.tcgetattr(terminal.inside)
    references = ros.collect(interface('reference').type, 'reference',
                             interface('reference').reader_qos)
    said(suite, 'inhibit')
    await_stop(ros, 'at_rest')
    terminal.wait_for('at rest')
    assert termios.tcgetattr(terminal.inside) != before
    forge_walking(ros, terminal)
    terminal.press(' ')
    terminal.wait_for('walking in')
    terminal.press('w\x1b[Aa\x1b[Cw')
    terminal.wait_for('+0.3 m/s, +0.0 rad/s')
    ros.spin_until(lambda: references and references[-1].twist.linear.x > 0.29)
    terminal.press(' ')
    terminal.wait_for('at rest in')
    await_stop(ros, 'at_rest')
    terminal.press('xq')
    assert terminal.status() == 0, terminal.output
    assert termios.tcgetattr(terminal.inside) == before


def test_a_terminated_teleop_leaves_the_terminal_as_it_was(terminal: Terminal) -> None:
    before = termios.tcgetattr(terminal.inside)
    terminal.wait_for('+0.0 m/s')
    terminal.process.send_signal(signal.SIGTERM)
    assert terminal.status() == 0, terminal.output
    assert termios.tcgetattr(terminal.inside) == before


def test_keys_need_a_terminal(suite: Processes) -> None:
    process = subprocess.run([sys.executable, '-m', 'dmp_cpg_ros', *CLIENT, 'teleop'],
                             env=suite.environment, stdin=subprocess.DEVNULL,
                             capture_output=True, text=True, timeout=90, check=False)
    assert process.returncode == 1
    assert 'terminal' in process.stderr


class Pad:
    """A joystick: a pipe through which its events come."""

    def __init__(self, path: Path) -> None:
        os.mkfifo(path)
        self.path, self.file = str(path), os.open(path, os.O_RDWR)
        for axis in AXES:
            self.tell(AXIS | INITIAL, axis, 0)

    def tell(self, kind: int, number: int, value: int) -> None:
        os.write(self.file, EVENT.pack(0, value, kind, number))

    def unplug(self) -> None:
        os.close(self.file)


def test_a_joystick_drives_while_a_button_is_held_and_stops(
        suite: Processes, ros: Ros, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    topic, pad = interface('reference'), Pad(tmp_path / 'js0')
    references = ros.collect(topic.type, 'reference', topic.reader_qos)
    said(suite, 'inhibit')
    await_stop(ros, 'at_rest')
    client = Terminal(suite, 'joystick', pad.path, '--top', '0.4')
    request.addfinalizer(client.close)
    client.wait_for('at rest')
    ahead, aside, around = AXES
    pad.tell(AXIS, ahead, -FULL)  # pushed away, with the button not held
    pad.tell(BUTTON, 0, 1)
    pad.tell(BUTTON, 0, 0)
    client.wait_for('walking in')
    ros.spin_until(lambda: bool(references))
    assert all(abs(reference.twist.linear.x) < 0.05 for reference in references)
    pad.tell(BUTTON, HELD, 1)
    pad.tell(AXIS, around, FULL // 2)
    ros.spin_until(lambda: references[-1].twist.linear.x > 0.39
                   and references[-1].twist.angular.z < -0.39)
    pad.tell(AXIS, ahead, 0)
    pad.tell(AXIS, around, 0)
    pad.tell(AXIS, aside, -FULL)
    ros.spin_until(lambda: references[-1].twist.linear.y > 0.23)
    pad.tell(BUTTON, HELD, 0)
    ros.spin_until(lambda: abs(references[-1].twist.linear.y) < 0.01)
    pad.tell(BUTTON, 0, 1)
    await_stop(ros, 'at_rest')
    pad.unplug()
    client.wait_for('js0 has ended')
    assert client.status() == 1


def test_without_a_joystick_it_says_which_are_there(suite: Processes, tmp_path: Path) -> None:
    assert 'joysticks here:' in refused(suite, 'joystick', str(tmp_path / 'js7'))


# What the clients that looked for twenty seconds have found -------------------------------------


def test_all_nodes_are_ready(suite: Processes, lookers: dict[str, NodeProcess]) -> None:
    """They are asked again where a client of another test came or went as the first one looked."""
    ready, clients = dict.fromkeys(WALKING_NODES, 'ready'), [lookers['recorder']]
    assert told(lookers['recorder'], 0)

    def found() -> dict[str, str]:
        """What the last one lists, if it has found the suite in its short time."""
        status, text = clients[-1].wait(90.0), clients[-1].output
        return {} if status else dict(line.split(maxsplit=1) for line in text.splitlines())

    def are_ready() -> bool:
        if ready.items() <= found().items():
            return True
        clients.append(suite.executable(*CLIENT, 'nodes', '--wait', '4'))
        return False

    wait_until(are_ready, 90.0, what=lambda: str(clients))
    lines = found()
    assert lines['bag_recorder'] == 'does not run'


def test_who_reads_no_further_ends_a_list_that_took_long_quietly(
        unread_looker: subprocess.Popen[str]) -> None:
    assert_ends_quietly(unread_looker)


def test_a_node_that_is_not_there_is_answered_with_those_that_are(
        lookers: dict[str, NodeProcess]) -> None:
    assert 'canonical_oscillators' in told(lookers['node'])


def test_a_topic_that_is_not_there_is_answered_with_those_that_are(
        lookers: dict[str, NodeProcess]) -> None:
    assert 'joint_states' in told(lookers['topic'])
