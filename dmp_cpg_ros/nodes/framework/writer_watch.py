# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One writer per topic: its messages are told from those of others by their numbers and stamps.

The middleware numbers the messages of every publisher from 1 on. rclpy of Jazzy hands that number
to callbacks and keeps the publisher's identity to itself, so a reader knows the writer of a topic
by a run of numbers that goes on, by no more than one for each tick of the robot's time. Somebody
else's message is behind it, or ahead of it, or has the stamp of a tick that has been written
already. Who the others are, the graph tells. Another publisher becomes the writer when the former
one is silent and nobody else is in the graph. In lock-step a writer repeats its last message for a
node that was restarted; that changes nothing for the others.

Who has sent exactly as many messages as the writer and is quicker at every tick passes: numbers
protect from mistakes and from what does not know them, DDS Security from the rest.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

SILENT_NS = 500_000_000
"""Time without a message of the writer after which another one may take over [ns]."""

REMEMBERED_NS = 2_000_000_000
"""Time for which a stranger is remembered after its last message [ns]."""

LEARNING = 50
"""Messages of a writer from which the length of a tick is learned."""

SHORTEST_TICK_NS = 500_000
"""Stamps of two ticks differ by so much at least [ns]."""

MADE_UP_NS, FASTEST = 500_000_000, 4
"""In real time: robot's time between two messages beyond that of the clock [ns], and how much
faster than the clock a robot's time may go.
"""

STALL_NS, MOST_OWED_NS = 100_000_000, 2_000_000_000
"""In real time: time without a message from which on what was sent meanwhile may come at once
[ns], and of how much robot's time that may be at most [ns].
"""

PROVEN = 5
"""Messages in a row, of nobody else, from which one of several publishers is the writer."""

LOST = 20
"""Messages in a row that may be lost of a writer that sends on change, or is not known yet."""


