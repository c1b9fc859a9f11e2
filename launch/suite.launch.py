# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Brings up the whole suite: the nodes in the order of the data flow, then the robot.

``ros2 launch dmp_cpg_ros suite.launch.py`` starts and stops with nothing but ROS 2; the command
``walk`` does more, it also plays a scenario, waits for readiness and writes a report.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = 'dmp_cpg_ros'
LEGS = ('fl', 'fr', 'rl', 'rr')


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments and the nodes."""
    config = PathJoinSubstitution([FindPackageShare(PACKAGE), 'config'])
    arguments = [
        DeclareLaunchArgument(
            'parameters', default_value=PathJoinSubstitution([config, 'suite.yaml']),
            description='YAML file with the parameters of all nodes'),
        DeclareLaunchArgument(
            'robot',
            default_value=PathJoinSubstitution([config, 'robots', 'mini_quadruped.yaml']),
            description='YAML file that names the model, its legs and its feet'),
        DeclareLaunchArgument(
            'lock_step', default_value='false', choices=['true', 'false'],
            description='the robot waits for the targets of every tick'),
        DeclareLaunchArgument(
            'record', default_value='false', choices=['true', 'false'],
            description='record all topics of the suite in a bag'),
    ]
    parameters = [
        LaunchConfiguration('parameters'),
        {
            'robot': ParameterValue(LaunchConfiguration('robot'), value_type=str),
            'lock_step': ParameterValue(LaunchConfiguration('lock_step'), value_type=bool),
        },
    ]

    def node(executable: str, name: str = '', **options: object) -> Node:
        return Node(package=PACKAGE, executable=executable, name=name or executable,
                    parameters=[*parameters, *options.pop('parameters', [])],
                    output='screen', emulate_tty=True, **options)

    return LaunchDescription([
        *arguments,
        node('bag_recorder', condition=IfCondition(LaunchConfiguration('record'))),
        node('reference_filter'),
        node('canonical_oscillators'),
        *(node('leg_transformation', f'leg_{leg}', parameters=[{'leg': leg}]) for leg in LEGS),
        node('inhibition'),
        node('posture_control'),
        # Without the robot there is nothing to walk: the others end with it.
        node('mujoco_robot', on_exit=Shutdown()),
    ])
