# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``live_view`` beside a running suite: what it shows, and what becomes of its commands."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rclpy')

import by_hand
import ros_processes
from browser import Page
from by_hand import COARSE, PATIENCE_S, SIZE, drive, heard, start, state
from checkout import needs_make, recipe
from ros_processes import (
    BY_ITSELF,
    NodeProcess,
    Processes,
    Ros,
    composed_suite,
    joined,
    reserved_domain,
    wait_until,
)

from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.posture_feedback import read_body_mode
from dmp_cpg_ros.studies.first_walk import ADDRESS, ViewClient
from dmp_cpg_ros.suite_table import ROBOT, WALKING_NODES

shared_domain, suite, ros = (
    ros_processes.shared_domain, ros_processes.shared_suite, ros_processes.shared_ros)
page = by_hand.page


class Client(ViewClient):
    """A browser without a picture, of a process that serves the page."""

    def __init__(self, process: NodeProcess) -> None:
        self.process = process
        super().__init__(process.wait_for_output(ADDRESS, PATIENCE_S)[1], PATIENCE_S)

    def scene(self) -> Any:
        """What is drawn, once the suite is there."""
        found: list[Any] = []

        def drawn() -> bool:
            answer = self.ask('/scene')
            assert self.process.running, self.process
            if answer.status == 200:
                found.append(json.loads(answer.read()))
            return bool(found)

        wait_until(drawn, PATIENCE_S, what=lambda: f'the scene of {self.process}')
        return found[0]

    def granted(self, **command: Any) -> str:
        """Answer to a command that is taken, by a robot that looks after itself a moment later."""
        answers: list[tuple[bool, str]] = []

        def taken() -> bool:
            answers.append(self.send(**command))
            assert answers[-1][0] or BY_ITSELF in answers[-1][1], answers[-1]
            return answers[-1][0]

        wait_until(taken, PATIENCE_S, what=lambda: f'{command}: {answers[-1]}')
        return answers[-1][1]

    def drive(self) -> None:
        """Start the gait, and command a velocity until it walks by it."""
        self.granted(inhibit=False)
        self.until(lambda frame: self.send(velocity=[0.3, 0, 0])[0] and not frame['requested']
                   and frame['stop']['state'] == 'walking')

    def until(self, condition: Callable[[Any], object]) -> Any:
        """First frame of which a condition holds."""
        frame = None
        try:
            for frame in self.frames():
                if condition(frame):
                    return frame
        except DmpCpgError as error:
            raise AssertionError(f'{error}, the last of which: {frame}') from error
        raise AssertionError(self.process)


@pytest.fixture(scope='module')
def client(suite: Processes) -> Client:
    client = Client(suite.executable('live_view'))
    client.scene()
    return client


def at_rest(client: Client) -> Any:
    """Frame of a suite that somebody has stopped, whatever came before."""
    client.send(inhibit=True)
    return client.until(lambda frame: frame['stop'].get('state') == 'at_rest')


def test_the_scene_says_what_walks_and_what_can_be_asked(client: Client) -> None:
    scene = client.scene()
    assert scene['robot'] == 'mini_quadruped' and scene['legs'] == list(LEGS)
    assert scene['drives'] is True and scene['rate'] == ros_processes.SHARED_HZ
    assert {'amble', 'trot'} <= set(scene['gaits'])
    assert scene['inhibited'] == ['fl'] and scene['mass'] > 1.0


def test_frames_show_the_suite_at_rest(client: Client) -> None:
    # The body comes to rest after the gait.
    frame = client.until(lambda frame: frame.get('at_rest') and frame['stop'] and frame['mode']
                         and np.allclose(frame['speed'], 0.0, atol=0.05))
    bodies = np.array(frame['bodies'])
    assert bodies.shape[1] == 7
    assert bodies.shape[0] > max(shape['body'] for shape in client.scene()['shapes'])
    assert frame['mode'] == 'standing' and frame['requested'] is True
    x, places = np.array(frame['x']), np.array(frame['places'])
    assert x.shape == places.shape == (4, 2)
    assert np.linalg.norm(x[0] - places[0]) < frame['region']
    assert frame['gains'][0] > 0.0 and frame['gains'][1:] == [0.0, 0.0, 0.0]
    assert frame['stop']['state'] == 'at_rest' and frame['stop']['certified'] == 'true'
    assert sum(frame['load']) > 0.5 * 9.81 * client.scene()['mass']


def test_times_of_frames_grow(client: Client) -> None:
    times = [frame['time'] for frame, _ in zip(client.frames(), range(20), strict=False)]
    assert all(later >= earlier for earlier, later in zip(times, times[1:], strict=False))
    assert times[-1] > times[0]


