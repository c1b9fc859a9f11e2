# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``posture_control``: mode of the body, and the torques that balance it while it stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
from std_msgs.msg import String

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.estimation.body_estimate import BodyEstimate, estimated_state
from dmp_cpg_ros.core.estimation.estimator import BodyEstimator, EstimatorState
from dmp_cpg_ros.core.estimation.parameters import (
    ESTIMATE,
    EstimationParameters,
    StateSourceParameters,
)
from dmp_cpg_ros.core.inhibition.blocked import Progress
from dmp_cpg_ros.core.maths.rotations import roll_pitch_yaw
from dmp_cpg_ros.core.modes.body_control import BodyControl
from dmp_cpg_ros.core.modes.manager import ModeParameters
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.modes.shortfall import NO_SHORTFALL
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.sensor_readings import SensorReadings
from dmp_cpg_ros.core.robot_model.state import LEGS, RobotState
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.nodes.framework.gaits import description_of, follow_gait, known_gaits
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.messages import robot_state
from dmp_cpg_ros.nodes.messages.canonical_state import CanonicalStateReader
from dmp_cpg_ros.nodes.messages.interfaces import BODY_TOPICS, interface
from dmp_cpg_ros.nodes.messages.joint_targets import read_drive_mode
from dmp_cpg_ros.nodes.messages.posture_feedback import PostureFeedbackWriter
from dmp_cpg_ros.nodes.messages.reference import read_reference
from dmp_cpg_ros.nodes.messages.transforms import WITHOUT_TF, TransformWriter
from dmp_cpg_ros.nodes.messages.values import Array, stamped, told_at
from dmp_cpg_ros.suite_table import POSTURE

FORGOTTEN_NS = 300_000_000
"""Gap after which the estimator begins anew [ns]: the robot has come to a stand by itself."""

KEPT_NS = 40_000_000
"""Gap after which a body counts as one that has kept its attitude [ns]: the turn rate at its end
says nothing of what was between. At 1 rad/s, as in a trot, that makes 0.2 rad of a gap of 0.2 s.
"""

MOST_WAITED = 25
"""Ticks for which the estimator waits for an IMU before it goes on without."""

NEVER_NS = 10**18
"""Longest time between two messages of a rate that is hardly any [ns]: thirty years."""

WELL_AGAIN_NS = 1_000_000_000
"""Time without a problem after which sensors count as well again [ns]."""


