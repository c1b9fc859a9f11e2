# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Vectors, rotations and matrix exponentials."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""An array of floats."""
