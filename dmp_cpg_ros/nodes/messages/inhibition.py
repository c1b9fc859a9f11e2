# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``inhibition_gains``, and ``inhibition_state`` for people."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray

from dmp_cpg_ros import layouts
from dmp_cpg_ros.core.canonical.inhibition import Inhibition, InhibitionParameters
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.inhibition.announced import Announced
from dmp_cpg_ros.core.inhibition.step_timing import QUICKEST
from dmp_cpg_ros.core.parameters import range_of
from dmp_cpg_ros.core.robot_model.state import LEGS
from dmp_cpg_ros.core.suite_parameters import INHIBITION, RequestParameters
from dmp_cpg_ros.core.voting.parameters import VotingParameters
from dmp_cpg_ros.nodes.messages import cdr
from dmp_cpg_ros.nodes.messages.joint_states import AnyJoints, JointStateReader, JointStateWriter
from dmp_cpg_ros.nodes.messages.values import header_ns, status_message


class InhibitionGainsWriter:
    """Writes ``inhibition_gains``."""

    def __init__(self) -> None:
        """Lay the message out."""
        self._writer = JointStateWriter(layouts.GAIN_ROWS, cdr.FIELDS[:1])

    def fill(self, time_ns: int, inhibition: Inhibition, from_ns: int = 0
             ) -> cdr.SerializedJointState:
        """Refill with what acts from a tick on [ns]; raises DataError when a number is not
        finite.
        """
        return self._writer.fill(time_ns, np.array((
            *inhibition.gains, inhibition.region_radius, inhibition.rest_phase,
            inhibition.requested, inhibition.at_rest, inhibition.automatic, inhibition.opposite,
            inhibition.share, inhibition.quickness, 1e-9 * max(0, from_ns - time_ns))))


_LARGEST_GAIN = (range_of(InhibitionParameters, 'inhibition_gain')[1]
                 * range_of(VotingParameters, 'vote_limit')[1])
_RADII = range_of(InhibitionParameters, 'region_radius')
_LONGEST_LEAD = range_of(RequestParameters, 'request_lead')[1]


class InhibitionGainsReader:
    """Reads ``inhibition_gains``."""

    def __init__(self) -> None:
        """Prepare the order."""
        self._reader = JointStateReader(layouts.GAIN_ROWS, cdr.FIELDS[:1])

    def read(self, message: AnyJoints) -> Inhibition:
        """Inhibition that is announced; raises DataError for numbers that no parameters allow."""
        return self.read_ahead(message)[0]

    def read_ahead(self, message: AnyJoints) -> tuple[Inhibition, int]:
        """Inhibition that is announced, and how long after its stamp it begins to act [ns]."""
        (values,) = self._reader.read(message)
        gains, (radius, rest, *flags, share, quickness, lead) = (
            values[:len(LEGS)], values[len(LEGS):].tolist())
        if not (0.0 <= gains.min() and gains.max() <= _LARGEST_GAIN):
            raise DataError(f'gains {gains} must be from 0 to {_LARGEST_GAIN:g}')
        low, high = _RADII
        if not low <= radius <= high:
            raise DataError(f'region_radius = {radius} must be from {low:g} to {high:g}')
        if not {0.0, 1.0}.issuperset(flags):
            raise DataError(f'{", ".join(layouts.GAIN_ROWS[-7:-3])} must be 0 or 1, not {flags}')
        if not 0.0 <= rest <= 2.0 * pi:
            raise DataError(f'rest_phase = {rest} must be from 0 to 2 pi')
        if not 0.0 < share <= 1.0:
            raise DataError(f'share = {share} must be above 0 and at most 1')
        if not 1.0 <= quickness <= QUICKEST:
            raise DataError(f'quickness = {quickness} must be from 1 to {QUICKEST:g}')
        if not 0.0 <= lead <= _LONGEST_LEAD:
            raise DataError(f'lead = {lead} must be from 0 to {_LONGEST_LEAD:g}')
        requested, at_rest, automatic, opposite = map(bool, flags)
        return Inhibition(requested, gains, radius, at_rest, automatic, opposite, rest, share,
                          quickness), round(1e9 * lead)


class AnnouncedReader:
    """Reads ``inhibition_gains`` in their order: what acts, and what is to."""

    def __init__(self) -> None:
        """Know nothing."""
        self._reader = InhibitionGainsReader()
        self._known: Announced | None = None

    def read(self, message: AnyJoints) -> Announced:
        """What has been announced up to now, of which the first acts at once; raises DataError as
        :meth:`InhibitionGainsReader.read` does.
        """
        inhibition, lead_ns = self._reader.read_ahead(message)
        stamp_ns = header_ns(message)
        # nobody who hears this is behind the stamp: whoever sent it has heard of his tick
        known = (self._known or Announced(inhibition)).at(stamp_ns)
        self._known = known.told(stamp_ns + lead_ns, inhibition)
        return self._known


def inhibition_state(time_ns: int, word: str, values: Mapping[str, Any]) -> DiagnosticArray:
    """State word of the stop at a time [ns], with values, for people."""
    return status_message(INHIBITION, time_ns, word, values)


def read_state_word(message: DiagnosticArray) -> str:
    """State word of ``inhibition_state``, for people; raises DataError where there is none."""
    names = [status.name for status in message.status]
    if INHIBITION not in names:
        raise DataError(f"no status named '{INHIBITION}' among {names}")
    return str(message.status[names.index(INHIBITION)].message)
