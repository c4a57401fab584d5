"""Provenance of a result: versions of the program and its libraries."""

from __future__ import annotations

import platform
from importlib import metadata

from studio.console.machine import DISTRIBUTION, program_version

LIBRARIES = (
    "numpy",
    "scipy",
    "opencv-contrib-python-headless",
    "av",
    "mujoco-core",
    "vtk",
    "mcap",
)
"""Those that can change a result."""


def library_versions() -> dict[str, str]:
    """Version by name of this program, Python and the libraries that can change a result."""
    versions = {DISTRIBUTION: program_version(), "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions
