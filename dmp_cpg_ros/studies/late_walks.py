# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Walks whose targets arrive late: after a delay, in bursts from controllers that starve, or, from
legs that die and are started again, not at all.

In the plain loop with the robot's command watchdog between the legs and the robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.loop import Tick
from dmp_cpg_ros.core.robot_model.state import LEGS, JointTargets
from dmp_cpg_ros.core.suite_parameters import RobotParameters, TickParameters
from dmp_cpg_ros.robot.watchdog import CommandWatchdog
from dmp_cpg_ros.studies.walking_trials import STANDING, Walk, attitude
from dmp_cpg_ros.suite_table import RETURN_S

LATE_S = 6.0
"""Time for which a robot whose targets arrive late is watched at its speed [s]."""

STARVED_S = 15.0
"""Time for which one is whose controllers starve [s]."""

SOUND_NS = 4_000_000_000
"""Time of a walk from which on they do [ns]."""

SILENT_S, TWICE_S = (0.35, 0.9), 6.0
"""Range of times for which legs are silent that are so twice, and time for which the robot is
watched besides that between the two [s].
"""

TARGET_TIMEOUT_NS = round(1e9 * RobotParameters().target_timeout)


class LateWalk(Walk):
    """A walk whose targets arrive late: those of each leg in order, from the second on after times
    drawn evenly from a range.

    Parameters
    ----------
    gait : str
        Name of the gait.
    delay_ms : tuple of float
        Least and longest [ms].
    lead_ms : int
        ``target_lead`` [ms].
    seed : int
        Of the delays and, as for :class:`Walk`, of the start.
    rate : float
        ``control_rate`` [Hz].
    """

    return_ns = 0

    def __init__(self, gait: str, delay_ms: tuple[float, float], lead_ms: int, seed: int,
                 rate: float = TickParameters.control_rate) -> None:
        self._delay_ms, self._lead_ms = delay_ms, lead_ms
        self._random = np.random.default_rng(seed)
        self._guard: CommandWatchdog | None = None
        self._on_the_way: list[list[tuple[int, int, JointTargets]]] = [[] for _ in LEGS]
        self._arrival_ns = [0] * len(LEGS)
        super().__init__(gait, seed=seed, values=(
            ('target_lead', 1e-3 * lead_ms), ('control_rate', rate)))

    def acting(self, tick: Tick) -> JointTargets:
        """Send what the legs want, and take of it what the robot's watchdog gives out."""
        if self._guard is None:
            self._guard = CommandWatchdog(self.robot.description, TARGET_TIMEOUT_NS,
                                          self._lead_ms * 1_000_000, return_ns=self.return_ns)
        for i, (leg, of_leg) in enumerate(tick.targets.by_leg().items()):
            queue, at_ns = self._on_the_way[i], self.arrives_ns(
                i, tick.time_ns, self._guard.stamps[i] is None)
            if at_ns is not None:
                self._arrival_ns[i] = max(self._arrival_ns[i], at_ns)
                queue.append((self._arrival_ns[i], tick.time_ns, of_leg))
            while queue and queue[0][0] <= tick.time_ns:
                self._guard.accept(leg, *queue.pop(0)[1:])
        return self._guard.targets(self.state)

    def arrives_ns(self, i: int, now_ns: int, first: bool) -> int | None:
        """When what a leg sends now arrives [ns]; None: never."""
        return now_ns + round(1e6 * self._random.uniform(*self._delay_ms) * (not first))


@dataclass(frozen=True)
class LateOutcome:
    """Whether a walk with late targets fell, its mean speed [m/s], and the root mean square of its
    roll and pitch [deg].
    """

    fell: bool
    reached: float = nan
    tilt: float = nan


def late(gait: str, speed: float, delay_ms: tuple[float, float], lead_ms: int, seed: int,
         rate: float = TickParameters.control_rate) -> LateOutcome:
    """Ramp to a speed [m/s] and hold it for ``LATE_S``; see :class:`LateWalk`."""
    run = LateWalk(gait, delay_ms, lead_ms, seed, rate)
    if not (run.settle((speed, 0.0, 0.0)) and run.walk(LATE_S)):
        return LateOutcome(True)
    states = run.states[-round(LATE_S / run.tick_s):]
    tilt = np.rad2deg(np.sqrt(np.mean(np.sum(attitude(states)[:, :2] ** 2, axis=1))))
    return LateOutcome(
        False, float(np.mean([state.base_velocity_in_base[0] for state in states])), float(tilt))


