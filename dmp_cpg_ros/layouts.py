# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rows of the suite's own ``JointState`` messages, for nodes and analysis.

A row is the name of a state, the state in ``position``, its rate in ``velocity`` and what drives
it in ``effort``; messages are read by the names.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import copysign

from dmp_cpg_ros.core.balance.body_command import MODES, MOVING, BodyCommand
from dmp_cpg_ros.core.balance.capture_point import EDGES
from dmp_cpg_ros.core.errors import DataError
from dmp_cpg_ros.core.gait.known_gaits import GaitShares
from dmp_cpg_ros.core.modes.motion_library import MOVEMENT_NAMES
from dmp_cpg_ros.core.robot_model.state import JOINT_NAMES, LEGS

Rows = tuple[list[float], list[float]]
"""Positions and velocities."""

OSCILLATOR_ROWS = tuple(f'{leg}_x{i}' for leg in LEGS for i in (1, 2))
"""Of ``canonical_state``: the oscillators."""

GAIT_PREFIX = 'gait/'
"""Of ``canonical_state``: one row for each known gait, position = share, velocity = its rate."""

CADENCE_ROW = 'cadence_scale'
"""Of ``canonical_state``, at the end: the factor on the cadence."""

SHIFT_ROWS = tuple(f'{leg}_foot_{axis}' for leg in LEGS for axis in 'xyz')
CORRECTION_ROWS = ('base_x', 'base_y', 'base_yaw')
MARGIN_ROWS = tuple(f'margin/{edge}' for edge in EDGES)
PROGRESS_ROWS = tuple(
    f'progress/{what}' for what in ('x', 'y', 'behind', 'rough', 'gaps', 'high'))
FELT_ROWS = tuple(f'felt/{leg}' for leg in LEGS)
GROUND_ROWS = tuple(f'ground/{leg}' for leg in LEGS)
MODE_ROWS = tuple(f'mode/{mode}' for mode in MODES)
MOVEMENT_ROWS = tuple(f'movement/{name}' for name in MOVEMENT_NAMES)
POSTURE_ROWS = (
    *JOINT_NAMES, *SHIFT_ROWS, *CORRECTION_ROWS, *MARGIN_ROWS, *PROGRESS_ROWS, *FELT_ROWS,
    *GROUND_ROWS, *MODE_ROWS, *MOVEMENT_ROWS)
"""Of ``posture_feedback``. A margin's position is that of the capture point to an edge of the
support polygon [m]; those of the progress are the body's velocity [m/s], how far the leading
feet are behind, how rough the ground is, for what way gaps are counted on [m], and 1 while a foot
has met what is not climbed. What is felt of a leg is 1 while its joints are, 0 while their angles
are planned; of the ground, the heights of the feet over the plane that the body follows [m]. A
mode's position is 1 while it lasts, else 0; a movement's is the phase of its canonical system, 0
while it does not move the legs.
"""

GAIN_ROWS = (*LEGS, 'region_radius', 'rest_phase', 'requested', 'at_rest', 'automatic',
             'opposite', 'share', 'quickness', 'lead')
"""Of ``inhibition_gains``: α_i [1/s] of each leg, r₀, the phase of fl at rest [rad], four flags
that are 0 or 1, share of the command, factor on the cadence, and how long after the stamp it is
that all this begins to act [s].
"""

REFERENCE_ROWS = ('v_x', 'v_y', 'gamma')
"""Of ``gait_memory``, after those of ``canonical_state``."""


def work_rows(joints: Sequence[str]) -> tuple[str, ...]:
    """Rows of ``joint_work``: of each joint its work, and at the end what it lost."""
    return (*joints, *(f'loss/{joint}' for joint in joints))


def canonical_rows(gaits: Iterable[str]) -> tuple[str, ...]:
    """Rows of ``canonical_state`` where some gaits are known."""
    return (*OSCILLATOR_ROWS, *(GAIT_PREFIX + name for name in gaits), CADENCE_ROW)


def gait_rows(shares: GaitShares, rate_of_cadence: float, gaits: Sequence[str]) -> Rows:
    """Rows of the gaits and of the cadence, in the order of the gaits."""
    position, velocity = [0.0] * (len(gaits) + 1), [0.0] * (len(gaits) + 1)
    before = gaits.index(shares.before)
    position[before] = 1.0
    if shares.after:
        after = gaits.index(shares.after)
        position[before], velocity[before] = 1.0 - shares.share, -shares.rate
        position[after], velocity[after] = shares.share, shares.rate
    position[-1], velocity[-1] = shares.cadence_scale, rate_of_cadence
    return position, velocity


def read_gait_rows(names: Sequence[str], position: Sequence[float], velocity: Sequence[float],
                   ) -> GaitShares:
    """Gait in force of the rows that begin with ``GAIT_PREFIX``, and of the last one.

    Which gait gives way is told by the sign of its rate −ṡ, also while the change pauses and the
    rate is −0.0. A change of which nothing is done (s = 0) is none yet.

    Raises
    ------
    DataError
        If the shares are not those of one gait or of a change between two.
    """
    *shares, factor = position
    given = [(name[len(GAIT_PREFIX):], share, rate) for name, share, rate
             in zip(names, shares, velocity, strict=False) if share != 0.0]
    if len(given) == 1 and given[0][1] == 1.0:
        return GaitShares(given[0][0], cadence_scale=factor)
    given.sort(key=lambda row: copysign(1.0, row[2]))
    signs = [copysign(1.0, rate) for _, _, rate in given]
    if signs != [-1.0, 1.0] or not abs(given[0][1] + given[1][1] - 1.0) < 1e-9:
        raise DataError(f'shares of gaits {given} must be 1 of one gait, or 1 - s and s of two')
    (before, _, _), (after, share, rate) = given
    return GaitShares(before, after, share, rate, factor)


def command_rows(command: BodyCommand) -> Rows:
    """Rows of modes and movements, for ``posture_feedback``."""
    position, velocity = ([0.0] * (len(MODES) + len(MOVEMENT_NAMES)) for _ in range(2))
    position[MODES.index(command.mode)] = 1.0
    if command.movement:
        row = len(MODES) + MOVEMENT_NAMES.index(command.movement)
        position[row], velocity[row] = command.x, command.x_dot
    return position, velocity


def read_command_rows(position: Sequence[float], velocity: Sequence[float]) -> BodyCommand:
    """What the body does by the rows of modes and movements.

    Raises
    ------
    DataError
        If not one mode is in force, or if a mode and its movement do not go together.
    """
    count = len(MODES)
    modes = [mode for mode, value in zip(MODES, position, strict=False) if value == 1.0]
    moved = [k for k, x in enumerate(position[count:]) if x != 0.0]
    if len(modes) != 1 or sum(map(abs, position[:count])) != 1.0:
        raise DataError(f'one of {", ".join(MODE_ROWS)} must be 1 and the others 0')
    if len(moved) != (modes[0] in MOVING):
        raise DataError(f"mode '{modes[0]}' with {len(moved)} movements; only {MOVING} have one")
    if not moved:
        return BodyCommand(modes[0])
    x, x_dot = position[count + moved[0]], velocity[count + moved[0]]
    if not 0.0 <= x <= 1.0:
        raise DataError(f'phase {x} of {MOVEMENT_NAMES[moved[0]]} must be in [0, 1]')
    return BodyCommand(modes[0], MOVEMENT_NAMES[moved[0]], x, x_dot)
