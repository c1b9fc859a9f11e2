# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Brings up the whole suite: the recorder, the nodes in the order of the data flow, the robot.

``ros2 launch dmp_cpg_ros suite.launch.py`` needs nothing but ROS 2; the command ``walk`` does
more: it plays a scenario, waits until the nodes are ready, and writes a report.
"""

from pathlib import Path

from ament_index_python.packages import get_packages_with_prefixes
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from dmp_cpg_ros.robot.urdf import urdf
from dmp_cpg_ros.suite import load_suite, return_times
from dmp_cpg_ros.suite_table import (
    COMPOSED,
    PROCESSES,
    RECORDED_WALK,
    RECORDER,
    ROBOT,
    VISUALIZATION,
    instances,
    namespace_rules,
)

FRAMES = 'robot_state_publisher'
"""Package and executable that publish the frames of the links, below ``base_link``."""


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments and the nodes."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'parameters', default_value='',
            description="YAML file with the parameters of all nodes; if empty, the package's own"),
        DeclareLaunchArgument(
            'robot', default_value='',
            description='YAML file that names the model, its legs and its feet; '
                        'if empty, as the parameters say'),
        DeclareLaunchArgument(
            'lock_step', default_value='', choices=['', 'true', 'false'],
            description='whether the robot waits for the targets of every tick; '
                        'if empty, as the parameters say'),
        DeclareLaunchArgument(
            'namespace', default_value='',
            description='namespace of all nodes and topics, /clock and /diagnostics included'),
        DeclareLaunchArgument(
            'processes', default_value='each', choices=list(PROCESSES),
            description='a process for every node, for every block of them, or one for all'),
        DeclareLaunchArgument(
            'respawn', default_value='false', choices=['true', 'false'],
            description='whether to start nodes again that end before their time, all but the '
                        'robot'),
        DeclareLaunchArgument(
            'return_time', default_value='',
            description='how much longer the gait goes on without a node that may come back [s]; '
                        'if empty, as the parameters say, else what respawn needs'),
        DeclareLaunchArgument(
            'record', default_value='false', choices=['true', 'false'],
            description='whether to record all topics of the suite in a bag'),
        DeclareLaunchArgument(
            'bag', default_value='bag', description='folder of that bag; must not exist yet'),
        DeclareLaunchArgument(
            VISUALIZATION, default_value='false', choices=['true', 'false'],
            description='whether to publish markers and the path of the body, for RViz and '
                        'Foxglove'),
        DeclareLaunchArgument(
            FRAMES, default_value='auto', choices=['auto', 'true', 'false'],
            description='whether to start it for the frames of all links on /tf; auto: where it '
                        'is installed'),
        OpaqueFunction(function=nodes),
    ])


def nodes(context: LaunchContext) -> list[Node]:
    """Make the nodes; an argument that was left empty overrides nothing.

    Files are looked for here already, so that a wrong one is one error and not one of each node.
    """
    given = context.launch_configurations
    words = given['namespace'].strip('/')
    namespace = f'/{words}' if words else ''
    robot = {'robot': given['robot']} if given['robot'] else {}
    suite = load_suite(given['parameters'] or None, robot, namespace)
    shared = {name: str(suite.robot_file) for name in robot}
    if given['lock_step']:
        shared['lock_step'] = given['lock_step'] == 'true'
    if given['return_time']:
        shared['return_time'] = float(given['return_time'])
    recording = given['record'] == 'true'
    if recording:
        shared['expected_nodes'] = list(RECORDED_WALK)
        if Path(given['bag']).exists():
            raise FileExistsError(f"'{given['bag']}' exists; name another folder with bag:=FOLDER")
    described = []
    if given[FRAMES] == 'true' or (
            given[FRAMES] == 'auto' and FRAMES in get_packages_with_prefixes()):
        described.append(frames_of(suite.robot_file, namespace))
    table = {name: (kind.name, dict(own)) for kind, name, own in instances()}
    if given['respawn'] == 'true' and not given['return_time']:
        ticking = [name for name, (kind, _) in table.items() if kind != RECORDER]
        for name, seconds in return_times(suite.file, ticking, True, namespace).items():
            table[name][1]['return_time'] = seconds
    looking_on = [name for name, wanted in (
        (RECORDER, recording), (VISUALIZATION, given[VISUALIZATION] == 'true')) if wanted]
    for process, names in {**{name: (name,) for name in looking_on},
                           **PROCESSES[given['processes']]}.items():
        kind, own = table[names[0]]
        parameters = {'output': given['bag']} if kind == RECORDER else dict(shared)
        if len(names) == 1:
            place = {'executable': kind, 'name': process}
            parameters.update(own)
        else:
            rules = [f'{name}:{key}:={value}' for name in names
                     for key, value in table[name][1].items()]
            place = {'executable': COMPOSED, 'arguments': list(names),
                     'ros_arguments': [word for rule in rules for word in ('-p', rule)]}
        described.append(Node(
            package='dmp_cpg_ros', namespace=namespace or None, **place,
            parameters=[str(suite.file), *([parameters] if parameters else [])],
            remappings=[rule for rule in namespace_rules(namespace) if rule[0] != '__ns'],
            output='screen', emulate_tty=True,
            # Without the robot there is nothing to walk: the others end with it.
            on_exit=Shutdown() if ROBOT in names else None,
            respawn=given['respawn'] == 'true' and ROBOT not in names))
    return described


def frames_of(robot_file: Path, namespace: str) -> Node:
    """Make the node that turns ``joint_states`` into ``/tf``, with the robot's own description.

    The latched ``robot_description`` stays the robot's alone: this node's copy has another name.
    """
    return Node(
        package=FRAMES, executable=FRAMES, name=FRAMES, namespace=namespace or None,
        parameters=[{
            'robot_description': ParameterValue(urdf(robot_file), value_type=str),
            'use_sim_time': True, 'publish_frequency': 50.0}],
        remappings=[('robot_description', f'{FRAMES}/robot_description'),
                    *(rule for rule in namespace_rules(namespace) if rule[0] != '__ns')],
        output='screen')
