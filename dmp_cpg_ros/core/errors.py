# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Named errors; their texts say what was wrong and what is valid."""

from __future__ import annotations


class DmpCpgError(ValueError):
    """Base class of every error that this package raises on bad input."""


class ParameterError(DmpCpgError):
    """A parameter is missing, of the wrong type, not finite or out of its range."""


class DataError(DmpCpgError):
    """A message, recording or demonstration holds values that cannot be used."""


class MissingFileError(DmpCpgError):
    """A file that was named does not exist or cannot be read."""
