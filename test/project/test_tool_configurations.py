# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Configurations of the tools of ROS 2 name what there is."""

from __future__ import annotations

import pytest
from checkout import ROOT

from dmp_cpg_ros.configuration import load_yaml
from dmp_cpg_ros.suite_table import instances

CONFIG = ROOT / 'config'


@pytest.mark.parametrize('place', ['', 'robot1/'])
def test_every_node_reports_into_one_group(place: str) -> None:
    (parameters,) = load_yaml(CONFIG / 'diagnostics' / 'aggregator.yaml').values()
    groups = {name: group for name, group in parameters['ros__parameters'].items()
              if isinstance(group, dict)}
    assert all(group['path'] == name and group['type'] == 'diagnostic_aggregator/GenericAnalyzer'
               for name, group in groups.items())
    for _, node, _ in instances():
        found = [name for name, group in groups.items()
                 if any(word in place + node for word in group['contains'])]
        assert len(found) == 1, node