class Stalls(NamedTuple):
    """How legs' messages are held up, all of them at the end of a stall.

    Attributes
    ----------
    every_ms : float
        Mean time from the end of one to the begin of the next, drawn from an exponential
        distribution [ms].
    longest_ms : float
        They last from ``SHORTEST_MS`` to so long, drawn evenly [ms].
    together : float
        Share of those that hold up all four legs.
    lost : float
        Share of what is sent meanwhile that never arrives.
    """

    every_ms: float
    longest_ms: float
    together: float = 0.5
    lost: float = 0.5

    def __str__(self) -> str:
        return f'every {self.every_ms:g} ms, up to {self.longest_ms:g} ms'


SHORTEST_MS, USUAL_MS = 20.0, 8.0
"""Shortest stall; longest delay between two [ms]."""


class StarvedWalk(LateWalk):
    """A walk whose controllers starve now and then, as on a machine that is too full.

    The gait is told to stop while the robot looks after itself, as ``inhibition`` is by its node.

    Parameters
    ----------
    gait : str
        Name of the gait.
    stalls : Stalls
        How.
    seed : int
        Of the stalls and of the start.
    rate : float
        ``control_rate`` [Hz].

    Attributes
    ----------
    stood : int
        How often the robot has looked after itself.
    """

    def __init__(self, gait: str, stalls: Stalls, seed: int,
                 rate: float = TickParameters.control_rate) -> None:
        self._stalls, self._draw = stalls, np.random.default_rng((seed, 1))
        self._until_ns, self._next_ns = [0] * len(LEGS), [SOUND_NS] * len(LEGS)
        self.stood, self._alone = 0, False
        super().__init__(gait, (0.0, USUAL_MS), 0, seed, rate)

    def acting(self, tick: Tick) -> JointTargets:
        """As :class:`LateWalk`; the gait hears of the robot's fallback."""
        if tick.time_ns >= self._next_ns[0] and self._draw.random() < self._stalls.together:
            until_ns = self._stalled_ns(tick.time_ns)
            for i in range(len(LEGS)):
                self._stall(i, until_ns)
        for i in range(len(LEGS)):
            if tick.time_ns >= self._next_ns[i]:
                self._stall(i, self._stalled_ns(tick.time_ns))
        targets = super().acting(tick)
        alone = self._guard is not None and bool(self._guard.fallback)
        if alone != self._alone:
            self._alone, self.stood = alone, self.stood + alone
            self.loop.request(alone)
        return targets

    def arrives_ns(self, i: int, now_ns: int, first: bool) -> int | None:
        """When what a leg sends now arrives [ns]; None: never."""
        if now_ns < self._until_ns[i] and self._draw.random() < self._stalls.lost:
            return None
        return max(self._until_ns[i], super().arrives_ns(i, now_ns, first) or 0)

    def _stalled_ns(self, now_ns: int) -> int:
        return now_ns + round(1e6 * self._draw.uniform(SHORTEST_MS, self._stalls.longest_ms))

    def _stall(self, i: int, until_ns: int) -> None:
        self._until_ns[i] = max(self._until_ns[i], until_ns)
        self._next_ns[i] = self._until_ns[i] + round(
            1e6 * self._draw.exponential(self._stalls.every_ms))


@dataclass(frozen=True)
class StarvedOutcome:
    """Whether a walk with stalls fell, and how often the robot looked after itself."""

    fell: bool
    stood: int


def starved(gait: str, speed: float, stalls: Stalls, seed: int) -> StarvedOutcome:
    """Ramp to a speed [m/s] and walk on for ``STARVED_S``; see :class:`StarvedWalk`."""
    run = StarvedWalk(gait, stalls, seed)
    upright = run.settle((speed, 0.0, 0.0)) and run.walk(STARVED_S)
    return StarvedOutcome(not upright, run.stood)


