# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Matching of messages by stamp into the inputs of one tick, in any order of arrival.

The class does not depend on ROS, so that its rules can be tested by themselves; :func:`drain`
takes any rclpy subscription.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from dmp_cpg_ros.core.clock import RESET_NS

TickCallback = Callable[[int, dict[str, Any]], None]

AHEAD_NS = 2_000_000_000
"""A stamp that lies further ahead of the last tick is of a clock that was set, or false [ns]."""

CONFIRMED = 3
"""In real time: messages of the trigger in a row that must agree on another time before it is
believed.
"""

PENDING_TICKS = 64
"""Ticks that may be incomplete at one time; older ones are forgotten. What a trigger that is late
finds gone is replaced by what came later: sensors that bear another stamp count as silent.
"""

PATIENCE = 3
"""In real time: ticks in a row that an input may miss before ticks stop waiting for it."""

HOLD_TICKS = 8
"""In real time: later ticks that may be triggered while one waits for an input that is late."""


class TickInputs:
    """Collects the inputs of each tick and calls back once per tick, in the order of the stamps.

    In lock-step a tick fires when every input with its stamp is there, and every delayed input
    with the stamp of the tick before (at the first tick delayed inputs are what came before it, or
    None). The trigger of a tick that comes again is passed on to ``on_repeat``. A node that is
    restarted is told of the last two ticks again: it begins with the former, of which somebody may
    lack what it has said, or with the latter if only that is told again; and it does not wait for
    what is missing of a tick if it is told again of a later one, for which all have ended it. In
    real time a tick fires the same way, or else with the newest value of each input that does not
    come: that was lost, for a later one of its kind is there; that is silent; or for which
    ``HOLD_TICKS`` later ticks have waited. A node that stalls so delays those behind it instead of
    being left behind.

    Every writer sends its stamps in rising order during one run of the robot, and its messages
    keep their order. So a message that lies behind the last tick, but beyond what its writer told
    before, is late and nothing else. Without the trigger there is no tick: only it can tell that
    the clock was set, by messages that lie before what it told itself, or too far ahead. What
    others tell beyond their own last message is of this run, however far the trigger is behind.

    Parameters
    ----------
    on_tick : callable (stamp_ns, values)
        Called with the stamp [ns] and a dict from the name of each input to its value.
    inputs : sequence of str
        Inputs that bear the stamp of the tick.
    trigger : str
        The input without which there is no tick; one of ``inputs``.
    delayed : sequence of str
        Inputs that act one tick later. In real time the one that arrived last acts.
    optional : sequence of str
        Of ``inputs``: those without which a tick may run in real time; their value is None until
        the first arrives.
    lock_step : bool
        Whether ticks wait for exact stamps.
    on_repeat : callable (stamp_ns), optional
        Called in lock-step when the trigger of a tick that has fired, or of one that waits, comes
        again.
    """

    def __init__(self, on_tick: TickCallback, inputs: Sequence[str], trigger: str, *,
                 delayed: Sequence[str] = (),
                 optional: Sequence[str] = (), lock_step: bool = False,
                 on_repeat: Callable[[int], None] = lambda _: None) -> None:
        """Start without any message."""
        others = set(inputs) - {trigger}
        if trigger not in inputs or not set(optional) <= others or set(delayed) & set(inputs):
            raise ValueError('trigger and optional inputs must be inputs, delayed ones must not')
        self._on_tick, self._inputs, self._trigger = on_tick, tuple(inputs), trigger
        self._delayed, self._optional, self._lock_step = tuple(delayed), optional, lock_step
        self._on_repeat = on_repeat
        self._others = tuple(name for name in inputs if name != trigger)
        self._held: dict[str, Any] = dict.fromkeys(delayed)
        self._astray: dict[str, deque[tuple[int, Any]]] = {}
        self.ignored = 0
        self.reset()

    def reset(self) -> None:
        """Forget all ticks and their messages.

        What was counted stays, and so do delayed inputs in real time: those are sent when they
        change.
        """
        self._pending: dict[int, dict[str, Any]] = {}
        self._newest: dict[str, tuple[int, Any]] = {}
        self._late: dict[str, dict[int, Any]] = {name: {} for name in self._delayed}
        self._missed = dict.fromkeys(self._inputs, 0)
        self._told_again = set[int]()
        self.last_ns: int | None = None
        self._near_ns: int | None = None  # the last tick, or what the trigger began anew with

    def add(self, name: str, stamp_ns: int, value: Any) -> bool:
        """Take a message; ticks that it completes are fired before this returns.

        Parameters
        ----------
        name : str
            Input.
        stamp_ns : int
            Stamp of the message [ns].
        value : object
            Its content.

        Returns
        -------
        bool
            Whether the stamp can be of this robot's run. When ``CONFIRMED`` messages in a row of
            the trigger, and none of this run between them, agree on another time, the robot has
            started again, and ticks begin anew with what has come of that time.
        """
        if name in self._held:
            self._add_delayed(name, stamp_ns, value)
            return True
        near, last = self._near_ns, self.last_ns
        if near is not None and not -RESET_NS < stamp_ns - near <= AHEAD_NS:
            newest_ns = self.newest_ns(name)
            if newest_ns - RESET_NS < stamp_ns < near:
                self.ignored += 1
                return True
            if name == self._trigger or not near < newest_ns < stamp_ns <= newest_ns + AHEAD_NS:
                return self._follow_clock(name, stamp_ns, value)
        if self._astray:
            self._astray = {}
        newest = self._newest.get(name)
        if newest is not None and stamp_ns <= newest[0] - RESET_NS:
            self._take_back(name, stamp_ns)
            newest = None
        if newest is None or stamp_ns > newest[0]:
            self._newest[name] = (stamp_ns, value)
            if last is None or stamp_ns >= last:
                self._missed[name] = 0
        if last is not None and stamp_ns <= last:
            self._ignore(name, stamp_ns)
            return True
        tick = self._pending.setdefault(stamp_ns, {})
        if name in tick:
            self._ignore(name, stamp_ns)
            return True
        tick[name] = value
        if not self._lock_step:
            self._fire_newest()
        elif last is None or len(tick) == len(self._inputs):
            self._fire_exact()
        if len(self._pending) > PENDING_TICKS:
            del self._pending[min(self._pending)]
        return True

    def _follow_clock(self, name: str, stamp_ns: int, value: Any) -> bool:
        """Keep a message of another time, or begin anew with all of them if it confirms that."""
        astray = self._astray.setdefault(name, deque(maxlen=PENDING_TICKS))
        while astray and not 0 < stamp_ns - astray[-1][0] < RESET_NS:
            astray.pop()
        astray.append((stamp_ns, value))
        if name != self._trigger or len(astray) < (1 if self._lock_step else CONFIRMED):
            return False
        others, self._astray = self._astray, {}
        self.reset()
        self._near_ns = astray[0][0]
        for at, other, known in sorted((
                (at, other, known) for other, all_of in others.items() for at, known in all_of
                if abs(at - stamp_ns) < RESET_NS), key=lambda message: message[:1]):
            self.add(other, at, known)
        return True

    def _take_back(self, name: str, stamp_ns: int) -> None:
        """Forget what an input has told of later ticks: it was false, or of the run before."""
        for stamp in [stamp for stamp in self._pending if stamp > stamp_ns]:
            self._pending[stamp].pop(name, None)
            if not self._pending[stamp]:
                del self._pending[stamp]

    def awaited(self) -> tuple[int, list[str]]:
        """Stamp of the oldest tick that is not complete [ns], and the inputs that it lacks; −1
        where there is none.
        """
        if not self._pending:
            return -1, []
        stamp, last = min(self._pending), self.last_ns
        return stamp, [name for name in self._inputs if name not in self._pending[stamp]] + [
            name for name in self._delayed if last is not None and last not in self._late[name]]

    def before(self, name: str, stamp_ns: int) -> Any:
        """Newest value of a delayed input that can act at a stamp [ns]; None without any."""
        late = self._late[name]
        return late.get(max((at for at in late if at < stamp_ns), default=-1))

    def newest_ns(self, name: str) -> int:
        """Newest stamp of an input [ns]; −1 without any."""
        return self._newest.get(name, (-1, None))[0]

    def reached(self, name: str, stamp_ns: int) -> bool:
        """Whether an input has come up to a stamp [ns]."""
        newest = self._newest.get(name)
        return newest is not None and newest[0] >= stamp_ns

    def _ignore(self, name: str, stamp_ns: int) -> None:
        self.ignored += 1
        if not self._lock_step or name != self._trigger:
            return
        if self.last_ns is not None:
            self._on_repeat(stamp_ns)
        if stamp_ns in self._pending:
            self._told_again.add(stamp_ns)
            self._fire_exact()

    def _add_delayed(self, name: str, stamp_ns: int, value: Any) -> None:
        if not self._lock_step:
            self._held[name] = value
            return
        late = self._late[name]
        late[stamp_ns] = value
        if len(late) > PENDING_TICKS:
            del late[min(late)]
        self._fire_exact()

    def _fire_exact(self) -> None:
        """Lock-step: fire the oldest tick once it is complete; later ones overtake it only where
        the node is told of them again, and what is missing of it does not come.
        """
        while self._pending:
            last, full = self.last_ns, len(self._inputs)
            whole = [at for at, tick in self._pending.items() if len(tick) == full]
            stamp = min(whole, default=-1)
            if not whole or not self._may_fire(stamp):
                return
            tick, behind = self._pending[stamp], max(self._told_again, default=-1) > stamp
            for name, late in self._late.items():
                if last in late:
                    tick[name] = late[last]
                elif last is None or behind:
                    tick[name] = self.before(name, stamp)
                else:
                    return
            self._pending = {at: of for at, of in self._pending.items() if at >= stamp}
            self._told_again = {at for at in self._told_again if at > stamp}
            self._fire(stamp, tick)

    def _may_fire(self, stamp: int) -> bool:
        """Whether a complete tick is the next: the oldest, or told again; the first one of a run,
        or one after which another has begun.
        """
        if max(self._told_again, default=-1) >= stamp:
            return True
        if self.last_ns is not None:
            return stamp == min(self._pending)
        return stamp <= 0 or any(
            at > stamp and self._trigger in tick for at, tick in self._pending.items())

    def _fire_newest(self) -> None:
        """Real time: fire, oldest first, each tick that has nothing to wait for any more."""
        while self._pending:
            stamp = min(self._pending)
            tick = self._pending[stamp]
            if self._trigger in tick:
                if self._waits(stamp, tick):
                    return
                self._fire_incomplete(stamp, tick)
            elif self._is_lost(self._trigger, stamp):
                del self._pending[stamp]
            else:
                return

    def _waits(self, stamp: int, tick: dict[str, Any]) -> bool:
        """Whether the tick, which has been triggered, lacks an input that may still come."""
        if len(tick) == len(self._inputs):
            return False
        triggered = sum(self._trigger in each for each in self._pending.values())
        return triggered <= 1 + HOLD_TICKS and any(
            name not in tick and self._missed[name] < PATIENCE and not self._is_lost(name, stamp)
            for name in self._others)

    def _is_lost(self, name: str, stamp: int) -> bool:
        """Whether an input of a tick cannot come: a later one came, and each keeps its order."""
        newest = self._newest.get(name)
        return newest is not None and newest[0] > stamp

    def _fire_incomplete(self, stamp: int, tick: dict[str, Any]) -> None:
        """Fire with the newest of what is missing, or drop a tick for which nothing has come."""
        for name in self._others:
            if name in tick:
                continue
            self._missed[name] += 1
            if name not in self._newest and name not in self._optional:
                del self._pending[stamp]
                return
            tick[name] = self._newest.get(name, (0, None))[1]
        tick.update(self._held)
        self._fire(stamp, tick)

    def _fire(self, stamp: int, tick: dict[str, Any]) -> None:
        del self._pending[stamp]
        for name, late in self._late.items() if self._lock_step else ():
            acting = max((at for at in late if at < stamp), default=stamp)
            self._late[name] = {at: value for at, value in late.items() if at >= acting}
        self.last_ns = self._near_ns = stamp
        self._on_tick(stamp, tick)


def drain(subscription: Any, enough: Callable[[], bool] = lambda: False) -> int:
    """Take what waits in a subscription's queue now, in order, as the executor would.

    A node calls this for its command topics at the start of its tick, so that commands which
    arrived before the tick act in it whatever the executor's order, and for topics that do not
    wake it. The executor later finds the queue empty and goes on.

    Parameters
    ----------
    subscription : rclpy.subscription.Subscription
        Its callback is called for every message.
    enough : callable () → bool
        Asked before every message whether to leave the rest.

    Returns
    -------
    int
        Number of messages taken.
    """
    count, handle, msg_type, raw = 0, subscription.handle, subscription.msg_type, subscription.raw
    kinds = type(subscription).CallbackType
    with_information = subscription._callback_type is kinds.WithMessageInfo
    while not enough():
        with handle:
            taken = handle.take_message(msg_type, raw)
        if taken is None:
            break
        count += 1
        subscription.callback(*taken[:1 + with_information])
    return count
