# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Drives the robot by keyboard, in a terminal that is set back at the end."""

from __future__ import annotations

import os
import re
import select
import sys
import termios
import tty
from typing import Any

from rclpy.task import Future

from dmp_cpg_ros.commands.suite_client import ClientError, SuiteClient, VelocityCommand
from dmp_cpg_ros.nodes.messages.conversions import InhibitionGainsReader
from dmp_cpg_ros.nodes.messages.inhibition_state import read_state_word
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


class Teleop:
    """What the keys do.

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

        def on_state(message: Any) -> None:
            self._word = read_state_word(message)

        def on_gains(message: Any) -> None:
            self._requested = gains.read(message).requested

        self.velocity = STILL
        self._word, self._requested, self._shown = '', False, ''
        services = {key: interface(name) for key, name in SERVICES.items()}
        self._clients = {key: node.create_client(service.type, service.name)
                         for key, service in services.items()}
        for name, callback in (('inhibition_state', on_state), ('inhibition_gains', on_gains)):
            topic = interface(name)
            node.create_subscription(topic.type, topic.name, callback, topic.reader_qos)
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
            client = self._clients[key]
            request = client.srv_type.Request()
            if key == ' ':
                request.data = not self._requested
            client.call_async(request).add_done_callback(self._answered)

    def show(self) -> None:
        """Rewrite the last line of the terminal where it has changed."""
        v_x, _, yaw_rate = self.velocity
        line = f'{v_x:+.1f} m/s, {yaw_rate:+.1f} rad/s, {self._word.replace("_", " ")}'
        if line != self._shown:
            self._shown = line
            print(f'\r\x1b[K{line}', end='', flush=True)

    def _answered(self, future: Future) -> None:
        answer = future.result()
        print(f'\r\x1b[K{"" if answer.success else "refused: "}{answer.message}')
        self._shown = ''


def drive_by_keyboard(client: SuiteClient, command: VelocityCommand, rate: float) -> None:
    """Drive until q, Ctrl-C or the end of the input; the last command is zero.

    Raises
    ------
    ClientError
        If the input is no terminal, or the suite ends.
    """
    if not sys.stdin.isatty():
        raise ClientError('teleop reads keys from a terminal, and this input is none')
    teleop = Teleop(client)
    print(HELP, end='')
    terminal = sys.stdin.fileno()
    former = termios.tcgetattr(terminal)
    try:
        tty.setcbreak(terminal)  # gives every key at once and shows none
        while True:
            command.send(teleop.velocity)
            teleop.show()
            client.spin_until(lambda: _waiting(terminal), 1.0 / rate)
            for key in _keys(terminal):
                if key == 'q':
                    return
                teleop.press(key)
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, former)
        print()
        command.end()


def _waiting(terminal: int) -> bool:
    return bool(select.select([terminal], [], [], 0.0)[0])


def _keys(terminal: int) -> list[str]:
    """Keys that were pressed, arrows by the letter that does the same; q at the end of input."""
    if not _waiting(terminal):
        return []
    text = os.read(terminal, 1024).decode(errors='replace')
    pressed = re.findall(r'\x1b[\[O](.)|(.)', text, re.DOTALL)
    return [ARROWS.get(arrow, '') or key for arrow, key in pressed] or ['q']
