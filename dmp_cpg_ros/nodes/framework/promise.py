# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is promised of a stop or a start that was requested."""

from __future__ import annotations

from math import isfinite, nan
from typing import NamedTuple

from dmp_cpg_ros.core.inhibition.prediction import Outlook
from dmp_cpg_ros.core.maths.rounding import exactly, no_less


class Promise(NamedTuple):
    """When a request will be fulfilled.

    Attributes
    ----------
    predicted_s, bound_s : float
        Time from the request to rest or to walking as predicted, and its certified bound [s]; not
        finite where there is none.
    bound_m : float
        Way of the reference until rest, at most [m]; NaN for a start.
    outlook : Outlook or None
        What is predicted of the body.
    """

    predicted_s: float = nan
    bound_s: float = nan
    bound_m: float = nan
    outlook: Outlook | None = None

    @property
    def stands_s(self) -> float:
        """Time until the body stands [s]."""
        return self.outlook.stands_s if self.outlook else nan

    def told_later(self, since_s: float, before_m: float) -> Promise:
        """The same bounds when the request is some time ago [s], since when the reference has
        gone no farther than was promised then [m].
        """
        return Promise(self.predicted_s + since_s, self.bound_s + since_s, self.bound_m + before_m)

    def foreseen(self, outlook: Outlook, since_s: float) -> Promise:
        """The same with what is predicted, of a request that is some time ago [s]; what it has
        taken stays where that is known.
        """
        known = isfinite(self.predicted_s)
        return self._replace(
            predicted_s=self.predicted_s if known else outlook.time_s + since_s,
            outlook=outlook._replace(down_s=outlook.down_s + since_s))

    def words(self, stop: bool, certificate: str, push_recovery: bool) -> str:
        """Say it, with the certificate in a few words; and whether pushes begin the gait anew."""
        when = f'in {exactly(self.predicted_s)} s' if isfinite(self.predicted_s) else (
            'not within 10 s')
        most = f'at most {no_less(self.bound_s)} s' if isfinite(self.bound_s) else (
            'without a bound from this state')
        way = (f'; the reference goes on for at most {no_less(self.bound_m)} m{self._standing()}'
               + ('; a push may begin it anew' if push_recovery else '')) if stop else ''
        return f'{"at rest" if stop else "walking"} {when}, {most}; {certificate}{way}'

    def _standing(self) -> str:
        """When and where the body will stand, of which there is no certificate but trials."""
        of = self.outlook
        if of is None or not isfinite(of.time_s):
            return ''
        return (f'; the body stands in about {of.stands_s:.2f} s, by trials within '
                f'{no_less(of.stands_within_s, 2)} s and {no_less(of.stands_within_m, 2)} m')
