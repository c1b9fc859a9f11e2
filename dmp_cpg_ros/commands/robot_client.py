# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``robot_client``: commands to a running suite from a shell, without a ROS installation."""

from __future__ import annotations

import argparse
import importlib
import math
import signal
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
import yaml
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import SetBool, Trigger

from dmp_cpg_ros.commands.ros_arguments import number, positive
from dmp_cpg_ros.commands.suite_client import (
    ClientError,
    SuiteClient,
    connected,
    deliver,
    prepared,
    status_of,
    velocity_command,
)
from dmp_cpg_ros.commands.teleop import AXES, HELD, drive, steer
from dmp_cpg_ros.core.errors import DataError, DmpCpgError, ParameterError
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.nodes.framework.execution import OK
from dmp_cpg_ros.nodes.framework.parameters import plain
from dmp_cpg_ros.nodes.messages.commands import push_force, read_push_force
from dmp_cpg_ros.nodes.messages.interfaces import INTERFACES, TOPICS, interface
from dmp_cpg_ros.strict_yaml import parse_yaml
from dmp_cpg_ros.suite_table import RECORDER, WALKING_NODES

INTERRUPTED = 130
"""Exit status after Ctrl-C."""

DRIVING = ('cmd_vel', 'teleop', 'joystick')
"""Commands whose last command is zero, whatever ends them."""

SWITCHES = {'inhibit': ('inhibit', True), 'resume': ('inhibit', False),
            'enable': ('~/enable', True), 'disable': ('~/enable', False)}
"""Commands that are either side of a service."""

ENDLESS = (*DRIVING, 'echo')
"""Commands that Ctrl-C ends as it should."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit status."""
    options, words = prepared(_parser(), arguments)
    if options.command not in DRIVING:
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # nodes | head ends quietly
    try:  # the last command is zero and the terminal is as it was, whatever ends it
        options.run(connected('robot_client', words, options.wait), options)
    except (DmpCpgError, RuntimeError) as error:
        return status_of('robot_client', error)
    except KeyboardInterrupt:
        return OK if options.command in ENDLESS else INTERRUPTED
    finally:
        rclpy.try_shutdown()
    return OK


def request(client: SuiteClient, options: argparse.Namespace) -> None:
    """Inhibit or resume the gait, stand up, lie down or recover, let the driver command the joints
    or not; a refusal is an error.
    """
    service, on = SWITCHES.get(options.command, (options.command, None))
    answer = client.call(service, Trigger.Request() if on is None else SetBool.Request(data=on))
    if not answer.success:
        raise ClientError(answer.message)
    print(answer.message)


def publish_command(client: SuiteClient, options: argparse.Namespace) -> None:
    """Command a velocity for some time or until Ctrl-C; the last command is zero."""
    with velocity_command(client, stamped=options.stamped) as send:
        begin, sent = time.monotonic(), 0
        while time.monotonic() - begin < options.seconds:
            send((options.v_x, options.v_y, options.yaw_rate))
            sent += 1
            client.spin_until(lambda: False, max(
                0.0, begin + min(sent / options.rate, options.seconds) - time.monotonic()))


def push(client: SuiteClient, options: argparse.Namespace) -> None:
    """Push the simulated robot; what it would refuse is not sent."""
    message = push_force(options.force)
    try:
        read_push_force(message)
    except DataError as error:
        raise ParameterError(str(error)) from None
    publisher = client.publisher(interface('push'))
    publisher.publish(message)
    deliver(publisher)


