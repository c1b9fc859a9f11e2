# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The certificate of a change: of gaits with every blend between them, and of cadences.

Offsets do not enter the spectrum (:mod:`~dmp_cpg_ros.core.gait.transition`), so that a blend
differs from a gait only by its cadence. The inequalities are therefore computed for all cadences
of both gaits, widened by what the moving offsets add to a leg's frequency, and hold for every
blend. A stop that is requested in a transition waits until the offsets stand still. The same holds
for a cadence that is on its way to the one that was accepted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations, zip_longest

from dmp_cpg_ros.core.canonical.coupling import degrees
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.canonical.system import MOST_KEPT
from dmp_cpg_ros.core.certificates.certify import BEFORE_VOTES, certify
from dmp_cpg_ros.core.certificates.inequality import Certificate, Inequality, discharged, lost
from dmp_cpg_ros.core.certificates.network import Setting
from dmp_cpg_ros.core.certificates.votes import vote_inequalities
from dmp_cpg_ros.core.contraction.finding import CONTINUOUS
from dmp_cpg_ros.core.gait.body_scale import BodyScale
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.network import GaitNetwork
from dmp_cpg_ros.core.gait.running import CADENCE_RATE
from dmp_cpg_ros.core.gait.transition import SETTLING_RATE, STANDING, GaitTransition
from dmp_cpg_ros.core.inhibition.entry import eligible_legs, farthest_way
from dmp_cpg_ros.core.inhibition.supervisor import REST_ACTIVITY
from dmp_cpg_ros.core.maths.records import replace_unchecked
from dmp_cpg_ros.core.reference.operating_range import OperatingRange, operating_range
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import SuiteParameters
from dmp_cpg_ros.core.transformation.leg import LegParameters
from dmp_cpg_ros.core.voting.parameters import VotingParameters


def certify_changes(parameters: SuiteParameters, gaits: Sequence[Gait], scale: BodyScale,
                    tick_s: float, acting_cadence: float | None = None, *,
                    required_only: bool = False, until_lost: bool = False, until: str = '',
                    every_gait: bool = True) -> Certificate:
    """Compute the certificate of some gaits and of every change between them.

    Parameters
    ----------
    parameters : SuiteParameters
        Parameters of all parts.
    gaits : sequence of Gait
        Gaits, before ``cadence_scale``.
    scale : BodyScale
        The robot's lengths.
    tick_s : float
        Control tick [s].
    acting_cadence : float, optional
        Factor on the cadence that still acts, on its way to that of the parameters.
    required_only, until_lost, until : bool, bool, str
        As for :func:`~dmp_cpg_ros.core.certificates.certify.certify`.
    every_gait : bool
        Whether votes are looked at in the other gaits where one loses an inequality.

    Returns
    -------
    Certificate
        What holds in each of the gaits and on every way between two of them.

    Raises
    ------
    ParameterError
        If the tick is not positive and finite.
    """
    p, rate = parameters, parameters.gait_change.gait_change_rate
    networks, cadence = all_networks(p, gaits, scale, acting_cadence), p.canonical.cadence_scale
    arriving = abs((acting_cadence or cadence) - cadence) / CADENCE_RATE
    ways = list(combinations(gaits, 2))
    share = max((_fastest(*way, rate) for way in ways), default=0.0)
    spans = [operating_range(network, p.inhibition, p.reference) for network in networks]
    span = _widened(spans, share)
    unvoted = replace(p, voting=VotingParameters())
    setting = Setting.of(networks[0], unvoted, tick_s, span, 2.0 * math.pi if ways else max(
        farthest_way(network, p.inhibition) for network in networks))
    legs = () if not p.inhibition.auto else _eligible_in_any(
        networks, p.inhibition, one_of_a_kind=until_lost)
    whole = certify(setting, legs, required_only=required_only, until_lost=until_lost, until=until)
    if (until_lost and not whole.holds) or until not in ('', BEFORE_VOTES):
        return whole
    pause = 0.0 if not ways else (
        math.log(span.omega[1] / (STANDING * span.omega[0])) / SETTLING_RATE + tick_s)
    bound = whole.time_to_rest + pause + arriving
    rows = [_changed(row, bound, p.leg, 'gait' if ways else 'cadence')
            for row in whole.inequalities]
    rows = discharged(rows, alike=replace(setting, parameters=p).alike)
    if until != BEFORE_VOTES and not (required_only and lost(rows)):
        rows += votes_among(p, networks, tick_s, spans, until_lost=until_lost or not every_gait)
    if ways and not required_only:
        rows.append(Inequality(
            'offset_rate', share * span.omega[1], whole['frequency_mismatch'].right, 'rad/s',
            'fastest offset', 'tolerated mismatch', CONTINUOUS,
            'the legs would keep their places even if the moving offsets were not fed forward',
            required=False))
    return replace(whole, inequalities=tuple(rows), time_to_rest=bound)


