# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Stops and starts of the MuJoCo robot in the plain loop, as the nodes would do in lock-step.

The robot walks once for all request phases of a gait and speed; every case goes on from a copy of
robot and loop at its phase, and so gives the same numbers as a run of its own.

Two simple ways to stop a gait are compared with sparse inhibition:

- *freeze*: all phases stop at once, and every leg holds the joint targets that it has.
- *finish swing*: a leg that stands stops at once; a leg that swings goes on to its touchdown.

In both the reference is brought to zero as usual, the balance of the body works as usual, and no
oscillator is coupled or inhibited until the gait is resumed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.context import RunContext
from dmp_cpg_ros.analysis.stop_outcome import WALKING_ERROR, StopOutcome, body_at_rest
from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.phase import phase, phase_generator, state_at
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.loop import Array, Tick, WalkingLoop
from dmp_cpg_ros.core.primitives.spring_damper import SpringState
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets, RobotState
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.robot.mujoco_robot import MujocoRobot
from dmp_cpg_ros.studies.loop_recording import LoopRun, recording_of

METHODS = ('inhibition', 'freeze', 'finish_swing')
"""Ways to stop: sparse inhibition, and the two simple ones."""

WALKING_BEFORE, WALKING_AFTER = 4.0, 3.5
"""Time from the start to the first request, and from the resume to the end [s]."""

SHORTEST_HOLD, LONGEST_HOLD, HOLD_AT_REST = 2.5, 12.0, 1.0
"""The hold takes this at least and at most, and this after the oscillators are at rest [s]."""

SPEED_WINDOW = 2.0
"""Time at the end over which the resumed speed is averaged [s]."""


class FreezingLoop(WalkingLoop):
    """A walking loop whose legs freeze when :meth:`freeze` is called; made as a WalkingLoop."""

    _frozen: NDArray[np.bool_] | None = None

    def freeze(self, finish_swing: bool) -> None:
        """Stop the legs from the next tick on.

        Parameters
        ----------
        finish_swing : bool
            Whether a leg that swings finishes its swing before it freezes.
        """
        self._finish_swing, self._frozen = finish_swing, np.zeros(len(LEGS), dtype=bool)

    def resume(self) -> None:
        """Walk on from the phases and joint angles at which the legs are."""
        self._frozen = None

    def tick(self, state: RobotState) -> Tick:
        """Run all parts on the robot's state of one tick, as :meth:`WalkingLoop.tick`."""
        if self._frozen is None:
            return super().tick(state)
        dt = self._clock.step(state.time_ns)
        self.stop = replace(self.stop, time_ns=state.time_ns)
        self.r = self.reference.step(self.r, np.zeros(3), dt)
        self._frozen = self._frozen | ~(self._finish_swing & self._swinging())
        omega = np.where(self._frozen, 0.0, self.network.omega(self.r))
        x = state_at(phase(self.x) + omega * dt, np.hypot(self.x[:, 0], self.x[:, 1]))
        x_dot = omega[:, None] * (x @ phase_generator().T)
        self.canon = replace(self.canon, x=x, x_dot=x_dot)
        balance, feedback = self.body.posture.step(
            self.posture.balance, state, self.canon.gait, x, x_dot, self.r, dt)
        self.posture = replace(self.posture, balance=balance)
        targets = self._joint_targets(state, x_dot, feedback, dt)
        return Tick(state.time_ns, self.r, x, x_dot, self.stop, feedback, targets, self.mode,
                    self.canon.gait)

    def _swinging(self) -> NDArray[np.bool_]:
        """Which legs are in the swing of their cycle, (4,)."""
        gait, scale = self.network.gait, self.network.scale
        duty = gait.duty(scale.foot_speed(*self.r.tolist()), scale)
        return np.abs(gait.cycle_position(phase(self.x))) < 0.5 * (1.0 - duty)

    def _leg(self, i: int, state: RobotState, x_dot: Array, feedback: PostureFeedback,
             dt: float) -> JointTargets:
        """Targets of one leg: those of its primitive, or those that it froze with."""
        if self._frozen is None or not self._frozen[i]:
            return super()._leg(i, state, x_dot, feedback, dt)
        leg, joints, of_leg = self.legs[i].primitive, self.legs[i].joints, self.leg_states[i].leg
        position, zero = of_leg.joints.position, np.zeros(3)
        held = replace(of_leg, joints=SpringState(position, zero))
        self.leg_states[i] = replace(self.leg_states[i], leg=held)
        measured = SpringState(state.joint_position[joints], state.joint_velocity[joints]) \
            if leg.parameters.reading == 'torque' else None
        return leg.targets(held, position, zero, feedback.torque[joints], measured)


