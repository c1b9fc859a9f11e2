# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Brings up Nav2 about the suite, on a static map of a free field, as doc/how_to/nav2.md says.

``loopback:=true`` puts Nav2's own loopback simulator in the place of the suite.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import Node

from dmp_cpg_ros.commands.nav2_limits import nav2_limits
from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.suite import load_suite

COMMANDS = {'controller_server': 'nav2_controller', 'behavior_server': 'nav2_behaviors'}
"""Executables that command velocities, and their packages: these go through the smoother."""

SERVERS = {'planner_server': 'nav2_planner', 'bt_navigator': 'nav2_bt_navigator'}
"""Executables of the other servers, and their packages."""


def generate_launch_description() -> LaunchDescription:
    """Describe the arguments and the nodes."""
    return LaunchDescription([
        DeclareLaunchArgument(
            'parameters', default_value='',
            description="YAML file with the parameters of the suite; if empty, the package's own"),
        DeclareLaunchArgument(
            'robot', default_value='',
            description='YAML file that names the robot; if empty, as the parameters say'),
        DeclareLaunchArgument(
            'map', default_value=str(find_config('maps/free_field.yaml')),
            description='YAML file of the map'),
        DeclareLaunchArgument(
            'nav2_parameters', default_value=str(find_config('nav2.yaml')),
            description='YAML file with the parameters of Nav2, without the limits'),
        DeclareLaunchArgument(
            'loopback', default_value='false', choices=['true', 'false'],
            description="whether Nav2's loopback simulator takes the place of the suite"),
        OpaqueFunction(function=nodes),
    ])


def nodes(context: LaunchContext) -> list[Node | IncludeLaunchDescription]:
    """Make the nodes, with the limits of the suite's robot and gait."""
    given = context.launch_configurations
    robot = {'robot': given['robot']} if given['robot'] else {}
    limits = nav2_limits(load_suite(given['parameters'] or None, robot))
    lifecycle = ['map_server', *SERVERS, *COMMANDS, 'velocity_smoother']

    def node(package: str, name: str, *remappings: tuple[str, str], **values: object) -> Node:
        # As nav2_bringup has it: this executable's name would be that of its costmap, too.
        own = {} if name == 'controller_server' else {'name': name}
        return Node(
            package=package, executable=name, **own, output='screen', remappings=remappings,
            parameters=[given['nav2_parameters'],
                        {**limits.get(name, {}), 'use_sim_time': True, **values}])

    described = [
        node('nav2_map_server', 'map_server', yaml_filename=given['map']),
        *(node(package, name) for name, package in SERVERS.items()),
        *(node(package, name, ('cmd_vel', 'cmd_vel_nav')) for name, package in COMMANDS.items()),
        node('nav2_velocity_smoother', 'velocity_smoother', ('cmd_vel', 'cmd_vel_nav'),
             ('cmd_vel_smoothed', 'cmd_vel')),
        node('nav2_lifecycle_manager', 'lifecycle_manager', autostart=True, node_names=lifecycle)]
    if given['loopback'] == 'true':
        return [*described, Node(  # the clock is its own
            package='nav2_loopback_sim', executable='loopback_simulator',
            name='loopback_simulator', output='screen', parameters=[given['nav2_parameters']])]
    # Dead reckoning from where the robot was switched on: nothing here corrects it.
    described.append(Node(
        package='tf2_ros', executable='static_transform_publisher', name='map_to_odom',
        arguments=['--frame-id', 'map', '--child-frame-id', 'odom'],
        parameters=[{'use_sim_time': True}]))
    suite = Path(__file__).with_name('suite.launch.py')
    return [*described, IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(suite)),
        launch_arguments={name: given[name] for name in ('parameters', 'robot')}.items())]
