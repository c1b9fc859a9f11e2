# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What runs, as far as certificates are computed from it, and what of it may change now."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import degrees
from dmp_cpg_ros.core.canonical.inhibition import AUTO, Inhibition
from dmp_cpg_ros.core.certificates.certify import BEFORE_VOTES, CLOSED_ROWS, QUICK_ROWS, certify
from dmp_cpg_ros.core.certificates.changes import all_networks, certify_changes, votes_among
from dmp_cpg_ros.core.certificates.inequality import Certificate, Inequality, Look
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.timing import later_arming
from dmp_cpg_ros.core.certificates.votes import VOTE_ROWS
from dmp_cpg_ros.core.contraction.capture import RADIUS_TOLERANCE, capture_set
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL, inhibited_contraction
from dmp_cpg_ros.core.contraction.voting import different_voters
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.entry import eligible_legs
from dmp_cpg_ros.core.inhibition.step_timing import time_to_slow
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.operating_range import operating_range
from dmp_cpg_ros.core.reference.stop_distance import stop_distance
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import UNCERTIFIED_VOTES, VOTE_SOURCES, SuiteParameters

UNCERTIFIED = frozenset(
    ('auto_inhibit', 'auto_delay', 'caution', 'step_timing', 'start_inhibited',
     'cmd_vel_timeout', 'allow_uncertified', 'auto_speeds', 'auto_hysteresis', *UNCERTIFIED_VOTES,
     *VOTE_SOURCES))
"""Parameters of certified nodes that no inequality depends on."""

_CAPTURING = frozenset(('rho', 'radius', 'coupling_gain', 'coupling_graph', 'inhibition_gain',
                        'region_radius', 'inhibited_legs'))
"""Parameters that decide which set inhibition holds the legs in."""

_QUICK_EFFORT, _WHOLE_EFFORT, _ELIGIBLE_EFFORT, _STOPPING_EFFORT, _WEAK_EFFORT = 3, 10, 2, 5, 3
"""Of rows of the oscillators and of a whole certificate of one leg, of whether a leg may be
chosen, of what a set of voters needs to stop a network and what it does to it, and of the gain up
to which a smaller one cannot; from times of a processor that were measured.
"""


