# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which changes of gait ``canonical_oscillators`` accepts, and which gait is then wanted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from dmp_cpg_ros.core.balance.controller import PostureParameters
from dmp_cpg_ros.core.canonical.inhibition import InhibitionParameters
from dmp_cpg_ros.core.certificates.changes import refused_change
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.network import CanonicalParameters
from dmp_cpg_ros.core.gait.running_network import RunningNetwork
from dmp_cpg_ros.core.gait.transition import GaitChangeParameters
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.reference.filter import ReferenceParameters
from dmp_cpg_ros.core.suite_parameters import (
    CertificateParameters,
    GaitParameters,
    SuiteParameters,
    TickParameters,
)
from dmp_cpg_ros.core.transformation.leg import LegParameters

Sets = Mapping[type[Parameters], Parameters]


def take_gait(
    running: RunningNetwork, gait: GaitParameters, choice: GaitChoiceParameters
) -> None:
    """Let a network want what parameters say; without ``auto_gait`` that is the parameter
    ``gait``.
    """
    running.choice = choice
    if not choice.auto_gait:
        running.want(gait.gait)


def check_gait(running: RunningNetwork, sets: Sets, before: Sets) -> None:
    """Refuse parameters whose gaits are not known, or whose changes of gait are not certified.

    Parameters
    ----------
    running : RunningNetwork
        What walks.
    sets, before : mapping from class to instance
        The new parameters and those in effect.

    Raises
    ------
    ParameterError
        With the valid names, or with the inequality that fails.
    """
    name, choice = _of(sets, GaitParameters).gait, _of(sets, GaitChoiceParameters)
    asked = name != _of(before, GaitParameters).gait
    chosen = choice.auto_gait and choice != _of(before, GaitChoiceParameters)
    named = running.networks.reader.named
    if asked:
        named(name)
        if choice.auto_gait:
            raise ParameterError(
                f"gait = '{name}' cannot be set while auto_gait chooses among "
                f'{", ".join(choice.auto_gaits)}; set auto_gait to false first'
            )
    if chosen:
        gaits = [running.leading_to, running.wanted, *map(named, choice.auto_gaits)]
    elif asked:
        gaits = [running.leading_to, running.wanted, named(name)]
    else:
        return
    reason = refused_change(
        SuiteParameters(
            _of(sets, ReferenceParameters),
            _of(sets, CanonicalParameters),
            _of(sets, InhibitionParameters),
            _of(sets, LegParameters),
            _of(sets, PostureParameters),
            gait_change=_of(sets, GaitChangeParameters),
        ),
        [named(gait.name) for gait in gaits],
        running.networks.scale,
        _of(sets, TickParameters).tick_ns * 1e-9,
    )
    if reason and not _of(sets, CertificateParameters).allow_uncertified:
        raise ParameterError(f'{reason} (allow_uncertified:=true changes all the same)')


def _of(sets: Sets, kind: type[Any]) -> Any:
    return cast(Any, sets[kind])
