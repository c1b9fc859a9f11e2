# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the suite's nodes; each is described in the file of the part that it belongs to.

Which node has which is said by :mod:`dmp_cpg_ros.suite_table`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, cast

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters, StateSourceParameters
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters
from dmp_cpg_ros.core.modes.manager import ModeParameters
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.robot_model.grounds import World
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.robot_model.world import WorldParameters
from dmp_cpg_ros.core.transformation.foot_path import Motion
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.core.voting.parameters import VoteSourceParameters, VotingParameters


@dataclass(frozen=True)
class SuiteParameters:
    """Parameters of all parts of the suite, and the motion of the feet where it is not the foot
    path of the package.
    """

    reference: ReferenceParameters = field(default_factory=ReferenceParameters)
    canonical: CanonicalParameters = field(default_factory=CanonicalParameters)
    inhibition: InhibitionParameters = field(default_factory=InhibitionParameters)
    leg: LegParameters = field(default_factory=LegParameters)
    posture: PostureParameters = field(default_factory=PostureParameters)
    estimation: EstimationParameters = field(default_factory=EstimationParameters)
    state_source: StateSourceParameters = field(default_factory=StateSourceParameters)
    votes: VoteSourceParameters = field(default_factory=VoteSourceParameters)
    mode: ModeParameters = field(default_factory=ModeParameters)
    gait_change: GaitChangeParameters = field(default_factory=GaitChangeParameters)
    gait_choice: GaitChoiceParameters = field(default_factory=GaitChoiceParameters)
    voting: VotingParameters = field(default_factory=VotingParameters)
    motion: Motion | None = None

    @classmethod
    def of(cls, sets: Mapping[type[Parameters], Any]) -> SuiteParameters:
        """Parameters of the parts from parameter sets by their class; defaults for what is not
        among them.
        """
        given = ((part.name, sets.get(cast(Any, part.default_factory))) for part in fields(cls))
        return cls(**{name: value for name, value in given if value is not None})

    @property
    def sets(self) -> dict[str, Parameters]:
        """Parameter sets by the name of their part."""
        return {name: value for name, value in vars(self).items() if isinstance(value, Parameters)}


@dataclass(frozen=True)
class RobotFileParameters(Parameters):
    """Which robot walks."""

    robot: str = parameter(
        'robots/mini_quadruped.yaml', 'robot file, in the config folder or by its path')


@dataclass(frozen=True)
class GaitParameters(Parameters):
    """How it walks."""

    gaits_file: str = parameter(
        'gaits.yaml', 'file with the gaits, in the config folder or by its path')
    gait: str = parameter('amble', 'name of the gait')


@dataclass(frozen=True)
class CommandParameters(Parameters):
    """How commands arrive."""

    stamped_cmd_vel: bool = parameter(False, 'whether cmd_vel is a TwistStamped')


@dataclass(frozen=True)
class TickParameters(Parameters):
    """How often the robot tells its state."""

    control_rate: float = parameter(
        250.0, "rate of the robot's states; its period must be a whole number of physics steps",
        1.0, 2000.0, unit='Hz')

    def __post_init__(self) -> None:
        """Validate; the period must be a whole number of microseconds."""
        super().__post_init__()
        if abs(1e6 / self.control_rate - round(1e6 / self.control_rate)) > 1e-6:
            raise ParameterError(
                f'control_rate = {self.control_rate:g} Hz must have a period of whole '
                f'microseconds; 200, 250, 500 and 1000 Hz have')

    @property
    def tick_ns(self) -> int:
        """Control tick [ns]."""
        return round(1e6 / self.control_rate) * 1000


@dataclass(frozen=True)
class RequestParameters(Parameters):
    """When a request acts."""

    request_lead: float = parameter(
        0.024, 'real time: time after which a stop or a start acts on oscillators and reference, '
        'at the same tick of both; 0: when they hear of it', 0.0, 0.2, unit='s')


@dataclass(frozen=True)
class LegChoice(Parameters):
    """Which leg a transformation node moves."""

    leg: str = parameter('fl', 'which leg', choices=LEGS)


@dataclass(frozen=True)
class DriveParameters(Parameters):
    """How whatever moves the joints treats their targets."""

    target_timeout: float = parameter(
        0.2, "age of a leg's targets after which the fallback controller takes over", 0.01, 10.0,
        unit='s')
    target_lead: float = parameter(
        0.0, 'time after its tick at which a target acts, for which it is computed', 0.0, 0.06,
        unit='s')


