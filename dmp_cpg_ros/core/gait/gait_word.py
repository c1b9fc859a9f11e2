# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The gait that acts, in words: it travels with the phases, so that whoever reads a phase knows
how to read it.

The word is the gait's name, followed by `` *`` and the factor on its cadence where that is not 1:
``trot``, ``trot *1.25``. While gaits change it is both names, the share s of the way and its rate
ṡ [1/s]: ``amble>trot 0.35 0.61``. Numbers are written so that they read back to the same floats.
It is the ``frame_id`` of ``canonical_state``.
"""

from __future__ import annotations

from math import isfinite

from dmp_cpg_ros.core.errors import DataError

_SEPARATOR = ' *'


def gait_word(name: str, cadence_scale: float) -> str:
    """Word of a gait at a cadence.

    Parameters
    ----------
    name : str
        Name of the gait.
    cadence_scale : float
        Factor on its cadence.
    """
    return name if cadence_scale == 1.0 else f'{name}{_SEPARATOR}{float(cadence_scale)!r}'


def read_gait_word(word: str) -> tuple[str, float]:
    """Name of the gait and factor on its cadence.

    Raises
    ------
    DataError
        If the factor is not a positive number.
    """
    name, separator, factor = word.partition(_SEPARATOR)
    if not separator:
        return name, 1.0
    try:
        scale = float(factor)
    except ValueError:
        scale = float('nan')
    if not (isfinite(scale) and scale > 0.0):
        raise DataError(
            f"gait '{word}': the factor after '{_SEPARATOR.strip()}' must be a positive number, "
            "as in 'trot *1.25'"
        )
    return name, scale
