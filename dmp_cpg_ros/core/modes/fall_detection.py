# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""When a robot counts as fallen: it is tilted, low, or carries nothing, for too long."""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.modes.body_condition import BodyCondition
from dmp_cpg_ros.core.parameters import Parameters, parameter


@dataclass(frozen=True)
class FallParameters(Parameters):
    """Limits beyond which the robot counts as fallen."""

    fall_tilt: float = parameter(
        0.9, 'tilt beyond which the robot has fallen', unit='rad', minimum=0.1, maximum=3.2
    )
    fall_height: float = parameter(
        0.5,
        'height over its feet below which a robot that should stand has fallen, as a fraction of '
        'the standing height',
        minimum=0.0,
        maximum=0.95,
    )
    fall_delay: float = parameter(
        0.1, 'time after which a tilted or low robot has fallen', unit='s', minimum=0.0,
        maximum=5.0,
    )
    fall_support: float = parameter(
        0.08,
        'share of the weight on the legs below which a robot that should stand has lost the '
        'ground; 0: never',
        minimum=0.0,
        maximum=0.9,
    )
    fall_support_delay: float = parameter(
        0.6, 'time after which a robot without ground under its feet has fallen', unit='s',
        minimum=0.05, maximum=10.0,
    )


@dataclass(frozen=True)
class FallState:
    """Since when each sign has been there [ns]; −1 while it is not."""

    tilted_ns: int = -1
    low_ns: int = -1
    unsupported_ns: int = -1


class FallDetector:
    """Watches the condition; state in, state out.

    Parameters
    ----------
    parameters : FallParameters
        Limits.
    stance_height : float
        Height of ``base_link`` when standing [m].
    """

    def __init__(self, parameters: FallParameters, stance_height: float) -> None:
        """Keep the limits."""
        self.parameters, self._stance_height = parameters, stance_height

    def step(
        self, state: FallState, condition: BodyCondition, time_ns: int, standing: bool
    ) -> tuple[FallState, str]:
        """Look at one tick.

        Parameters
        ----------
        state : FallState
            State after the last tick.
        condition : BodyCondition
            Condition at this tick.
        time_ns : int
            Its stamp [ns].
        standing : bool
            Whether the robot should stand on its feet; else only its tilt is watched.

        Returns
        -------
        state : FallState
        sign : str
            What says that it has fallen; empty while it has not.
        """
        p, share = self.parameters, condition.height / self._stance_height
        state = FallState(
            _since(state.tilted_ns, condition.tilt > p.fall_tilt, time_ns),
            _since(state.low_ns, standing and share < p.fall_height, time_ns),
            _since(
                state.unsupported_ns, standing and condition.support < p.fall_support, time_ns
            ),
        )
        if _lasts(state.tilted_ns, time_ns, p.fall_delay):
            return state, f'tilted by {condition.tilt:.2f} rad, more than {p.fall_tilt:g} rad'
        if _lasts(state.low_ns, time_ns, p.fall_delay):
            return state, (
                f'{condition.height:.3f} m over its feet, less than {p.fall_height:g} of '
                f'{self._stance_height:.3f} m'
            )
        if _lasts(state.unsupported_ns, time_ns, p.fall_support_delay):
            return state, f'no ground under its feet for {p.fall_support_delay:g} s'
        return state, ''


def _since(since_ns: int, present: bool, time_ns: int) -> int:
    if not present:
        return -1
    return since_ns if since_ns >= 0 else time_ns


def _lasts(since_ns: int, time_ns: int, delay_s: float) -> bool:
    return since_ns >= 0 and (time_ns - since_ns) * 1e-9 >= delay_s