@dataclass(frozen=True)
class RobotParameters(DriveParameters):
    """How the robot behind the port is run."""

    physics: str = parameter(
        'mujoco', 'simulation of the robot: MuJoCo, or joints that track perfectly',
        choices=('mujoco', 'perfect_tracking'))
    reading: str = parameter(
        'kinematic', 'whether joints follow targets or receive torques only',
        choices=('kinematic', 'torque'))
    contact_feedback: bool = parameter(
        False, 'whether early and late touchdown shift the phase of the legs')
    gated: bool = parameter(
        False, 'whether the robot waits for mujoco_robot/advance_until: for each tick in '
        'lock-step, to begin in real time')
    seed: int = parameter(0, 'seed of the initial spread', 0)
    start_pose: str = parameter(
        'standing', 'start pose: standing, lying on the belly, or fallen, drawn by the seed',
        choices=('standing', 'lying', 'fallen'))
    initial_spread: float = parameter(
        0.0, 'joints start at the home pose plus a uniform draw from plus or minus this', 0.0, 0.3,
        unit='rad')
    longest_lag: float = parameter(
        0.03, "real time: how long after their time a leg's targets may still act; rather than "
        'that the simulation waits for newer ones, up to target_timeout of wall time; 0: it never '
        'waits', 0.0, 10.0, unit='s')
    viewer: bool = parameter(False, 'whether to open a window with the robot')
    live_view: bool = parameter(
        False, 'whether to serve live_view, the suite in a browser, whose address is printed')
    fail: str = parameter(
        '', 'failure to inject when it is set, such as {component: imu, kind: stuck, for_s: 0.5}')
    failures_allowed: bool = parameter(False, 'whether failures may be injected')


@dataclass(frozen=True)
class CertificateParameters(Parameters):
    """What happens without a certificate."""

    allow_uncertified: bool = parameter(
        False, 'whether the gait may start, and parameters may change, although the certificate '
        'fails')


CERTIFIED: tuple[type[Parameters], ...] = (
    CanonicalParameters, InhibitionParameters, VotingParameters, ReferenceParameters,
    LegParameters, PostureParameters, TickParameters, GaitParameters, GaitChangeParameters,
    GaitChoiceParameters, RobotFileParameters)
"""Parameter sets that the certificate is computed from; nodes that compute it declare all of
them.
"""

REFERENCE, CANONICAL, INHIBITION = 'reference_filter', 'canonical_oscillators', 'inhibition'
"""Nodes that own parameters which may change; the table of all nodes is
:mod:`dmp_cpg_ros.suite_table`.
"""

UNCERTIFIED_VOTES = ('vote_fade', 'vote_resume')
"""Parameters of the counting of votes that no inequality depends on."""

PART_OF: dict[str, tuple[type[Parameters], ...]] = {
    REFERENCE: (ReferenceParameters,),
    CANONICAL: (CanonicalParameters, GaitChangeParameters, GaitChoiceParameters),
    'leg_transformation': (LegParameters,),
    INHIBITION: (InhibitionParameters, VotingParameters, VoteSourceParameters),
    'posture_control': (
        PostureParameters, EstimationParameters, StateSourceParameters, ModeParameters),
}
"""Parameter sets of the part of the core that a node runs; others it declares for certificates."""

VOTE_SOURCES = (
    'footing_weight', 'collision_weight', 'tilt_weight', 'tilt_limit', 'silence_weight')
"""Parameters that may change and that the inhibition alone has."""

CHANGEABLE: dict[str, tuple[str, ...]] = {
    REFERENCE: (
        'alpha_r', 'max_speed', 'max_lateral_speed', 'max_turn_rate', 'max_curve', 'braking',
        'cmd_vel_timeout'),
    CANONICAL: (
        'rho', 'coupling_gain', 'coupling_graph', 'cadence_scale', 'gait', 'gait_change_rate',
        'auto_gait', 'auto_gaits', 'auto_speeds', 'auto_hysteresis'),
    INHIBITION: (
        'inhibition_gain', 'region_radius', 'inhibited_legs', 'capture_speed', 'auto_inhibit',
        'auto_delay', 'push_recovery', 'caution', 'vote_rule', 'vote_majority', 'vote_limit',
        *UNCERTIFIED_VOTES),
}
"""Parameters of the certified nodes that may change while they run, by the node that owns them;
other nodes that declare them follow their owner.
"""

OWNER = {name: node for node, names in CHANGEABLE.items() for name in names}
"""Which node owns a parameter that may change."""


def chosen_world(world: WorldParameters, robot: RobotParameters) -> World:
    """Make the world that the robot's parameters choose.

    Raises
    ------
    ParameterError
        If the robot has no physics for it.
    """
    if robot.physics != 'mujoco' and (world.world, world.world_friction) != ('flat', 0.0):
        raise ParameterError(
            f'world {world.world} needs physics: mujoco; with physics: {robot.physics} the body '
            'rides level on its feet, and the only world is flat, without a friction of its own')
    return world.build()