@dataclass(frozen=True)
class StopCase:
    """One case of the study.

    Attributes
    ----------
    gait : str
        Name of the gait.
    speed : float
        Commanded forward speed [m/s].
    phase : float
        Fraction of a cycle by which the request comes later.
    cadence : float
        Factor on the gait's cadence.
    leg : str
        Leg whose oscillator is inhibited.
    push : float
        Lateral impulse in the instant of the request [N s].
    method : str
        One of ``METHODS``.
    """

    gait: str
    speed: float
    phase: float
    cadence: float = 1.0
    leg: str = 'fl'
    push: float = 0.0
    method: str = METHODS[0]


def run_trials(robot: MujocoRobot, cases: Sequence[StopCase], gait: Gait,
               parameters: SuiteParameters, bound_s: float = np.nan) -> Iterator[StopOutcome]:
    """Walk once; at the phase of each case stop and hold, and after an inhibition walk on.

    Parameters
    ----------
    robot : MujocoRobot
        Is reset; equal calls give equal outcomes.
    cases : sequence of StopCase
        Of one gait, speed and cadence, with ascending phases. The leg is in the parameters.
    gait : Gait
        The gait, its cadence included.
    parameters : SuiteParameters
        Parameters of the parts, without a timeout of the command.
    bound_s : float
        Guaranteed time to rest, for the outcomes; NaN where there is none [s].

    Yields
    ------
    StopOutcome
        One per case, in order.

    Raises
    ------
    ParameterError
        If the phases do not ascend or the walks differ.
    """
    phases = [case.phase for case in cases]
    walks = {(case.gait, case.speed, case.cadence) for case in cases}
    if phases != sorted(phases) or len(walks) > 1:
        raise ParameterError('the cases of one walk need one gait, speed and cadence and '
                             f'ascending phases, not {sorted(walks)} at {phases}')
    run = LoopRun(robot, FreezingLoop(robot.description, gait, parameters))
    for case in cases:
        run.loop.command(case.speed)
        omega = run.loop.network.omega(np.array((case.speed, 0.0, 0.0)))
        request = round((WALKING_BEFORE + case.phase * 2.0 * np.pi / omega) / run.tick_s)
        run.walk((request - run.state.time_ns // robot.tick_ns) * run.tick_s)
        run.states.clear()
        yield StopOutcome(fell=True) if run.fell() else _outcome(deepcopy(run), case, bound_s)


def _outcome(run: LoopRun[FreezingLoop], case: StopCase, bound_s: float) -> StopOutcome:
    """What becomes of a run that walks at the phase of the case."""
    if case.push:
        run.push(np.array((0.0, case.push, 0.0)))
    run.states = [run.state]
    times: dict[str, Any] = {}
    if case.method == METHODS[0]:
        predicted, measured = _held(run)
        times = {'predicted_s': predicted, 'bound_s': bound_s, 'measured_s': measured}
    else:
        run.loop.freeze(case.method == 'finish_swing')
        run.walk(SHORTEST_HOLD)
    if run.fell():
        return StopOutcome(True, **times)
    robot = run.robot.description
    at_rest = body_at_rest(recording_of(run.states), robot, RunContext(robot=robot).contact_force)
    if case.method != METHODS[0]:
        return at_rest
    run.loop.request(False)
    run.walk(WALKING_AFTER)
    last = run.states[-round(SPEED_WINDOW / run.tick_s):]
    resumed = float(np.mean([state.base_velocity_in_base[0] for state in last]))
    return replace(at_rest, fell=run.fell(), **times, resumed_speed=resumed,
                   walked_on=abs(resumed - case.speed) <= WALKING_ERROR * case.speed)


def _held(run: LoopRun[FreezingLoop]) -> tuple[float, float]:
    """Inhibit and hold; return the predicted and measured time to rest [s]."""
    predicted, held, measured = run.loop.request(True), 0.0, np.inf
    while held < min(LONGEST_HOLD, max(SHORTEST_HOLD, measured + HOLD_AT_REST)) and not run.fell():
        run.walk(run.tick_s)
        held += run.tick_s
        if run.loop.stop.word == 'at_rest':
            measured = run.loop.stop.measured_s
    # a robot that fell on the way says nothing of the oscillators' time to rest
    return predicted, np.nan if run.fell() and measured == np.inf else measured
