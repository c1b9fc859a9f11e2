# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Bound on the time that an inhibited network takes to settle, from any state in its capture set.

The rates |ẋ_i| obey v̇ ≤ −(L + diag α − diag b) v + |∂f/∂ω| |ω̇| there (contraction applied to ẋ
itself, driven by the reference's decay), and the swings' activity follows the phase rates through
its filter. Where it is proved, the same is computed for the step that runs, by what it has moved.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.step import SteppedNetwork
from dmp_cpg_ros.core.contraction.capture import CaptureSet
from dmp_cpg_ros.core.contraction.equilibrium import InhibitedEquilibrium
from dmp_cpg_ros.core.contraction.hopf_bounds import growth, largest_radial
from dmp_cpg_ros.core.contraction.synchronisation import comparison_laplacian
from dmp_cpg_ros.core.inhibition import supervisor
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.maths.exponential import exponential
from dmp_cpg_ros.core.reference.operating_range import REST_SPEED

STEP = 0.01
"""Length of a cell of time, or about that in whole steps [s]."""

HORIZON = 10.0
"""Time beyond which a bound is of no use [s]."""

_BLOCK, _BLOCKS = 32, 4  # cells of a block, and blocks looked at at once
_BEYOND = 1.0 + 1e-9  # rounding of what is not looked at
_KEPT = 64  # of what does not depend on who is inhibited


def settling(s: Setting, capture: CaptureSet, rest: InhibitedEquilibrium, speed: float,
             step: SteppedNetwork | None = None) -> float:
    """Bound on the time from any state in the capture set to the thresholds of rest.

    Parameters
    ----------
    s : Setting
        What runs.
    capture : CaptureSet
        Invariant set under inhibition, which contracts.
    rest : InhibitedEquilibrium
        Equilibrium at zero reference.
    speed : float
        Of the reference at first [m/s].
    step : SteppedNetwork, optional
        What is proved of the step, where that is to be bounded and not the equation.

    Returns
    -------
    float
        [s]; infinite beyond ``HORIZON``.
    """
    r, span, N = s.network.parameters.radius, s.span, len(capture.distance)
    alpha_r, a_b = s.parameters.reference.alpha_r, s.parameters.reference.braking

    def drive(speed: Array) -> tuple[Array, Array]:
        """|∂f/∂ω| |ω̇| and |∂f/∂ω| |ω − ω_rest|: sideways and turning count twice in the speed
        that sets the cadence.
        """
        return (span.omega_slope * np.maximum(alpha_r * speed, 2.0 * a_b * (speed > 0.0)) * r,
                span.omega_slope * speed * r)

    of = _falling(s, capture, *map(float, drive(np.float64(speed)))) if step is None else (
        _falling_in_steps(s, capture, step))
    fade, cells = math.exp(-alpha_r * of.cell), int(HORIZON / of.cell)
    if a_b == 0.0 and not speed * fade ** (cells - 1) <= 1.001 * REST_SPEED:
        return math.inf
    swings = _filtered(math.exp(-s.parameters.leg.activity_rate * of.cell))
    n, m = of.start.shape
    carried, apart = _carried(of.carry), float(of.inner.min()) > 1e-12
    fed = _fed(of, carried) if speed > 0.0 else carried
    blocks, swinging = np.empty((_BLOCKS, (_BLOCK + 1) * n, m)), np.empty((_BLOCKS, _BLOCK + 1, N))
    bounds, followed = of.start, np.ones((_BLOCK + 1, N))
    for begin in range(0, cells, _BLOCKS * _BLOCK):
        speeds, speed = _slowing(speed, fade, a_b * of.cell)
        driven = speeds[0] > 0.0
        if driven:
            drives = np.stack(drive(speeds), axis=1).reshape(_BLOCKS, fed.shape[1], -1)
        for k, block in enumerate(blocks):
            carried.dot(bounds, out=block)
            if driven:
                block += fed.dot(drives[k])
            bounds = block[-n:]
        within = blocks.reshape(_BLOCKS, _BLOCK + 1, n, m).swapaxes(2, 3).reshape(
            _BLOCKS, _BLOCK + 1, -1)[:, :-1, -2 * N:]
        v, e = within[..., :N], within[..., N:]
        inner = np.maximum(of.inner, rest.radius - e)
        phase_rate = v / inner if apart else np.divide(
            v, inner, out=np.full_like(v, np.inf), where=inner > 1e-12)
        wanted = np.minimum(1.0, phase_rate / span.omega_armed[0])
        for follows, activity in zip(wanted, swinging, strict=True):
            followed[1:] = follows
            swings.dot(followed, out=activity)
            followed[0] = activity[-1]
        slow = (phase_rate.max(axis=2).ravel() <= supervisor.REST_PHASE_RATE) & (
            speeds <= REST_SPEED)
        if slow.any():
            resting = np.flatnonzero(slow & (
                swinging[:, :-1].max(axis=2).ravel() <= supervisor.REST_ACTIVITY))
            if len(resting) > 0:
                cell = begin + int(resting[0])
                return cell * of.cell if cell < cells else math.inf
        falling = (bounds <= block[-2 * n:-n]).all()
        if falling and _too_slow(of, rest, carried[-n:], bounds, cells - begin):
            break
    return math.inf


def _too_slow(of: _Falling, rest: InhibitedEquilibrium, carry: Array, bounds: Array, cells: int
              ) -> bool:
    """Whether phases are not at rest some cells after those that were looked at began, for what
    falls, and is fed ever less, falls for ever; without what feeds it, it would be smaller.

    Parameters
    ----------
    of, rest
        Those of :func:`settling`.
    carry : ndarray (n, n)
        Of bounds in a block.
    bounds : ndarray (n, m)
        After the blocks that were looked at, which are as many as are to come at once.
    cells : int
        Cells until the horizon, with those that were looked at.
    """
    together = carry.dot(carry)
    together = together.dot(together)
    for _ in range(_BLOCKS * _BLOCK, cells, _BLOCKS * _BLOCK):
        bounds = together.dot(bounds)
    v, e = bounds.T.reshape(-1)[-2 * len(of.inner):].reshape(2, -1)
    return bool((v > _BEYOND * supervisor.REST_PHASE_RATE * np.maximum(
        of.inner, rest.radius - e)).any())


class _Falling(NamedTuple):
    """How bounds fall in a cell of time, and what ω̇ and ω feed them.

    Attributes
    ----------
    cell : float
        Its length [s].
    start : ndarray (n, m)
        Bounds at first, of which columns fall alike; column after column, the last 2N are those of
        |ẋ_i| and of the distance from rest.
    carry : ndarray (n, n)
        Of bounds in a cell.
    feed : ndarray (n, 2/m)
        What r |ω̇| and r times what ω is off that of rest add to them, each to its own column
        where there are two [s].
    inner : ndarray (N,)
        Smallest |x_i| in the set.
    """

    cell: float
    start: Array
    carry: Array
    feed: Array
    inner: Array


def _fastest(s: Setting, gains: Array, u: Array, disc: float) -> Array:
    """Bound of |ẋ_i| in a box and a disc, ndarray (N,)."""
    system, r = s.network.system, s.network.parameters.radius
    degree = system.graph.comparison.diagonal()
    return np.asarray(
        s.span.omega_armed[1] * disc + largest_radial(float(system.rho[0]), r, disc)
        + gains * u + degree * (u + u.max()))


def _falling(s: Setting, capture: CaptureSet, turning: float, away: float) -> _Falling:
    """Of the differential equation."""
    system, u = s.network.system, capture.distance
    K = comparison_laplacian(system.graph)
    diagonal = K.ravel()[::len(K) + 1]
    diagonal += capture.gains
    diagonal -= growth(system.rho, system.radius, capture.smallest_radius)
    carry = exponential(-K * STEP)
    shape = np.linalg.solve(K, np.ones(len(K)))              # K shape = 1: bounds above it fall
    fastest = _fastest(s, capture.gains, u, s.network.parameters.radius)
    start = np.outer(shape, [max(float((fastest / shape).max()), turning),
                             max(float((2.0 * u / shape).max()), away)])
    return _Falling(STEP, start, carry, (shape - carry.dot(shape))[:, None],
                    capture.smallest_radius)


def _falling_in_steps(s: Setting, capture: CaptureSet, step: SteppedNetwork) -> _Falling:
    """Of the step, some of which make a cell; what it has moved is bounded too."""
    r, u = s.network.parameters.radius, step.distance
    fastest = _fastest(s, capture.gains, u, step.disc)
    start = np.concatenate([np.minimum(2.0 * u, step.moved @ fastest), fastest, 2.0 * u])
    n = len(u)
    each, kicks = np.zeros((3 * n, 3 * n)), np.zeros((3 * n, 2))
    each[:n, :n] = each[2 * n:, 2 * n:] = step.differences
    each[n:2 * n, :n], each[n:2 * n, n:2 * n] = step.rates
    kicks[:n, 0], kicks[n:2 * n, 0] = step.forced * step.step_s, step.disc / r * step.step_s
    kicks[2 * n:, 1] = step.forced
    carry, feed = np.eye(len(each)), 0.0 * kicks
    count = max(1, round(STEP / step.step_s))
    for _ in range(count):
        carry, feed = each.dot(carry), each.dot(feed) + kicks
    return _Falling(count * step.step_s, start[:, None], carry, feed, np.maximum(r - u, 0.0))


def _carried(carry: Array) -> Array:
    """Matrix that makes of bounds those at the ends of all cells of a block, and the first."""
    n = len(carry)
    powers = np.empty(((_BLOCK + 1) * n, n))
    powers[:n], known = np.eye(n), n
    while known < _BLOCK * n:
        powers[:known].dot(carry, out=powers[known:2 * known])
        carry, known = carry.dot(carry), 2 * known
    powers[known:] = carry
    return powers


def _fed(of: _Falling, carried: Array) -> Array:
    """Matrix that makes of what feeds bounds in each cell of a block what it adds to them."""
    n, width = of.feed.shape
    since = np.zeros((2 * _BLOCK, n, width))  # by the cells since it was fed, after those to come
    since[_BLOCK:] = carried[:-n].dot(of.feed).reshape(_BLOCK, n, width)
    cell = since.strides[0]
    return np.ndarray((_BLOCK + 1, n, _BLOCK, width), float, since, (_BLOCK - 1) * cell,
                      (cell, 8 * width, -cell, 8)).reshape((_BLOCK + 1) * n, -1)


_CELLS = np.arange(_BLOCK + 1)
_LATER = _CELLS[:, None] - _CELLS


@lru_cache(maxsize=_KEPT)
def _slowing(speed: float, fade: float, drop: float) -> tuple[Array, float]:
    """Speeds in the cells of the blocks that are looked at at once, and after them, where a cell
    leaves a share or takes so much away [m/s].
    """
    speeds = np.zeros(_BLOCKS * _BLOCK)
    for cell in range(len(speeds)):
        if speed == 0.0:
            break
        speeds[cell] = speed
        faded, dropped = speed * fade, speed - drop
        speed = faded if faded < dropped else dropped if dropped > 0.0 else 0.0
    return speeds, speed


@lru_cache(maxsize=_KEPT)
def _filtered(kept: float) -> Array:
    """Matrix that makes of the first value of a filter and what it follows in each cell of a block
    its values at the ends of all cells, the first included.
    """
    weights = np.where(_LATER >= 0, (1.0 - kept) * kept ** np.maximum(_LATER, 0), 0.0)
    weights[:, 0] = kept ** _CELLS
    return weights
