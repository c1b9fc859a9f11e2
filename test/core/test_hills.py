# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The robot stays over its feet where hills change faster than its body follows."""

from __future__ import annotations

import pytest

from dmp_cpg_ros.studies.walking_trials import cross


@pytest.mark.parametrize('seed', [511, 911])
def test_amble_crosses_hills_on_which_its_feet_were_put_beside_it(seed: int) -> None:
    """Level on a slope of 17 degrees aside, with feet leaned downhill, it fell uphill."""
    outcome = cross('amble', 'hills', {'degrees': 15.0}, seed)
    assert outcome.crossed, outcome
