# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the study of long walks reads and plays."""

import numpy as np
import pytest

from dmp_cpg_ros.core.scenario.scenario import Scenario
from dmp_cpg_ros.studies.long_walk import MINUTE, events, growth, table


def test_growth_is_that_of_the_second_half_for_an_hour() -> None:
    begin = np.linspace(0.0, 80.0, 60)
    later = 80.0 + 0.2 * np.arange(60)
    assert growth([*begin, *later], 2.0) == pytest.approx(0.2 * 60)
    assert growth([*begin, *later[:1] * np.ones(60)], 2.0) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('readings', [1, 2, 3])
def test_few_readings_are_told_as_they_are(readings: int) -> None:
    row = table({'inhibition': [30.0] * readings}, 1.0).splitlines()[-1]
    cells = [cell.strip() for cell in row.strip('|').split('|')]
    assert cells[:4] == ['inhibition', '30.0', '30.0', '30.0']
    assert float(cells[4]) == 0.0


def test_every_minute_walks_stops_and_starts_in_order() -> None:
    played = list(events(3))
    Scenario.from_mapping({'name': 'long', 'duration': 3 * MINUTE, 'events': played})
    times = [event['at'] for event in played]
    assert times == sorted(times) and times[-1] < 3 * MINUTE
    assert [event['inhibit'] for event in played if 'inhibit' in event] == [True, False] * 3
    assert len({event['gait'] for event in played if 'gait' in event}) == 2
