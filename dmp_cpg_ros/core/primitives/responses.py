# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Movements that known forces cause through a spring-damper; the regressors of learning."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.primitives.spring_damper import quadratic_drive_step, spring_exponential

Force = Callable[[Array], Array]


def transient_responses(stiffness: float, damping: float, times: Array, force: Force,
                        longest_step: float) -> tuple[Array, Array]:
    """Responses y'' = u_i(s) − k y − b y' from rest, and the two free movements.

    Parameters
    ----------
    stiffness, damping : float
        k [1/s²] and b [1/s].
    times : ndarray (m,)
        Increasing scaled times from 0 [s].
    force : callable
        s (q,) → u (q, p), the time courses of p forces.
    longest_step : float
        Intervals between samples are divided until they are not longer [s].

    Returns
    -------
    forced : ndarray (3, m, p)
        Position, velocity and acceleration (derivatives by s) caused by each force.
    free : ndarray (3, m, 2)
        The same of the free movements from (y, y') = (1, 0) and (0, 1).
    """
    parts = np.ceil(np.diff(times) / longest_step - 1e-9).astype(int).clip(1)  # steps per interval
    ends = np.cumsum(parts)
    lengths = np.repeat(np.diff(times) / parts, parts)
    begins = np.repeat(times[:-1], parts) + lengths * (
        np.arange(len(lengths)) - np.repeat(ends - parts, parts))
    first = force(begins)
    last = np.concatenate([first[1:], force(times[-1:])])
    drives = np.stack([first, force(begins + 0.5 * lengths), last])  # (3, q, p)
    E, rest = spring_exponential(stiffness, damping, lengths), np.zeros(1)  # (2, 2, q)
    pushes = np.stack(quadratic_drive_step(
        stiffness, damping, E[..., None], rest, rest, drives, lengths[:, None]), axis=1)
    state = np.hstack([np.zeros((2, pushes.shape[2])), np.eye(2)])
    states, stops = [state], set((ends - 1).tolist())
    for q, step in enumerate(np.ascontiguousarray(np.moveaxis(E, 2, 0))):
        state = step @ state
        state[:, :-2] += pushes[q]
        if q in stops:
            states.append(state)
    position, velocity = np.stack(states, axis=1)
    acceleration = -stiffness * position - damping * velocity
    acceleration[:, :-2] += force(times)
    everything = np.stack([position, velocity, acceleration])
    return everything[..., :-2], everything[..., -2:]


def periodic_responses(stiffness: float, damping: float, omega: float, force: Force,
                       phases: Array, harmonics: int) -> Array:
    """Steady responses to forces that are periodic functions of the phase φ = ωs.

    Each Fourier coefficient is divided by k − (mω)² + i b mω, so the result is exact up to the
    truncation.

    Parameters
    ----------
    stiffness, damping, omega : float
        k [1/s²], b [1/s], ω [rad/s].
    force : callable
        φ (q,) → u (q, p).
    phases : ndarray (m,)
        Where the responses are wanted [rad].
    harmonics : int
        Highest harmonic that is kept.

    Returns
    -------
    ndarray (3, m, p)
        Position, velocity and acceleration (derivatives by s).
    """
    count = 4 * harmonics
    cycle = force(2.0 * np.pi * np.arange(count) / count)
    coefficients = np.fft.rfft(cycle, axis=0)[: harmonics + 1] / count
    coefficients[1:] *= 2.0
    rate = 1j * omega * np.arange(harmonics + 1)[:, None]
    coefficients = coefficients / (stiffness + damping * rate + rate**2)
    angles = np.outer(phases, np.arange(harmonics + 1))
    cosines, sines, orders = np.cos(angles), np.sin(angles), []
    for order in range(3):
        terms = coefficients * rate**order
        # No matrix product: its bits depend on the number of threads.
        orders.append(np.einsum('mh,hp->mp', cosines, np.ascontiguousarray(terms.real))
                      - np.einsum('mh,hp->mp', sines, np.ascontiguousarray(terms.imag)))
    return np.stack(orders)
