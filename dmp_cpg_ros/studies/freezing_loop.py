# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Baselines of a stop: all phases freeze at once, or each leg's after its swing.

- *freeze*: all phases stop at once, and every leg holds the joint targets that it has.
- *finish swing*: a leg that stands stops at once; a leg that swings goes on to its touchdown.

In both the reference is brought to zero as usual, the balance of the body works as usual, and no
oscillator is coupled or inhibited until the gait is resumed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.core.balance.controller import PostureFeedback
from dmp_cpg_ros.core.canonical.phase import phase, phase_generator, state_at
from dmp_cpg_ros.core.loop import Array, Tick, WalkingLoop
from dmp_cpg_ros.core.primitives.spring_damper import SpringState
from dmp_cpg_ros.core.robot_model.state import LEGS, LegTargets, RobotState


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

    def tick(self, state: RobotState) -> Tick:
        """Run all parts on the robot's state of one tick, as :meth:`WalkingLoop.tick`."""
        if self._frozen is None:
            return super().tick(state)
        dt = self._clock.step(state.time_ns)
        self.stop = replace(self.stop, time_ns=state.time_ns)
        stopping = replace(self.inhibition, requested=True)
        self.r = self.reference.towards(self.r, (0.0, 0.0, 0.0), stopping, dt)
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
             dt: float) -> LegTargets:
        """Targets of one leg: those of its primitive, or those that it froze with."""
        if self._frozen is None or not self._frozen[i]:
            return super()._leg(i, state, x_dot, feedback, dt)
        leg, joints, of_leg = self.legs[i].primitive, self.legs[i].joints, self.leg_states[i].leg
        position, zero = of_leg.joints.position, (0.0,) * 3
        held = of_leg._replace(joints=SpringState(position, zero))
        self.leg_states[i] = self.leg_states[i]._replace(leg=held)
        measured = None
        if leg.parameters.reading == 'torque':
            measured = SpringState(*(tuple(of[joints].tolist()) for of in (
                state.joint_position, state.joint_velocity)))
        return leg.targets(held, position, zero, feedback.torque[joints], measured)
