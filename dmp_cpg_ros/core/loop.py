# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The suite without ROS: the blocks of the diagram, tick by tick in the order of the nodes.

For tuning, tests and studies. In lock-step the nodes publish the same numbers, bit for bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.certificates.gate import Running
from dmp_cpg_ros.core.certificates.verdict import Change
from dmp_cpg_ros.core.clock import TickClock
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.estimation.body_estimate import estimated_state
from dmp_cpg_ros.core.estimation.estimator import BodyEstimator, EstimatorState
from dmp_cpg_ros.core.estimation.parameters import ESTIMATE
from dmp_cpg_ros.core.gait.choice import changing_to
from dmp_cpg_ros.core.gait.contact_feedback import ContactLimits, quarter_weight
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.running import RunningGait, limits_on_the_way
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.prediction import Outlook, look_ahead, next_gait
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.constants import GRAVITY
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.maths.vec3 import Triple
from dmp_cpg_ros.core.modes.body_control import BodyControl
from dmp_cpg_ros.core.modes.leg_control import LegControl
from dmp_cpg_ros.core.modes.manager import ModeState
from dmp_cpg_ros.core.parameters import check_names
from dmp_cpg_ros.core.reference.filter import CommandGate, ReferenceSystem
from dmp_cpg_ros.core.reference.governor import Governor
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.sensor_readings import readings_of
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, LegTargets, RobotState
from dmp_cpg_ros.core.suite_parameters import OWNER, SuiteParameters
from dmp_cpg_ros.core.transformation.leg import body_scale
from dmp_cpg_ros.core.voting.voters import vote_sensors
from dmp_cpg_ros.core.voting.votes import VoteInbox
from dmp_cpg_ros.core.voting.voting import Voting


