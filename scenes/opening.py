"""Opening a scene by whatever the user has: a built-in room's name, a package, a splat file.

Scans of the built-in rooms come with the program, made by `benchmarks/scan_built_in.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.formats.registry import is_in_world_frame, read_splats
from scenes.formats.sog import is_sog_folder
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.package import ScenePackage, Stage, load_package
from scenes.package.files import PackageError
from scenes.pose import Pose
from scenes.samples import SAMPLE_NAMES


def open_scene(name_or_path: str | Path) -> ScenePackage:
    """Open a built-in room, a scene package or a plain splat file.

    A splat file becomes a scene without objects: axes are turned from the file's (x right, y down,
    z forward, unless it was written in the world frame) to Z up; unit and origin are kept, since
    the file does not state them.

    Args:
        name_or_path: a name of `scenes.samples.SAMPLE_NAMES`, a package folder or a splat file.

    Raises:
        PackageError: there is nothing of that name, or it is foreign or damaged.
        FormatError: a splat file is damaged.
    """
    if str(name_or_path) in SAMPLE_NAMES:
        return open_builtin(str(name_or_path))
    path = Path(name_or_path)
    if not path.exists():
        raise PackageError(
            f"{path}: no such folder or file, nor a built-in scene; "
            f"built-in are: {', '.join(SAMPLE_NAMES)}"
        )
    if path.is_dir() and not is_sog_folder(path):
        return load_package(path)
    return _package_of_splats(path)


def _package_of_splats(path: Path) -> ScenePackage:
    left_out: list[str] = []
    cloud = read_splats(path, on_bad=left_out.append)
    if not is_in_world_frame(path):
        cloud = turned(cloud, WORLD_FROM_FORWARD_CAMERA)
    low, high = np.percentile(cloud.means, (1.0, 99.0), axis=0) if len(cloud) else np.zeros((2, 3))
    middle = 0.5 * (low + high).astype(np.float64)
    return ScenePackage(
        name=path.name,
        room=cloud,
        objects=(),
        codes=(),
        world_from_rig=Pose(WORLD_FROM_FORWARD_CAMERA.rotation, middle),
        footprint_m=np.stack([low[:2], high[:2]]),
        physical=None,
        stages=(Stage("open", "; ".join([f"splat file {path.name}", *left_out])),),
    )


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