def stick(client: Client, ros: Ros) -> list[Any]:
    """Commands, from when their writer knows this reader and the stick is released."""
    commands = heard(ros, 'cmd_vel')
    ros.spin_until(lambda: client.send(velocity=[0.1, 0, 0])[0] and bool(commands))
    ros.spin_until(lambda: commands[-1].linear.x == 0.0)
    commands.clear()
    return commands


def test_a_velocity_is_commanded_and_a_silent_browser_means_zero(
        client: Client, ros: Ros) -> None:
    commands = stick(client, ros)
    assert client.send(velocity=[0.3, -0.1, 0.2]) == (True, '')
    ros.spin_until(lambda: len(commands) > 1)
    first, last = commands[0], commands[-1]
    assert (first.linear.x, first.linear.y, first.angular.z) == (0.3, -0.1, 0.2)
    assert (last.linear.x, last.linear.y, last.angular.z) == (0.0, 0.0, 0.0)
    assert len(commands) == 2


def test_a_released_stick_means_zero_once(client: Client, ros: Ros) -> None:
    commands = stick(client, ros)
    client.send(velocity=[0.2, 0, 0])
    client.send(velocity=[0, 0, 0])
    client.send(gait='amble')
    ros.spin_until(lambda: len(commands) >= 2)
    first, *others = [command.linear.x for command in commands]
    # On a slow machine the browser is silent for a while in between, which means zero too.
    assert first == 0.2 and others in ([0.0], [0.0, 0.0])


def test_inhibit_and_resume_are_answered_and_shown(client: Client) -> None:
    at_rest(client)
    assert 'walking in' in client.granted(inhibit=False)
    client.drive()
    text = client.granted(inhibit=True)
    while 'at rest in' not in text:  # it had come to a stand by itself before, for a moment
        client.drive()
        text = client.granted(inhibit=True)
    assert 'certificate holds' in text
    frame = client.until(lambda frame: frame['stop']['state'] == 'at_rest')
    stop = frame['stop']
    assert float(stop['measured_s']) <= float(stop['bound_s'])


def test_a_gait_is_changed_and_another_request_is_refused_with_the_reason(client: Client) -> None:
    taken, _ = client.send(gait='trot')
    assert taken
    client.until(lambda frame: frame['gait'] == 'trot')
    assert client.send(gait='amble')[0]
    client.until(lambda frame: frame['gait'] == 'amble')
    taken, text = client.send(request='recover')
    assert not taken and text


def test_it_lies_down_and_stands_up(client: Client, ros: Ros) -> None:
    modes = heard(ros, 'body_mode')
    assert client.send(request='lie_down')[0]
    lying = client.until(lambda frame: frame['mode'] == 'lying')
    assert client.send(request='stand_up')[0]
    standing = client.until(lambda frame: frame['mode'] == 'standing')
    base = client.scene()['base']
    assert standing['bodies'][base][2] > 1.5 * lying['bodies'][base][2]
    ros.spin_until(lambda: [read_body_mode(mode) for mode in modes[-1:]] == ['standing'])


def test_a_push_acts_in_the_world(client: Client, ros: Ros) -> None:
    pushes = heard(ros, 'push')

    def sent() -> bool:  # until the writer knows its reader
        assert client.send(push=[0, 12.5, 1]) == (True, '')
        return bool(pushes)

    ros.spin_until(sent)
    force = pushes[0].wrench.force
    assert (force.x, force.y, force.z) == (0.0, 12.5, 1.0)
    assert pushes[0].header.frame_id == 'world'


NO_COMMANDS = (
    [], 'inhibit', None, {}, {'inhibit': True, 'gait': 'trot'}, {'inhibit': 1},
    {'inhibit': 'true'}, {'gait': 'gallop'}, {'gait': ['trot']}, {'request': 'shutdown'},
    {'request': {}}, {'velocity': 1.0}, {'velocity': [1.0, 0.0]}, {'velocity': ['1', 0, 0]},
    {'velocity': [True, 0, 0]}, {'velocity': [None, 0, 0]}, {'velocity': [1e7, 0, 0]},
    {'velocity': [10**400, 0, 0]}, {'push': [1001, 0, 0]}, {'push': [[1], 0, 0]}, {'reset': True})


def test_what_is_no_command_reaches_nobody(client: Client, ros: Ros) -> None:
    commands, pushes = stick(client, ros), heard(ros, 'push')
    before = client.until(lambda frame: True)
    for command in NO_COMMANDS:
        answer = client.ask('/command', json.dumps(command))
        said = answer.read().decode()
        assert answer.status == 400 and 'Traceback' not in said, (command, said)
    after = client.until(lambda frame: frame['time'] > before['time'])
    assert (after['requested'], after['gait']) == (before['requested'], before['gait'])
    client.send(velocity=[0.2, 0, 0])
    ros.spin_until(lambda: bool(commands))
    assert commands[0].linear.x == 0.2 and not pushes


