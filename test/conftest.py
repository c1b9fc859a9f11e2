# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What all tests share: they reproduce, stay on this machine and need no screen."""

from __future__ import annotations

import os
import sys

from hypothesis import settings

# The same examples in every run, and no limit on the time of one: machines differ.
settings.register_profile('suite', deadline=None, derandomize=True, print_blob=True)
settings.load_profile('suite')

os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
os.environ.setdefault('ROS_DOMAIN_ID', '87')
os.environ.setdefault('MPLBACKEND', 'Agg')
if not (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
    os.environ.setdefault('MUJOCO_GL', 'egl')

# The ROS wheels do not name their prefix; a sourced ROS 2 has.
_prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
if sys.prefix not in _prefixes:
    os.environ['AMENT_PREFIX_PATH'] = os.pathsep.join(filter(None, [sys.prefix, *_prefixes]))
