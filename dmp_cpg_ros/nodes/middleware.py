# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of the middleware, by a profile file."""

from __future__ import annotations

import os
from pathlib import Path

from dmp_cpg_ros.configuration import find_config

PROFILE = 'fastdds.xml'
"""Profile of Fast DDS in the config folder; it says why it is there."""

VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
"""Environment variables that name a profile: of Fast DDS 2 (Jazzy has it) and of 3."""

_IN_WORKING_FOLDER = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')


def prepare_middleware() -> None:
    """Name our profile to Fast DDS unless the user has one; call before ``rclpy.init``.

    Other middlewares do not look at these variables. Processes that are started later inherit
    them.
    """
    if any(os.environ.get(name) for name in VARIABLES):
        return
    if any(Path(name).is_file() for name in _IN_WORKING_FOLDER):
        return
    profile = str(find_config(PROFILE))
    for name in VARIABLES:
        os.environ[name] = profile
