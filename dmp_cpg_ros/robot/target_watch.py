# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Targets that no leg sends: those that jump, and those that repeat while they move.

Targets tell the same motion twice: over a time t an angle changes by the mean velocity times t. In
walks on ``config/robots`` they have differed by 0.0012 rad in a tick of 4 ms at most, but for
joints whose angle or velocity was cut at its limit, which are not judged until they have caught
up. What breaks that by more is no motion: a robot that does not follow it goes on with the rhythm
of its last cycle, as if the leg were silent, and stops.

The leg is believed again once its jumps have cancelled each other, as those of an offset that
comes and goes, or once it rests: then it is somebody's step, and the robot stands.
"""

from __future__ import annotations

from dmp_cpg_ros.core.robot_model.description import LegGeometry
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, JointTargets

APART, PULL = 0.04, 1000.0
"""Change of a target apart from what its velocity says [rad], more by that [rad/s²] times the
squared time between two of them, that is a jump.
"""

CANCELLED = 0.03
"""Sum of jumps that is none [rad]: the offset that came has gone."""

RESTING, RESTS_NS = 0.3, 100_000_000
"""Speed of a target up to which a leg rests [rad/s], and for how long it must have rested to be
believed [ns].
"""

NEAR = 1e-6
"""Distance from a limit at which a target is cut at it [rad], [rad/s]."""

CAUGHT_UP = 0.01
"""Difference at which an angle that lagged behind its velocity has caught up [rad]."""

NOTHING = [0.0] * len(JOINTS_OF_LEG)
"""No jump."""


class TargetWatch:
    """Watches the targets of one leg.

    Parameters
    ----------
    leg : LegGeometry
        The leg, for the limits of its joints.
    gap_ns : int
        Time without targets after which there is nothing to compare them with [ns].

    Attributes
    ----------
    doubted_ns : int
        Stamp of the last targets that were not believed [ns]; -1: none.
    """

    def __init__(self, leg: LegGeometry, gap_ns: int) -> None:
        """Begin without targets."""
        self._limits = list(zip(leg.position_lower.tolist(), leg.position_upper.tolist(),
                                leg.velocity_limit.tolist(), strict=True))
        self._gap_ns, self._uneasy_ns = gap_ns, -1
        self._stamp_ns: int | None = None
        self._position: list[float] = []
        self._velocity = self._jumped = NOTHING
        self._cut = [False] * len(JOINTS_OF_LEG)
        self.doubted_ns = -1

    def believes(self, stamp_ns: int, targets: JointTargets) -> bool:
        """Whether targets are such as a leg sends.

        Parameters
        ----------
        stamp_ns : int
            Of the targets, later than that of the last ones [ns].
        targets : JointTargets
            Arrays (3,), finite.
        """
        position, velocity = targets.position.tolist(), targets.velocity.tolist()
        rests, last_ns = max(map(abs, velocity)) <= RESTING, self._stamp_ns
        if position == self._position and not rests:
            self.doubted_ns = stamp_ns
            return False
        if last_ns is None or stamp_ns - last_ns > self._gap_ns:
            self._jumped = NOTHING
        else:
            self._jumped = self._jumps(
                stamp_ns, 1e-9 * (stamp_ns - last_ns), position, velocity, rests)
        self._stamp_ns, self._position, self._velocity = stamp_ns, position, velocity
        if self._jumped is NOTHING:
            return True
        self.doubted_ns = stamp_ns
        return False

    def _jumps(self, stamp_ns: int, dt: float, position: list[float], velocity: list[float],
               rests: bool) -> list[float]:
        """Sum of the jumps [rad], with those since the last targets, a time dt [s] before."""
        most, total, jumps = APART + PULL * dt * dt, self._jumped, False
        for i, (q, before, rate, rate_before, (low, high, fastest)) in enumerate(zip(
                position, self._position, velocity, self._velocity, self._limits, strict=True)):
            apart = q - before - 0.5 * dt * (rate + rate_before)
            self._cut[i] = (
                min(abs(q - low), abs(q - high), abs(before - low), abs(before - high),
                    abs(abs(rate) - fastest), abs(abs(rate_before) - fastest)) <= NEAR
                or (self._cut[i] and not -CAUGHT_UP <= apart <= CAUGHT_UP))
            if not (self._cut[i] or -most <= apart <= most):
                jumps, total = True, [*total[:i], total[i] + apart, *total[i + 1:]]
        if jumps or not rests:
            self._uneasy_ns = stamp_ns
        gone = (max(map(abs, total)) <= CANCELLED
                or stamp_ns - self._uneasy_ns >= RESTS_NS)
        return NOTHING if gone else total
