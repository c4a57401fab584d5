"""Names of files that are videos of a 360° camera."""

from __future__ import annotations

VIDEO_SUFFIXES = frozenset({".mp4", ".mov", ".m4v", ".mkv", ".insv"})
"""Endings of names, in small letters."""

PAIRED = ("_00_", "_10_")
"""The part of the name that says which lens, of cameras that write one file a lens."""
