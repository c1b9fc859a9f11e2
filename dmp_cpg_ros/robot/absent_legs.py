# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Legs whose targets act too late: how they go on meanwhile, and how they are followed again.

A leg that is late alone goes on with its part of the rhythm of the last cycle, while those that
are in time are followed: they feel the body, and keep it up. The rhythm keeps time with them, as
its period is only what the memory says of it. Where several are late all go on with it. A leg that
is back is followed once it is where the rhythm is, and the joints go over to it.
"""

from __future__ import annotations

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.demonstration import minimum_jerk
from dmp_cpg_ros.core.robot_model.state import JOINTS_OF_LEG, LEGS
from dmp_cpg_ros.robot.last_cycle import LastCycle, Rhythm

CARRIED_NS = 24_000_000
"""Age up to which late targets are carried on by their own velocity [ns]."""

IN_TIME_NS = 60_000_000
"""Time for which targets must have been in time again until they are followed again [ns]: those
that come now and then only tell what was, and to follow them each time tears at the feet.
"""

SETTLED_NS = 500_000_000
"""Time since all legs have been followed again from which they may all go on with the cycle of
before that disturbance [ns]. Sooner they do not balance with it: of trots at 50 Hz whose legs were
silent again 0.2 to 0.6 s later four of twelve fell.
"""

SEVERAL_NS = 100_000_000
"""Time for which several legs that are not settled may go on with it [ns], where it was one at
first.
"""

IN_STEP_NS = 200_000_000
"""Least time that legs have, which are in time again, until the rhythm is in step with them [ns].
"""

APART, AHEAD_S = 0.2, 0.1
"""How far a leg that comes back to a robot in motion may be from its rhythm [rad], and in how much
time it must not be three times as far [s]: feet touch down a little earlier or later. Legs that
had not been away were so by 0.10 rad and 0.43 rad at most, a robot's stance by 0.38 and 0.72 rad.
"""

TAKEN_UP_S = 0.3
"""Time in which joints go over to targets that are followed again [s]."""

JOINTS = tuple(slice(len(JOINTS_OF_LEG) * i, len(JOINTS_OF_LEG) * (i + 1))
               for i in range(len(LEGS)))
"""Joints of each leg."""


class AbsentLegs:
    """Which legs are away, and what their joints do until they are followed again.

    Parameters
    ----------
    memory : LastCycle
        What the legs have sent.
    patience_ns : int
        Time after which a leg that is back, but elsewhere in the gait, is waited for no longer
        [ns].

    Attributes
    ----------
    rhythm : Rhythm or None
        With which they go on.
    since_ns : int
        Since when one of them has been away [ns]; 0: all are here.
    """

    def __init__(self, memory: LastCycle, patience_ns: int) -> None:
        """Begin with all of them."""
        self._memory, self._patience_ns = memory, patience_ns
        self.rhythm: Rhythm | None = None
        self._off = np.zeros(len(LEGS) * len(JOINTS_OF_LEG))
        self._taken_ns, self._taking_s = [0] * len(LEGS), [TAKEN_UP_S] * len(LEGS)
        self.all_here()

    def all_here(self) -> None:
        """Forget who has been away, of a robot that has looked after itself: what it did before
        is no cycle of what it does then.
        """
        self.since_ns, self._followed_ns, self._several = 0, 0, (0, -IN_TIME_NS)
        self._late_ns, self._away_ns = [0] * len(LEGS), [0] * len(LEGS)

    def look(self, *, of_before: bool = False) -> None:
        """Look for the rhythm, while nobody is away; where there is none that of before may do."""
        self.rhythm = self._memory.rhythm(of_before=of_before)

    def watch(self, now: int, ages: list[int]) -> None:
        """Note who is late, by the ages of the legs' targets [ns]; two, whose controllers starve,
        take the others with them: what these do for two that are elsewhere throws a trot over.
        """
        late = [age > CARRIED_NS for age in ages]
        alone = sum(late) == 1
        if not self.since_ns:
            self.look(of_before=alone or self._settled(now))
        of_before = self.rhythm is not None and self.rhythm.of_before
        if of_before and not alone and not self._settled(self.since_ns or now):
            since, last = self._several
            self._several = since if now - last < IN_TIME_NS else now, now
        for i, so in enumerate(late):
            if so or not (alone or of_before):
                self._late_ns[i] = now
                self._away_ns[i] = self._away_ns[i] or now
                self.since_ns = self.since_ns or now

    def _settled(self, now: int) -> bool:
        """Whether all legs had been followed again for long enough when the first was late."""
        return 0 < self._followed_ns < now - SETTLED_NS

    def go_on(self, now: int, targets: Array, given: Array) -> bool:
        """Let those who are away go on.

        Parameters
        ----------
        now : int
            Stamp [ns].
        targets : ndarray (3, 12)
            Position, velocity and effort of all joints by the newest targets; changed in place.
        given : ndarray (12,)
            Positions that were given last [rad].

        Returns
        -------
        bool
            False where one has been elsewhere for too long, or several have nothing to go on with.
        """
        since, last = self._several
        if last == now > since + SEVERAL_NS:
            return False
        in_time = [now - late_ns > IN_TIME_NS for late_ns in self._late_ns]
        here = [i for i, away_ns in enumerate(self._away_ns) if not away_ns] or [
            i for i, so in enumerate(in_time) if so]
        going = targets.copy()
        if self.rhythm is not None:
            self.rhythm.keep_time(now, [(JOINTS[i], targets[:2, JOINTS[i]]) for i in here])
            going = self.rhythm.at(now)
        away = [i for i, away_ns in enumerate(self._away_ns) if away_ns]
        back = [i for i in away if in_time[i]]
        in_step = not any(_elsewhere((targets - going)[:2, JOINTS[i]]) for i in back)
        for i in away:
            of = JOINTS[i]
            if in_time[i] and in_step:
                self._away_ns[i], self._taken_ns[i], self._taking_s[i] = 0, now, TAKEN_UP_S
                self._off[of] = given[of] - targets[0, of]
            elif (now - self._away_ns[i] > self._patience_ns
                  and now - self._late_ns[i] > IN_TIME_NS + IN_STEP_NS):
                return False
            else:
                targets[:, of], self._taken_ns[i] = going[:, of], 0
                if self.rhythm is not None:
                    self._memory.went_on(i, now, going[:, of])
        self.since_ns = min(filter(None, self._away_ns), default=0)
        if not self.since_ns and self.rhythm is not None and (
                self._followed_ns or not self.rhythm.of_before):
            self._followed_ns = now
        return True

    def take_up(self, now: int, off: Array, seconds: float) -> None:
        """Go over to the targets of all legs within a time [s], from where the joints are off them
        [rad].
        """
        self._off = off
        self._taken_ns, self._taking_s = [now] * len(LEGS), [seconds] * len(LEGS)

    def taking_up(self, now: int, position: Array) -> bool:
        """Add to positions (12,) [rad] by how much joints are still off; whether any are."""
        if not any(self._taken_ns):
            return False
        for i, (taken_ns, seconds) in enumerate(zip(self._taken_ns, self._taking_s, strict=True)):
            if taken_ns and now - taken_ns < seconds * 1e9:
                position[JOINTS[i]] += (
                    1.0 - share(now - taken_ns, seconds)) * self._off[JOINTS[i]]
            else:
                self._taken_ns[i] = 0
        return any(self._taken_ns)


def _elsewhere(apart: Array) -> bool:
    """Whether a leg whose angles and rates, (2, 3), are so far from the rhythm is, or is about to
    be, elsewhere in the gait than the robot, which would be torn out of its stride.
    """
    off, rate = apart
    return bool(np.abs(off).max() > APART or np.abs(off + AHEAD_S * rate).max() > 3.0 * APART)


def share(time_ns: int, seconds: float, order: int = 0) -> float:
    """Share of a movement of least jerk that is done after a time [ns], or its derivative."""
    s = min(max(time_ns * 1e-9 / seconds, 0.0), 1.0)
    return 30.0 * (s * (1.0 - s)) ** 2 if order else float(minimum_jerk(np.array(s)))
