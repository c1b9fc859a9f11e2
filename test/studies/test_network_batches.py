# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A batch of networks steps each of them as the canonical system does."""

from __future__ import annotations

import numpy as np
import pytest
from contraction_batches import random_setting

from dmp_cpg_ros.studies.network_batch import Batch


@pytest.mark.parametrize('size', [2, 3, 4, 7, 12])
def test_a_batch_steps_as_the_canonical_system(size: int) -> None:
    rng = np.random.default_rng(size)
    settings = [random_setting(rng, size) for _ in range(40)]
    dts = rng.uniform(0.0005, 0.01, 40)
    batch = Batch(settings, dts)
    x = batch.target + 0.5 * batch.region[..., None] * rng.uniform(-2.0, 2.0, (40, size, 2))
    for tick in range(20):
        if tick == 10:
            batch.use(batch.rows[::-1])                      # other settings for the same states
        armed = rng.random(40) < 0.7
        acting = armed & batch.inside(x)
        expected = np.stack([s.system.step(x[k], s.omega, s.gains * acting[k], dts[batch.rows[k]])
                             for k, s in enumerate(batch.settings)])
        x = batch.step(x, armed)
        assert np.abs(x - expected).max() < 1e-12
        x = expected
