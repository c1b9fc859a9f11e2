# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``posture_control``: mode of the body, and the torques that balance it while it stands."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

from std_msgs.msg import String

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.estimation.parameters import EstimationParameters
from dmp_cpg_ros.core.modes.body_control import BodyControl
from dmp_cpg_ros.core.modes.manager import ModeParameters
from dmp_cpg_ros.core.modes.requests import REQUESTS
from dmp_cpg_ros.core.robot_model.kinematics import RobotLegs
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.nodes.framework.execution import run_node
from dmp_cpg_ros.nodes.framework.gaits import description_of, follow_gait, known_gaits
from dmp_cpg_ros.nodes.framework.parameters import LockStepParameters
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.nodes.inputs.body_state import BodyState
from dmp_cpg_ros.nodes.messages.conversions import (
    CanonicalStateReader,
    PostureFeedbackWriter,
    read_reference,
)
from dmp_cpg_ros.suite_table import KINDS, POSTURE


class PostureControl(SuiteNode):
    """Balances the body: torques for the stance legs, placement for the swinging feet.

    Decides its mode, too: stands it up, lays it down, notices a fall, brings it back.
    """

    KIND = POSTURE
    PARAMETER_SETS = (*KINDS[KIND].sets, LockStepParameters)
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
        self._mode_publisher = self.publisher('body_mode')
        self._writer, self._publisher = PostureFeedbackWriter(), self.publisher('posture_feedback')
        self.match('canonical_state', {
            **self._body.readers,
            'reference': read_reference,
            'canonical_state': canonical.read,
        }, optional=self._body.optional)
        for what in REQUESTS:
            self.serve(what, self._answering(what))

    def activate(self) -> None:
        """Tell late joiners the mode from the start."""
        self._tell()

    def on_parameters(self) -> None:
        """Take over the gains."""
        self._control = self._control.with_posture(self.parameters_of(PostureParameters))
        self._body.on_parameters()

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Compute the feedback for the stamp of the canonical state."""
        state = self._body.state(stamp_ns, values)
        x, x_dot, gait = values['canonical_state']
        follow_gait(self, gait)
        self._state, feedback = self._control.step(
            self._state, state, gait, x, x_dot, values['reference'], self.elapsed)
        self._publisher.publish(self._writer.fill(stamp_ns, feedback))
        self._tell()

    def diagnostic_values(self) -> Mapping[str, Any]:
        """What the body does and why, and what the estimator found out."""
        condition = self._state.mode.condition
        measured = {} if condition is None else {
            name: getattr(condition, name) for name in ('tilt', 'height', 'support')}
        return {
            'body_mode': self._state.mode.mode,
            'reason': self._state.mode.reason,
            **measured,
            **self._body.diagnostic_values(),
        }

    def _answering(self, what: str) -> Callable[[Any, Any], Any]:
        """Take a request; the answer says what will happen from the next tick on, or why not."""

        def answer(request: Any, response: Any) -> Any:
            if not self.active:
                response.success = False
                response.message = f'posture_control is {self.state_label}, not active'
                return response
            self._state, given = self._control.request(self._state, what)
            response.success, response.message = given.accepted, given.text
            return response

        return answer

    def _tell(self) -> None:
        """Publish and log a new mode; a fall is an error until it is over."""
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


def main() -> int:
    """Run the node."""
    return run_node(PostureControl)


if __name__ == '__main__':
    sys.exit(main())
