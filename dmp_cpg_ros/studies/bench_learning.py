# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Compares learning with ``movement_primitives`` (DFKI, BSD licence) on the same data in one run.

Both get positions only and the same number of bases; each reproduces with its own integrator at
the demonstration's sampling interval. Where that package is not installed, its columns stay empty;
it has no rhythmic primitive, so that of each rhythm one cycle is learned as a discrete movement
too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.commands.demonstration_files import read_demonstration
from dmp_cpg_ros.core.errors import DmpCpgError
from dmp_cpg_ros.core.learning import discrete as learning_discrete
from dmp_cpg_ros.core.learning import rhythmic as learning_rhythmic
from dmp_cpg_ros.core.learning.learning import ranges
from dmp_cpg_ros.core.learning.period import find_period, mean_cycle, spread_between_cycles
from dmp_cpg_ros.core.primitives.demonstration import Demonstration
from dmp_cpg_ros.paper.demonstrations import (
    LETTERS,
    handwriting,
    joint_angles,
    straight_reach,
    walking_joints,
)

_REPEATS = 5


@dataclass(frozen=True)
class LearningResult:
    """How one library learned one demonstration.

    Attributes
    ----------
    errors : ndarray (n,)
        Largest reproduction error over time, as a fraction of each degree of freedom's range.
    seconds : float
        Shortest fit of several [s].
    """

    errors: NDArray[np.float64]
    seconds: float


def demonstrations() -> dict[str, tuple[str, Demonstration]]:
    """Built demonstrations by name, each with its kind, positions only."""
    made = {f'handwriting {letter}': ('discrete', handwriting(letter)) for letter in LETTERS}
    made['minimum jerk'] = ('discrete', straight_reach([0.0, 1.0], [1.0, -1.0]))
    made['joint angles'] = ('discrete', joint_angles())
    made['walking joints'] = ('rhythmic', walking_joints())
    return {
        name: (kind, Demonstration(d.times, d.positions, names=d.names))
        for name, (kind, d) in made.items()
    }


def single_cycles(
    rows: dict[str, tuple[str, Demonstration]],
) -> dict[str, tuple[str, Demonstration]]:
    """First and mean cycle of every rhythm as discrete movements, for discrete libraries.

    Parameters
    ----------
    rows : dict
        Name → kind and demonstration.

    Returns
    -------
    dict
        The same of the single cycles.
    """
    cycles = {}
    for name, (kind, whole) in rows.items():
        if kind == 'rhythmic':
            period = find_period(whole)
            for which, of in (('one', whole), ('mean', mean_cycle(whole, period))):
                inside = of.times - of.times[0] <= period * (1.0 + 1e-9)
                cycle = Demonstration(of.times[inside], of.positions[inside])
                cycles[f'{which} cycle of {name}'] = ('discrete', cycle)
    return cycles


def learn_ours(kind: str, demonstration: Demonstration, bases: int) -> LearningResult:
    """Fit and reproduce with this package; the period of a rhythm is found in the fit.

    Parameters
    ----------
    kind : str
        ``discrete`` or ``rhythmic``.
    demonstration : Demonstration
    bases : int

    Returns
    -------
    LearningResult
    """
    if kind == 'discrete':
        reach, seconds = _fastest(lambda: learning_discrete.learn_discrete(demonstration, bases))
        errors = learning_discrete.reproduction_errors(reach, demonstration)
    else:
        cycle, seconds = _fastest(lambda: learning_rhythmic.learn_rhythmic(demonstration, bases))
        errors = learning_rhythmic.reproduction_errors(cycle, demonstration)
    return LearningResult(errors, seconds)


