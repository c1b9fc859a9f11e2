# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Driving a suite by hand from a shell: by keyboard and by joystick."""

from __future__ import annotations

import argparse
import math
import os
import re
import select
import sys
import termios
import tty
from contextlib import closing
from typing import Any

from rclpy.task import Future

from dmp_cpg_ros.commands.joystick import Joystick
from dmp_cpg_ros.commands.suite_client import ClientError, SuiteClient, velocity_command
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.nodes.framework.own_messages import OwnMessages
from dmp_cpg_ros.nodes.messages.inhibition import InhibitionGainsReader, read_state_word
from dmp_cpg_ros.nodes.messages.interfaces import interface

STILL = (0.0, 0.0, 0.0)

STEPS = {'w': (0.1, 0.0), 's': (-0.1, 0.0), 'a': (0.0, 0.2), 'd': (0.0, -0.2)}
"""Change of v_x [m/s] and of the yaw rate [rad/s] by one press of a key."""

ARROWS = {'A': 'w', 'B': 's', 'D': 'a', 'C': 'd'}
"""Last letter of what an arrow key sends, and the key that does the same."""

SERVICES = {' ': 'inhibit', 'u': 'stand_up', 'l': 'lie_down', 'r': 'recover'}
"""Keys that call a service; the first stops the gait or starts it again."""

HELP = """\
w/s or up/down: faster, slower; a/d or left/right: turn; x: no velocity
space: inhibit or resume; u: stand up, l: lie down, r: recover; q: quit
"""

BUTTONS = {0: ' ', 1: 'r', 2: 'l', 3: 'u'}
"""Buttons that do what a key does, as Linux numbers those of most gamepads: A, B, X, Y."""

AXES, HELD = (1, 0, 3), 4
"""Axes of these that go ahead, aside and around: left stick, left stick, right stick; and the
button that has to be held, the left shoulder.
"""

ASIDE = 0.6
"""Largest speed to the side over that ahead."""

STEERING = """\
hold the left shoulder button to move; left stick: ahead and aside, right stick: around
A: inhibit or resume; Y: stand up, X: lie down, B: recover; Ctrl-C ends
"""


class Teleop:
    """What keys and buttons do.

    Parameters
    ----------
    client : SuiteClient
        The suite.

    Attributes
    ----------
    velocity : tuple of 3 floats
        Commanded v_x, v_y [m/s] and yaw rate [rad/s].
    """

    def __init__(self, client: SuiteClient) -> None:
        """Create clients, and listen to the state of the stop."""
        node, gains = client.node, InhibitionGainsReader()
        self._requested: bool | None = None  # until it is known nothing is asked for

        def on_state(message: Any) -> None:
            self._word = read_state_word(message)

        def on_gains(message: Any) -> None:
            self._requested = gains.read(message).requested

        self.velocity = STILL
        self._word, self._shown = '', ''
        services = {key: interface(name) for key, name in SERVICES.items()}
        self._clients = {key: node.create_client(service.type, service.name)
                         for key, service in services.items()}
        heard = OwnMessages(node, self._print)
        for name, callback in (('inhibition_state', on_state), ('inhibition_gains', on_gains)):
            heard.listen(interface(name), callback)
        kinds = {kind for service in services.values() for kind in service.publishers}
        client.meet(sorted(kinds), *self._clients.values())

    def press(self, key: str) -> None:
        """Take a key; unknown ones do nothing."""
        v_x, _, yaw_rate = self.velocity
        if key in STEPS:
            faster, further = STEPS[key]
            self.velocity = (round(v_x + faster, 3), 0.0, round(yaw_rate + further, 3))
        elif key == 'x':
            self.velocity = STILL
        elif key in self._clients:
            if key == ' ' and self._requested is None:
                return
            client = self._clients[key]
            request = client.srv_type.Request()
            if key == ' ':
                request.data = not self._requested
            client.call_async(request).add_done_callback(self._answered)

    def show(self) -> None:
        """Rewrite the last line of the terminal where it has changed."""
        v_x, _, yaw_rate = self.velocity
        word = '' if self._requested is None else self._word.replace('_', ' ')
        line = f'{v_x:+.1f} m/s, {yaw_rate:+.1f} rad/s, {word}'
        if line != self._shown:
            self._shown = line
            print(f'\r\x1b[K{line}', end='', flush=True)

    def _answered(self, future: Future) -> None:
        answer = future.result()
        self._print(f'{"" if answer.success else "refused: "}{answer.message}')

    def _print(self, text: str) -> None:
        """Print a line in the place of the last one, which follows it."""
        print(f'\r\x1b[K{text}')
        self._shown = ''


def drive(client: SuiteClient, options: argparse.Namespace) -> None:
    """Drive by keyboard until q, Ctrl-C or the end of the input; the last command is zero."""
    terminal = sys.stdin.fileno()
    if not os.isatty(terminal):
        raise ClientError('teleop reads keys from a terminal, and this input is none')
    with velocity_command(client, stamped=options.stamped) as send:
        teleop = Teleop(client)
        print(HELP, end='')
        former = termios.tcgetattr(terminal)
        try:
            tty.setcbreak(terminal)  # gives every key at once and shows none
            while True:
                send(teleop.velocity)
                teleop.show()
                client.spin_until(lambda: _waiting(terminal), 1.0 / options.rate)
                for key in _keys(terminal):
                    if key == 'q':
                        return
                    teleop.press(key)
        finally:
            termios.tcsetattr(terminal, termios.TCSADRAIN, former)
            print()


def _waiting(terminal: int) -> bool:
    return bool(select.select([terminal], [], [], 0.0)[0])


def _keys(terminal: int) -> list[str]:
    """Keys that were pressed, arrows by the letter that does the same; q at the end of input."""
    if not _waiting(terminal):
        return []
    text = os.read(terminal, 1024).decode(errors='replace')
    pressed = re.findall(r'\x1b[\[O](.)|(.)', text, re.DOTALL)
    return [ARROWS.get(arrow, '') or key for arrow, key in pressed] or ['q']

def steer(client: SuiteClient, options: argparse.Namespace) -> None:
    """Drive by joystick until Ctrl-C or until it is unplugged; the last command is zero.

    Nothing moves while the button is not held that has to be.
    """
    if min(*options.axes, options.held + 1) < 0:
        raise ParameterError('axes are numbers from 0 on, and so are buttons; --held -1 is none')
    with closing(Joystick(options.device)) as joystick, velocity_command(
            client, stamped=options.stamped) as send:
        teleop = Teleop(client)
        print(STEERING, end='')
        try:
            while True:
                for button in joystick.read():
                    teleop.press(BUTTONS.get(button, ''))
                teleop.velocity = deflected(joystick, options)
                send(teleop.velocity)
                teleop.show()
                client.spin_until(lambda: False, 1.0 / options.rate)
        finally:
            print()


def deflected(joystick: Joystick, options: argparse.Namespace) -> tuple[float, float, float]:
    """Velocity v_x, v_y [m/s] and yaw rate [rad/s] that a joystick asks for."""
    if options.held >= 0 and options.held not in joystick.held:
        return STILL
    ahead, aside, around = (0.0 - joystick.axis(axis) for axis in options.axes)
    longest = max(1.0, math.hypot(ahead, aside))
    return (options.top * ahead / longest, ASIDE * options.top * aside / longest,
            options.turn * around)
