# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Posture block: the body's mode around the posture controller."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.body_command import BALANCED
from dmp_cpg_ros.core.balance.controller import (
    PostureController,
    PostureFeedback,
    PostureParameters,
    PostureState,
)
from dmp_cpg_ros.core.canonical.phase import phase_rate
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.supervisor import REST_ACTIVITY, REST_PHASE_RATE, REST_SPEED
from dmp_cpg_ros.core.maths.updated import updated
from dmp_cpg_ros.core.modes.body_condition import BodySense
from dmp_cpg_ros.core.modes.body_mode import BodyModes, ModeParameters, ModeState
from dmp_cpg_ros.core.modes.body_requests import ModeAnswer, request
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.legs import RobotLegs
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.transformation.leg import body_scale

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodyState:
    """State of the posture block.

    Attributes
    ----------
    mode : ModeState
        What the body does, requests included.
    balance : PostureState
        Of the posture controller.
    """

    mode: ModeState
    balance: PostureState


class BodyControl:
    """The posture block: the body's mode, the balance while it stands, what carries it else.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    posture : PostureParameters
        Gains of the balance.
    parameters : ModeParameters
        Start, fall detection, recovery.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(
        self, description: RobotDescription, posture: PostureParameters,
        parameters: ModeParameters, legs: RobotLegs | None = None,
    ) -> None:
        """Build the parts."""
        self.posture = PostureController(description, posture, legs)
        self.modes = BodyModes(description, parameters)
        self._sense, self._scale = BodySense(description, legs), body_scale(description)

    def with_posture(self, parameters: PostureParameters) -> BodyControl:
        """Return the block with other gains of the balance; from the next step on they act."""
        other = copy(self)
        other.posture = PostureController(
            self.posture.description, parameters, self.posture.legs)
        return other

    def initial_state(self) -> BodyState:
        """State at the start."""
        return BodyState(self.modes.initial_state(), self.posture.initial_state())

    def request(self, state: BodyState, what: str) -> tuple[BodyState, ModeAnswer]:
        """Take a request; see :func:`~dmp_cpg_ros.core.modes.body_requests.request`."""
        mode, answer = request(self.modes, state.mode, what)
        return BodyState(mode, state.balance), answer

    def step(
        self, state: BodyState, measured: RobotState, gait: GaitInForce, x: Array, x_dot: Array,
        r: Array, dt: float,
    ) -> tuple[BodyState, PostureFeedback]:
        """Advance mode and balance to the tick of a measured state.

        Parameters
        ----------
        state : BodyState
            After the last tick, requests included.
        measured : RobotState
            Of this tick.
        gait : Gait or BlendedGait
            In force.
        x, x_dot : ndarray (4, 2)
            Canonical states and rates.
        r : ndarray (3,)
            Reference.
        dt : float
            Time since the last tick [s].

        Returns
        -------
        state : BodyState
        feedback : PostureFeedback
            For the legs, with what the body does.
        """
        at_rest = state.mode.mode == 'stopping' and self._rests(
            x, x_dot, r, state.balance.activity)
        mode = self.modes.step(
            state.mode, self._sense.condition(measured), measured.time_ns, at_rest)
        if mode.mode in BALANCED:
            balance, feedback = self.posture.step(
                state.balance, measured, gait, x, x_dot, r, dt)
            if feedback.command.mode != mode.mode:
                feedback = updated(feedback, command=self.modes.command(mode))
            return BodyState(mode, balance), feedback
        torque = self._sense.carrying_torque(measured, self.modes.carried(mode))
        return BodyState(mode, self.posture.initial_state()), PostureFeedback(
            torque, np.zeros((4, 3)), np.zeros((4, 2)), np.zeros(3),
            self.modes.command(mode), measured.joint_position.copy(),
        )

    def _rests(self, x: Array, x_dot: Array, r: Array, activity: Array) -> bool:
        """Whether phases, reference and swings rest."""
        return (
            self._scale.foot_speed(float(r[0]), float(r[1]), float(r[2])) <= REST_SPEED
            and float(np.abs(phase_rate(x, x_dot)).max()) <= REST_PHASE_RATE
            and float(activity.max()) <= REST_ACTIVITY
        )
