# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one place that imports MuJoCo, so that it works where pictures cannot be drawn.

MuJoCo picks its OpenGL backend from the environment variable ``MUJOCO_GL`` while it is imported,
and with ``egl`` or ``osmesa`` that import fails when the library is missing. The simulation needs
no OpenGL at all, so the variable is checked first: without a screen it becomes ``egl`` where EGL
can be loaded and ``disable`` elsewhere. Every module of this package that needs MuJoCo takes it
from here.
"""

from __future__ import annotations

import ctypes
import logging
import os
import sys

_log = logging.getLogger(__name__)
_KNOWN = ('', 'enable', 'enabled', 'on', 'true', '1', 'disable', 'disabled', 'off', 'false', '0',
          'glfw', 'egl', 'osmesa', 'glx', 'cgl', 'wgl')
_LIBRARY = {'egl': 'libEGL.so.1', 'osmesa': 'libOSMesa.so.8'}


def usable_backend(wanted: str, has_screen: bool) -> str:
    """Return the value for ``MUJOCO_GL`` that can be imported here.

    Parameters
    ----------
    wanted : str
        Present value; empty when unset.
    has_screen : bool
        Whether there is a display to open windows on.
    """
    backend = wanted.strip().lower()
    if backend not in _KNOWN:
        _log.warning("MUJOCO_GL = '%s' is not known; valid are egl, osmesa, glfw, disable", wanted)
        wanted = backend = ''
    backend = backend or ('' if has_screen else 'egl')
    if backend not in _LIBRARY or not sys.platform.startswith('linux'):
        return wanted
    try:
        ctypes.CDLL(_LIBRARY[backend])
    except OSError:
        return 'disable'
    return backend


def has_screen() -> bool:
    """Return whether there is a display to open windows on."""
    return not sys.platform.startswith('linux') or bool(
        os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY'))


_backend = usable_backend(os.environ.get('MUJOCO_GL', ''), has_screen())
if _backend or 'MUJOCO_GL' in os.environ:
    os.environ['MUJOCO_GL'] = _backend

import mujoco  # noqa: E402  (the backend must be chosen before)

__all__ = ['has_screen', 'mujoco', 'usable_backend']
