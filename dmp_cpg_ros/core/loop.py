# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite without ROS: the same objects in the order of the nodes, tick by tick.

For tuning, tests and studies. In lock-step the nodes publish the same numbers, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.controller import PostureController, PostureFeedback
from dmp_cpg_ros.core.canonical.inhibition import (
    Inhibition,
    InhibitionParameters,
    initial_inhibition,
)
from dmp_cpg_ros.core.certificates.changes import refused_change
from dmp_cpg_ros.core.certificates.gate import CertificateGate, Running
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.estimation.estimate import estimated_state
from dmp_cpg_ros.core.estimation.estimator import BodyEstimator, EstimatorState
from dmp_cpg_ros.core.estimation.parameters import ESTIMATE
from dmp_cpg_ros.core.gait.choice import highest_speed
from dmp_cpg_ros.core.gait.contact_feedback import ContactPhase, initial_contact_state
from dmp_cpg_ros.core.gait.foot_contact import quarter_weight
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.gait_networks import GaitNetworks
from dmp_cpg_ros.core.gait.gait_reader import GaitReader
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.running_network import RunningNetwork
from dmp_cpg_ros.core.gait.transition import BlendedGait
from dmp_cpg_ros.core.inhibition.prediction import predict
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor, SupervisorState
from dmp_cpg_ros.core.inhibition.vote_counter import VoteCounter
from dmp_cpg_ros.core.inhibition.voting_sensors import vote_sensors
from dmp_cpg_ros.core.maths.updated import updated
from dmp_cpg_ros.core.modes.body_command import BodyCommand
from dmp_cpg_ros.core.modes.body_control import BodyControl
from dmp_cpg_ros.core.modes.body_mode import ModeState
from dmp_cpg_ros.core.modes.body_requests import REQUESTS
from dmp_cpg_ros.core.modes.motion import LegMotion, MotionState
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceSystem
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.legs import RobotLegs
from dmp_cpg_ros.core.robot_model.sensor_readings import readings_of
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, RobotState
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.joint_system import TransformationState
from dmp_cpg_ros.core.transformation.leg import LegPrimitive, LegState, body_scale

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tick:
    """Everything that one tick produced.

    Attributes
    ----------
    time_ns : int
        Stamp [ns].
    r : ndarray (3,)
        Reference.
    x, x_dot : ndarray (4, 2)
        Canonical states and rates.
    supervisor : SupervisorState
        State of the stop and start.
    feedback : PostureFeedback
        Torques and placement shifts.
    targets : JointTargets
        Of all twelve joints.
    mode : ModeState
        What the body does.
    gait : str
        Word of the gait in which the phases are to be read, as in ``canonical_state``.
    """

    time_ns: int
    r: Array
    x: Array
    x_dot: Array
    supervisor: SupervisorState
    feedback: PostureFeedback
    targets: JointTargets
    mode: ModeState
    gait: str = ''


