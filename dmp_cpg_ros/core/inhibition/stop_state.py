# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a stop or a start after a tick."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dmp_cpg_ros.core.clock import carried
from dmp_cpg_ros.core.inhibition.blocked import NO_BLOCK, BlockState
from dmp_cpg_ros.core.inhibition.push_recovery import NO_PUSH, PushState
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.voting.votes import NO_VOTES, Tally


@dataclass(frozen=True)
class SupervisorState:
    """State of the supervisor after a tick.

    Attributes
    ----------
    time_ns : int
        Stamp of the tick [ns].
    state : str
        One of :data:`~dmp_cpg_ros.core.inhibition.supervisor.STATES`.
    requested : bool
        Whether the gait is to stop: asked for, or voted, and no push keeps it from it.
    automatic : bool
        Whether the stop was asked for by ``auto_inhibit`` (or by starting at rest) and not by a
        service call.
    request_ns : int
        Stamp at which the present stop or start was requested [ns].
    armed : bool
        Whether the inhibition's gains are on.
    activity : tuple of four floats
        Swing activity of the legs.
    measured_s : float
        Time from the request to rest or to phase lock [s]; NaN until then.
    idle_ns : int
        Stamp since which the command has been zero [ns]; −1 while it is not.
    asked : bool
        Whether the service or ``auto_inhibit`` asks for the stop.
    voted : bool
        Whether votes hold the stop.
    vote_gains : ndarray (4,)
        Largest gains of the votes since then [1/s]: what holds the gait does not fade.
    tally : Tally
        Votes of this tick.
    push : PushState
        Whether a push has released the gait from a stop.
    leg : int
        Leg that is inhibited where it is chosen.
    rest_phase : float
        Phase of fl at rest [rad].
    share, quickness : float
        Share of the command that the reference follows, and factor on the cadence.
    fastest : float
        That the reference has been lately [m/s].
    block : BlockState
        Whether the robot makes way, and whether it has stopped because it does not.
    """

    time_ns: int
    state: str
    requested: bool
    automatic: bool
    request_ns: int
    armed: bool
    activity: tuple[float, ...]
    measured_s: float = float('nan')
    idle_ns: int = -1
    asked: bool = False
    voted: bool = False
    vote_gains: Array = field(default_factory=lambda: np.zeros(len(LEGS)))
    tally: Tally = NO_VOTES
    push: PushState = NO_PUSH
    leg: int = 0
    rest_phase: float = 0.0
    share: float = 1.0
    quickness: float = 1.0
    fastest: float = 0.0
    block: BlockState = NO_BLOCK

    @property
    def in_force(self) -> bool:
        """Whether a stop is in force, a push or not: the reference is zero."""
        return self.requested or self.push.acts

    @property
    def holds(self) -> bool:
        """Whether inhibition holds the legs."""
        return self.armed and self.state in ('captured', 'at_rest')

    def carried(self, now_ns: int) -> SupervisorState:
        """The same on a clock that was set back, see :func:`~dmp_cpg_ros.core.clock.carried`."""
        idle_ns, request_ns = (carried(stamp, self.time_ns, now_ns)
                               for stamp in (self.idle_ns, self.request_ns))
        return replace_unchecked(self, idle_ns=idle_ns, request_ns=request_ns,
                                 push=self.push.carried(self.time_ns, now_ns))
