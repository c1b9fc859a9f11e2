# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The gaits that are known, and the gait in force as shares of them.

The share of each gait is a canonical state: 1 for the gait that is walked, and while gaits change
1 − s for the one before and s for the one after, with the rates −ṡ and ṡ. So it is published, and
whoever reads a phase reads it in the gait in force.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import NamedTuple

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitInForce, GaitTransition
from dmp_cpg_ros.core.parameters import shown


class GaitShares(NamedTuple):
    """The gait in force as numbers.

    Attributes
    ----------
    before : str
        The gait, or the one from which the present change comes.
    after : str
        The one to which it leads; empty without a change.
    share : float
        s in [0, 1] of the gait after.
    rate : float
        ṡ ≥ 0 [1/s].
    cadence_scale : float
        Factor on the cadences.
    """

    before: str
    after: str = ''
    share: float = 0.0
    rate: float = 0.0
    cadence_scale: float = 1.0


def shares_of(gait: GaitInForce) -> GaitShares:
    """Shares of a gait in force."""
    if isinstance(gait, BlendedGait):
        way = gait.transition
        return GaitShares(
            way.before.name, way.after.name, gait.share, gait.rate, gait.cadence_scale)
    return GaitShares(gait.name, cadence_scale=gait.cadence_scale)


class KnownGaits:
    """Gaits by name, and the ways between them; ways that were asked for are kept.

    Parameters
    ----------
    gaits : mapping of str to Gait
        Gaits by name.
    """

    def __init__(self, gaits: Mapping[str, Gait]) -> None:
        """Remember the gaits."""
        self.gaits = dict(gaits)
        self._transitions: dict[tuple[str, str], GaitTransition] = {}
        self._last: tuple[GaitShares, GaitInForce] | None = None

    def in_force(self, shares: GaitShares) -> GaitInForce:
        """Gait of shares; the same object while they stay.

        Raises
        ------
        DataError
            If a gait is not known, or a number is impossible.
        """
        if self._last is None or shares != self._last[0]:
            self._last = shares, self._gait_of(shares)
        return self._last[1]

    def at_cadence(self, gait: GaitInForce, cadence_scale: float) -> GaitInForce:
        """Return a gait with this factor on its cadence instead of the one that it has."""
        if isinstance(gait, BlendedGait):
            return gait.scaled(cadence_scale)
        return self.named(gait.name).scaled(cadence_scale)

    def transition(self, before: Gait, after: Gait) -> GaitTransition:
        """Way from one gait to another; its arcs are chosen once."""
        names = (before.name, after.name)
        found = self._transitions.get(names)
        if found is None or found.before is not before or found.after is not after:
            found = self._transitions[names] = GaitTransition(before, after)
        return found

    def named(self, name: str) -> Gait:
        """Gait of a name; raises ParameterError with the valid names."""
        if not isinstance(name, str) or name not in self.gaits:
            raise ParameterError(
                f"there is no gait {shown(name)}; valid are {', '.join(self.gaits)}")
        return self.gaits[name]

    def chosen(self, choice: GaitChoiceParameters) -> tuple[Gait, ...]:
        """Gaits that are chosen among; none without ``auto_gait``. Raises as :meth:`named`."""
        try:
            return tuple(map(self.named, choice.auto_gaits if choice.auto_gait else ()))
        except ParameterError as error:
            raise ParameterError(f'auto_gaits: {error}') from None

    def _gait_of(self, shares: GaitShares) -> GaitInForce:
        before, after, share, rate, factor = shares
        if not (isfinite(factor) and factor > 0.0):
            raise DataError(f'the factor on the cadence must be positive, not {factor}')
        try:
            gait = self.named(before)
            if not after:
                return gait.scaled(factor)
            return self.transition(gait, self.named(after)).at(share, rate).scaled(factor)
        except ParameterError as error:
            raise DataError(f'{shares}: {error}') from error
