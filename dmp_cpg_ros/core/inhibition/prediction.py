# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a stop that was requested will rest, and a start will walk; and when the body will stand.

Oscillators and reference form a closed hierarchy, into which nothing of a stopping body enters:
the same code that drives the legs predicts to the tick. The body is not part of it. Its times are
those of the feet, which are, and of how long it then takes to calm down, which trials say: on the
flat, slopes and hills with friction of 0.3 to 1, a payload of up to 30 % and a push of up to
0.3 m/s in the instant of the request (``study_stops --random``, doc/walking.md).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from math import ceil, exp, hypot, inf, nan
from typing import Any, NamedTuple

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.canonical.phase import scalar_phase
from dmp_cpg_ros.core.gait.running import CanonicalState, RunningGait
from dmp_cpg_ros.core.gait.transition import GaitInForce
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.stop_state import SupervisorState
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.filter import ReferenceSystem
from dmp_cpg_ros.core.transformation.foot_path import swing_height

DOWN = 0.2
"""Share of the swing's height below which a foot that comes down counts as down."""

CALMING, AT_ONCE, LANDED, LONGEST_CALMING = 0.31, 0.12, 0.44, 0.8
"""Time from the last foot's coming down until the body stands still [s]: where it swings back over
its feet, where it does not, where all feet come down at once, and what no trial exceeded.
"""

TRIED = 0.28
"""Standing height of the robot of those trials [m]. Times grow with it: equal gaits have speeds in
√(g l), so that a body swings more often before it is slow enough, and each time for √(l/g).
"""

STOPPED = 1e-3
"""Speed below which a reference that brakes has stopped [m/s]."""

FOLLOWING, SLOW = 0.1, 0.12
"""The body follows the reference's speed in this time [s], and does not swing back if it goes
slower than this [m/s] as the last foot comes down.
"""

HIND_ALONE = (False, False, True, False), (False, False, False, True)
"""Feet in the air where none but a hind foot is."""

BALANCED, OWN_CADENCE = 0.9, 0.95
"""Share of the stance in which feet of both sides and ends stand, and factor on a gait's cadence,
from which on a body does not sway by itself: in walk and trot, not in an amble.
"""

FARTHER = 0.1, 0.25
"""What the body goes farther than its reference in no trial: so far [m], and so far for every
metre per second at the request [s].
"""


class Outlook(NamedTuple):
    """What becomes of a request.

    Attributes
    ----------
    time_s : float
        From now to rest (of a stop) or to phase lock (of a start) [s]; infinite when it does not
        happen within the horizon, or not before what was asked for is turned round by itself, as
        by ``auto_inhibit``.
    down_s : float
        Until the last foot that swings is down [s]; NaN for a start.
    way_m : float
        Of the reference until then [m].
    speed : float
        |v| of the reference now [m/s].
    calming_s : float
        From the last foot's coming down until the body stands, in the middle of trials [s].
    size : float
        Standing height over ``TRIED``.
    """

    time_s: float
    down_s: float
    way_m: float
    speed: float
    calming_s: float = CALMING
    size: float = 1.0

    @property
    def stands_s(self) -> float:
        """Time until the body stands: below 2 cm/s on four feet, in the middle of trials [s]."""
        return self.down_s + self.calming_s

    @property
    def stands_within_s(self) -> float:
        """Time within which it stood in all trials [s]."""
        return self.down_s + LONGEST_CALMING * max(self.size, 1.0)

    @property
    def stands_within_m(self) -> float:
        """Way of the body within which it stood in all trials [m]."""
        fixed, share = FARTHER
        return self.way_m + (fixed + share * self.speed) * max(self.size, 1.0)


def looking_ahead(supervisor: GaitSupervisor, reference: ReferenceSystem, canonical: RunningGait,
                  state: SupervisorState, published: Announced, canon: CanonicalState, r: Array,
                  command: tuple[float, float, float], dt: float, horizon: float = 10.0,
                  body_mode: str = 'standing') -> Generator[None, None, Outlook]:
    """Run ahead from a request; every step of the generator is a tick of what is looked ahead.

    Parameters
    ----------
    supervisor, reference, canonical
        The blocks as they run.
    state : SupervisorState
        Present state, the request included.
    published : Announced
        What has been published; the request, where it has not, is at the next tick.
    canon : CanonicalState
        Present state of the oscillators, gait and cadence perhaps on their way to others.
    r : ndarray (3,)
        Present reference.
    command : tuple of float
        External command that is assumed to stay (v_x, v_y, γ).
    dt, horizon : float
        Tick, and longest time that is looked ahead [s].
    body_mode : str
        What the body does, assumed to stay.

    Returns
    -------
    Outlook
        At the end.
    """
    way_m, speed, stop = 0.0, hypot(r[0], r[1]), state.requested
    size = canonical.scale.leg_length / TRIED
    body = _Body(r, reference.parameters.braking > 0.0, dt, size)
    ticks = ticks_ahead(supervisor, reference, canonical, state, published, canon, r, command, dt,
                        body_mode)
    for k, (state, _, canon, r) in zip(range(1, ceil(horizon / dt) + 1), ticks, strict=False):
        if state.requested != stop:
            break
        yield
        if stop:
            way_m += dt * hypot(r[0], r[1])
            body.follow(k * dt, r, canon.gait,
                        _up(canon, state, canon.gait.pace(r, canonical.scale)[3]))
        if state.state in ('at_rest', 'walking', 'free', 'stepping'):
            return Outlook(
                k * dt, body.down_s if stop else nan, way_m, speed, body.calming_s, size)
    return Outlook(inf, nan, nan, speed)


