# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The reference system: commanded speed and turn rate through first-order filters (paper,
Section 5).

v̇ = α_r (v_ext − v),   γ̇ = α_r (γ_ext − γ)

|v̇| is limited, for no foot can push the body harder (:mod:`~dmp_cpg_ros.core.reference.governor`);
but not where the filter brakes no harder than it would for v_ext = 0, so that stops are those of
the plain filter.

While a stop is requested, r goes to zero along its own direction, ṙ = −max(α_r, a_b/s) r with
s = |v| + |γ| l the largest speed of a foot: as fast as the filter or with the constant
deceleration a_b, whichever is faster, so that it is zero after a finite time and never overshoots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import Inhibition
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.maths import Array, clamped
from dmp_cpg_ros.core.maths.first_order import FirstOrderFilter
from dmp_cpg_ros.core.maths.vec3 import Triple, triple
from dmp_cpg_ros.core.parameters import Parameters, parameter
from dmp_cpg_ros.core.reference.governor import Governor


@dataclass(frozen=True)
class ReferenceParameters(Parameters):
    """Parameters of the reference system."""

    alpha_r: float = parameter(
        3.0, 'rate of the reference filters; bodies do not follow faster stops', 0.05, 6.0,
        unit='1/s')
    max_speed: float = parameter(
        3.5, 'largest forward speed that is accepted', 0.0, 10.0, unit='m/s')
    max_lateral_speed: float = parameter(
        0.6, 'largest sideways speed that is accepted', 0.0, 10.0, unit='m/s')
    max_turn_rate: float = parameter(
        2.2, 'largest turn rate that is accepted', 0.0, 10.0, unit='rad/s')
    max_curve: float = parameter(
        0.3, 'largest acceleration towards the centre of a curve, at low speed', 0.01, 10.0,
        unit='g')
    max_acceleration: float = parameter(
        4.0, 'largest acceleration of the reference, except when braking to rest', 0.1, 1e3,
        unit='m/s^2')
    braking: float = parameter(
        0.0, 'least deceleration of the reference while a stop is requested; 0: as alpha_r has it',
        0.0, 6.0, unit='m/s^2')
    cmd_vel_timeout: float = parameter(
        0.5, 'time without cmd_vel after which the command is zero; 0: never', 0.0, 3600.0,
        unit='s')


class CommandGate:
    """The external command r_ext: checked, limited, and zero when its source falls silent or
    the gait is stopped.

    Parameters
    ----------
    parameters : ReferenceParameters
        Limits and timeout.
    scale : BodyScale, optional
        The robot's lengths, for the limits of the gait and of curves.
    gaits : sequence of Gait
        Whose limits are kept, see :func:`~dmp_cpg_ros.core.gait.choice.limiting_gaits`: those of
        the last.

    Attributes
    ----------
    limited_by : str
        What cut the command that acts: ``range``, ``gait``, ``timeout``; empty for nothing.
    """

    def __init__(self, parameters: ReferenceParameters, scale: BodyScale | None = None,
                 gaits: Sequence[Gait] = ()) -> None:
        """Start with a zero command."""
        self._scale, self.limited_by = scale, ''
        self.asked: Triple = (0.0, 0.0, 0.0)
        self._received_ns, self._fresh = 0, False
        self.follow(parameters, gaits)

    def follow(self, parameters: ReferenceParameters, gaits: Sequence[Gait],
               passing: Sequence[Gait] = (), passing_s: float = 0.0) -> None:
        """Take new limits; they hold from the next :meth:`at` on, whatever was accepted when.

        Parameters
        ----------
        parameters : ReferenceParameters
            Limits and timeout.
        gaits : sequence of Gait
            Whose limits are kept, at the cadence that is wanted.
        passing : sequence of Gait
            The same at the cadence that acts: as long as it moves, commands keep to both.
        passing_s : float
            For how long it moves [s].
        """
        self.parameters = parameters
        self._passing_ns, self._passed_ns = round(1e9 * passing_s), inf
        self._ends = () if self._scale is None else tuple(
            each[-1] for each in (gaits, passing) if each)
        self._limit()

    def accept(self, v_x: float, v_y: float, gamma: float) -> None:
        """Take a new command; it acts from the next :meth:`at` on.

        Parameters
        ----------
        v_x, v_y, gamma : float
            Forward and sideways speed [m/s], turn rate [rad/s].

        Raises
        ------
        DataError
            If a value is not finite; the former command stays.
        """
        if not np.all(np.isfinite((v_x, v_y, gamma))):
            raise DataError(
                f'command v = ({v_x}, {v_y}) m/s, gamma = {gamma} rad/s must be finite')
        self.asked, self._fresh = (float(v_x), float(v_y), float(gamma)), True
        self._limit()

    def _limit(self) -> None:
        """Bring the command within its range, and then within the limits of the last gait at
        the cadence that is wanted, and at the one that acts.
        """
        p, (v_x, v_y, gamma) = self.parameters, self.asked
        limited = in_range = (clamped(v_x, -p.max_speed, p.max_speed),
                              clamped(v_y, -p.max_lateral_speed, p.max_lateral_speed),
                              clamped(gamma, -p.max_turn_rate, p.max_turn_rate))
        cut_by = '' if in_range == self.asked else 'range'
        within = [(limited, cut_by)]
        for gait in self._ends:
            assert self._scale is not None
            limited = gait.limited(limited, self._scale, p.max_curve)
            within.append((limited, cut_by if limited == in_range else 'gait'))
        self._on_the_way, self._arrived = within[-1], within[:2][-1]

    def at(self, time_ns: int) -> tuple[float, float, float]:
        """Command that acts at a tick, with its stamp on the robot's clock [ns]: (v_x, v_y, γ)."""
        if self._fresh:
            self._fresh, self._received_ns = False, time_ns
        self._received_ns = min(self._received_ns, time_ns)
        self._passed_ns = min(self._passed_ns, time_ns + self._passing_ns)
        command, self.limited_by = self._acting(time_ns)
        return command

    def foreseen(self, time_ns: int) -> Triple:
        """Command that will act at a tick if no other comes: :meth:`at` without its effect."""
        return self._acting(time_ns)[0]

    def _acting(self, time_ns: int) -> tuple[Triple, str]:
        """Command at a time [ns], and what cuts it."""
        timeout = self.parameters.cmd_vel_timeout
        silent = 0.0 < timeout < (time_ns - self._received_ns) * 1e-9
        if silent and not self._fresh:
            return (0.0, 0.0, 0.0), 'timeout'
        return self._on_the_way if time_ns < self._passed_ns else self._arrived


