# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which changes of gait ``canonical_oscillators`` accepts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from dmp_cpg_ros.core.certificates.changes import refused_change
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.running import CanonicalState, RunningGait
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.suite_parameters import (
    CertificateParameters,
    GaitParameters,
    SuiteParameters,
    TickParameters,
)

Sets = Mapping[type[Parameters], Parameters]


def check_gait(
    running: RunningGait, state: CanonicalState, sets: Sets, before: Sets
) -> None:
    """Refuse parameters whose gaits are not known, or whose changes of gait are not certified.

    Parameters
    ----------
    running : RunningGait
        What walks.
    state : CanonicalState
        Its state.
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
    named = running.gaits.named
    if asked:
        named(name)
        if choice.auto_gait:
            raise ParameterError(
                f"gait = '{name}' cannot be set while auto_gait chooses among "
                f'{", ".join(choice.auto_gaits)}; set auto_gait to false first'
            )
    if chosen:
        gaits = [state.leading_to, state.wanted, *map(named, choice.auto_gaits)]
    elif asked:
        gaits = [state.leading_to, state.wanted, named(name)]
    else:
        return
    reason = refused_change(
        SuiteParameters.of(sets),
        [named(gait.name) for gait in gaits],
        running.scale,
        _of(sets, TickParameters).tick_ns * 1e-9,
    )
    if reason and not _of(sets, CertificateParameters).allow_uncertified:
        raise ParameterError(f'{reason} (allow_uncertified:=true changes all the same)')


def _of(sets: Sets, kind: type[Any]) -> Any:
    return cast(Any, sets[kind])
