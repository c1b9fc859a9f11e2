# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``posture_control``: virtual-model feedback torques and foot placement from the body's state."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

from dmp_cpg_ros.core.estimation_parameters import EstimationParameters
from dmp_cpg_ros.core.leg_primitive import LegParameters
from dmp_cpg_ros.core.posture import PostureController, PostureParameters
from dmp_cpg_ros.core.suite_parameters import NODE_PARAMETERS
from dmp_cpg_ros.nodes.body_state import BodyState
from dmp_cpg_ros.nodes.conversions import (
    CanonicalStateReader,
    PostureFeedbackWriter,
    read_reference,
)
from dmp_cpg_ros.nodes.executors import run_node
from dmp_cpg_ros.nodes.gait_setup import GaitReader, description_of
from dmp_cpg_ros.nodes.managed_node import ManagedNode
from dmp_cpg_ros.nodes.message_values import header_ns
from dmp_cpg_ros.nodes.ros_parameters import LockStepParameters


class PostureControl(ManagedNode):
    """Balances the body: torques for the stance legs, placement for the swinging feet."""

    KIND = 'posture_control'
    PARAMETER_SETS = (*NODE_PARAMETERS[KIND], LockStepParameters)
    # The rate of the swings' activity is the legs' too, and the certificate's.
    CHANGEABLE = tuple(name for cls in (PostureParameters, EstimationParameters)
                       for name in cls.__dataclass_fields__
                       if name not in LegParameters.__dataclass_fields__)

    def configure(self) -> None:
        """Build the controller and its topics."""
        gaits, canonical = GaitReader(self), CanonicalStateReader()
        description = description_of(self)
        self._controller = PostureController(
            description, gaits.gait, self.parameters_of(PostureParameters)
        )
        self._body = BodyState(self, description)
        self._memory, self._last_ns = self._controller.initial_state(), -1
        self._writer, self._publisher = PostureFeedbackWriter(), self.publisher('posture_feedback')
        self._ticks = self.match(
            (*self._body.inputs, 'reference', 'canonical_state'),
            'canonical_state',
            optional=self._body.optional,
            lock_step=self.parameters_of(LockStepParameters).lock_step,
        )
        readers: dict[str, Callable[[Any], Any]] = {
            **self._body.readers,
            'reference': read_reference,
            'canonical_state': lambda message: (
                *canonical.read(message),
                gaits.read(message.header.frame_id),
            ),
        }
        for name, read in readers.items():
            self.listen(name, self._taking(name, read))

    def _taking(self, name: str, read: Callable[[Any], Any]) -> Callable[[Any], None]:
        return lambda message: self._ticks.add(name, header_ns(message), read(message))

    def on_parameters(self) -> None:
        """Take over the gains."""
        self._controller.parameters = self.parameters_of(PostureParameters)
        self._body.on_parameters()

    def diagnostic_values(self) -> Mapping[str, Any]:
        """Tell what the estimator found out about the robot and its ground."""
        return self._body.diagnostic_values()

    def on_tick(self, stamp_ns: int, values: dict[str, Any]) -> None:
        """Compute the feedback for the stamp of the canonical state."""
        dt = (stamp_ns - self._last_ns) * 1e-9 if 0 <= self._last_ns < stamp_ns else 0.0
        self._last_ns = stamp_ns
        state = self._body.state(stamp_ns, values)
        x, x_dot, self._controller.gait = values['canonical_state']
        self._memory, feedback = self._controller.step(
            self._memory, state, x, x_dot, values['reference'], dt
        )
        self._publisher.publish(self._writer.fill(stamp_ns, feedback))


def main() -> int:
    """Run the node."""
    return run_node(PostureControl)


if __name__ == '__main__':
    sys.exit(main())
