# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A walking loop of oscillators, reference and stop alone, where the body does not matter."""

from __future__ import annotations

from dmp_cpg_ros.core.balance.controller import PostureController, PostureFeedback, PostureState
from dmp_cpg_ros.core.loop import WalkingLoop
from dmp_cpg_ros.core.robot_model.state import LegTargets

NO_TARGETS = LegTargets((0.0,) * 3, (0.0,) * 3, (0.0,) * 3)
NO_FEEDBACK = PostureFeedback((0.0,) * 12, ((0.0,) * 3,) * 4, ((0.0,) * 2,) * 4, (0.0,) * 3)


class LimblessLoop(WalkingLoop):
    """A walking loop without legs and balance, of which the rest knows nothing."""

    def _leg(self, *_: object) -> LegTargets:
        return NO_TARGETS


class NoBalance(PostureController):
    def step(self, memory: PostureState, *_: object) -> tuple[PostureState, PostureFeedback]:
        return memory, NO_FEEDBACK
