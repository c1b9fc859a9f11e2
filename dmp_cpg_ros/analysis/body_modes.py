# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When the robot was to stand on its feet: not while it lay, rose or lowered itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dmp_cpg_ros.analysis.recording import Recording
from dmp_cpg_ros.core.modes.command import BALANCED

Array = NDArray[np.float64]


def should_stand(recording: Recording, time: Array) -> NDArray[np.bool_]:
    """Whether the robot was to stand at some times.

    Parameters
    ----------
    recording : Recording
        The run; where its body mode was not recorded the robot was to stand always.
    time : ndarray (n,)
        [s]

    Returns
    -------
    ndarray (n,) of bool
    """
    if not recording.modes:
        return np.ones(len(time), dtype=bool)
    changes = np.array([event.time for event in recording.modes])
    standing = np.array([event.message in BALANCED for event in recording.modes])
    return np.asarray(standing[np.maximum(np.searchsorted(changes, time, 'right') - 1, 0)])


def stands_until(recording: Recording, start: float, end: float) -> float:
    """First time in an interval at which the robot is not to stand, or the interval's end [s]."""
    down = (event.time for event in recording.modes if event.message not in BALANCED)
    return min((time for time in down if start <= time < end), default=end)


def fall_noticed(recording: Recording) -> bool:
    """Whether the suite noticed a fall; a robot that was found fallen has not fallen since."""
    return any(event.message == 'damped' for event in recording.modes[1:])
