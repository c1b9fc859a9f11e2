# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters that change while the suite runs: may they, and what is the nearest that may.

A change that would lose the certificate is refused with the inequality that fails, both its sides,
and the nearest value that works: on the straight way from the running values for numbers, the
other choices for words.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.inhibition import AUTO, Inhibition
from dmp_cpg_ros.core.certificates.certify import Certificate, certificate_of
from dmp_cpg_ros.core.certificates.changes import all_networks, certify_changes
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.suggest import nearest_value
from dmp_cpg_ros.core.certificates.timing import later_arming
from dmp_cpg_ros.core.contraction.capture import RADIUS_TOLERANCE, capture_set
from dmp_cpg_ros.core.contraction.inhibited import GLOBAL, inhibited_contraction
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.gait.gait import BodyScale, Gait
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.inhibition.entry import eligible_legs
from dmp_cpg_ros.core.inhibition.step_timing import time_to_slow
from dmp_cpg_ros.core.maths import Array
from dmp_cpg_ros.core.reference.stop_distance import stop_distance
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import UNCERTIFIED_VOTES, VOTE_SOURCES, SuiteParameters

UNCERTIFIED = frozenset(
    ('auto_inhibit', 'auto_delay', 'push_recovery', 'caution', 'step_timing', 'start_inhibited',
     'cmd_vel_timeout', 'allow_uncertified', 'auto_speeds', 'auto_hysteresis', *UNCERTIFIED_VOTES,
     *VOTE_SOURCES))
"""Parameters of certified nodes that no inequality depends on."""

_CAPTURING = frozenset(('rho', 'radius', 'coupling_gain', 'coupling_graph', 'inhibition_gain',
                        'region_radius', 'inhibited_legs'))
"""Parameters that decide which set inhibition holds the legs in."""

_DIGITS = 4


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

    def certificate(self) -> Certificate:
        """Compute the certificate, or take it from the last that were; the way of the feet has no
        part in it.
        """
        return _certificate(self._of_certificate)

    def holds(self) -> bool:
        """Whether the certificate holds, from the inequalities that are required."""
        return _certificate(self._of_certificate, required_only=True).holds

    @property
    def _of_certificate(self) -> Running:
        return replace(self, parameters=replace(self.parameters, motion=None),
                       acting_cadence=self.acting_cadence if self.moving else None)

    @property
    def moving(self) -> bool:
        """Whether the cadence that acts is not that of the parameters."""
        return self.acting_cadence not in (None, self.parameters.canonical.cadence_scale)

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

    def stop_distance(self, r: Array, command: tuple[float, float, float]) -> float:
        """Bound on the way of the reference r, ndarray (3,), after a stop is requested while a
        command acts [m].
        """
        turning = max(abs(float(r[2])), abs(command[2])) * self.scale.hip_radius
        return stop_distance(self.parameters.reference, math.hypot(*r[:2]),
                             math.hypot(*command[:2]), self.tick_s, turning)

    def refused_now(self, before: Running, network: GaitNetwork, inhibition: Inhibition,
                    x: Array) -> str:
        """Why a change of what captures the legs has to wait; empty when it may be made.

        While the gait runs every certified change may: inhibition sets in when the legs are in
        their places. In a stop that holds them, the state must be in the invariant set of the new
        parameters, or the legs would break free and take a stride; votes have no such set.

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
        """
        acting = inhibition.gains
        served = before.parameters.inhibition.gains_on(int(acting.argmax())) > 0.0
        # the service's gain is above that of any vote, whatever it was when it was asked for
        voted = bool(acting[served].min(initial=math.inf) <= acting[~served].max(initial=0.0))
        names = sorted((_CAPTURING | {'cadence_scale'} if voted else _CAPTURING)
                       & before.differences(self).keys())
        if not (names and inhibition.requested
                and network.acting_gains(inhibition, x).any()):
            return ''
        if voted:
            return (f'{", ".join(names)} cannot change while votes alone hold the legs; ask again '
                    'while the gait runs or is stopped by the service')
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
        networks = all_networks(p, (self.gait, *self.others), self.scale, self.acting_cadence)
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


@lru_cache(maxsize=16)
def _certificate(of: Running, required_only: bool = False) -> Certificate:
    if of.others or of.moving:
        return certify_changes(of.parameters, (of.gait, *of.others), of.scale, of.tick_s,
                               of.acting_cadence, required_only=required_only)
    network = GaitNetwork(of.parameters.canonical, of.gait, of.scale)
    return certificate_of(Setting.of(network, of.parameters, of.tick_s),
                          required_only=required_only)


