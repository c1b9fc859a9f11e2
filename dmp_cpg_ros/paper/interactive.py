# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the page of the paper computes when a slider moves: a certificate, a stop and a start.

Runs in the browser, on NumPy and the core alone; nothing of the body is simulated.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.certificates.certify import certify
from dmp_cpg_ros.core.certificates.inequality import finite
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.network import CanonicalParameters, GaitNetwork
from dmp_cpg_ros.core.gait.running import RunningGait
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.prediction import look_ahead, ticks_ahead
from dmp_cpg_ros.core.inhibition.supervisor import GaitSupervisor
from dmp_cpg_ros.core.reference.filter import ReferenceSystem
from dmp_cpg_ros.core.reference.governor import Governor
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import SuiteParameters

COMMAND = (0.3, 0.0, 0.0)
"""Velocity of the walk that is stopped [m/s], [rad/s]."""

WALKED, RESTED, PATIENCE = 1.0, 0.6, 4.0
"""Time of walking, at rest, and how long rest and walking are waited for [s]."""

EVERY = 2
"""Ticks between two states that are drawn."""


class Page:
    """The suite at which the page looks.

    Parameters
    ----------
    gaits : mapping of str to mapping
        Gaits as in ``gaits.yaml``.
    scale : mapping of str to float
        Fields of :class:`~dmp_cpg_ros.core.gait.body_scale.BodyScale`.
    tick_s : float
        Control tick [s].
    """

    def __init__(self, gaits: Mapping[str, Any], scale: Mapping[str, float], tick_s: float
                 ) -> None:
        """Read the gaits."""
        self.gaits = {name: Gait.from_mapping(name, values) for name, values in gaits.items()}
        self.scale, self.tick_s = BodyScale(**scale), tick_s

    def answer(self, what: str, values: str) -> str:
        """Return :meth:`certificate` or :meth:`episode` of values, both as JSON."""
        return json.dumps({'certificate': self.certificate, 'episode': self.episode}[what](
            json.loads(values)), allow_nan=False)

    def _parts(self, values: Mapping[str, Any], **changes: Any) -> tuple[Gait, SuiteParameters]:
        canonical = {name: values[name] for name in (
            'coupling_gain', 'coupling_graph', 'cadence_scale')}
        return self.gaits[values['gait']], SuiteParameters(
            canonical=CanonicalParameters(**canonical), inhibition=InhibitionParameters(
                values['inhibition_gain'], values['region_radius'], (values['leg'],), **changes))

    def certificate(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Certificate of values, with a sentence for each inequality that fails.

        Parameters
        ----------
        values : mapping
            ``gait``, ``coupling_graph``, ``leg``; ``inhibition_gain``, ``coupling_gain`` [1/s],
            ``region_radius``, ``cadence_scale``.

        Returns
        -------
        dict
            As ``certify --json``, with ``broken``, the failing inequalities in one line each, and
            ``omega``, the smallest and largest cadence [rad/s].

        Raises
        ------
        ParameterError
            If a value is out of its range.
        """
        gait, p = self._parts(values)
        running = Setting.of(GaitNetwork(p.canonical, gait, self.scale), p, self.tick_s)
        found = certify(running)
        return {**found.as_mapping(), 'broken': [row.explained() for row in found.failing],
                'omega': running.span.omega}

    def episode(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Oscillators through a stop and a start, with what is predicted at each request.

        Parameters
        ----------
        values : mapping
            As for :meth:`certificate`.

        Returns
        -------
        dict
            ``stop`` and ``start``: time, predicted and measured duration [s], None for more than
            ``patience`` [s];
            ``frames``: time, state, x and places x_d (4, 2), armed gains (4,) and speed of each;
            ``legs``, ``region``: their names, and r0.
        """
        gait, p = self._parts(values, start_inhibited=False)
        dt = self.tick_s
        canonical = RunningGait(p.canonical, self.scale, KnownGaits({gait.name: gait}))
        reference = ReferenceSystem(
            p.reference, self.scale.hip_radius, Governor((gait,), self.scale))
        supervisor = GaitSupervisor(
            p.inhibition, p.voting, p.leg.activity_rate, p.reference)
        canon, r = canonical.initial_state(gait, p.inhibition), np.array(COMMAND)
        state = supervisor.initial_state(leg=p.canonical.first_leg)
        inhibition = supervisor.inhibition(state)
        ticks = ticks_ahead(
            supervisor, reference, canonical, state, Announced(inhibition), canon, r, COMMAND, dt)
        frames: list[dict[str, Any]] = []
        told: dict[str, Any] = {}
        k, end = 0, round(WALKED / dt)
        for request, wanted, after in ((True, 'at_rest', RESTED), (False, 'walking', WALKED)):
            begun, done, measured = -1, False, None
            while begun < 0 or k < end:
                if k == end:
                    state, begun = supervisor.request(state, request), k
                    now = (supervisor, reference, canonical, state, Announced(inhibition), canon,
                           r, COMMAND, dt)
                    predicted, ticks = look_ahead(*now, PATIENCE), ticks_ahead(*now)
                    end += round(PATIENCE / dt)
                k += 1
                state, inhibition, canon, r = next(ticks)
                if begun >= 0 and not done and state.state in (wanted, 'free'):
                    done, measured, end = True, (k - begun) * dt, k + round(after / dt)
                if k % EVERY == 0:
                    frames.append({
                        'time': k * dt, 'state': state.state, 'x': canon.x.tolist(),
                        'places': canonical.network(canon.gait).target_at(
                            inhibition.rest_phase).tolist(),
                        'gains': inhibition.gains.tolist(), 'speed': float(np.hypot(*r[:2]))})
            told['stop' if request else 'start'] = {
                'time': begun * dt, 'predicted': finite(predicted.time_s), 'measured': measured}
        return {'legs': LEGS, 'frames': frames, 'region': p.inhibition.region_radius,
                'patience': PATIENCE, **told}