class BodyState:
    """Topics and estimator behind the state of the body.

    Parameters
    ----------
    node : SuiteNode
        The node that needs the state; its parameters choose where it comes from.
    description : RobotDescription
        The robot.
    legs : RobotLegs, optional
        Its legs, where others ask them too.

    Attributes
    ----------
    optional : tuple of str
        Topics whose silence the estimator bears.
    readers : mapping of str to callable
        How to read each topic.
    estimate : BodyEstimate or None
        The last one.
    """

    def __init__(self, node: SuiteNode, description: RobotDescription,
                 legs: RobotLegs | None = None) -> None:
        """Build the estimator, where there is one, and its publisher."""
        self._node = node
        self.estimate: BodyEstimate | None = None
        self._memory: EstimatorState | None = None
        self._waited, self._tick_ns = 0, FORGOTTEN_NS
        self._estimator: BodyEstimator | None = None
        self.optional: tuple[str, ...] = ()
        self.readers: dict[str, Callable[[Any], Any]] = {
            'joint_states': stamped(robot_state.JointsReader(description.joint_names).read)}
        if node.parameters_of(StateSourceParameters).state_source != ESTIMATE:
            self.readers['ground_truth'] = robot_state.read_odom
            return
        self.optional = BODY_TOPICS[ESTIMATE]
        self.readers |= {'joint_states': stamped(robot_state.JointsReader(
                             description.joint_names, strict=False).read),
                         'imu': stamped(robot_state.read_imu),
                         'foot_contacts': stamped(robot_state.FootContactsReader().read)}
        self._estimator = BodyEstimator(
            description, node.parameters_of(EstimationParameters), legs)
        self._writer = robot_state.OdometryWriter()
        self._publisher = node.publisher('odom')
        self._transforms = None
        if interface('/tf').installed:
            self._transforms = node.publisher('/tf')
            self._transform = TransformWriter(robot_state.ODOM_FRAME, robot_state.BASE_FRAME)
        else:
            node.get_logger().info(WITHOUT_TF)
        self._published = -1
        self._problems: dict[str, int] = {}
        self.on_parameters()

    def on_parameters(self) -> None:
        """Take over the estimator's parameters."""
        if self._estimator is None:
            return
        parameters = self._node.parameters_of(EstimationParameters)
        self._estimator.parameters = parameters
        rate = parameters.estimate_rate
        self._period_ns = round(min(1e9 / rate, NEVER_NS)) if rate > 0.0 else 0

    def state(self, stamp_ns: int, values: Mapping[str, Any]) -> RobotState:
        """State at a stamp from what the topics said.

        Parameters
        ----------
        stamp_ns : int
            Stamp of the tick [ns].
        values : mapping
            By topic, what its reader returned.
        """
        if self._estimator is None:
            _, (position, velocity, effort) = values['joint_states']
            base: robot_state.BaseMotion = values['ground_truth']
            return RobotState(stamp_ns, position, velocity, effort, *base, np.zeros(3),
                              np.zeros(len(LEGS)))
        readings = sensor_readings(stamp_ns, values)
        memory = self._memory
        away_ns = stamp_ns - memory.estimate.time_ns if memory else 0
        self._tick_ns = min(self._tick_ns, max(1, away_ns)) if memory else self._tick_ns
        gap_ns = max(KEPT_NS, 2 * self._tick_ns)
        if memory and gap_ns < away_ns <= FORGOTTEN_NS + self._node.return_ns:
            self._memory, estimate = self._estimator.resumed(memory, readings)
        else:
            self._memory, estimate = self._estimator.step(
                None if away_ns > FORGOTTEN_NS else memory, readings)
        self.estimate = estimate
        self._tell_problems(stamp_ns, estimate)
        if self._period_ns and stamp_ns // self._period_ns != self._published:
            self._published = stamp_ns // self._period_ns
            self._publisher.publish(self._writer.fill_estimate(estimate))
            if self._transforms is not None:
                self._transforms.publish(self._transform.fill(
                    stamp_ns, estimate.position_in_world, estimate.quaternion))
        return estimated_state(readings, estimate)

    def awaited(self, stamp_ns: int, values: Mapping[str, Any]) -> bool:
        """Whether the estimator would begin with readings of several ticks while the robot walks:
        who comes back, or hears of the gait again, waits for those of one tick, for a while.
        """
        if self._estimator is None or not self._node.return_ns or stamp_ns <= 0:
            return False
        last_ns = self._memory.estimate.time_ns if self._memory else 0
        if stamp_ns - last_ns <= FORGOTTEN_NS or values['imu'] and values['imu'][0] == stamp_ns:
            self._waited = 0
            return False
        self._waited += 1
        return self._waited <= MOST_WAITED

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Values for ``/diagnostics``: what no other topic tells of the estimate."""
        memory, estimate = self._memory, self.estimate
        if memory is None or estimate is None:
            return {}
        roll, pitch, _ = roll_pitch_yaw(estimate.quaternion)
        slope_x, slope_y = memory.terrain.slope
        return {'estimated_roll_rad': roll, 'estimated_pitch_rad': pitch,
                'estimated_height_m': estimate.height, 'terrain_slope_x': slope_x,
                'terrain_slope_y': slope_y,
                'gyro_bias_rad_s': ' '.join(f'{bias:.5f}' for bias in memory.filter.gyro_bias)}

    def _tell_problems(self, stamp_ns: int, estimate: BodyEstimate) -> None:
        """Name what has been missing lately: over a link that loses packets it is another sensor
        every time.
        """
        seen = {**self._problems, **dict.fromkeys(estimate.problems, stamp_ns)}
        self._problems = problems = {
            name: at for name, at in seen.items() if stamp_ns - WELL_AGAIN_NS <= at <= stamp_ns}
        if estimate.problems:
            self._node.warn('sensors', 'the estimator does without '
                            f'{", ".join(sorted(problems))}: silent, not finite, impossible, or '
                            'not what the others tell')
        elif not problems:
            self._node.clear('sensors')


def sensor_readings(stamp_ns: int, values: Mapping[str, Any]) -> SensorReadings:
    """Readings of one tick; what bears another stamp is missing (NaN), but joints, whose stamp is
    told.
    """
    joints_ns, (position, velocity, effort) = values['joint_states']
    nothing, no_contacts = np.full(3, np.nan), np.full(len(LEGS), np.nan)
    rate, force = told_at(stamp_ns, values['imu'], (nothing, nothing))
    contacts = told_at(stamp_ns, values['foot_contacts'], no_contacts)
    return SensorReadings(
        stamp_ns, position, velocity, effort, rate, force, contacts, joints_ns)


class PostureControl(SuiteNode):
    """Balances the body: torques for the stance legs, placement for the swinging feet.

    Decides its mode, too: stands it up, lays it down, notices a fall, brings it back.
    """

    KIND = POSTURE
    # The rate of the swings' activity is the legs' too, and the certificate's.
    CHANGEABLE = tuple(name for cls in (PostureParameters, EstimationParameters)
                       for name in cls.__dataclass_fields__
                       if name not in LegParameters.__dataclass_fields__) + ('gait',)

    def configure(self) -> None:
        """Build the controller and its topics."""
        canonical = CanonicalStateReader(known_gaits(self))
        description = description_of(self)
        legs = RobotLegs(description)
        self._body = BodyState(self, description, legs)
        self._control = BodyControl(
            description, self.parameters_of(PostureParameters),
            self.parameters_of(ModeParameters), legs)
        self._state, self._told = self._control.initial_state(), ''
        self._shortfall = NO_SHORTFALL
        self._joined = False
        self._mode_publisher = self.publisher('body_mode')
        self._writer = PostureFeedbackWriter()
        self._publisher = self.publisher('posture_feedback')
        self.match('canonical_state', {
            **self._body.readers,
            'reference': read_reference,
            'canonical_state': canonical.read,
        }, optional=self._body.optional)
        self.listen('drive_mode', self._on_drive)
        for what in REQUESTS:
            self.serve(what, partial(self._take_request, what))

    def on_parameters(self) -> None:
        """Take over the gains."""
        self._control = self._control.with_posture(self.parameters_of(PostureParameters))
        self._body.on_parameters()

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Compute the feedback for the stamp of the canonical state."""
        if self._body.awaited(stamp_ns, values):
            return
        state = self._body.state(stamp_ns, values)
        x, x_dot, gait = values['canonical_state']
        follow_gait(self, gait)
        if not self._joined:
            self._joined = True
            if stamp_ns > 0 or self._state.mode.mode == 'standing':  # which it may not be
                self._state = self._control.picked_up(self._state, state)
        control, feedback = self._control.step(
            self._state, state, gait, x, x_dot, values['reference'], self.elapsed)
        message = self._writer.fill(stamp_ns, feedback)  # refuses what is not finite
        self._state = control
        self._publisher.publish(message)
        self._tell()
        self._tell_shortfall(values['reference'], feedback.progress)

    def diagnostic_values(self) -> Mapping[str, Any]:
        """What the body does and why, and what the estimator found out."""
        condition = self._state.mode.condition
        measured = {} if condition is None else {
            name: getattr(condition, name) for name in ('tilt', 'height', 'support')}
        (ahead, left), slow = self._state.balance.offset.place, self._state.balance.integral
        return {'body_mode': self._state.mode.mode, 'reason': self._state.mode.reason, **measured,
                'mass_offset_m': f'{ahead:.4f} {left:.4f}',
                'speed_correction_m_s': ' '.join(f'{part:.4f}' for part in slow.correction),
                **self._body.diagnostic_values()}

    def _take_request(self, what: str, _: Any) -> tuple[bool, str]:
        self._state, given = self._control.request(self._state, what)
        return given.accepted, given.text

    def _on_drive(self, message: Any) -> None:
        self._state = self._control.told_drive(
            self._state, read_drive_mode(message))

    def _tell(self) -> None:
        """Publish and log a new mode, the first at a tick, which shows how the robot is found; a
        fall is an error until it is over.
        """
        mode, reason = self._state.mode.mode, self._state.mode.reason
        if mode == self._told:
            return
        self._mode_publisher.publish(String(data=mode))
        if self._told:
            self.get_logger().info(f'{self._told} -> {mode}: {reason}')
        self._told = mode
        if mode == 'damped':
            self.warn('fell', f'{reason}; the joints are damped, call recover', error=True)
        elif mode in ('standing', 'lying'):
            self.clear('fell')
        self.report()

    def _tell_shortfall(self, r: Array, progress: Progress | None) -> None:
        """Say that the body stays slower than what it was granted, and when it no longer does."""
        before = self._shortfall
        self._shortfall = now = before.step(
            r, progress and progress.velocity, self._control.posture.scale.leg_length,
            self.elapsed)
        if now.lasts and not before.lasts:
            self.warn('slow', f'the body goes at {now.goes:.2f} of the {now.asked:.2f} m/s of its '
                      'reference: its legs bring it no faster in this gait, on this ground')
        elif before.lasts and not now.lasts:
            self.clear('slow')
