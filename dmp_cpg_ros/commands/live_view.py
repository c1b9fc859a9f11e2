# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``live_view``: a running suite in a browser, to look at, to drive, to push and to stop.

It is a client of topics, services and parameters as any other, and reads what comes at every tick
at the rate at which it shows it: messages in between wake nobody.
"""

from __future__ import annotations

import argparse
import json
import secrets
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.callback_groups import CallbackGroup
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from dmp_cpg_ros.commands.ros_arguments import positive
from dmp_cpg_ros.commands.suite_client import SuiteClient, connected, prepared, status_of
from dmp_cpg_ros.commands.view_commands import ViewCommands
from dmp_cpg_ros.commands.view_server import Frames, ViewServer
from dmp_cpg_ros.configuration import ROBOTS, find_config
from dmp_cpg_ros.core import suite_parameters as core
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.phase import state_at
from dmp_cpg_ros.core.errors import DataError, DmpCpgError
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.robot_model.world import WorldParameters
from dmp_cpg_ros.nodes.framework.execution import OK, schedule
from dmp_cpg_ros.nodes.framework.own_messages import OwnMessages
from dmp_cpg_ros.nodes.framework.parameters import BATCH, LockStepParameters, ParameterTable, plain
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateReader
from dmp_cpg_ros.nodes.messages.inhibition import InhibitionGainsReader, read_state_word
from dmp_cpg_ros.nodes.messages.interfaces import interface
from dmp_cpg_ros.nodes.messages.posture_feedback import read_body_mode
from dmp_cpg_ros.nodes.messages.reference import read_reference
from dmp_cpg_ros.nodes.messages.robot_state import FootContactsReader, JointsReader, read_odom
from dmp_cpg_ros.nodes.messages.values import header_ns
from dmp_cpg_ros.robot.robot_file import load_robot_file
from dmp_cpg_ros.robot.scene import Scene
from dmp_cpg_ros.suite import load_gaits
from dmp_cpg_ros.suite_table import ROBOT

PERIOD_S = 1.0 / 30.0
"""Time between two frames [s]."""

TIMED_S = 1.0
"""Span over which the real-time factor is taken [s]."""

STATE_TOPICS = ('ground_truth', 'odom', 'joint_states', 'canonical_state', 'reference',
                'foot_contacts')
"""What is read for every frame."""


class Polled(CallbackGroup):  # type: ignore[misc]
    """Subscriptions that wake nobody: their newest message is taken when it is wanted."""

    def can_execute(self, entity: Any) -> bool:
        """Never, so that no executor waits for them."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Never."""
        return False

    def ending_execution(self, entity: Any) -> None:
        """Nothing was begun."""


def parameters_of(client: SuiteClient, node: str, *sets: type[Parameters]) -> dict[type[Any], Any]:
    """Parameter sets of a node that runs; raises ClientError when it does not answer."""
    table = ParameterTable(sets)
    request = GetParameters.Request(names=list(table.fields))
    getting = client.node.create_client(GetParameters, f'{node}/get_parameters')
    values = map(parameter_value_to_python, client.ask(getting, request).values)
    return dict(table.build({name: plain(value) for name, value
                             in zip(request.names, values, strict=True) if value is not None}))


