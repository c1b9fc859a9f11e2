# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Brings up the whole suite: the nodes in the order of the data flow, then the robot.

``ros2 launch dmp_cpg_ros suite.launch.py`` needs nothing but ROS 2; the command ``walk`` does
more: it plays a scenario, waits until the nodes are ready, and writes a report.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = 'dmp_cpg_ros'
LEGS = ('fl', 'fr', 'rl', 'rr')


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments and the nodes."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'parameters',
            default_value=PathJoinSubstitution(
                [FindPackageShare(PACKAGE), 'config', 'suite.yaml']),
            description='YAML file with the parameters of all nodes'),
        DeclareLaunchArgument(
            'robot', default_value='',
            description='YAML file that names the model, its legs and its feet; '
                        'if empty, as the parameters say'),
        DeclareLaunchArgument(
            'lock_step', default_value='', choices=['', 'true', 'false'],
            description='whether the robot waits for the targets of every tick; '
                        'if empty, as the parameters say'),
        DeclareLaunchArgument(
            'record', default_value='false', choices=['true', 'false'],
            description='whether to record all topics of the suite in a bag'),
        OpaqueFunction(function=nodes),
    ])


def nodes(context: LaunchContext) -> list[Node]:
    """Make the nodes; an argument that was left empty overrides nothing."""
    robot = LaunchConfiguration('robot').perform(context)
    lock_step = LaunchConfiguration('lock_step').perform(context)
    ticking = {'lock_step': lock_step == 'true'} if lock_step else {}
    walking = {**ticking, 'robot': robot} if robot else ticking

    def node(executable: str, overrides: dict, name: str = '', **options: object) -> Node:
        parameters = [LaunchConfiguration('parameters'), *([overrides] if overrides else [])]
        return Node(package=PACKAGE, executable=executable, name=name or executable,
                    parameters=parameters, output='screen', emulate_tty=True, **options)

    return [
        node('bag_recorder', {}, condition=IfCondition(LaunchConfiguration('record'))),
        node('reference_filter', ticking),
        node('canonical_oscillators', walking),
        *(node('leg_transformation', {**walking, 'leg': leg}, f'leg_{leg}') for leg in LEGS),
        node('inhibition', walking),
        node('posture_control', walking),
        # Without the robot there is nothing to walk: the others end with it.
        node('mujoco_robot', walking, on_exit=Shutdown()),
    ]
