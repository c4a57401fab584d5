"""Photos with poses as a COLMAP folder: written, as every external trainer reads it, and read.

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
from scenes.formats.storage.error import refusal
from scenes.prepare.poses.sfm.job import Job, SfmOptions
from scenes.prepare.poses.sfm.run import SFM_FOLDER, run_worker
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View, load_reconstruction

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


MODEL_FILES = ("cameras", "images", "points3D")
MODEL_FOLDERS = (".", "sparse/0", "sparse", "colmap/sparse/0", "0")
PICTURE_FOLDERS = ("images", "../images", "../../images")


def find_model(folder: Path) -> Path | None:
    """The folder with the model's files, in `folder` or where COLMAP and nerfstudio put it."""
    for place in MODEL_FOLDERS:
        candidate = folder / place
        for suffix in (".bin", ".txt"):
            if all((candidate / f"{name}{suffix}").is_file() for name in MODEL_FILES):
                return candidate
    return None


def import_colmap(
    folder: Path,
    work_dir: Path,
    *,
    pictures: Path | None = None,
    options: SfmOptions | None = None,
    progress: Progress = silent,
) -> Reconstruction:
    """Take poses and points from a model; its photos are freed of distortion if they have any.

    The frame is the model's own. The originals are only read. Every picture with a pose becomes a
    view, whatever it sees.

    Args:
        folder: the model's folder, or a project with `sparse/0` and `images` in it.
        work_dir: folder for what the preparation makes; made if missing.
        pictures: the photos' folder if it is not `images` beside or above the model.
        options: only the number of threads counts.
        progress: called with the share done.

    Raises:
        FormatError: there is no model or no photos' folder.
        CaptureError: the model has no poses, or a photo of it is missing.
        WorkerError: the files are damaged so that COLMAP's reader gives up.
        OSError: the disk is full or a folder is not writable.
        Cancelled: from `progress`.
    """
    model = find_model(folder)
    if model is None:
        names = ", ".join(MODEL_FILES)
        raise refusal(
            folder,
            "",
            f"no COLMAP model ({names} as .bin or .txt)",
            "give its folder, such as sparse/0",
        )
    if pictures is None:
        places = [root / place for root in (folder, model) for place in PICTURE_FOLDERS]
        pictures = next((place for place in places if place.is_dir()), None)
    if pictures is None or not pictures.is_dir():
        raise refusal(
            folder, "", "no folder `images` with the model's photos", "name the photos' folder"
        )
    job = Job(
        work=work_dir / SFM_FOLDER,
        pictures_folder=pictures.resolve(),
        pictures=(),
        ordered=False,
        options=options or SfmOptions(),
        import_model=model.resolve(),
    )
    run_worker(job, progress)
    return load_reconstruction(job.work / "reconstruction")
