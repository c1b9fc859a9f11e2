# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gains for which a certificate holds, and the value nearest to one that does not work."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from dmp_cpg_ros.core.certificates.inequality import Certificate, Look
from dmp_cpg_ros.core.maths.roots import sign_change

if TYPE_CHECKING:
    from dmp_cpg_ros.core.certificates.gate import Running

MARGIN = 1.25
"""Factor by which a suggested gain exceeds what its inequality needs."""

GAIN_ROWS = ('synchronisation', 'contraction', 'capture', 'rest_in_region', 'time_step',
             'hierarchy', 'rest_posture', 'rest_radius', 'time_to_rest')
"""Inequalities that the two gains decide; the others depend on other parameters."""

_LARGEST_COUPLING, _LARGEST_INHIBITION = 1e4, 1e5
_DIGITS = 4  # of a nearest value
_NEAR = 0.02  # of one plus the share of the way that is left to the wanted values


@dataclass(frozen=True)
class Suggestion:
    """Gains for which the certificate holds.

    Attributes
    ----------
    coupling_gain, inhibition_gain : float
        k and k_inh [1/s].
    certificate : Certificate
        With these gains.
    changed : bool
        Whether they differ from the present ones.
    """

    coupling_gain: float
    inhibition_gain: float
    certificate: Certificate
    changed: bool


def suggest_gains(running: Running) -> Suggestion | None:
    """Raise the gains, inhibition before coupling, until the certificate holds.

    Parameters
    ----------
    running : Running
        What is to run.

    Returns
    -------
    Suggestion or None
        The present gains when they hold; None when an inequality fails that gains cannot mend, or
        no gains within the parameters' ranges are enough.
    """
    def at(k: float, k_inh: float) -> Running:
        return running.changed({'coupling_gain': k, 'inhibition_gain': k_inh})

    of = running.parameters
    k0, k_inh0 = of.canonical.coupling_gain, of.inhibition.inhibition_gain
    present, k = running.certificate(whole=True), k0
    if present.holds:
        return Suggestion(k0, k_inh0, present, False)
    while k <= _LARGEST_COUPLING:
        k_inh = k_inh0
        while k_inh <= _LARGEST_INHIBITION:
            found = at(k, k_inh).changed({'voting': False}).certificate()
            if found.holds and (k == k0 or all(
                    MARGIN * found[name].left <= found[name].right
                    for name in ('synchronisation', 'contraction'))):  # those of the coupling
                found = at(k, k_inh).certificate(whole=True)
                if found.holds:
                    return Suggestion(k, k_inh, found, True)
                break  # the votes of some legs may still need stronger couplings
            if any(entry.name not in GAIN_ROWS for entry in found.failing):
                return None
            needed = MARGIN * found['capture'].left
            k_inh = _rounded(max(needed, 1.0) if needed > k_inh else 1.5 * max(k_inh, 1.0))
        k = _rounded(1.3 * k)
    return None


def nearest_values(numbers: Mapping[str, tuple[float, float]],
                   look: Callable[[dict[str, float], str], Look], name: str,
                   ends: tuple[Look, Look], trials: Callable[[str], tuple[str, int]]
                   ) -> dict[str, float]:
    """Values nearest to the wanted ones, on the straight way from those that run, that still work.

    What one inequality needs is looked for first, where it alone is easier to look at; then
    whether the others hold there.

    Parameters
    ----------
    numbers : mapping of str to (float, float)
        Names with the value that runs, which works, and the one that is asked for, which does not.
    look : callable (values, among) → Look
        What is seen of the inequalities at some values; where one is named, others than that need
        not be looked at.
    name : str
        An inequality that the wanted values lose.
    ends : (Look, Look)
        What is seen at the wanted values, which lose an inequality, and at those that run.
    trials : callable (name) → (str, int)
        For a lost inequality, what is looked at on the way, it or all, and how often at most; 0
        ends it with what runs.

    Returns
    -------
    dict of str → float
        To ``_NEAR`` of the way where there are trials enough, rounded towards those that run.
    """
    def between(to_go: float) -> dict[str, float]:
        return {key: before + (1.0 - to_go) * (after - before)
                for key, (before, after) in numbers.items()}

    def room(among: str, names: tuple[str, ...], at: float) -> float:
        return look(between(at - 1.0), among).share(names)

    to_go, (seen, runs) = 0.0, ends
    while seen.lost and to_go < 1.0:
        among, most = trials(name)
        known = seen.share(()), runs.share(seen.lost)
        to_go = sign_change(partial(room, among, seen.lost), 1.0 + to_go, 2.0, _NEAR, known,
                            slope=0.0, trials=most)[1] - 1.0
        seen = look(between(to_go), '') if among and to_go < 1.0 else runs
        name = seen.lost[0] if seen.lost else ''
    return {key: _shortened(value, numbers[key][0]) for key, value in between(to_go).items()}


def _shortened(value: float, towards: float) -> float:
    """Few digits, on the side of a value that works."""
    if value == towards or value == 0.0:
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - _DIGITS)
    if towards > value:
        return min(math.ceil(value / step) * step, towards)
    return max(math.floor(value / step) * step, towards)


def _rounded(gain: float) -> float:
    """Two or three digits that are not smaller."""
    step = 10.0 ** (len(str(int(gain))) - 2)
    return float(-(-gain // step) * step)