class WriterWatch:
    """Which messages of a topic are its writer's.

    Parameters
    ----------
    may_take_over : callable () → bool or None
        Whether the graph knows nobody who should not write this topic; None when it knows the
        writer too. Whoever sends some messages while all others are silent is the writer then.
    ticked : bool
        Whether the topic has one stamped message for every tick; else one for every change.
    lock_step : bool
        Whether no message is lost and robot's time does not keep to the clock.
    most_lost : float
        Messages in a row that may be lost as long as the length of a tick is not known.
    """

    __slots__ = ('_heard_ns', '_last', '_learned', '_lock_step', '_may_take_over', '_most_lost',
                 '_owed_ns', '_repeats', '_stamp_ns', '_stranger', '_stranger_ns', '_tick_ns',
                 '_ticked', '_tried')

    def __init__(self, may_take_over: Callable[[], bool | None], *, ticked: bool = True,
                 lock_step: bool = False, most_lost: float = LOST) -> None:
        """Know no writer yet."""
        self._most_lost = most_lost
        self._may_take_over, self._ticked, self._lock_step = may_take_over, ticked, lock_step
        self._stranger, self._stranger_ns = -1, -REMEMBERED_NS
        self._begin(0, 0, -SILENT_NS)

    def _begin(self, number: int, stamp_ns: int, now_ns: int) -> None:
        self._last, self._stamp_ns, self._heard_ns = number, stamp_ns, now_ns
        self._tick_ns, self._learned, self._repeats, self._owed_ns = 0, 0, 0, 0
        self._tried = (0, 0, 0)

    def admits(self, number: int | None, stamp_ns: int, now_ns: int) -> bool:
        """Whether a message is the writer's; True where the middleware does not number.

        Parameters
        ----------
        number : int or None
            Number that the message has among those of its publisher.
        stamp_ns : int
            Its stamp [ns]; of no meaning unless ticked.
        now_ns : int
            Time of its reception [ns].
        """
        ahead, passed_ns = (number or 0) - self._last, stamp_ns - self._stamp_ns
        if self._is_repeat(ahead, passed_ns):
            self._repeats = ahead
            return True
        silent = now_ns - self._heard_ns > SILENT_NS
        stranger = number is not None and number == self._stranger + 1
        if number is None or (self._continues(ahead, passed_ns, now_ns)
                              and not (silent and stranger)):
            self._take(number or 0, stamp_ns, now_ns)
            return True
        if silent:
            alone = self._may_take_over()
            if alone is None and not (self._ticked or self.known) and self._stranger < 0:
                return True  # nothing tells the writer from others before its topic has one
            if alone or (alone is None and self._ticked and not stranger):
                return self._takes_over(number, stamp_ns, now_ns, bool(alone))
        self._tried, self._stranger_ns = (0, 0, 0), now_ns
        if stranger or not (silent and self._ticked):
            self._stranger = number
        return False

    def _take(self, number: int, stamp_ns: int, now_ns: int) -> None:
        """Take a message of the writer, which tells how long a tick is."""
        ahead, passed_ns = number - self._last, stamp_ns - self._stamp_ns
        if ahead > 0 and (self._learned < LEARNING or passed_ns < ahead * self._tick_ns):
            self._learned += 1
            own_ns = passed_ns // max(1, ahead - self._repeats)
            self._tick_ns = min(self._tick_ns or own_ns, own_ns)
        self._repeats = 0
        gap_ns = max(0, now_ns - self._heard_ns)
        if self._owed_ns or gap_ns > STALL_NS:  # what comes in time again owes nothing
            more_ns = gap_ns if gap_ns > STALL_NS else -gap_ns
            self._owed_ns = min(max(0, self._owed_ns - passed_ns + more_ns), MOST_OWED_NS)
        self._last, self._stamp_ns = number, stamp_ns
        # What is sent again after a loss is received later than what waited behind it.
        self._heard_ns = max(self._heard_ns, now_ns)

    def _takes_over(self, number: int, stamp_ns: int, now_ns: int, alone: bool) -> bool:
        """Whether a message makes its publisher the writer: at once where it is alone, or nothing
        is lost, else after ``PROVEN`` of them in a row.
        """
        goes_on = number == self._tried[0] + 1 and stamp_ns > self._tried[1]
        self._tried = number, stamp_ns, 1 + (self._tried[2] if goes_on else 0)
        if not (alone or self._lock_step or self._tried[2] >= PROVEN):
            return False
        self._begin(number, stamp_ns, now_ns)
        if alone:  # whoever was one has left, or is the writer that has come back
            self._stranger = -1
        return True

    def forget(self) -> None:
        """Forget the writer, of which somebody knows that it was started again."""
        self._begin(0, 0, -SILENT_NS)

    @property
    def known(self) -> bool:
        """Whether the topic has had a writer."""
        return self._last > 0

    def may_admit(self, number: int | None, stamp_ns: int, now_ns: int) -> bool:
        """Whether :meth:`admits` can be true: False for most of what is not the writer's, which
        need not be read then, and is noted.
        """
        may = (number is None or now_ns - self._heard_ns > SILENT_NS
               or self._is_repeat(number - self._last, stamp_ns - self._stamp_ns)
               or self._continues(number - self._last, stamp_ns - self._stamp_ns, now_ns))
        if not may:
            self.refuse(number, now_ns)
        return may

    def refuse(self, number: int | None, now_ns: int) -> None:
        """Note a stranger's message: the next number is its sender's."""
        if number is not None and not self._ticked:
            self._tried, self._stranger, self._stranger_ns = (0, 0, 0), number, now_ns

    def has_strangers(self, now_ns: int) -> bool:
        """Whether strangers have been heard lately."""
        return now_ns - self._stranger_ns < REMEMBERED_NS

    def _is_repeat(self, ahead: int, passed_ns: int) -> bool:
        """Whether a message is one of the last two ticks that is told again."""
        return (self._lock_step and self._ticked and self._last > 0
                and -(self._tick_ns or inf) <= passed_ns <= 0 and ahead == self._repeats + 1)

    def _continues(self, ahead: int, passed_ns: int, now_ns: int) -> bool:
        """Whether a message can be the writer's next one, with losses before it perhaps."""
        if ahead < 1 or not self._last:
            return False
        if not self._ticked:
            # In lock-step a latched topic begins with what was told before its reader came, of
            # which the reader's queue keeps the newest. A gap is a loss where it cannot be one
            # of a stranger.
            beyond = self._last + ahead - self._stranger
            if self._stranger < 0:
                return self._lock_step or ahead <= self._most_lost
            return beyond != 1 and (ahead == 1 or (
                ahead <= self._most_lost and not 0 < beyond <= self._most_lost))
        if self._learned < LEARNING:
            return (ahead <= self._most_lost
                    and passed_ns >= (ahead - self._repeats) * SHORTEST_TICK_NS)
        if self._lock_step:
            return ahead <= self._repeats + 1 and passed_ns == self._tick_ns
        # A clock that is set back must not make the writer a stranger.
        # Ticks may all have been lost between those from which their length was learned.
        # What was held up by a stall of this process, or of the writer, comes at once, without
        # what its queue had no room for: messages that follow each other then may be far apart.
        shorter = ahead == 1 and not self.has_strangers(now_ns)
        return (SHORTEST_TICK_NS if shorter else ahead * self._tick_ns) <= passed_ns <= (
            FASTEST * max(0, now_ns - self._heard_ns) + MADE_UP_NS + self._owed_ns)
