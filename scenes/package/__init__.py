"""The scene package: a folder that holds a prepared room and reopens to the same room.

`package.py`, its records, cuts, what photos saw (`coverage.py`) and checksums.
"""

from scenes.package.package import (
    DISTRIBUTION,
    FORMAT_VERSION,
    ScenePackage,
    is_package,
    load_package,
    save_package,
)
from scenes.package.records import Stage

__all__ = [
    "DISTRIBUTION",
    "FORMAT_VERSION",
    "ScenePackage",
    "Stage",
    "is_package",
    "load_package",
    "save_package",
]