@dataclass(frozen=True)
class Running:
    """Everything that a certificate is computed from.

    Attributes
    ----------
    parameters : SuiteParameters
        Parameters of the parts.
    gait : Gait
        Before ``cadence_scale``.
    scale : BodyScale
        The robot's lengths.
    tick_s : float
        Control tick [s].
    others : tuple of Gait
        Gaits that it may change to and back, before ``cadence_scale``.
    acting_cadence : float, optional
        Factor on the cadence that acts, while it is on its way to that of the parameters; the
        certificate then holds for all between the two.
    """

    parameters: SuiteParameters
    gait: Gait
    scale: BodyScale
    tick_s: float
    others: tuple[Gait, ...] = ()
    acting_cadence: float | None = None

    def certificate(self, *, whole: bool = False, every_gait: bool = True) -> Certificate:
        """Compute the inequalities, of those that are not required only where the whole is asked
        for, or take them from the last that were; the way of the feet has no part in them. Where
        not every gait matters, votes are those of the first gait in which they lose one.
        """
        return _certificate(self._of_certificate, whole, every_gait=every_gait)

    def holds(self) -> bool:
        """Whether the certificate holds, at less cost where it does not."""
        return not self.look().lost

    def look(self, among: str = '') -> Look:
        """Whether a required inequality does not hold, looking no further than one that does not.
        Where one is named, only it and what is computed before it are sure to be looked at.
        """
        if among in VOTE_ROWS:
            return Look.at(self.votes(until_lost=True))
        until = among if among in QUICK_ROWS else BEFORE_VOTES if among else ''
        return Look.at(_certificate(self._of_certificate, False, True, until).inequalities)

    def votes(self, *, until_lost: bool = False) -> list[Inequality]:
        """Inequalities of voting, or all of the first gait in which one is lost."""
        of = self._of_certificate
        return votes_among(of.parameters, of.networks, of.tick_s, until_lost=until_lost)

    def effort(self, among: str = '') -> int:
        """How long :meth:`look` takes, mostly no longer; 1 is one of ``CLOSED_ROWS``
        for one leg. ``auto`` takes twice as much for each leg that is not alike another, and votes
        some for each set of voters in each network.
        """
        kinds, eligible, votes = 1, 0, 0
        if self.parameters.inhibition.auto:
            kinds = eligible = len(set(degrees(
                self.parameters.canonical.coupling_graph, len(LEGS))))
        if self.parameters.voting.voting and (not among or among in VOTE_ROWS):
            networks, majority = self.networks, self.parameters.voting.majority
            enough, fewer = (len(different_voters(networks[0].system, count))
                             for count in (majority, majority - 1))
            votes = len(networks) * (_STOPPING_EFFORT * enough + _WEAK_EFFORT * fewer)
        if among in VOTE_ROWS:
            return votes
        return votes + _ELIGIBLE_EFFORT * eligible + kinds * (
            1 if among in CLOSED_ROWS else _QUICK_EFFORT if among in QUICK_ROWS else _WHOLE_EFFORT)

    @property
    def networks(self) -> list[GaitNetwork]:
        """Networks of all gaits, at the cadence of the parameters and at the one that acts."""
        return all_networks(
            self.parameters, (self.gait, *self.others), self.scale, self.acting_cadence)

    @property
    def settled(self) -> Running:
        """The same when the cadence has come to that of the parameters."""
        return replace(self, acting_cadence=None)

    def covers(self, other: Running) -> bool:
        """Whether the certificate holds for another in which a cadence acts between those of this
        one and which does not differ otherwise.
        """
        wanted = self.parameters.canonical.cadence_scale
        here, there = (wanted if running.acting_cadence is None else running.acting_cadence
                       for running in (self, other))
        return self.settled == other.settled and min(here, wanted) <= there <= max(here, wanted)

    @property
    def _of_certificate(self) -> Running:
        return replace(self, parameters=replace(self.parameters, motion=None),
                       acting_cadence=self.moving_cadence)

    @property
    def moving_cadence(self) -> float | None:
        """Factor on the cadence that acts, where it is another than that of the parameters."""
        return self.acting_cadence if self.moving else None

    @property
    def moving(self) -> bool:
        """Whether the cadence that acts is not that of the parameters, but for rounding."""
        return self.acting_cadence is not None and not math.isclose(
            self.acting_cadence, self.parameters.canonical.cadence_scale)

    def time_to_rest(self, network: GaitNetwork, x: Array, r: Array,
                     quickness: float = 1.0) -> float:
        """Bound on the time to rest of a stop that is requested in a known state [s].

        Parameters
        ----------
        network : GaitNetwork
            That acts, at the cadence that it has without the quickness of a pushed robot.
        x, r : ndarray (4, 2), (3,)
            States and reference.
        quickness : float
            Factor on the cadence, which falls to 1 before inhibition is armed.
        """
        return self.certificate().time_to_rest + time_to_slow(quickness) + later_arming(
            Setting.of(network, self.parameters, self.tick_s), x, r)

    def time_ahead(self, lead_s: float) -> float:
        """What it adds to the time to rest that a request, and inhibition that is armed, act a
        lead later [s]; of any leg one is armed that is not yet past C by then however fast it is,
        and comes there as much later as it may be slower.
        """
        if not (self.parameters.inhibition.auto and lead_s > 0.0):
            return 2.0 * lead_s
        slowest, fastest = zip(*(operating_range(
            network, self.parameters.inhibition, self.parameters.reference).omega_armed
            for network in self.networks), strict=True)
        return lead_s * (1.0 + max(fastest) / min(slowest))

    def stop_distance(
            self, r: Array, command: tuple[float, float, float], lead_s: float = 0.0) -> float:
        """Bound on the way of the reference r (3,) in a stop that acts a lead later [s] [m]."""
        turning = max(abs(float(r[2])), abs(command[2])) * self.scale.hip_radius
        return stop_distance(self.parameters.reference, math.hypot(*r[:2]),
                             math.hypot(*command[:2]), self.tick_s, turning, lead_s)

    def refused_now(self, before: Running, network: GaitNetwork, inhibition: Inhibition,
                    x: Array, *, ahead: bool = False) -> str:
        """Why a change of what captures the legs has to wait; empty when it may be made.

        While the gait runs every certified change may. Once inhibition is armed legs may be caught
        at any time; at rest the state must be in the invariant set of the new parameters, or the
        legs would break free and take a stride. Votes have no such set.

        Parameters
        ----------
        before : Running
            What runs.
        network : GaitNetwork
            That acts, perhaps in another gait than the one that is wanted.
        inhibition : Inhibition
            That acts.
        x : ndarray (4, 2)
            States.
        ahead : bool
            Whether inhibition may have been armed, to act later, without its being heard here.
        """
        acting, armed = network.acting_gains(inhibition, x), inhibition.gains
        held_by = acting if acting.any() else armed
        served = before.parameters.inhibition.gains_on(int(held_by.argmax())) > 0.0
        # the service's gain is above that of any vote, whatever it was when it was asked for
        voted = bool(held_by[served].min(initial=math.inf) <= held_by[~served].max(initial=0.0))
        names = sorted((_CAPTURING | {'cadence_scale'} if voted and armed.any() else _CAPTURING)
                       & before.differences(self).keys())
        if not (names and inhibition.requested):
            return ''
        if not armed.any():
            return '' if not ahead else (
                f'{", ".join(names)} cannot change while a stop is under way, in which legs may '
                'be caught at any time; ask again when they are at rest')
        if voted:
            return (f'{", ".join(names)} cannot change while votes alone hold the legs; ask again '
                    "while the gait runs or the service's stop holds it")
        if not inhibition.at_rest:
            return (f'{", ".join(names)} cannot change while the legs are being captured; ask '
                    'again when they are at rest')
        target = network.with_parameters(self.parameters.canonical).target_at(
            inhibition.rest_phase)
        outside = self._outside(x, np.linalg.norm(x - target, axis=1), inhibition.gains)
        return outside and (f'{", ".join(names)} cannot change in this rest: {outside}; ask again '
                            'while the gait runs')

    def _outside(self, x: Array, distance: Array, gains: Array) -> str:
        """What lies outside of the invariant set of these parameters, when a leg that is chosen
        is the one on which gains act; empty when nothing does.
        """
        p, held_by = self.parameters, int(gains.argmax())
        networks = self.networks
        fastest = max(Setting.of(network, p, self.tick_s).span.omega[1] for network in networks)
        system = networks[0].system
        if p.inhibition.auto and (np.count_nonzero(gains) != 1 or any(
                held_by not in eligible_legs(network, p.inhibition) for network in networks)):
            return f'{AUTO} would not take what holds the legs now'
        capture = capture_set(system, fastest, p.inhibition.gains_on(held_by),
                              p.inhibition.region_radius)
        for leg, far, most in zip(LEGS, distance, capture.distance, strict=True):
            if far > most:
                return (f'{leg} rests {far:.4g} from its place, and the new parameters hold it '
                        f'within {most:.4g}')
        regional = inhibited_contraction(system, capture).reach != GLOBAL
        if regional and np.hypot(*x.T).min() < p.canonical.radius * (1.0 - RADIUS_TOLERANCE):
            return 'the new parameters contract only for legs near their cycle'
        return ''

    def differences(self, other: Running) -> dict[str, tuple[Any, Any]]:
        """Names of parameters that differ, with this value and the other one."""
        others = other.values
        return {name: (value, others[name]) for name, value in self.values.items()
                if value != others[name]}

    @property
    def values(self) -> dict[str, Any]:
        """All parameters by name; a name that two parts share is one parameter."""
        return {name: getattr(held, name) for held in self.parameters.sets.values()
                for name in held.__dataclass_fields__}

    def changed(self, values: Mapping[str, Any]) -> Running:
        """Return this with other values of some parameters.

        Raises
        ------
        ParameterError
            If a value is impossible.
        """
        parts = {part: {name: values[name] for name in held.__dataclass_fields__ if name in values}
                 for part, held in self.parameters.sets.items()}
        return replace(self, parameters=replace(self.parameters, **{
            part: replace(getattr(self.parameters, part), **changes)
            for part, changes in parts.items() if changes}))


@lru_cache(maxsize=32)
def _certificate(of: Running, whole: bool, until_lost: bool = False, until: str = '', *,
                 every_gait: bool = True) -> Certificate:
    if of.others or of.moving:
        return certify_changes(
            of.parameters, (of.gait, *of.others), of.scale, of.tick_s, of.acting_cadence,
            required_only=not whole, until_lost=until_lost, until=until, every_gait=every_gait)
    network = GaitNetwork(of.parameters.canonical, of.gait, of.scale)
    return certify(Setting.of(network, of.parameters, of.tick_s),
                   required_only=not whole, until_lost=until_lost, until=until)
