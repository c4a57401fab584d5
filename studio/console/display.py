"""Whether a window can be opened here. Qt ends the process where it cannot, so ask first."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys

from studio.console.extras import why_incomplete

XCB_PLUGIN_NEEDS = "xcb-cursor"
"""The system library that Qt's X11 plug-in needs and most servers lack."""


def why_no_window() -> str | None:
    """The reason why no window can be opened, in words, or None if one can."""
    missing = why_incomplete("studio", what="the window")
    if missing is not None:
        return missing
    if sys.platform in ("win32", "darwin") or os.environ.get("QT_QPA_PLATFORM") == "offscreen":
        return None
    if os.environ.get("WAYLAND_DISPLAY"):
        return None
    display = os.environ.get("DISPLAY")
    if not display:
        return "no display (DISPLAY is not set)"
    if not _x_server_answers():
        return f"the display {display!r} does not answer"
    if ctypes.util.find_library(XCB_PLUGIN_NEEDS) is None:
        return "a system library is missing: install libxcb-cursor0"
    return None


def _x_server_answers() -> bool:
    name = ctypes.util.find_library("xcb")
    if name is None:
        return False
    xcb = ctypes.CDLL(name)
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connect.argtypes = [ctypes.c_char_p, ctypes.c_void_p]
    xcb.xcb_connection_has_error.argtypes = [ctypes.c_void_p]
    xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
    connection = xcb.xcb_connect(None, None)
    failed = bool(xcb.xcb_connection_has_error(connection))
    xcb.xcb_disconnect(connection)
    return not failed
