"""Photos with poses as a COLMAP folder: what every external trainer reads.

Layout and fields as in COLMAP's "Output Format" page: `images/` beside `sparse/0/` with
cameras.bin, images.bin and points3D.bin. Poses are camera from world; pixels count from the corner,
as ours do.
"""

from __future__ import annotations

import shutil
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scenes.cameras import Pinhole
from scenes.formats.storage.atomic import write_folder
from scenes.prepare.reconstruction import Reconstruction, View

PINHOLE_MODEL = 1
"""COLMAP's number for fx, fy, cx, cy."""


def write_colmap_folder(
    folder: Path, reconstruction: Reconstruction, views: Sequence[View]
) -> None:
    """Write `views` and all points; photos are copied. An older folder of that name is replaced.

    Raises:
        ValueError: a view is not a pinhole.
        WriteError: the disk is full or the folder cannot be written; an older one stays.
    """
    cameras = [_pinhole(view) for view in views]

    def fill(target: Path) -> None:
        sparse = target / "sparse" / "0"
        sparse.mkdir(parents=True)
        (target / "images").mkdir()
        (sparse / "cameras.bin").write_bytes(_cameras(cameras))
        (sparse / "images.bin").write_bytes(_images(views))
        (sparse / "points3D.bin").write_bytes(_points(reconstruction))
        for view in views:
            shutil.copyfile(view.image, target / "images" / view.name)

    write_folder(folder, fill, replace=True)


def _pinhole(view: View) -> Pinhole:
    if isinstance(view.camera, Pinhole):
        return view.camera
    raise ValueError(
        f"{view.name}: a {type(view.camera).__name__} photo, external trainers take pinholes; "
        "train with the built-in trainer, or cut flat views from the photo first"
    )


def _cameras(cameras: Sequence[Pinhole]) -> bytes:
    """One camera a view, numbered from 1."""
    out = [struct.pack("<Q", len(cameras))]
    for number, camera in enumerate(cameras, start=1):
        out.append(struct.pack("<iiQQ", number, PINHOLE_MODEL, camera.width_px, camera.height_px))
        out.append(struct.pack("<4d", camera.fx, camera.fy, camera.cx, camera.cy))
    return b"".join(out)


def _images(views: Sequence[View]) -> bytes:
    """Poses; no 2D points."""
    out = [struct.pack("<Q", len(views))]
    for number, view in enumerate(views, start=1):
        camera_from_world = view.world_from_camera.inverse()
        numbers = [*camera_from_world.quaternion(), *camera_from_world.translation]
        out.append(struct.pack("<i7di", number, *(float(v) for v in numbers), number))
        out.append(view.name.encode() + b"\0" + struct.pack("<Q", 0))
    return b"".join(out)


def _points(reconstruction: Reconstruction) -> bytes:
    """Points without the tracks they came from."""
    row = np.dtype(
        [("id", "<u8"), ("xyz", "<f8", 3), ("rgb", "u1", 3), ("error", "<f8"), ("track", "<u8")]
    )
    rows = np.zeros(len(reconstruction.points), dtype=row)
    rows["id"] = np.arange(1, len(rows) + 1)
    rows["xyz"] = reconstruction.points
    rows["rgb"] = reconstruction.colours
    rows["error"] = reconstruction.errors_px
    return struct.pack("<Q", len(rows)) + rows.tobytes()