@dataclass(frozen=True)
class Verdict:
    """Whether a change may be made.

    Attributes
    ----------
    certificate : Certificate
        With the change.
    accepted : bool
        Whether no inequality is lost by it.
    reason : str
        Why not: the inequalities with both sides, and what is nearest; empty when accepted.
    """

    certificate: Certificate
    accepted: bool
    reason: str = ''


@dataclass
class CertificateGate:
    """Judges changes.

    Attributes
    ----------
    pause : callable ()
        Called between any two certificates, each of which takes some milliseconds: a node lets
        ticks pass meanwhile.
    """

    pause: Callable[[], None] = field(default=lambda: None)

    def judge(self, present: Running, held: Certificate, proposed: Running) -> Verdict:
        """Judge a change.

        Parameters
        ----------
        present : Running
            What runs.
        held : Certificate
            Its certificate.
        proposed : Running
            What is asked for.

        Returns
        -------
        Verdict
            Accepted when every required inequality holds, or, where the running parameters have no
            certificate to lose, when none gets worse.
        """
        certificate = proposed.certificate()
        lost = [entry for entry in certificate.failing
                if held[entry.name].holds or entry.margin < held[entry.name].margin]
        if not lost:
            return Verdict(certificate, True)
        reason = ' | '.join(entry.explained() for entry in lost)
        return Verdict(certificate, False, f'{reason}; {self._nearest(present, held, proposed)}')

    def _nearest(self, present: Running, held: Certificate, proposed: Running) -> str:
        """Nearest values that work, as text."""
        differences = present.differences(proposed)
        numbers = {name: pair for name, pair in differences.items() if isinstance(pair[0], float)}
        words = {name: pair[1] for name, pair in differences.items() if name not in numbers}
        if words and not self._holds(present.changed(words)):
            return self._choices(proposed, words)
        if not (held.holds or words) or not numbers:
            return 'nothing nearer is known: the running parameters are not certified themselves'

        def between(share: float) -> dict[str, Any]:
            return {**words, **{name: after if share == 1.0 else before + share * (after - before)
                                for name, (before, after) in numbers.items()}}

        share = nearest_value(lambda at: self._holds(present.changed(between(at))), 0.0, 1.0)
        values = ', '.join(f'{name} = {shown(_rounded(between(share)[name], before))}'
                           for name, (before, _) in numbers.items())
        return f'nearest value{"s that work" if len(numbers) > 1 else " that works"}: {values}'

    def _choices(self, proposed: Running, words: Mapping[str, Any]) -> str:
        """Other words that work in place of those that were asked for."""
        found = []
        for name, asked in words.items():
            working = [shown(choice) for choice in _alternatives(proposed, name)
                       if choice != asked and self._holds(proposed.changed({name: choice}))]
            found.append(f'{name} = {" or ".join(working)}' if working else
                         f'no other {name} with the rest as it is')
        return f'what works: {"; ".join(found)}'

    def _holds(self, running: Running) -> bool:
        self.pause()
        try:
            return running.holds()
        except DmpCpgError:
            return False


def _alternatives(running: Running, name: str) -> list[Any]:
    """All values of a parameter that is a choice; for several at once, one up to all of them."""
    entry = next(held.__dataclass_fields__[name] for held in running.parameters.sets.values()
                 if name in held.__dataclass_fields__)
    choices = entry.metadata['choices']
    if not isinstance(entry.default, tuple):
        return list(choices)
    several = [choice for choice in choices if choice != AUTO]
    return [*((choice,) for choice in choices), *(
        some for size in range(2, len(several) + 1) for some in combinations(several, size))]


def _rounded(value: float, towards: float) -> float:
    """Few digits, on the side of a value that works."""
    if value == towards or value == 0.0:
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - _DIGITS)
    if towards > value:
        return min(math.ceil(value / step) * step, towards)
    return max(math.floor(value / step) * step, towards)


def shown(value: Any) -> str:
    """Value as one types it for a parameter: lists in brackets, floats never as whole numbers."""
    if isinstance(value, (tuple, list)):
        return f'[{", ".join(map(str, value))}]'
    if isinstance(value, float):
        text = f'{value:g}'
        return text if set(text) & set('.en') else f'{text}.0'
    return str(value)