def parameter(client: SuiteClient, options: argparse.Namespace) -> None:
    """Get, set or list the parameters of a node."""
    action, node, name, value = options.action, options.node, options.name, options.value
    if (action == 'list') != (name is None) or (action == 'set') != (value is not None):
        raise ParameterError('param takes: list NODE, get NODE NAME, or set NODE NAME VALUE')
    try:
        given = parse_yaml(value or '', f"'{name}'")
    except DataError as error:
        raise ParameterError(str(error)) from None
    client.meet(['inhibition'])
    # The one that must not be repeated first: see SuiteClient.
    setting, getting, listing = (
        client.node.create_client(kind, f'{node}/{end}_parameters') for kind, end in (
            (SetParameters, 'set'), (GetParameters, 'get'), (ListParameters, 'list')))
    if action == 'list':
        print('\n'.join(sorted(client.ask(listing, ListParameters.Request()).result.names)))
        return
    known = client.ask(getting, GetParameters.Request(names=[name])).values
    if not known or known[0].type == Parameter.Type.NOT_SET.value:
        raise ClientError(f"{node} has no parameter '{name}'; see: robot_client param list {node}")
    if action == 'get':
        print(plain(parameter_value_to_python(known[0])))
        return
    if known[0].type == Parameter.Type.DOUBLE.value and type(given) is int:
        given = float(given)
    if known[0].type == Parameter.Type.STRING.value and not isinstance(given, str):
        given = value
    if type(given) is int and not -2**63 <= given < 2**63:
        raise ParameterError(f"'{name}': an integer has at most 64 bits")
    client.meet([], setting)
    try:
        changed = Parameter(name, value=given)
    except TypeError:  # what no parameter can be; the node says of which type it is
        changed = Parameter(name, value=value)
    change = SetParameters.Request(parameters=[changed.to_parameter_msg()])
    result = client.answer([setting.call_async(change)], setting.service_name).results[0]
    if not result.successful:
        raise ClientError(f'Setting parameter failed: {result.reason}')
    print('Set parameter successful')


def show_nodes(client: SuiteClient, options: argparse.Namespace) -> None:
    """List the nodes of the suite with what they wait for, and the others."""
    client.meet(['inhibition'])
    node = client.node
    clients = {name: node.create_client(Trigger, f'{name}/ready')
               for name in (*WALKING_NODES, RECORDER)}
    client.spin_until(lambda: all(each.service_is_ready() for each in clients.values()),
                      options.wait)
    for name, each in clients.items():
        state = (client.ask(each, Trigger.Request()).message if each.service_is_ready()
                 else 'does not run')
        print(f'{name:24}{state}')
    here = {name for name, space in node.get_node_names_and_namespaces()
            if space == node.get_namespace()}
    for name in sorted(here - set(clients) - {node.get_name()}):
        print(f'{name:24}not of the suite')


def echo(client: SuiteClient, options: argparse.Namespace) -> None:
    """Print the messages of a topic as YAML."""
    client.meet(['inhibition'])
    name = client.node.resolve_topic_name(options.topic)
    ends = client.node.get_publishers_info_by_topic
    if not client.spin_until(lambda: ends(name), options.wait):
        raise ClientError(f"nobody publishes {name}; the suite's topics are "
                          f'{", ".join(topic.name for topic in TOPICS)}')
    known, end = INTERFACES.get(options.topic), ends(name)[0]
    package, _, kind = end.topic_type.split('/')
    try:
        message_type = getattr(importlib.import_module(f'{package}.msg'), kind)
    except ImportError as error:
        raise ClientError(f'messages of {package} are not installed: {error}') from None
    messages: list[Any] = []
    client.node.create_subscription(message_type, name, messages.append,
                                    known.reader_qos if known else end.qos_profile)
    while client.spin_until(lambda: messages):
        for message in messages:
            print(yaml.safe_dump(_as_mapping(message), sort_keys=False), end='---\n', flush=True)
            if options.once:
                return
        messages.clear()


def _as_mapping(value: Any) -> Any:
    """A message as what YAML can write."""
    if hasattr(value, 'get_fields_and_field_types'):
        return {name: _as_mapping(getattr(value, name))
                for name in value.get_fields_and_field_types()}
    if isinstance(value, (str, int, float)):
        return value
    if isinstance(value, bytes):
        return int.from_bytes(value, 'little')
    return [_as_mapping(entry) for entry in
            (value.tolist() if hasattr(value, 'tolist') else value)]


_Argument = tuple[tuple[str, ...], dict[str, Any]]


def _takes(*flags: str, **how: Any) -> _Argument:
    return flags, how


def _up_to(flag: str, metavar: str, usual: float, text: str) -> _Argument:
    """A positive number, with what it is without."""
    return _takes(flag, metavar=metavar, type=positive, default=usual,
                  help=f'{text} (default: {usual:g})')


