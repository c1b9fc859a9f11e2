# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the body is doing, as one line of text that travels with ``posture_feedback``.

``standing`` alone, or for movements ``rising rise 3 0.42``: mode, movement, how many movements
have begun, and the phase x of the discrete canonical system, as text that reads back to the same
float.
"""

from __future__ import annotations

from dataclasses import dataclass

from dmp_cpg_ros.core.errors import DataError

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
    count : int
        Number of movements begun; a change begins a new one.
    x : float
        Phase of the movement's canonical system, 1 at its beginning and falling to 0.
    """

    mode: str = 'standing'
    movement: str = ''
    count: int = 0
    x: float = 0.0

    @property
    def balanced(self) -> bool:
        """Whether the gait's primitives move the legs."""
        return self.mode in BALANCED

    @property
    def text(self) -> str:
        """The command as text."""
        if not self.movement:
            return self.mode
        return f'{self.mode} {self.movement} {self.count} {self.x!r}'

    @classmethod
    def from_text(cls, text: str) -> BodyCommand:
        """Read a text; raises DataError that says what is valid."""
        words = text.split()
        if not words or words[0] not in MODES or len(words) not in (1, 4):
            raise DataError(
                f"body mode '{text}' must be one of {', '.join(MODES)}, in {', '.join(MOVING)} "
                'followed by movement, count and phase'
            )
        mode, *rest = words
        if not rest:
            if mode in MOVING:
                raise DataError(f"body mode '{text}' lacks movement, count and phase")
            return cls(mode)
        try:
            count, x = int(rest[1]), float(rest[2])
        except ValueError as error:
            raise DataError(f"body mode '{text}': {error}") from None
        if mode not in MOVING or not 0.0 <= x <= 1.0:
            raise DataError(
                f"body mode '{text}': {', '.join(MOVING)} have a movement, its phase in [0, 1]"
            )
        return cls(mode, rest[0], count, x)


STANDING = BodyCommand()
"""The gait may run."""