class LiveView:
    """A running suite as frames, and commands to it.

    Parameters
    ----------
    client : SuiteClient
        The suite.

    Attributes
    ----------
    commands : ViewCommands
        What takes commands.

    Raises
    ------
    ClientError
        If it is not there.
    DmpCpgError
        If its robot cannot be drawn.
    """

    def __init__(self, client: SuiteClient) -> None:
        """Ask the suite for what it is, and subscribe."""
        self._client, self._node = client, client.node
        robot = parameters_of(client, ROBOT, core.RobotFileParameters, core.RobotParameters,
                              WorldParameters, core.TickParameters, LockStepParameters)
        canonical = parameters_of(client, core.CANONICAL, CanonicalParameters, core.GaitParameters)
        limits, inhibition = (
            parameters_of(client, node, *sets) for node, *sets in (
                (core.REFERENCE, ReferenceParameters, core.CommandParameters),
                (core.INHIBITION, InhibitionParameters)))
        self._radius = canonical[CanonicalParameters].radius
        gaits = KnownGaits(load_gaits(canonical[core.GaitParameters].gaits_file))
        file = find_config(robot[core.RobotFileParameters].robot, ROBOTS)
        self._joint_names = load_robot_file(file).joint_names
        self._scene = Scene(file, core.chosen_world(
            robot[WorldParameters], robot[core.RobotParameters]))
        reference = limits[ReferenceParameters]
        self.drives = not robot[LockStepParameters].lock_step
        self.scene = json.dumps({
            **self._scene.shapes(), 'robot': file.stem, 'gaits': list(gaits.gaits),
            'drives': self.drives, 'rate': robot[core.TickParameters].control_rate,
            'inhibited': inhibition[InhibitionParameters].inhibited_legs,
            'limits': [reference.max_speed, reference.max_lateral_speed, reference.max_turn_rate],
        }).encode()
        self._walls: deque[tuple[float, int]] = deque()
        self._stop: dict[str, str] = {}
        self._mode = ''
        self._values: dict[str, Any] = {}
        self._subscribe(gaits)
        self.commands = ViewCommands(
            client, gaits.gaits if self.drives else None,
            stamped=limits[core.CommandParameters].stamped_cmd_vel)

    def _subscribe(self, gaits: KnownGaits) -> None:
        newest = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=1,
                            reliability=ReliabilityPolicy.BEST_EFFORT)
        joints = JointsReader(self._joint_names)
        readers: dict[str, Callable[[Any], Any]] = {
            'joint_states': lambda message: (header_ns(message), joints.read(message)[0]),
            'canonical_state': CanonicalStateReader(gaits).read,
            'reference': read_reference,
            'foot_contacts': FootContactsReader().read}
        heard = OwnMessages(self._node, self._node.get_logger().warning,
                            lock_step=not self.drives)
        group, self._polled = Polled(), []
        for name in STATE_TOPICS:
            topic = interface(name)
            subscription = self._node.create_subscription(
                topic.type, name, lambda _: None, newest, callback_group=group)
            self._polled.append((name, subscription, heard.admitting(topic),
                                 readers.get(name, read_odom)))
        gains = InhibitionGainsReader()

        def hear_gains(message: Any) -> None:
            self._values['inhibition_gains'] = gains.read(message)

        for name, hear in (('inhibition_state', self._hear_stop), ('body_mode', self._hear_mode),
                           ('inhibition_gains', hear_gains)):
            heard.listen(interface(name), hear)

    def run(self, frames: Frames) -> None:
        """Show frames and take commands until Ctrl-C."""
        due = time.monotonic()
        try:
            while True:
                self._client.spin_until(self.commands.waiting, due - time.monotonic())
                self.commands.execute()
                now = time.monotonic()
                if now >= due:
                    due = max(due + PERIOD_S, now)
                    if frames.viewers and (frame := self._frame(now)):
                        frames.put(json.dumps(frame).encode())
        finally:
            self.commands.end()

    def _frame(self, now: float) -> dict[str, Any]:
        """What is shown of this moment; empty as long as there is nothing."""
        for name, subscription, admits, read in self._polled:
            with subscription.handle:
                taken = subscription.handle.take_message(subscription.msg_type, False)
            if taken is not None:
                try:
                    if admits(header_ns(taken[0]), taken[1]):
                        self._values[name] = read(taken[0])
                except DataError as error:
                    self._node.get_logger().warning(f'{name}: {error}', throttle_duration_sec=5.0)
        values = self._values
        motion = values.get('ground_truth') or values.get('odom')
        if motion is None or 'joint_states' not in values:
            return {}
        stamp, angles = values['joint_states']
        bodies, feet = self._scene.poses(
            motion.position_in_world, motion.quaternion, angles)
        frame = {
            'time': stamp * 1e-9, 'pace': self._pace(now, stamp), 'mode': self._mode,
            'bodies': _rounded(bodies), 'feet': _rounded(feet), 'stop': self._stop,
            'speed': _rounded(np.append(motion.velocity_in_base[:2], motion.rate_in_base[2]))}
        if 'canonical_state' in values:
            x, _, gait = values['canonical_state']
            rest = values['inhibition_gains'].rest_phase if 'inhibition_gains' in values else 0.0
            frame |= {'x': _rounded(x), 'gait': gait.name,
                      'places': _rounded(state_at(gait.phases + rest, self._radius))}
        if 'inhibition_gains' in values:
            acting = values['inhibition_gains']
            frame |= {'gains': acting.gains.tolist(), 'region': acting.region_radius,
                      'requested': acting.requested, 'at_rest': acting.at_rest}
        for name, what in (('reference', 'reference'), ('foot_contacts', 'load')):
            if name in values:
                frame[what] = _rounded(np.nan_to_num(values[name]))
        return frame

    def _pace(self, now: float, stamp_ns: int) -> float:
        """Real-time factor of the last second."""
        self._walls.append((now, stamp_ns))
        while len(self._walls) > 2 and now - self._walls[1][0] > TIMED_S:
            self._walls.popleft()
        begin, first_ns = self._walls[0]
        return round((stamp_ns - first_ns) * 1e-9 / (now - begin), 3) if now > begin else 0.0

    def _hear_stop(self, message: Any) -> None:
        word, values = read_state_word(message), message.status[0].values
        self._stop = {entry.key: entry.value for entry in values} | {'state': word}

    def _hear_mode(self, message: Any) -> None:
        self._mode = read_body_mode(message)


def _rounded(values: Any) -> Any:
    """Numbers as lists, to a tenth of a millimetre."""
    return np.round(values, 4).tolist()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    options, words = prepared(_parser(), arguments)
    schedule(BATCH)  # the robot's ticks come first
    scene, frames = [b''], Frames()
    views: list[LiveView] = []

    def take(command: Any) -> dict[str, Any]:
        if not views:
            raise DataError('the suite is not there yet')
        return views[0].commands.take(command)

    try:
        server = ViewServer(secrets.token_urlsafe(24), frames, lambda: scene[0], take,
                            options.port)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        print(f'live view: {server.address}', flush=True)
        views.append(LiveView(connected('live_view', words, options.wait)))
        scene[0] = views[0].scene
        views[0].run(frames)
    except (DmpCpgError, OSError, RuntimeError) as error:
        return status_of('live_view', error)
    except KeyboardInterrupt:
        return OK
    finally:
        rclpy.try_shutdown()
    return OK


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port; valid are 1 to 65535, and 0 for "
                                         'the first that is free')
    return int(text)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='live_view',
        description='Show a running suite (start one with walk) in a browser, with a stick and '
        'buttons. The address that is printed holds a token: who knows it can drive the robot. It '
        'works on this machine only; from another one: ssh -L 8642:127.0.0.1:8642 MACHINE.',
        epilog='Exit status: 0 after Ctrl-C, 1 when no suite is found, 2 for bad input.')
    parser.add_argument('--namespace', metavar='NAME', help="the suite's namespace")
    parser.add_argument('--port', metavar='N', type=_port, default=0,
                        help='port of the page (default: the first that is free from 8642 on)')
    parser.add_argument('--wait', metavar='SECONDS', type=positive, default=60.0,
                        help='how long to look for the suite (default: 60)')
    return parser


if __name__ == '__main__':
    sys.exit(main())
