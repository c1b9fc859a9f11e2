# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Random numbers and graphs of the attacks on certificates, and the smallest case that fails."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from dmp_cpg_ros.core.canonical.coupling import Edges

Case = dict[str, Any]
Judged = tuple[str, float] | None
"""What is wrong, empty for nothing, and the largest share of a promise that was needed; None where
a case is impossible or not certified.
"""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform between those of two others."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def random_edges(size: int, rng: np.random.Generator) -> Edges:
    """Directed edges among which node 0 reaches all."""
    edges = {(i, int(rng.integers(i))) for i in range(1, size)}
    edges |= {(int(i), int(j)) for i, j in rng.integers(size, size=(size, 2)) if i != j}
    return tuple(sorted(edges))


def both_ways(edges: Iterable[tuple[int, int]]) -> Edges:
    """Edges and their reverses."""
    edges = set(edges)
    return tuple(sorted(edges | {(j, i) for i, j in edges}))


def smallest(case: Case, simpler: Callable[[Case], Iterator[Case]], fails: Callable[[Case], bool],
             seconds: float = math.inf) -> Case:
    """Take what is simpler than a case and still fails, again and again, for a time [s]."""
    end, trials = time.monotonic() + seconds, simpler(case)
    while time.monotonic() < end and (trial := next(trials, None)) is not None:
        if fails(trial):
            case, trials = trial, simpler(trial)
    return case
