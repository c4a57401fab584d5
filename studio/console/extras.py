"""Optional parts of the program that a light installation lacks, and how to get them."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping

from studio.console.machine import DISTRIBUTION

EXTRAS: Mapping[str, tuple[str, ...]] = {
    "studio": ("PySide6", "PySide6QtAds", "pyvista", "qtawesome", "pyqtgraph", "tomlkit"),
    "prepare": ("open3d", "pycolmap"),
    "networks": ("onnxruntime",),
    "usd": ("pxr",),
    "cluster": ("distributed",),
    "sites": ("zenoh",),
    "people-media": ("aiortc", "aioice"),
}
"""Packages that each extra of `pyproject.toml` brings, as they are imported; without pi-heif, which
only photos in HEIC miss, who say so themselves."""

NAMES: Mapping[str, str] = {
    "PySide6": "Qt",
    "open3d": "Open3D",
    "pxr": "OpenUSD",
    "zenoh": "Eclipse Zenoh",
    "aiortc": "WebRTC",
}
"""Names of some as people know them."""


class MissingExtraError(ValueError):
    """A command needs packages that were not installed; says how to get them."""


def why_incomplete(extra: str, *, what: str) -> str | None:
    """Return what to install for an extra that is not here, or not whole; None if it is.

    Args:
        extra: its name.
        what: the command or part that needs it, such as "nexus prepare".
    """
    missing = [name for name in EXTRAS[extra] if importlib.util.find_spec(name) is None]
    return _sentence(what, missing, extra) if missing else None


def require_extra(extra: str, *, what: str) -> None:
    """Check that an extra is installed, before anything that takes long.

    Raises:
        MissingExtraError: it is not, or not whole.
    """
    missing = why_incomplete(extra, what=what)
    if missing is not None:
        raise MissingExtraError(missing)


def explain_missing(error: Exception, *, what: str) -> str | None:
    """Return what to install if an import failed that an extra would mend; None otherwise."""
    if not isinstance(error, ModuleNotFoundError):
        return None
    wanted = (error.name or "").partition(".")[0]
    for extra, packages in EXTRAS.items():
        if wanted in packages:
            return _sentence(what, [wanted], extra)
    return None


def _sentence(what: str, missing: list[str], extra: str) -> str:
    named = ", ".join(NAMES.get(name, name) for name in missing)
    return f"{what} needs {named}: pip install '{DISTRIBUTION}[{extra}]'"