def test_infinity_is_refused(client: Client) -> None:
    assert client.ask('/command', '{"velocity": [1e999, 0, 0]}').status == 400


def lock_step_messages(folder: Path, *, looked_on: bool) -> list[bytes]:
    """Last messages of the oscillators and of the joints after a second in lock-step."""
    with reserved_domain() as domain, composed_suite(
            domain, folder, lock_step=True, gated=True, start_inhibited=False,
            control_rate=ros_processes.SHARED_HZ) as suite:
        view = Client(suite.executable('live_view')) if looked_on else None
        ros, opener = Ros(domain), interface('mujoco_robot/advance_until')
        try:
            topics = [interface(name) for name in ('canonical_state', 'joint_states')]
            messages = [ros.collect(topic.type, topic.name, topic.recorder_qos)
                        for topic in topics]
            gate = ros.node.create_publisher(opener.type, opener.name, opener.publisher_qos)

            def advance(seconds: int) -> None:
                """Let ticks pass up to a time, as often as it takes to be heard."""
                clock = opener.type()
                clock.clock.sec = seconds

                def passed() -> bool:
                    gate.publish(clock)
                    return all(heard and heard[-1].header.stamp.sec >= seconds
                               for heard in messages)

                ros.spin_until(passed, PATIENCE_S)

            if view is not None:
                assert view.scene()['drives'] is False
            advance(1)
            if view is not None:
                shown = (frame['time'] for frame in view.frames())  # first what was shown before
                assert next(time for time in shown if time >= 1.0) == 1.0
                answer = view.ask('/command', '{"inhibit": true}')
                assert (answer.status, 'lock-step' in answer.read().decode()) == (400, True)
            advance(2)
            return [bytes(heard[-1].position) + bytes(heard[-1].velocity) for heard in messages]
        finally:
            ros.end()


def test_in_lock_step_it_looks_on_and_changes_nothing(tmp_path: Path) -> None:
    seen, unseen = (lock_step_messages(tmp_path, looked_on=looked) for looked in (True, False))
    assert seen == unseen


def test_without_a_suite_it_says_so() -> None:
    with reserved_domain() as domain:
        alone = Processes(domain)
        process = alone.executable('live_view', '--wait', '0.5')
        assert process.wait(PATIENCE_S) == 1, str(process)
        assert 'live_view: no suite answers' in process.output


def test_the_robot_serves_a_view_that_waits_for_the_other_nodes_and_ends_with_it() -> None:
    with reserved_domain() as domain:
        alone = Processes(domain)
        try:
            client = Client(alone.node(ROBOT, live_view=True))
            assert client.ask('/scene').status != 200
            alone.executable(
                'composed_suite', *(name for name in WALKING_NODES if name != ROBOT))
            assert client.scene()['robot'] == 'mini_quadruped'
            client.process.signal(signal.SIGKILL)

            def gone() -> bool:
                try:
                    return client.ask('/scene').status == 0
                except OSError:
                    return True

            wait_until(gone, PATIENCE_S, what=lambda: 'the end of the view')
        finally:
            alone.end()


def test_a_view_that_ends_lets_go(client: Client, suite: Processes, ros: Ros) -> None:
    second = Client(suite.executable('live_view'))
    second.scene()
    assert second.address != client.address
    commands = heard(ros, 'cmd_vel')
    ros.spin_until(lambda: second.send(velocity=[0.2, 0, 0])[0] and commands)
    second.process.signal(signal.SIGTERM)
    assert second.process.wait(PATIENCE_S) == 0, second.process
    ros.spin_until(lambda: commands[-1].linear.x == 0.0)


# --- in a browser -------------------------------------------------------------------------------

def test_in_a_browser_the_robot_is_driven_pushed_and_stopped(
        client: Client, page: Page, ros: Ros) -> None:
    at_rest(client)
    page.open(client.address, *SIZE, scale=COARSE)
    drive(page, ros)
    frame = client.until(lambda frame: frame['at_rest'])
    assert frame['requested'] and frame['stop']['automatic'] == 'false'


def press(page: Page, button: str) -> None:
    """Click a button until what it asks for is taken, by a robot that may look after itself."""
    start(page, lambda: page.click(button))