class Tick(NamedTuple):
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
    gait : Gait or BlendedGait
        In which the phases are to be read.
    """

    time_ns: int
    r: Array
    x: Array
    x_dot: Array
    supervisor: SupervisorState
    feedback: PostureFeedback
    targets: JointTargets
    mode: ModeState
    gait: GaitInForce


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

    def __init__(self, description: RobotDescription, gait: Gait,
                 parameters: SuiteParameters | None = None,
                 gaits: Mapping[str, Gait] | None = None) -> None:
        """Build the parts at rest (or free, with ``start_inhibited`` false)."""
        p = parameters or SuiteParameters()
        self._reader = reader = KnownGaits({**(gaits or {}), gait.name: gait})
        scale, legs = body_scale(description), RobotLegs(description)
        self._weight = description.mass * GRAVITY
        self.gate = CommandGate(p.reference, scale)
        self.canonical = RunningGait(
            p.canonical, scale, reader, p.gait_change, p.gait_choice, quarter_weight(description))
        self._take(p, gait)
        self.inbox = VoteInbox()
        self.estimator = None if p.state_source.state_source != ESTIMATE else BodyEstimator(
            description, p.estimation, legs)
        self.body = BodyControl(description, p.posture, p.mode, legs)
        self.legs = [LegControl(leg, description, p.leg, self.body.modes.movements, p.motion, legs)
                     for leg in LEGS]
        self._clock, self._dt = TickClock(), 0.004
        self.r = np.zeros(3)
        self.canon = self.canonical.initial_state(gait, p.inhibition)
        self.stop = self.supervisor.initial_state(leg=p.canonical.first_leg)
        self.inhibition = self.supervisor.inhibition(self.stop)
        self.votes = self.voting.initial_state(self.network)
        self.estimator_state: EstimatorState | None = None
        self.posture = self.body.initial_state()
        self.leg_states = [leg.initial_state() for leg in self.legs]
        self.outlook: Outlook | None = None
        self._limits: ContactLimits | None = None
        self._barring = 'standing'

    def _take(self, p: SuiteParameters, wanted: Gait, cadence: float | None = None) -> None:
        """Make the parts anew that may get other parameters and hold nothing else."""
        gaits, passing, passing_s = limits_on_the_way(
            p.gait_choice, wanted.name, self._reader.named, p.canonical.cadence_scale, cadence)
        self.gate.follow(p.reference, gaits, passing, passing_s)
        self.parameters = p
        self.reference = ReferenceSystem(
            p.reference, self.canonical.scale.hip_radius, Governor(gaits, self.canonical.scale))
        self.supervisor = GaitSupervisor(
            p.inhibition, p.voting, p.leg.activity_rate, p.reference)
        self.voting = Voting(p.inhibition, p.voting, p.votes, p.reference, self._weight)

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
        dt = self._clock.step(state.time_ns)
        self._dt = dt or self._dt
        command, inhibition = self.gate.at(state.time_ns), self.inhibition
        self.r = r = self.reference.towards(self.r, command, inhibition, dt)
        self.canon = canon = self.canonical.step(
            self.canon, r, inhibition, dt, state.foot_force, self._contact_limits(dt))
        gait, x, x_dot, network = canon.gait, canon.x, canon.x_dot, self.network
        estimated = self._estimated(state)
        if dt == 0.0 and self.mode.mode == 'standing':  # which it may not be
            self.posture = self.body.picked_up(self.posture, estimated)
        self.posture, feedback = self.body.step(self.posture, estimated, gait, x, x_dot, r, dt)
        self._barring = self.mode.mode
        self.votes = self.voting.step(
            self.votes, state.time_ns, network, vote_sensors(state), x, r,
            self.stop.state in ('walking', 'free'), self.inbox.take(self.votes.memory.asks))
        self.stop = self.supervisor.step(
            self.stop, state.time_ns, network, x, x_dot, r, command, self.votes.tally,
            self.mode.mode, feedback.margins, feedback.progress,
            changing_to(self.parameters.gait_choice, gait, canon.wanted))
        self.inhibition = self.supervisor.inhibition(self.stop)
        targets = self._joint_targets(state, x_dot, feedback, dt)
        return Tick(state.time_ns, r, x, x_dot, self.stop, feedback, targets, self.mode, gait)

    def _joint_targets(self, state: RobotState, x_dot: Array, feedback: PostureFeedback,
                       dt: float) -> JointTargets:
        """Targets of all legs."""
        fl, fr, rl, rr = [self._leg(i, state, x_dot, feedback, dt) for i in range(len(LEGS))]
        return JointTargets(
            np.array((*fl.position, *fr.position, *rl.position, *rr.position)),
            np.array((*fl.velocity, *fr.velocity, *rl.velocity, *rr.velocity)),
            np.array((*fl.effort, *fr.effort, *rl.effort, *rr.effort)))

    def _leg(self, i: int, state: RobotState, x_dot: Array, feedback: PostureFeedback,
             dt: float) -> LegTargets:
        canon = self.canon
        self.leg_states[i], targets = self.legs[i].step(
            self.leg_states[i], canon.gait, canon.x, x_dot, self.r, feedback,
            state.joint_position, state.joint_velocity, dt)
        return targets

    @property
    def network(self) -> GaitNetwork:
        """The oscillators in the gait in force."""
        return self.canonical.network(self.canon.gait)

    @property
    def x(self) -> Array:
        """Canonical states, ndarray (4, 2)."""
        return self.canon.x

    @property
    def mode(self) -> ModeState:
        """What the body does."""
        return self.posture.mode

    def command(self, v_x: float, v_y: float = 0.0, gamma: float = 0.0) -> None:
        """Command a velocity; acts from the next tick on. Raises DataError for values that are
        not finite.
        """
        self.gate.accept(v_x, v_y, gamma)

    def request(self, stop: bool) -> float:
        """Request a stop or a start, as the service does; returns the predicted time to it [s],
        and keeps what else is predicted in :attr:`outlook`.

        Raises DataError for a start while the robot does not stand.
        """
        if not stop and self._barring != 'standing':
            raise DataError(f'the gait cannot start: the robot is {self._barring}')
        self.stop = self.supervisor.request(self.stop, stop)
        self.outlook = look_ahead(
            self.supervisor, self.reference, self.canonical, self.stop,
            Announced(self.inhibition), self.canon, self.r, self._foreseen, self._dt)
        return self.outlook.time_s

    @property
    def _foreseen(self) -> Triple:
        """Command that will act at the next tick."""
        return self.gate.foreseen(self.stop.time_ns + round(1e9 * self._dt))

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
            If a value is impossible, or a parameter may not change.
        """
        check_names(values, tuple(sorted(OWNER)), (), 'change')
        named, canon = self._reader.named, self.canon
        wanted = named(values.get('gait', canon.wanted.name))
        present = self._described(self.parameters, canon.wanted)
        proposed = self._described(present.changed(values).parameters, wanted)
        if wanted is not canon.wanted:
            proposed.parameters.gait_choice.check_asked(wanted.name)
        walked = [named(end.name) for end in canon.gait.ends]
        if waits := proposed.refused_now(present, self.network, self.inhibition, self.x):
            return waits
        verdict = Change(present, present.settled.certificate(), proposed,
                         (*walked, canon.wanted)).verdict()
        if verdict.accepted:
            p = proposed.parameters
            self._take(p, wanted, canon.cadence_scale)
            self.canonical = self.canonical.with_parameters(
                p.canonical, p.gait_change, p.gait_choice)
            self.canon = replace_unchecked(canon, wanted=wanted)
            self._limits = verdict.certificate.contact
        return verdict.reason

    def _described(self, parameters: SuiteParameters, gait: Gait) -> Running:
        """What a certificate is computed from."""
        others = self._reader.chosen(parameters.gait_choice)
        return Running(
            parameters, gait, self.canonical.scale, self._dt,
            tuple(other for other in others if other is not gait), self.canon.cadence_scale)

    def time_to_rest(self) -> float:
        """Bound on the time to rest of a stop that is requested now [s]."""
        canon = self.canon
        slow = self.canonical.gaits.at_cadence(canon.gait, canon.cadence_scale)
        return self.in_force().time_to_rest(
            self.network.of(slow), self.x, self.r, self.stop.quickness)

    def in_force(self) -> Running:
        """What runs, in the gait in force or in the change between two when a request acts."""
        gait = next_gait(self.reference, self.canonical, Announced(self.inhibition), self.canon,
                         self.r, self._foreseen, self._dt)
        return self._described_in(gait)

    def _described_in(self, gait: GaitInForce) -> Running:
        """What a certificate is computed from in a gait, or in a change between two."""
        first, *others = (self._reader.named(end.name) for end in gait.ends)
        return replace(self._described(self.parameters, first), others=tuple(others))

    def _contact_limits(self, dt: float) -> ContactLimits | None:
        """What contact feedback may do, computed at the second tick, which has a time step."""
        if self._limits is None and dt > 0.0 and self.parameters.canonical.contact_feedback:
            running = self._described(self.parameters, self.canon.wanted)
            self._limits = running.certificate().contact
        return self._limits

    def _estimated(self, state: RobotState) -> RobotState:
        """State of the robot as the posture block is to know it."""
        if self.estimator is None:
            return replace_unchecked(state, foot_force=np.zeros(4))  # as odom, which has none
        readings = readings_of(state)
        self.estimator_state, estimate = self.estimator.step(self.estimator_state, readings)
        return estimated_state(readings, estimate)

    def vote(self, weights: Mapping[str, float], voter: str = '') -> None:
        """Vote for a stop with a weight for each leg, as the topic ``votes`` does, from the next
        tick on; raises DataError for a name or a number that cannot be used.
        """
        self.inbox.accept(weights, voter)

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
        self.posture, answer = self.body.request(self.posture, what)
        if not answer.accepted:
            raise DataError(f'{what}: {answer.text}')
        return answer.text

    def change_gait(self, name: str) -> str:
        """Change the gait, as :meth:`change`."""
        return self.change({'gait': name})

    def told_drive(self, drive_mode: str) -> None:
        """Hear what the robot's drives do by themselves, as on the topic ``drive_mode``."""
        self.posture = self.body.told_drive(self.posture, drive_mode)
