# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which node has which parameters; each is described in the file of the part that it belongs to.

A node that predicts or certifies another part declares that part's parameters too. In a parameter file such shared
values stand once, under ``/**``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait_network import CanonicalParameters
from dmp_cpg_ros.core.inhibition import InhibitionParameters
from dmp_cpg_ros.core.leg_primitive import LegParameters
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.posture import PostureParameters
from dmp_cpg_ros.core.reference import ReferenceParameters
from dmp_cpg_ros.core.robot_state import LEGS


@dataclass(frozen=True)
class SuiteParameters:
    """Parameters of all parts of the suite."""

    reference: ReferenceParameters = field(default_factory=ReferenceParameters)
    canonical: CanonicalParameters = field(default_factory=CanonicalParameters)
    inhibition: InhibitionParameters = field(default_factory=InhibitionParameters)
    leg: LegParameters = field(default_factory=LegParameters)
    posture: PostureParameters = field(default_factory=PostureParameters)


@dataclass(frozen=True)
class ScheduleParameters(Parameters):
    """How a node keeps step with the robot."""

    lock_step: bool = parameter(False, 'whether ticks wait for every message of their stamp, so that a run does '
                                       'not depend on the speed of the machine')


@dataclass(frozen=True)
class GaitParameters(ScheduleParameters):
    """Which robot walks, and how."""

    robot: str = parameter('robots/mini_quadruped.yaml', 'robot file, in the config folder or by its path')
    gaits_file: str = parameter('gaits.yaml', 'file with the gaits, in the config folder or by its path')
    gait: str = parameter('amble', 'name of the gait')


@dataclass(frozen=True)
class ReferenceFilterParameters(ReferenceParameters, ScheduleParameters):
    """Parameters of the node ``reference_filter``."""

    stamped_cmd_vel: bool = parameter(False, 'whether cmd_vel is a TwistStamped')


@dataclass(frozen=True)
class CanonicalOscillatorsParameters(CanonicalParameters, InhibitionParameters, GaitParameters):
    """Parameters of the node ``canonical_oscillators``."""


@dataclass(frozen=True)
class LegTransformationParameters(LegParameters, GaitParameters):
    """Parameters of the node ``leg_transformation``."""

    leg: str = parameter('fl', 'which leg', choices=LEGS)


@dataclass(frozen=True)
class InhibitionNodeParameters(InhibitionParameters, CanonicalParameters, ReferenceParameters, LegParameters,
                               GaitParameters):
    """Parameters of the node ``inhibition``: its own, and those of the parts that it predicts."""

    stamped_cmd_vel: bool = parameter(False, 'whether cmd_vel is a TwistStamped')
    control_rate: float = parameter(250.0, 'rate of the robot\'s states', unit='Hz', minimum=1.0,
                                    maximum=2000.0)


@dataclass(frozen=True)
class PostureControlParameters(PostureParameters, GaitParameters):
    """Parameters of the node ``posture_control``."""


@dataclass(frozen=True)
class MujocoRobotParameters(ScheduleParameters):
    """Parameters of the node ``mujoco_robot``."""

    robot: str = parameter('robots/mini_quadruped.yaml', 'robot file, in the config folder or by its path')
    physics: str = parameter('mujoco', 'what moves the robot: MuJoCo, or joints that track perfectly',
                             choices=('mujoco', 'perfect_tracking'))
    control_rate: float = parameter(250.0, 'rate of the robot\'s states; its period must be a whole number of '
                                    'physics steps', unit='Hz', minimum=1.0, maximum=2000.0)
    reading: str = parameter('kinematic', 'whether joints follow targets or receive torques only',
                             choices=('kinematic', 'torque'))
    gated: bool = parameter(False, 'whether ticks wait for ~/advance_until (lock-step only)')
    seed: int = parameter(0, 'seed of the initial spread', minimum=0)
    initial_spread: float = parameter(0.0, 'joints start at the home pose plus a uniform draw from plus or minus '
                                      'this', unit='rad', minimum=0.0, maximum=0.3)
    target_timeout: float = parameter(0.2, 'age of a leg\'s targets after which the robot holds a stand by itself',
                                      unit='s', minimum=0.01, maximum=10.0)
    viewer: bool = parameter(False, 'whether to open a window with the robot')

    @property
    def tick_ns(self) -> int:
        """Control tick [ns].

        Raises
        ------
        ParameterError
            If the period is not a whole number of microseconds.
        """
        return tick_of(self.control_rate)


NODE_PARAMETERS: dict[str, type[Parameters]] = {
    'reference_filter': ReferenceFilterParameters,
    'canonical_oscillators': CanonicalOscillatorsParameters,
    'leg_transformation': LegTransformationParameters,
    'inhibition': InhibitionNodeParameters,
    'posture_control': PostureControlParameters,
    'mujoco_robot': MujocoRobotParameters,
}
"""Parameter set of every kind of node that has a part of the core in it."""


def tick_of(control_rate: float) -> int:
    """Control tick [ns] of a rate [Hz].

    Raises
    ------
    ParameterError
        If the period is not a whole number of microseconds.
    """
    tick_us = 1e6 / control_rate
    if abs(tick_us - round(tick_us)) > 1e-6:
        raise ParameterError(f'control_rate = {control_rate:g} Hz must have a period of whole microseconds, '
                             f'not {tick_us:.6f} us; 200, 250, 500 and 1000 Hz have')
    return round(tick_us) * 1000