class _Body:
    """What is told of a body that follows a reference to rest.

    Without ``braking`` of the reference the last foot that comes down tells when it stands. A body
    that brakes stands ``CALMING`` after its reference does, or after that foot where it is later;
    but a hind foot that comes down alone, when the others stand already, holds up none that went
    ahead (backwards it does).

    Parameters
    ----------
    r : ndarray (3,)
        Reference at the request.
    brakes : bool
        Whether the reference brakes.
    dt : float
        Tick [s].
    size : float
        Standing height over ``TRIED``.
    """

    def __init__(self, r: Array, brakes: bool, dt: float, size: float) -> None:
        self._size = size
        self._speed, self._brakes, self._share = hypot(r[0], r[1]), brakes, 1.0 - exp(
            -dt / (FOLLOWING * size))
        self._passed = HIND_ALONE if r[0] >= 0.0 else ()
        self._stopped_s = self._held_s = self.down_s = 0.0
        self._calming_s = CALMING

    def follow(self, time_s: float, r: Array, gait: GaitInForce, up: tuple[bool, ...]) -> None:
        """Take a tick at a time after the request [s], with the feet that are in the air."""
        speed = hypot(r[0], r[1])
        self._speed += self._share * (speed - self._speed)
        if speed > STOPPED:
            self._stopped_s = time_s
        if any(up):
            self.down_s, self._calming_s = time_s, self._calming(gait)
            self._held_s = 0.0 if up in self._passed else time_s

    @property
    def calming_s(self) -> float:
        """How long it takes to calm down after the last foot came down, in the middle of trials
        [s].
        """
        if not self._brakes or self._calming_s == LANDED:
            return self._size * self._calming_s
        return max(self._size * AT_ONCE, max(
            self._stopped_s, self._held_s) + self._size * CALMING - self.down_s)

    def _calming(self, gait: GaitInForce) -> float:
        """The same where nothing but the last foot, which is down in this tick, tells it [s]."""
        if gait.apart == 0.0:
            return LANDED
        sways = not (gait.firm >= 1.0 and gait.two_sided >= BALANCED
                     and gait.cadence_scale >= OWN_CADENCE)
        return CALMING if sways or self._speed > SLOW / self._size else AT_ONCE


def look_ahead(*arguments: Any, **options: Any) -> Outlook:
    """What becomes of a request, at once; the parameters are those of :func:`looking_ahead`."""
    ahead = looking_ahead(*arguments, **options)
    while True:
        try:
            next(ahead)
        except StopIteration as end:
            outlook: Outlook = end.value
            return outlook


def ticks_ahead(supervisor: GaitSupervisor, reference: ReferenceSystem, canonical: RunningGait,
                state: SupervisorState, published: Announced, canon: CanonicalState, r: Array,
                command: tuple[float, float, float], dt: float, body_mode: str = 'standing'
                ) -> Iterator[tuple[SupervisorState, Inhibition, CanonicalState, Array]]:
    """Oscillators, reference and state of the stop tick by tick, without end; the parameters are
    those of :func:`looking_ahead`.

    Yields
    ------
    state : SupervisorState
    inhibition : Inhibition
        What is published: without a lead of the supervisor what acts at the next tick.
    canon : CanonicalState
    r : ndarray (3,)
    """
    tick_ns = round(dt * 1e9)
    while True:
        stamp_ns = state.time_ns + tick_ns
        published = published.at(stamp_ns)
        r = reference.towards(r, command, published.acting, dt)
        canon = canonical.step(canon, r, published.acting, dt)
        state = supervisor.step(state, stamp_ns, canonical.network(canon.gait), canon.x,
                                canon.x_dot, r, command, body_mode=body_mode,
                                acts=supervisor.lead_ns == 0 or published.stops)
        published = published.after(state, supervisor.inhibition(state), supervisor.lead_ns)
        yield state, published.latest, canon, r


def next_gait(reference: ReferenceSystem, canonical: RunningGait, published: Announced,
              canon: CanonicalState, r: Array, command: tuple[float, float, float], dt: float,
              time_ns: int = 0) -> GaitInForce:
    """Gait in force at the last tick before what is published acts, or else at the next tick;
    the parameters are those of :func:`looking_ahead`, with the stamp of the last tick [ns].

    A change of gait may begin until then, and a stop in which it does waits until the change
    stands still.
    """
    tick_ns, until_ns = round(dt * 1e9), published.latest_ns
    while True:
        time_ns += tick_ns
        published = published.at(time_ns)
        r = reference.towards(r, command, published.acting, dt)
        canon = canonical.step(canon, r, published.acting, dt)
        if time_ns + tick_ns >= until_ns:
            return canon.gait


def _up(canon: CanonicalState, state: SupervisorState, duty: float) -> tuple[bool, ...]:
    """Which feet are in the air, of fl, fr, rl, rr."""
    up = []
    for (x_1, x_2), activity in zip(canon.x.tolist(), state.activity, strict=True):
        position = canon.gait.scalar_cycle_position(scalar_phase(x_1, x_2))
        swung = position / (1.0 - duty) + 0.5
        up.append(0.0 < swung < 1.0 and activity * swing_height(swung)[0] > DOWN)
    return tuple(up)
