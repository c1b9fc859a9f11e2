# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a simulated robot lets wall time pass, as its controllers are too slow for real time.

A robot that runs ahead of controllers that cannot keep up is answered later and later: what it
publishes meanwhile is worked off, too, and while it looks after itself nothing ever acts in time
again. While it waits they catch up. Nobody is waited for who does not answer.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from dmp_cpg_ros.core.robot_model.state import LEGS

FUTILE_NS = 500_000_000
"""Time for which a leg is not waited for that has not answered [ns]: targets that are always late,
as over a slow link, do not come any sooner for it.
"""


def acts_too_long(age_ns: int, tick_ns: int, longest_ns: int) -> bool:
    """Whether targets of an age beyond their time would act for longer than they may by the end of
    the coming tick [ns]; new ones never do, nor any where ``longest_ns`` is 0.
    """
    return age_ns > 0 and 0 < longest_ns < age_ns + tick_ns


@dataclass
class SlowMotion:
    """Which legs a robot waits for.

    Attributes
    ----------
    tick_ns : int
        Time between two states [ns].
    longest_ns : int
        How long beyond their time targets may act [ns]; 0: the robot never waits.
    lead_ns : int
        Time after its stamp at which a target acts [ns].
    patience_ns : int
        Wall time without an answer of a leg after which it is not waited for [ns].
    """

    tick_ns: int
    longest_ns: int
    lead_ns: int
    patience_ns: int
    _heard: dict[str, tuple[int, int]] = field(default_factory=dict)
    _in_vain: dict[str, int] = field(default_factory=dict)

    def hear(self, leg: str, stamp_ns: int, wall_ns: int) -> None:
        """Take note of targets of a leg, whatever they are, and of when they came."""
        self._heard[leg] = stamp_ns, wall_ns

    def waits(self, now_ns: int, wall_ns: int) -> bool:
        """Whether to wait at a stamp; a leg that has never sent any targets is no reason to."""
        if len(self._heard) < len(LEGS):
            return False
        awaited = False
        for leg, (stamp_ns, came_ns) in self._heard.items():
            if not acts_too_long(now_ns - stamp_ns - self.lead_ns, self.tick_ns, self.longest_ns):
                continue
            if wall_ns - came_ns > self.patience_ns:
                self._in_vain[leg] = wall_ns + FUTILE_NS
            awaited |= wall_ns >= self._in_vain.get(leg, 0)
        return awaited
