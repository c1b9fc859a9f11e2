# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is told of the inhibition, and from which tick on it acts.

In lock-step what is told at a tick acts at the next one. In real time a message takes a time that
nobody knows beforehand: what acts when it arrives acts at a tick that was not predicted, and on
the oscillators at another one than on the reference. So it is told ahead: it acts a lead later,
for everybody at the same tick. What a push asks for does not wait.
"""

from __future__ import annotations

from typing import NamedTuple

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState


class Announced(NamedTuple):
    """The inhibition that acts, and those that are to.

    Attributes
    ----------
    acting : Inhibition
        At the tick that was asked for last.
    coming : tuple of (int, Inhibition)
        The stamps of the ticks from which others act [ns], in their order.
    """

    acting: Inhibition
    coming: tuple[tuple[int, Inhibition], ...] = ()

    @property
    def latest(self) -> Inhibition:
        """What was told last."""
        return self.coming[-1][1] if self.coming else self.acting

    @property
    def latest_ns(self) -> int:
        """Stamp of the tick from which it acts [ns]; 0 where it does."""
        return self.coming[-1][0] if self.coming else 0

    @property
    def stops(self) -> bool:
        """Whether the stop that was told last acts: the reference follows no command any more."""
        return self.acting.requested and all(each.requested for _, each in self.coming)

    def at(self, stamp_ns: int) -> Announced:
        """The same at a tick [ns]."""
        due = sum(from_ns <= stamp_ns for from_ns, _ in self.coming)
        return Announced(self.coming[due - 1][1], self.coming[due:]) if due else self

    def told(self, from_ns: int, inhibition: Inhibition) -> Announced:
        """With what is told now, in place of all that was to act at that tick or later."""
        return Announced(self.acting, (
            *(earlier for earlier in self.coming if earlier[0] < from_ns), (from_ns, inhibition)))

    def after(self, state: SupervisorState, inhibition: Inhibition, lead_ns: int) -> Announced:
        """With what whoever watches the stop tells at a state of his; what stops or runs the gait
        in another way does so a lead later, unless a push asks for it. What holds the legs as the
        stop that acts does takes the place of all that was to act between: a start that was taken
        back lets no leg go.
        """
        from_ns = self.latest_ns
        if state.push.acts:
            from_ns = 0
        elif self.coming and self.stops and inhibition.requested and inhibition.holds_as(
                self.acting):
            from_ns = self.coming[0][0]
        elif lead_ns and inhibition.differs(self.latest):
            from_ns = state.time_ns + lead_ns
        return self.told(max(from_ns, state.time_ns), inhibition)