def learn_theirs(demonstration: Demonstration, bases: int) -> LearningResult | None:
    """Fit and reproduce with ``movement_primitives``; None where it cannot be imported.

    Parameters
    ----------
    demonstration : Demonstration
        Of a discrete movement.
    bases : int

    Returns
    -------
    LearningResult or None
    """
    try:
        DMP = import_module('movement_primitives.dmp').DMP
    except ImportError:
        return None
    times = demonstration.times - demonstration.times[0]

    def fit() -> Any:
        dmp = DMP(demonstration.dofs, float(times[-1]), float(times[1]), bases)
        dmp.imitate(times, demonstration.positions)
        return dmp

    dmp, seconds = _fastest(fit)
    made_at, made = dmp.open_loop()
    columns = [np.interp(times, made_at, column) for column in made.T]
    errors = np.abs(np.stack(columns, axis=1) - demonstration.positions).max(axis=0)
    return LearningResult(errors / ranges([demonstration]), seconds)


def table(rows: dict[str, tuple[str, Demonstration]], bases: int) -> str:
    """Markdown table of both libraries.

    Errors are of the median and of the worst degree of freedom. For rhythms there are also the
    departure of the recorded cycles from their mean, which no periodic movement can reproduce,
    and the error from that mean.

    Parameters
    ----------
    rows : dict
        Name → kind and demonstration.
    bases : int

    Returns
    -------
    str
    """
    lines = [
        '| demonstration | samples | degrees of freedom | differs between cycles | '
        'error from the mean cycle | error | fit | '
        'error, movement_primitives | fit, movement_primitives |',
        '|---|---|---|---|---|---|---|---|---|',
    ]
    for name, (kind, demonstration) in rows.items():
        differs = from_mean = '–'
        if kind == 'rhythmic':
            period = find_period(demonstration)
            spread = spread_between_cycles(demonstration, period)
            differs = _percent(spread / ranges([demonstration]))
            primitive = learning_rhythmic.learn_rhythmic(demonstration, bases, period=period)
            from_mean = _percent(
                learning_rhythmic.reproduction_errors(
                    primitive, mean_cycle(demonstration, period), period
                )
            )
        ours = learn_ours(kind, demonstration, bases)
        theirs = learn_theirs(demonstration, bases) if kind == 'discrete' else None
        lines.append(
            f'| {name} | {len(demonstration.times)} | {demonstration.dofs} | {differs} | '
            f'{from_mean} | {_cells(ours)} | {_cells(theirs)} |'
        )
    return '\n'.join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison and print its table; returns the exit status."""
    parser = argparse.ArgumentParser(prog='bench_learning', description=__doc__)
    parser.add_argument('--bases', type=int, default=25, help='default: 25')
    parser.add_argument('--bag', type=Path, help='a recorded walk to learn the joints of, too')
    parser.add_argument('--start', type=float, help='of the bag, after its first sample [s]')
    parser.add_argument('--end', type=float, help='of the bag, after its first sample [s]')
    options = parser.parse_args(arguments)
    rows = demonstrations()
    try:
        if options.bag is not None:
            walk = read_demonstration(options.bag, start=options.start, end=options.end)
            rows['recorded walk'] = ('rhythmic', Demonstration(walk.times, walk.positions))
        rows.update(single_cycles(rows))
        print(table(rows, options.bases))
    except DmpCpgError as error:
        print(f'bench_learning: {error}', file=sys.stderr)
        return 2
    return 0


def _fastest(fit: Callable[[], Any]) -> tuple[Any, float]:
    """Result and the shortest of several durations, the least disturbed by other processes."""
    durations = []
    for _ in range(_REPEATS):
        began = perf_counter()
        result = fit()
        durations.append(perf_counter() - began)
    return result, min(durations)


def _cells(result: LearningResult | None) -> str:
    if result is None:
        return '– | –'
    return f'{_percent(result.errors)} | {1e3 * result.seconds:.2g} ms'


def _percent(values: NDArray[np.float64]) -> str:
    """Median and worst of some fractions."""
    return f'{100.0 * np.median(values):.2g} / {100.0 * np.max(values):.2g} %'


if __name__ == '__main__':
    sys.exit(main())