def test_in_a_browser_the_body_lies_down_and_stands_up_and_the_gait_is_chosen(
        client: Client, page: Page) -> None:
    at_rest(client)
    page.open(client.address, *SIZE, webgl=False)
    page.until(state('at rest'))
    mode = "document.querySelector('#mode').textContent"
    page.until(f"{mode} === 'standing'")
    gait = "[...document.querySelectorAll('#gaits .chosen')].map((e) => e.textContent).join()"
    for name in ('trot', 'amble'):
        press(page, f'#gaits [data-gait="{name}"]')
        page.until(f"{gait} === '{name}'")
    for name, becomes in (('lie_down', 'lying'), ('stand_up', 'standing')):
        press(page, f'[data-request="{name}"]')
        page.until(f"{mode} === '{becomes}'")
    page.evaluate("document.querySelector('#answers').replaceChildren()")
    page.click('[data-request="recover"]')
    page.until("document.querySelector('#answers').textContent.includes('refused')")
    assert not page.problems


@pytest.mark.parametrize('released', ['W', 'Meta'])
def test_a_key_that_is_released_with_shift_or_meta_drives_no_more(
        client: Client, page: Page, released: str) -> None:
    page.open(client.address, *SIZE, webgl=False)
    ahead = "document.querySelector('#command').textContent.startsWith('0.50 m/s')"
    page.until(f"document.querySelector('#robot').textContent && !({ahead})")
    page.key('keyDown', 'w')
    page.until(ahead)
    page.key('keyUp', released)
    page.until(f'!({ahead})')
    assert not page.problems


@pytest.mark.parametrize('touched', ['#resume', '#top', '#hold'])
def test_the_space_bar_stops_the_robot_whatever_was_clicked_before(
        client: Client, page: Page, touched: str) -> None:
    at_rest(client)
    page.open(client.address, *SIZE, webgl=False)
    page.until(state('at rest'))
    client.drive()
    page.click(touched)
    page.evaluate(f"document.querySelector('{touched}').focus()")  # as by the tabulator
    page.key('keyDown', ' ')
    page.key('keyUp', ' ')
    frame = client.until(lambda frame: frame['requested'] and frame['stop'].get('automatic')
                         == 'false' and frame['stop']['state'] == 'at_rest')
    assert frame['requested'] and not page.problems


def test_a_gamepad_drives_and_stops_the_robot(client: Client, page: Page, ros: Ros) -> None:
    at_rest(client)
    references = heard(ros, 'reference')
    page.open(client.address, *SIZE, webgl=False)
    page.until(state('at rest'))

    def held(axes: str, button: int | None = None) -> None:
        pressed = ', '.join(f'{{ pressed: {str(i == button).lower()} }}' for i in range(17))
        page.evaluate('navigator.getGamepads = () => [null, { mapping: "standard", '
                      f'axes: [{axes}], buttons: [{pressed}] }}]')

    def press_b() -> None:
        held('0, 0, 0, 0')
        page.evaluate('new Promise(done => requestAnimationFrame(() => '
                      'requestAnimationFrame(done)))')
        held('0, 0, 0, 0', button=1)

    start(page, press_b)
    held('0, -1, 0.5, 0')
    ros.spin_until(lambda: bool(references) and references[-1].twist.linear.x > 0.4
                   and references[-1].twist.angular.z < -0.3)
    page.until(state('walking'))
    held('0.05, 0.05, -0.05, 0')
    ros.spin_until(lambda: abs(references[-1].twist.linear.x) < 0.05)
    held('0, 0, 0, 0', button=0)
    page.until("['at rest in', 'already'].some("
               "words => document.querySelector('#answers').textContent.includes(words))")
    page.until(state('at rest'))
    assert not page.problems


QUICK = ('--no-report', '--rate', str(ros_processes.SHARED_HZ))
"""Options with which a machine has less to do."""

AS_IT_STANDS = pytest.param((), id='as it stands', marks=pytest.mark.skipif(
    'FRESH_INSTALL' not in os.environ, reason='takes both cores: make test-install'))


@pytest.mark.parametrize('options', [pytest.param(QUICK, id='quick'), AS_IT_STANDS])
def test_make_demo_gives_an_address_at_which_the_robot_is_driven_pushed_and_stopped(
        page: Page, tmp_path: Path, options: tuple[str, ...]) -> None:
    needs_make()
    line = ' '.join(('--view', *options))
    command = recipe('demo', f'WALK_ARGS={line}')
    assert command.endswith(f'&& walk {line}'), command
    with reserved_domain() as domain, joined(domain) as ros:
        processes = Processes(domain)
        try:
            walk = processes.start('bash', '-c', f'cd {tmp_path} && {command}')
            page.open(walk.wait_for_output(ADDRESS, PATIENCE_S)[1], *SIZE, scale=COARSE)
            drive(page, ros)
            page.open('about:blank')  # which asks nobody who has ended
            os.killpg(walk.pid, signal.SIGINT)  # as a terminal does
            assert walk.wait(PATIENCE_S) == 130, str(walk)
            run = tmp_path / 'runs' / 'latest'
            assert (run / 'metrics.json').is_file(), walk
            assert (run / 'report.html').is_file() == (not options), walk
        finally:
            processes.end()