class WalkingLoop:
    """All parts of the suite in one object.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    gait : Gait
        The gait.
    parameters : SuiteParameters
        Parameters of all parts.
    gaits : mapping of str to Gait, optional
        Gaits that it may change to, beside the first.
    """

    def __init__(
        self,
        description: RobotDescription,
        gait: Gait,
        parameters: SuiteParameters | None = None,
        gaits: Mapping[str, Gait] | None = None,
    ) -> None:
        """Build the parts at rest (or free, with ``start_inhibited`` false)."""
        self.parameters = p = parameters or SuiteParameters()
        reader = GaitReader({**(gaits or {}), gait.name: gait}, unnamed=gait)
        networks = GaitNetworks(p.canonical, body_scale(description), p.gait_change, reader)
        self._running = RunningNetwork(networks, gait, p.gait_choice)
        self.network = self._running.network
        self.gate = CommandGate(p.reference, body_scale(description))
        self.gate.highest_speed = highest_speed(p.gait_choice, gait.name, reader.named)
        self.reference = ReferenceSystem(p.reference)
        self.supervisor = GaitSupervisor(p.inhibition, self.network, p.leg.activity_rate)
        self.votes = VoteCounter(
            p.inhibition, p.votes, self.network, p.reference, description.mass
        )
        known_legs = RobotLegs(description)
        self.posture = PostureController(description, self.network.gait, p.posture, known_legs)
        self.body = BodyControl(description, p.mode, known_legs)
        self.legs = [LegPrimitive(leg, description, self.network.gait, p.leg) for leg in LEGS]
        self.motions = [
            LegMotion(slice(3 * i, 3 * i + 3), self.body.modes.movements, leg.transformation)
            for i, leg in enumerate(self.legs)
        ]
        self.stop = self.supervisor.initial_state()
        self.inhibition = self.supervisor.inhibition(self.stop)
        self.r = np.zeros(3)
        self.x = initial_canonical_state(self.network, p.inhibition)
        self.posture_state = self.posture.initial_state()
        self.estimator = (
            BodyEstimator(description, p.estimation, known_legs)
            if p.state_source.state_source == ESTIMATE
            else None
        )
        self.estimator_state: EstimatorState | None = None
        self.mode, self.barring = self.body.initial_state(), 'standing'
        self.contact = (
            ContactPhase(quarter_weight(description)) if p.canonical.contact_feedback else None
        )
        self.contact_state = initial_contact_state()
        self.leg_states: list[LegState] = [leg.initial_state() for leg in self.legs]
        self.motion_states: list[MotionState | None] = [None] * len(LEGS)
        self._time_ns: int | None = None
        self._dt = 0.004
        self._body_command = BodyCommand()

    def command(self, v_x: float, v_y: float = 0.0, gamma: float = 0.0) -> None:
        """Command a velocity; acts from the next tick on. Raises DataError for values that are
        not finite.
        """
        self.gate.accept(v_x, v_y, gamma)

    def request(self, stop: bool) -> float:
        """Request a stop or a start, as the service does; returns the predicted time to it [s].

        Raises DataError for a start while the robot does not stand.
        """
        if not stop and self.barring != 'standing':
            raise DataError(f'the gait cannot start: the robot is {self.barring}')
        self.stop = self.supervisor.request(self.stop, stop)
        command = self.gate.at(self.stop.time_ns)
        return predict(
            self.supervisor,
            self.reference,
            self.stop,
            self.inhibition,
            self.x,
            self.r,
            command,
            self._dt,
            running=self._running,
        )

    def change(self, values: Mapping[str, Any]) -> str:
        """Change parameters as the nodes' services do; they act from the next tick on.

        Parameters
        ----------
        values : mapping of str to value
            Names of :data:`~dmp_cpg_ros.core.suite_parameters.OWNER`.

        Returns
        -------
        str
            Why the change is refused; empty when it is accepted.

        Raises
        ------
        ParameterError
            If a value is impossible.
        """
        running, name = self._running, values.get('gait', self._running.wanted.name)
        wanted = running.networks.reader.named(name)
        present = self._described(self.parameters, running.wanted)
        proposed = self._described(present.changed(values).parameters, wanted)
        leading_to = running.networks.reader.named(running.leading_to.name)
        reason = refused_change(
            proposed.parameters, (leading_to, running.wanted, wanted), present.scale, self._dt,
        )
        if reason:
            return reason
        waits = proposed.refused_now(present, self.network, self.inhibition, self.x)
        if waits:
            return waits
        verdict = CertificateGate().judge(present, present.certificate(), proposed)
        if verdict.accepted:
            self.parameters = p = proposed.parameters
            self._running.change(p.canonical, p.gait_change)
            self._running.choice, self._running.wanted = p.gait_choice, wanted
            self.gate.parameters = self.reference.parameters = p.reference
            self.gate.highest_speed = highest_speed(
                p.gait_choice, wanted.name, running.networks.reader.named)
            self.supervisor.parameters = p.inhibition
            self.votes.follow(p.inhibition, p.reference, p.votes)
            if self.contact is not None:
                self.contact.limits = verdict.certificate.contact
        return verdict.reason

    def _described(self, parameters: SuiteParameters, gait: Gait) -> Running:
        """What a certificate is computed from."""
        choice, named = parameters.gait_choice, self._running.networks.reader.named
        others = [named(name) for name in choice.auto_gaits if choice.auto_gait]
        return Running(parameters, gait, self.network.scale, self._dt,
                       tuple(other for other in others if other is not gait),
                       self._running.cadence_scale)

    def time_to_rest(self) -> float:
        """Bound on the time to rest of a stop that is requested now [s]."""
        return self.in_force().time_to_rest(self.network, self.x, self.r)

    def in_force(self) -> Running:
        """What runs, in the gait in force or in the change between two."""
        gait, named = self.network.gait, self._running.networks.reader.named
        ends = (gait.transition.before, gait.transition.after) if isinstance(
            gait, BlendedGait) else (gait,)
        first, *others = (named(end.name) for end in ends)
        return replace(self._described(self.parameters, first), others=tuple(others))

    def vote(self, weights: Mapping[str, float], voter: str = '') -> None:
        """Vote for a stop, as the topic ``votes`` does; counts from the next tick on.

        Parameters
        ----------
        weights : mapping of str to float
            Weight of each leg that is voted for.
        voter : str
            Who votes.

        Raises
        ------
        DataError
            If a name or a number cannot be used.
        """
        self.votes.box.accept(weights, voter)

    def request_mode(self, what: str) -> str:
        """Ask for ``stand_up``, ``lie_down`` or ``recover``, as the services do.

        Returns
        -------
        str
            What will happen.

        Raises
        ------
        DataError
            If it is refused.
        """
        self.mode, answer = self.body.request(self.mode, what)
        if not answer.accepted:
            raise DataError(f'{what}: {answer.text}')
        return answer.text

    def change_gait(self, name: str) -> str:
        """Change the gait, as :meth:`change`."""
        return self.change({'gait': name})

    @property
    def takers(self) -> dict[str, Callable[[Any], Any]]:
        """What takes the events of a scenario, by kind, for
        :func:`~dmp_cpg_ros.core.scenario.scenario.play`.
        """
        return {
            'command': lambda command: self.command(*command),
            'inhibit': self.request,
            'set': self.change,
            'votes': lambda weights: self.vote(weights, 'scenario'),
            **{what: self._asking(what) for what in REQUESTS},
            'gait': self.change_gait,
        }

    def _asking(self, what: str) -> Callable[[Any], Any]:
        return lambda _: self.request_mode(what)

    def tick(self, state: RobotState) -> Tick:
        """Run all parts on the robot's state of one tick.

        Parameters
        ----------
        state : RobotState
            Measured state with its stamp.

        Returns
        -------
        Tick
        """
        dt = 0.0 if self._time_ns is None else (state.time_ns - self._time_ns) * 1e-9
        self._time_ns, self._dt = state.time_ns, dt or self._dt
        command = self.gate.at(state.time_ns)
        inhibition = self.inhibition
        r_ext = np.array((0.0, 0.0, 0.0) if inhibition.requested else command)
        self.r = self.reference.step(self.r, r_ext, dt)
        self.x = self._running.begin_tick(self.x, self.r, inhibition, dt)
        self._follow(self._running.network)
        offset = self._contact_offset(state, inhibition, dt)
        self.x = self._running.advance(self.x, self.r, inhibition, dt, offset)
        self._follow(self._running.network)
        x_dot = self.network.rate(self.x, self.r, inhibition, offset)
        feedback = self._balance(self._body(state), x_dot, dt)
        self.barring = self.mode.mode
        ballot = self.votes.count(
            state.time_ns, vote_sensors(state), self.network, self.x, self.r, self.stop.word
        )
        self.stop = self.supervisor.step(
            self.stop, state.time_ns, self.x, x_dot, self.r, command, ballot, self.barring
        )
        self.inhibition = self.supervisor.inhibition(self.stop)
        if feedback.mode != self._body_command.text:
            self._body_command = BodyCommand.from_text(feedback.mode)
        body = self._body_command
        targets = [
            self._leg(i, state, x_dot, feedback, dt)
            if body.balanced
            else self._moved_leg(i, state, body, feedback, dt)
            for i in range(len(LEGS))
        ]
        return Tick(
            state.time_ns,
            self.r,
            self.x,
            x_dot,
            self.stop,
            feedback,
            JointTargets(
                np.concatenate([target.position for target in targets]),
                np.concatenate([target.velocity for target in targets]),
                np.concatenate([target.effort for target in targets]),
            ),
            self.mode,
            self._running.word,
        )

    def _contact_offset(
        self, state: RobotState, inhibition: Inhibition, dt: float
    ) -> Array | float:
        """Frequency offsets from the contacts, where these are fed back [rad/s]."""
        if self.contact is None:
            return 0.0
        if self.contact.limits is None and dt > 0.0:
            running = self._described(self.parameters, self._running.wanted)
            self.contact.limits = running.certificate().contact
        self.contact_state, offset = self.contact.step(
            self.contact_state, state.foot_force, self.network, self.x, self.r, inhibition, dt
        )
        return offset

    def _follow(self, network: GaitNetwork) -> None:
        """Let all parts use the network that acts, and its gait."""
        self.network = self.supervisor.network = network
        self.posture.gait = network.gait
        for leg in self.legs:
            leg.gait = network.gait

    def _body(self, state: RobotState) -> RobotState:
        """State of the robot as the posture controller is to know it."""
        if self.estimator is None:
            return updated(state, foot_force=np.zeros(len(LEGS)))  # as odom, which has none
        readings = readings_of(state)
        self.estimator_state, estimate = self.estimator.step(self.estimator_state, readings)
        return estimated_state(readings, estimate)

    def _balance(self, state: RobotState, x_dot: Array, dt: float) -> PostureFeedback:
        """Advance the body's mode, and balance where it stands."""
        body = self.body
        self.mode = body.step(
            self.mode, state, self.x, x_dot, self.r, self.posture_state.activity
        )
        if not body.balances(self.mode):
            self.posture_state = self.posture.initial_state()
            return body.feedback(self.mode, state)
        self.posture_state, feedback = self.posture.step(
            self.posture_state, state, self.x, x_dot, self.r, dt
        )
        return body.labelled(self.mode, feedback)

    def _leg(
        self, i: int, state: RobotState, x_dot: Array, feedback: PostureFeedback, dt: float
    ) -> JointTargets:
        leg = self.legs[i]
        self.motion_states[i] = None
        self.leg_states[i], goal, goal_velocity = leg.step(
            self.leg_states[i],
            self.x[i],
            x_dot[i],
            self.r,
            feedback.of_leg(i),
            dt,
        )
        return self._targets(i, state, goal, goal_velocity, feedback)

    def _moved_leg(
        self, i: int, state: RobotState, body: BodyCommand, feedback: PostureFeedback, dt: float
    ) -> JointTargets:
        """Targets of a leg while the gait's primitive does not move it."""
        joints = slice(3 * i, 3 * i + 3)
        self.motion_states[i], self.leg_states[i], goal, goal_velocity = self.motions[i].step(
            self.motion_states[i], self.leg_states[i], body, feedback.measured[joints], dt
        )
        return self._targets(i, state, goal, goal_velocity, feedback)

    def _targets(
        self, i: int, state: RobotState, goal: Array, goal_velocity: Array,
        feedback: PostureFeedback,
    ) -> JointTargets:
        leg, joints = self.legs[i], slice(3 * i, 3 * i + 3)
        measured = None
        if leg.parameters.reading == 'torque':
            measured = TransformationState(
                state.joint_position[joints], state.joint_velocity[joints]
            )
        return leg.targets(
            self.leg_states[i], goal, goal_velocity, feedback.torque[joints], measured
        )


def initial_canonical_state(network: GaitNetwork, parameters: InhibitionParameters) -> Array:
    """States (4, 2) at which the oscillators start: at rest under inhibition, or in their
    places.
    """
    return (
        network.rest_state(initial_inhibition(parameters))
        if parameters.start_inhibited
        else (network.locked_state())
    )
