# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers as text that says no more than is known."""

from __future__ import annotations

from math import ceil, isfinite

_NOISE = 1e-6  # of the last digit: what arithmetic adds to a number that has no more digits


def exactly(seconds: float) -> str:
    """Text of a time of whole microseconds [s], with three decimals or as many as it has."""
    text = f'{seconds:.6f}'
    return text[:-3] + text[-3:].rstrip('0')


def no_less(bound: float, digits: int = 3) -> str:
    """Text of an upper bound with so many decimals, rounded upwards."""
    if not isfinite(bound):
        return f'{bound}'
    return f'{ceil(bound * 10.0**digits - _NOISE) / 10.0**digits:.{digits}f}'
