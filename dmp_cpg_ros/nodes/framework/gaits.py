# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot's description and the gaits of the nodes that walk, and which changes of gait are
accepted.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from dmp_cpg_ros.configuration import find_config
from dmp_cpg_ros.core.certificates.certify import Certificate
from dmp_cpg_ros.core.certificates.changes import refused_change
from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.gait.choice import GaitChoiceParameters
from dmp_cpg_ros.core.gait.known_gaits import KnownGaits
from dmp_cpg_ros.core.gait.running import CanonicalState, RunningGait
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitInForce
from dmp_cpg_ros.core.parameters import Parameters
from dmp_cpg_ros.core.robot_model.description import RobotDescription
from dmp_cpg_ros.core.suite_parameters import (
    CertificateParameters,
    GaitParameters,
    RobotFileParameters,
    SuiteParameters,
    TickParameters,
)
from dmp_cpg_ros.nodes.framework.suite_node import SuiteNode
from dmp_cpg_ros.robot.model_reader import load_description
from dmp_cpg_ros.suite import load_gaits


def description_of(node: SuiteNode) -> RobotDescription:
    """Description of the robot that a node's parameters name."""
    return load_description(find_config(node.parameters_of(RobotFileParameters).robot))


def known_gaits(node: SuiteNode) -> KnownGaits:
    """Read all gaits of the file that a node's parameters name; raises ParameterError when the
    gait that they choose is not among them.
    """
    gaits = KnownGaits(load_gaits(node.parameters_of(GaitParameters).gaits_file))
    gaits.named(gait_name(node))
    return gaits


def gait_name(node: SuiteNode) -> str:
    """Name of the gait that a node's parameters choose."""
    return node.parameters_of(GaitParameters).gait


def follow_gait(node: SuiteNode, gait: GaitInForce) -> None:
    """Let a node's parameter ``gait`` name the gait that its messages say, once it has changed."""
    if gait.name != gait_name(node) and not isinstance(gait, BlendedGait):
        node.follow({'gait': gait.name})


def certificate_words(certificate: Certificate) -> str:
    """Certificate in a few words: whether it holds, its grade, what is sampled."""
    if not certificate.holds:
        return f'certificate fails: {", ".join(entry.name for entry in certificate.failing)}'
    sampled = f', sampled: {", ".join(certificate.sampled)}' if certificate.sampled else ''
    return f'certificate holds, {certificate.contraction_grade} grade{sampled}'


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
