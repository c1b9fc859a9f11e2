# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sharing a body wrench among stance feet within friction cones.

Weighted least squares (the minimum of Σ|f_i|²/w_i that yields the wrench), then each force is
brought into its cone: 0 ≤ f_z ≤ f_max and |f_xy| ≤ μ f_z. The limits therefore always hold; the
wrench is met where they allow it.

The minimum is f_i = w_i (λ + κ × p_i), with two multipliers λ and κ of the wrench. With
S = Σ w_i, the feet's mean c = Σ w_i p_i / S, a damping δ and the importance d of the moments, the
wrench (f, m) is met by

    (S + δ) λ + S κ × c = f ,    S c × λ + (Σ w_i (|p_i|² I − p_i p_iᵀ) + δ diag(d)⁻²) κ = m ,

of which λ is eliminated: three equations are left, with the feet's second moments about c.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

from dmp_cpg_ros.core.maths.vec3 import Triple, cross, inverse, times

REGULARISATION = 1e-4
"""Damping of the least squares, relative to the mean of the weights; keeps one or two stance
feet well posed.
"""

EQUAL = (1.0, 1.0, 1.0)


def distribute(
    force: Triple, moment: Triple, feet: Sequence[Triple], load: Sequence[float], friction: float,
    largest: float, importance: Triple = EQUAL,
) -> list[Triple]:
    """Forces of the ground on the feet.

    Parameters
    ----------
    force, moment : tuple of float
        Wanted force [N] and moment about the centre of mass [N m], z up.
    feet : sequence of n tuples of float
        Feet relative to the centre of mass in the same frame [m].
    load : sequence of n floats
        Weight of each foot in [0, 1]; 0 takes no force.
    friction : float
        μ of the cones.
    largest : float
        Largest normal force of a fully loaded foot [N]; scaled by ``load``.
    importance : tuple of float, optional
        Weights of the moment's components relative to the force's, where not all of them can be
        met [1/m]: one or two feet cannot turn the body about the line through them but by a
        horizontal force.

    Returns
    -------
    list of n tuples of float
        f_i [N].
    """
    total = sum(load)
    if total <= 0.0:
        return [(0.0, 0.0, 0.0)] * len(feet)
    pull, turn = _multipliers(force, moment, feet, load, total, importance)
    (pull_x, pull_y, pull_z), forces = pull, []
    for foot, share in zip(feet, load, strict=True):
        x, y, z = cross(turn, foot)
        x, y, z = share * (pull_x + x), share * (pull_y + y), share * (pull_z + z)
        z = min(max(z, 0.0), largest * share)
        tangential, allowed = sqrt(x * x + y * y), friction * z
        if tangential > allowed:
            x, y = x * (allowed / tangential), y * (allowed / tangential)
        forces.append((x, y, z))
    return forces


def _multipliers(
    force: Triple, moment: Triple, feet: Sequence[Triple], load: Sequence[float], total: float,
    importance: Triple,
) -> tuple[Triple, Triple]:
    """λ and κ of the module's text."""
    damping = REGULARISATION * max(total / len(feet), 1e-9)
    c_x = c_y = c_z = 0.0
    for (x, y, z), share in zip(feet, load, strict=True):
        c_x, c_y, c_z = c_x + share * x, c_y + share * y, c_z + share * z
    c_x, c_y, c_z = c_x / total, c_y / total, c_z / total
    # what damping leaves of the moments of c itself
    left = total * damping / (total + damping)
    xx, yy, zz = left * c_x * c_x, left * c_y * c_y, left * c_z * c_z
    xy, xz, yz = left * c_x * c_y, left * c_x * c_z, left * c_y * c_z
    for (x, y, z), share in zip(feet, load, strict=True):
        x, y, z = x - c_x, y - c_y, z - c_z
        xx, yy, zz = xx + share * x * x, yy + share * y * y, zz + share * z * z
        xy, xz, yz = xy + share * x * y, xz + share * x * z, yz + share * y * z
    d_x, d_y, d_z = importance
    a, b, c = damping / (d_x * d_x), damping / (d_y * d_y), damping / (d_z * d_z)
    spread = ((yy + zz + a, -xy, -xz), (-xy, xx + zz + b, -yz), (-xz, -yz, xx + yy + c))
    given = total / (total + damping)  # of the force's moment about the centre of mass
    x, y, z = cross((c_x, c_y, c_z), force)
    turn = times(
        inverse(spread), (moment[0] - given * x, moment[1] - given * y, moment[2] - given * z))
    x, y, z = cross(turn, (c_x, c_y, c_z))
    inertia = total + damping
    return (
        ((force[0] - total * x) / inertia, (force[1] - total * y) / inertia,
         (force[2] - total * z) / inertia),
        turn,
    )
