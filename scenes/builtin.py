"""The built-in rooms: scans that come with the program, made by `benchmarks/scan_built_in.py`."""

from __future__ import annotations

from pathlib import Path

from scenes.package import ScenePackage, load_package


def scan_folder(name: str) -> Path:
    """Folder that the scan of a built-in room is kept in."""
    return Path(__file__).parent / "samples" / "scans" / f"{name}.gnx"


def open_builtin(name: str) -> ScenePackage:
    """The scan of a built-in room.

    Args:
        name: one of `scenes.samples.SAMPLE_NAMES`.

    Raises:
        PackageError: the program's files are damaged.
    """
    return load_package(scan_folder(name))