def _sending(rate_hz: float = 10.0) -> tuple[_Argument, ...]:
    return (_up_to('--rate', 'HZ', rate_hz, 'commands per second'),
            _takes('--stamped', action='store_true',
                   help='send TwistStamped, for a suite with stamped_cmd_vel:=true'))


EVERYWHERE = (
    _takes('--namespace', metavar='NAME', help="the suite's namespace", default=argparse.SUPPRESS),
    _takes('--wait', metavar='SECONDS', type=positive, default=argparse.SUPPRESS,
           help='how long to look for the suite (default: 10)'))
"""Options before the command or after it."""

COMMANDS: tuple[tuple[str, Callable[..., None], str, tuple[_Argument, ...]], ...] = (
    ('cmd_vel', publish_command, 'command a velocity until Ctrl-C', (
        _takes('v_x', type=number, help='forward [m/s]'),
        *(_takes(name, type=number, help=f'to the left [{unit}] (default: 0)', default=0.0,
                 nargs='?') for name, unit in (('v_y', 'm/s'), ('yaw_rate', 'rad/s'))),
        _takes('--for', metavar='SECONDS', dest='seconds', type=positive, default=math.inf,
               help='end after so long'), *_sending())),
    ('inhibit', request, 'stop the gait', ()), ('resume', request, 'start the gait', ()),
    ('enable', request, 'let ros2_control_driver command the joints', ()),
    ('disable', request, 'let it follow the legs no more: the robot looks after itself', ()),
    *((name, request, interface(name).meaning, ()) for name in REQUESTS),
    ('push', push, 'push the simulated robot for 0.1 s', (
        _takes('force', metavar='F', type=number, nargs=3, help='forward, to the left, up [N]'),)),
    ('param', parameter, 'get, set or list parameters of a node', (
        _takes('action', choices=('get', 'set', 'list'),
               help='list takes NODE, get NODE NAME, set NODE NAME VALUE'),
        _takes('node', metavar='NODE', help='such as inhibition; nodes lists them'),
        _takes('name', metavar='NAME', nargs='?', help='parameter'),
        _takes('value', metavar='VALUE', nargs='?',
               help='in YAML, such as trot, 0.5 or [fl, rr]'))),
    ('nodes', show_nodes, 'list the nodes and what they wait for', ()),
    ('echo', echo, 'print what is published on a topic', (
        _takes('topic', metavar='TOPIC', help='such as inhibition_state'),
        _takes('--once', action='store_true', help='end after the first message'))),
    ('teleop', drive, 'drive by keyboard', _sending()),
    ('joystick', steer, 'drive by joystick', (
        _takes('device', metavar='DEVICE', nargs='?', default='/dev/input/js0',
               help='of Linux (default: /dev/input/js0)'),
        _up_to('--top', 'MOST', 0.5, 'with the stick all the way [m/s]'),
        _up_to('--turn', 'MOST', 0.8, 'with the stick all the way [rad/s]'),
        _takes('--axes', metavar='N', type=int, nargs=3, default=AXES,
               help='that go forward, to the left and around (default: 1 0 3)'),
        _takes('--held', metavar='N', type=int, default=HELD,
               help='button without which nothing moves; -1: none (default: 4)'),
        *_sending(20.0))))
"""Commands: name, what runs, what it does, what it takes."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='robot_client',
        description='Command a running suite (start one with walk). It is looked for in the '
        'domain of ROS_DOMAIN_ID; --ros-args are taken as by every node.',
        epilog='Exit status: 0 when it was done, 1 when no suite is found or it refuses, 2 '
        'for bad input, 130 for Ctrl-C before it was done.')
    parser.set_defaults(namespace=None, wait=10.0)
    for flags, how in EVERYWHERE:
        parser.add_argument(*flags, **how)
    added = parser.add_subparsers(metavar='COMMAND', dest='command', required=True)
    for name, run, text, arguments in COMMANDS:
        command = added.add_parser(name, help=text, description=f'{text[:1].upper()}{text[1:]}.')
        command.set_defaults(run=run)
        for flags, how in (*EVERYWHERE, *arguments):
            command.add_argument(*flags, **how)
    return parser


if __name__ == '__main__':
    sys.exit(main())
