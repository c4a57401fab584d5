"""Whether OpenGL can be tried here: VTK ends the process where there is none at all."""

from __future__ import annotations

import ctypes
import ctypes.util
import subprocess
import sys

TRIAL_S = 30.0
"""How long the trial in a process of its own may take: VTK's libraries are 300 MB to load."""

TRIAL = "from studio.app.viewport.drawing.mesh_picture import MeshDrawer; MeshDrawer().close()"


def can_try_opengl() -> bool:
    """Whether VTK may be asked for a picture in this process.

    EGL that can be initialised is enough. Without it VTK looks for other ways, and a driver that
    fails there takes the process with it (a segmentation fault in VTK 9.5): that is tried in a
    process of its own.
    """
    if not sys.platform.startswith("linux") or _has_egl():
        return True
    try:
        done = subprocess.run(
            [sys.executable, "-c", TRIAL],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=TRIAL_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def _has_egl() -> bool:
    name = ctypes.util.find_library("EGL")
    if name is None:
        return False
    try:
        egl = ctypes.CDLL(name)
    except OSError:
        return False
    egl.eglGetDisplay.restype = ctypes.c_void_p
    egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
    egl.eglInitialize.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    display = egl.eglGetDisplay(None)
    return bool(display) and bool(egl.eglInitialize(display, None, None))