class ReferenceSystem:
    """First-order filters on v_x, v_y and γ with a limit on the acceleration.

    Parameters
    ----------
    parameters : ReferenceParameters
        Rate and largest acceleration.
    foot_distance : float
        l, distance of a foot from the base's origin, for braking while it turns [m].
    governor : Governor, optional
        What the gait and the robot allow of it; all without.

    Attributes
    ----------
    limited : bool
        Whether the limit acted in the last step.
    """

    def __init__(self, parameters: ReferenceParameters, foot_distance: float = 0.0,
                 governor: Governor | None = None) -> None:
        """Keep the parameters."""
        self.parameters, self._filter = parameters, FirstOrderFilter(parameters.alpha_r)
        self._foot_distance = foot_distance
        self._governor, self.limited = governor or Governor(), False
        self._left = 0.0, 1.0  # length of a step [s] and what is left of a deviation after it

    def towards(self, r: Array, command: tuple[float, float, float], inhibition: Inhibition,
                dt: float) -> Array:
        """Advance towards the share of a command that is to be followed, or to zero while a stop
        is requested; ndarray (3,).
        """
        if not inhibition.requested:
            v_x, v_y, gamma = command
            share = inhibition.share
            return self._towards(r, (share * v_x, share * v_y, share * gamma), dt)
        v_x, v_y, gamma = r.tolist()
        speed = (v_x * v_x + v_y * v_y) ** 0.5 + abs(gamma) * self._foot_distance
        kept, lost = self._kept(dt), self.parameters.braking * dt
        if lost <= (1.0 - kept) * speed:
            return self._towards(r, (0.0, 0.0, 0.0), dt)
        return r * max(0.0, 1.0 - lost / speed) if speed > 0.0 else np.zeros(3)

    def step(self, r: Array, r_ext: Array, dt: float) -> Array:
        """Advance: r(t + dt) = r_ext + (r − r_ext) exp(−α_r dt), less where v changes too fast.

        Parameters
        ----------
        r : ndarray (3,)
            v_x, v_y [m/s], γ [rad/s].
        r_ext : ndarray (3,)
            External command, held during the step.
        dt : float
            [s]

        Returns
        -------
        ndarray (3,)
        """
        return self._towards(r, triple(r_ext.tolist()), dt)

    def _kept(self, dt: float) -> float:
        """Share exp(−α_r dt) of a deviation that a step leaves; ticks are of one length."""
        if self._left[0] != dt:
            self._left = dt, float(self._filter.kept(dt))
        return self._left[1]

    def _towards(self, r: Array, r_ext: Triple, dt: float) -> Array:
        """As :meth:`step`."""
        kept, (x, y, gamma), (to_x, to_y, to_gamma) = self._kept(dt), r.tolist(), r_ext
        after_x, after_y = to_x + (x - to_x) * kept, to_y + (y - to_y) * kept
        following = np.array((after_x, after_y, to_gamma + (gamma - to_gamma) * kept))
        self.limited = False
        if dt <= 0.0 or not (to_x or to_y):
            return following
        share = self._governor.share(
            r, (after_x - x, after_y - y), dt, self.parameters.max_acceleration)
        if share < 1.0:
            before, change = r[:2], following[:2] - r[:2]
            if following[:2] @ following[:2] <= before @ before:
                to_rest = (1.0 - kept) * float(np.sqrt(before @ before))
                share = max(share, min(to_rest, self.parameters.max_acceleration * dt)
                            / float(np.sqrt(change @ change)))
            self.limited = share < 1.0
            if self.limited:
                following[:2] = before + share * change
        return following
