# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What all recordings of the tests have in common is parsed once in a process: rosbags needs two
thirds of the time in which it opens a short one for profiles and definitions of messages.

Import this module to let rosbags keep them.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from rosbags.highlevel import anyreader
from rosbags.rosbag2 import storage_mcap

_profiles_of = lru_cache(storage_mcap.parse_qos)


def _profiles(text: Any) -> list[Any]:
    return [*_profiles_of(text)]


storage_mcap.parse_qos = _profiles
anyreader.get_types_from_msg = lru_cache(anyreader.get_types_from_msg)