def refused_change(parameters: SuiteParameters, walked: Sequence[Gait], wanted: Sequence[Gait],
                   scale: BodyScale, tick_s: float, acting_cadence: float | None = None) -> str:
    """Why parameters may not act while what is walked changes into what is wanted; empty when
    they are certified for it, or nothing else is walked.

    Parameters
    ----------
    parameters, scale, tick_s, acting_cadence
        As for :func:`certify_changes`.
    walked, wanted : sequence of Gait
        Gaits; one that stands twice counts once.
    """
    among = list({gait.name: gait for gait in (*walked, *wanted)}.values())
    if len(among) == len(wanted):
        return ''
    certificate = certify_changes(parameters, among, scale, tick_s, acting_cadence,
                                  required_only=True)
    if certificate.holds:
        return ''
    return (f'changes among {", ".join(gait.name for gait in among)} are not certified: '
            f'{certificate.explained()}')


def votes_among(p: SuiteParameters, networks: Sequence[GaitNetwork], tick_s: float,
                spans: Sequence[OperatingRange] = (), *, until_lost: bool = False
                ) -> list[Inequality]:
    """What votes can do in some networks, of each inequality the worst, or all of the first in
    which one fails: their clamp follows the cadence, and a stop waits until a change of gait is
    over.
    """
    worst: dict[str, Inequality] = {}
    for network, span in zip_longest(networks, spans):
        for row in vote_inequalities(Setting.of(network, p, tick_s, span, 2.0 * math.pi)):
            known = worst.get(row.name)
            if known is None or not row.margin > known.margin:
                worst[row.name] = replace_unchecked(
                    row, sentence=f'{row.sentence}, in {network.gait.name}')
        if until_lost and lost(worst.values()):
            break
    return list(worst.values())


@lru_cache(MOST_KEPT)
def _fastest(before: Gait, after: Gait, rate: float) -> float:
    return GaitTransition(before, after).fastest(rate)


def _eligible_in_any(networks: Sequence[GaitNetwork], inhibition: InhibitionParameters, *,
                     one_of_a_kind: bool) -> set[int]:
    """Legs that are eligible in some network: one that changes at rest keeps what holds it; where
    one of those that are alike is enough, the one that is eligible in any case.
    """
    legs, p = set[int](), networks[0].parameters
    if one_of_a_kind and len(set(degrees(p.coupling_graph, len(LEGS)))) == 1:
        return {p.first_leg}
    for network in sorted(networks, key=lambda each: each.gait.omega(0.0, each.scale)):
        if len(legs) < len(LEGS):  # slow ones first, in which more are
            legs.update(eligible_legs(network, inhibition))
    return legs


def _changed(row: Inequality, bound: float, leg: LegParameters, what: str) -> Inequality:
    """Rows that are different in a transition: the time to rest, and the feet at rest."""
    if row.name == 'time_to_rest':
        return replace(row, left=bound,
                       sentence=f'{row.sentence}, the pause of a change of {what} included')
    if row.name == 'rest_posture' and math.isfinite(row.left):
        return replace(row, left=leg.clearance * REST_ACTIVITY, sentence=(
            'as a fraction of the standing height, when rest is declared, wherever in its cycle '
            'a leg rests'))
    return row


def all_networks(p: SuiteParameters, gaits: Sequence[Gait], scale: BodyScale,
                 acting_cadence: float | None) -> list[GaitNetwork]:
    """Networks of all gaits, at the cadence of the parameters and at the one that acts."""
    oscillators = [replace(p.canonical, cadence_scale=cadence)
                   for cadence in _cadences(p, acting_cadence)]
    return [GaitNetwork(canonical, gait, scale) for canonical in oscillators for gait in gaits]


def _cadences(p: SuiteParameters, acting_cadence: float | None) -> list[float]:
    """Factors on the cadence: of the parameters, and the one that acts where it is another."""
    cadence = p.canonical.cadence_scale
    return list(dict.fromkeys((cadence, acting_cadence or cadence)))


def _widened(spans: Sequence[OperatingRange], share: float) -> OperatingRange:
    """Range of all blends of gaits with some ranges, with frequencies that differ by a share."""
    def widened(pairs: list[tuple[float, float]]) -> tuple[float, float]:
        slowest, fastest = zip(*pairs, strict=True)
        return (1.0 - share) * min(slowest), (1.0 + share) * max(fastest)

    return OperatingRange(
        spans[0].foot_speed, spans[0].armed_speed, widened([span.omega for span in spans]),
        widened([span.omega_armed for span in spans]),
        max(span.omega_at_rest for span in spans), max(span.omega_slope for span in spans))