class KilledWalk(StarvedWalk):
    """A walk whose legs die, one at a time, and are started again with what the others tell; the
    first one while it starts.

    Parameters
    ----------
    gait : str
        Name of the gait.
    seed : int
        Of all draws and of the start.
    longest_s : float
        Within which time a leg is back [s].
    rate : float
        ``control_rate`` [Hz].

    Attributes
    ----------
    kills : int
        How many have died.
    """

    return_ns = round(1e9 * RETURN_S)

    def __init__(self, gait: str, seed: int, longest_s: float,
                 rate: float = TickParameters.control_rate) -> None:
        self._fate, self._longest_s, self.kills = np.random.default_rng((seed, 2)), longest_s, 0
        self._dead: tuple[int, ...] = ()
        self._until_they_live_ns, self._dies_ns = 0, round(
            1e9 * (STANDING + self._fate.uniform(0.1, 1.5)))
        super().__init__(gait, Stalls(0.0, 0.0), seed, rate)
        self._next_ns = [round(1e9 * (STANDING + STARVED_S)) + 1] * len(LEGS)  # no stalls

    def acting(self, tick: Tick) -> JointTargets:
        """As :class:`StarvedWalk`; some legs live, some do not."""
        now_ns = tick.time_ns
        if not self._dead and now_ns >= self._dies_ns:
            self._dead, for_s = self.who_dies()
            self.kills, self._until_they_live_ns = self.kills + 1, now_ns + round(1e9 * for_s)
        elif self._dead and now_ns >= self._until_they_live_ns:
            for leg in self._dead:
                self.loop.leg_states[leg] = self.loop.legs[leg].picked_up(
                    tick.gait, tick.x, tick.x_dot, tick.r, tick.feedback)
            targets = super().acting(tick)  # this tick's were those of the legs that have died
            self._dead, self._dies_ns = (), now_ns + round(1e9 * self.lives_on_s())
            return targets
        return super().acting(tick)

    def who_dies(self) -> tuple[tuple[int, ...], float]:
        """Legs that die now, and after what time they are back [s]."""
        leg = int(self._fate.integers(len(LEGS)))
        return (leg,), self._longest_s * self._fate.uniform(0.03, 1.0)

    def lives_on_s(self) -> float:
        """After what time the next one dies [s]."""
        return float(self._fate.uniform(0.3, 3.0))

    def arrives_ns(self, i: int, now_ns: int, first: bool) -> int | None:
        """When what a leg sends now arrives [ns]; None: never."""
        return None if i in self._dead else super().arrives_ns(i, now_ns, first)


@dataclass(frozen=True)
class KilledOutcome(StarvedOutcome):
    """The same of a walk whose legs died, how many did, and its largest tilt [rad]."""

    kills: int
    tilt: float


def killed(gait: str, speed: float, seed: int, longest_s: float) -> KilledOutcome:
    """Start to walk at a speed [m/s], and go on for ``STARVED_S``; see :class:`KilledWalk`."""
    run = KilledWalk(gait, seed, longest_s)
    run.loop.command(speed)
    return _outcome(run, run.walk(STARVED_S))


def _outcome(run: KilledWalk, upright: bool) -> KilledOutcome:
    tilt = float(np.abs(attitude(run.states)[:, :2]).max())
    return KilledOutcome(not upright, run.stood, run.kills, tilt)


class TwiceSilentWalk(KilledWalk):
    """A walk at a steady speed in which one leg or all of them die, as of ``posture_control``,
    and all of them a second time soon after they are back.

    Parameters
    ----------
    gait : str
        Name of the gait.
    seed : int
        Of all draws and of the start.
    after_s : float
        Time from the return to the second death [s].
    rate : float
        ``control_rate`` [Hz].
    """

    def __init__(self, gait: str, seed: int, after_s: float, rate: float) -> None:
        self._after_s = after_s
        super().__init__(gait, seed, SILENT_S[1], rate)
        self._dies_ns = 10**18
        if 2.0 / rate > RobotParameters().longest_lag:  # mujoco_robot waits for such targets
            self._delay_ms = 0.0, 0.0

    def walks(self) -> None:
        """Let the first die within a second."""
        self._dies_ns = self.state.time_ns + round(1e9 * self._fate.uniform(0.0, 1.0))

    def who_dies(self) -> tuple[tuple[int, ...], float]:
        """Legs that die now, and after what time they are back [s]."""
        legs, draw = tuple(range(len(LEGS))), self._fate.uniform
        if not self.kills and draw() < 0.5:
            legs = (int(self._fate.integers(len(LEGS))),)
        return legs, draw(*SILENT_S)

    def lives_on_s(self) -> float:
        """After what time the next one dies [s]."""
        return self._after_s if self.kills < 2 else 2.0 * STARVED_S


def twice_silent(gait: str, speed: float, after_s: float, rate: float, seed: int) -> KilledOutcome:
    """Ramp to a speed [m/s] and walk on while legs are silent twice; see
    :class:`TwiceSilentWalk`.
    """
    run = TwiceSilentWalk(gait, seed, after_s, rate)
    upright = run.settle((speed, 0.0, 0.0))
    run.walks()
    return _outcome(run, upright and run.walk(TWICE_S + after_s))
