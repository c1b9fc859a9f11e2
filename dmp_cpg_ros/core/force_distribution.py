# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Sharing a body wrench among stance feet within friction cones.

Weighted least squares (the minimum of Σ|f_i|²/w_i that yields the wrench), then each force is
brought into its cone: 0 ≤ f_z ≤ f_max and |f_xy| ≤ μ f_z. The limits therefore always hold; the
wrench is met where they allow it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REGULARISATION = 1e-4
"""Damping of the least squares, relative to the mean of the weights; keeps one or two stance
feet well posed.
"""


def distribute(wrench: Array, feet: Array, load: Array, friction: float, largest: float,
               importance: Array | None = None) -> Array:
    """Forces of the ground on the feet.

    Parameters
    ----------
    wrench : ndarray (6,)
        Wanted force [N] and moment about the centre of mass [N m], z up.
    feet : ndarray (n, 3)
        Feet relative to the centre of mass in the same frame [m].
    load : ndarray (n,)
        Weight of each foot in [0, 1]; 0 takes no force.
    friction : float
        μ of the cones.
    largest : float
        Largest normal force of a fully loaded foot [N]; scaled by ``load``.
    importance : ndarray (6,), optional
        Weights of the wrench's components, where not all of them can be met: one or two feet
        cannot turn the body about the line through them but by a horizontal force.

    Returns
    -------
    ndarray (n, 3)
        f_i [N].
    """
    n = len(feet)
    grasp = np.zeros((6, 3 * n))
    grasp[0, 0::3] = grasp[1, 1::3] = grasp[2, 2::3] = 1.0
    x, y, z = feet.T
    grasp[3, 1::3], grasp[3, 2::3] = -z, y
    grasp[4, 0::3], grasp[4, 2::3] = z, -x
    grasp[5, 0::3], grasp[5, 1::3] = -y, x
    if importance is not None:
        grasp, wrench = grasp * importance[:, None], wrench * importance
    weights = np.repeat(np.maximum(load, 0.0), 3)
    weighted = grasp * weights
    normal = weighted @ grasp.T
    damping = REGULARISATION * max(float(weights.mean()), 1e-9)
    normal.ravel()[::7] += damping
    forces = (weighted.T @ np.linalg.solve(normal, wrench)).reshape(n, 3)
    forces[:, 2] = np.clip(forces[:, 2], 0.0, largest * load)
    tangential = np.sqrt(forces[:, 0] ** 2 + forces[:, 1] ** 2)
    allowed = friction * forces[:, 2]
    forces[:, :2] *= np.where(tangential > allowed, allowed / np.maximum(tangential, 1e-12), 1.0)[
        :, None
    ]
    return forces
