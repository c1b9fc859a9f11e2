# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the body is doing, as the posture block tells the legs."""

from __future__ import annotations

from dataclasses import dataclass

BALANCED = ('standing', 'stopping')
"""Modes in which the gait's primitives move the legs and the posture controller balances."""

MOVING = ('lowering', 'rising', 'recovering')
"""Modes in which discrete primitives move the legs."""

MODES = (*BALANCED, 'lying', *MOVING, 'damped')
"""All modes."""


@dataclass(frozen=True)
class BodyCommand:
    """What the legs have to do in a tick.

    Attributes
    ----------
    mode : str
        One of ``MODES``.
    movement : str
        Name of the movement in a moving mode, else empty.
    x : float
        Phase of the movement's canonical system, 1 at its beginning and falling to 0; a jump
        upwards begins a new movement.
    x_dot : float
        Its rate [1/s].
    """

    mode: str = 'standing'
    movement: str = ''
    x: float = 0.0
    x_dot: float = 0.0

    @property
    def balanced(self) -> bool:
        """Whether the gait's primitives move the legs."""
        return self.mode in BALANCED


WITHOUT_MOVEMENT = {mode: BodyCommand(mode) for mode in MODES}
"""Command of each mode while no movement is under way."""

STANDING = WITHOUT_MOVEMENT['standing']
"""The gait may run."""
