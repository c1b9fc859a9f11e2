# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Posture block: the body's mode around the posture controller."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

from dmp_cpg_ros.core.balance.body_command import BALANCED
from dmp_cpg_ros.core.balance.controller import (
    PostureController,
    PostureFeedback,
    PostureParameters,
    PostureState,
)
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import made_often
from dmp_cpg_ros.core.modes.manager import ModeManager, ModeParameters, ModeState
from dmp_cpg_ros.core.modes.requests import ModeAnswer, request
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.robot_model.state import RobotState


@made_often
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

    def __init__(self, description: RobotDescription, posture: PostureParameters,
                 parameters: ModeParameters, legs: RobotLegs | None = None) -> None:
        """Build the parts."""
        self.posture = PostureController(description, posture, legs)
        self.modes = ModeManager(description, parameters, legs)

    def with_posture(self, parameters: PostureParameters) -> BodyControl:
        """Return the block with other gains of the balance; from the next step on they act."""
        other = copy(self)
        other.posture = PostureController(self.posture.description, parameters, self.posture.legs)
        return other

    def initial_state(self) -> BodyState:
        """State at the start."""
        return BodyState(self.modes.initial_state(), self.posture.initial_state())

    def picked_up(self, state: BodyState, measured: RobotState) -> BodyState:
        """State of a block that comes to a robot that has long begun."""
        return BodyState(self.modes.picked_up(state.mode, measured), state.balance)

    def request(self, state: BodyState, what: str) -> tuple[BodyState, ModeAnswer]:
        """Take a request; see :func:`~dmp_cpg_ros.core.modes.requests.request`."""
        mode, answer = request(self.modes, state.mode, what)
        return BodyState(mode, state.balance), answer

    def told_drive(self, state: BodyState, drive_mode: str) -> BodyState:
        """State that knows what the drives do by themselves: who is lowered by them does not stand
        any more, and has not fallen.
        """
        lowered = drive_mode == 'lie'
        if lowered == state.mode.lowered:
            return state
        return BodyState(replace(state.mode, lowered=lowered), state.balance)

    def step(self, state: BodyState, measured: RobotState, gait: GaitInForce, x: Array,
             x_dot: Array, r: Array, dt: float) -> tuple[BodyState, PostureFeedback]:
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
        mode = self.modes.step(state.mode, measured, x, x_dot, r, state.balance.activity)
        if mode.mode not in BALANCED:
            return (BodyState(mode, self.posture.initial_state()),
                    self.modes.feedback(mode, measured))
        balance, feedback = self.posture.step(
            state.balance, measured, gait, x, x_dot, r, dt, self.modes.command(mode))
        return BodyState(mode, balance), feedback
