# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The body's mode around the posture controller, the same in the node and in the plain loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.phase import phase_rate
from dmp_cpg_ros.core.inhibition.supervisor import REST_ACTIVITY, REST_PHASE_RATE, REST_SPEED
from dmp_cpg_ros.core.maths.updated import updated
from dmp_cpg_ros.core.modes.body_command import BALANCED
from dmp_cpg_ros.core.modes.body_condition import BodySense
from dmp_cpg_ros.core.modes.body_mode import BodyModes, ModeParameters, ModeState
from dmp_cpg_ros.core.modes.body_requests import ModeAnswer, request
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.robot_model.legs import RobotLegs
from dmp_cpg_ros.core.robot_model.state import RobotState
from dmp_cpg_ros.core.transformation.leg import body_scale

Array = NDArray[np.float64]


class BodyControl:
    """Decides the body's mode, and says what the legs get while nobody balances.

    Parameters
    ----------
    description : RobotDescription
        The robot.
    parameters : ModeParameters
        Start, fall detection, recovery.
    legs : RobotLegs, optional
        The robot's legs, where others ask them too.
    """

    def __init__(
        self, description: RobotDescription, parameters: ModeParameters,
        legs: RobotLegs | None = None,
    ) -> None:
        """Build the parts."""
        self.modes = BodyModes(description, parameters)
        self._sense, self._scale = BodySense(description, legs), body_scale(description)

    def initial_state(self) -> ModeState:
        """State at the start."""
        return self.modes.initial_state()

    def request(self, state: ModeState, what: str) -> tuple[ModeState, ModeAnswer]:
        """Take a request; see :func:`~dmp_cpg_ros.core.modes.body_requests.request`."""
        return request(self.modes, state, what)

    def step(
        self, mode: ModeState, state: RobotState, x: Array, x_dot: Array, r: Array,
        activity: Array,
    ) -> ModeState:
        """Advance the mode to the tick of a measured state.

        Parameters
        ----------
        mode : ModeState
            After the last tick, requests included.
        state : RobotState
            Measured.
        x, x_dot : ndarray (4, 2)
            Canonical states and rates.
        r : ndarray (3,)
            Reference.
        activity : ndarray (4,)
            Swing activity of the legs at the tick before.
        """
        at_rest = mode.mode == 'stopping' and self._rests(x, x_dot, r, activity)
        return self.modes.step(mode, self._sense.condition(state), state.time_ns, at_rest)

    def _rests(self, x: Array, x_dot: Array, r: Array, activity: Array) -> bool:
        """Whether phases, reference and swings rest."""
        return (
            self._scale.foot_speed(float(r[0]), float(r[1]), float(r[2])) <= REST_SPEED
            and float(np.abs(phase_rate(x, x_dot)).max()) <= REST_PHASE_RATE
            and float(activity.max()) <= REST_ACTIVITY
        )

    def balances(self, mode: ModeState) -> bool:
        """Whether the posture controller balances in a mode."""
        return mode.mode in BALANCED

    def labelled(self, mode: ModeState, feedback: PostureFeedback) -> PostureFeedback:
        """Feedback of the posture controller with the mode's name."""
        return feedback if feedback.mode == mode.mode else updated(feedback, mode=mode.mode)

    def feedback(self, mode: ModeState, state: RobotState) -> PostureFeedback:
        """What the legs get while the posture controller does not balance."""
        torque = self._sense.carrying_torque(state, self.modes.carried(mode))
        text = self.modes.command(mode).text
        return PostureFeedback(
            torque, np.zeros((4, 3)), np.zeros((4, 2)), np.zeros(3), text,
            state.joint_position.copy(),
        )
