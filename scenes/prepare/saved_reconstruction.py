"""A `Reconstruction` on disk: a small JSON of views beside a NumPy archive of points."""

from __future__ import annotations

import io
import json
import os
import zipfile
from pathlib import Path

import numpy as np

from scenes.cameras import camera_from_json, camera_to_json
from scenes.formats.storage.atomic import write_folder
from scenes.pose import Pose
from scenes.prepare.reconstruction import Reconstruction, View

VIEWS_FILE = "views.json"
POINTS_FILE = "points.npz"


def save_reconstruction(reconstruction: Reconstruction, folder: Path) -> None:
    """Write (or replace) a folder; pictures stay where they are and are named relative to it.

    Raises:
        OSError: the disk is full or the folder is not writable; an older one is as it was.
    """
    views = [
        {
            "name": view.name,
            "image": Path(os.path.relpath(view.image.resolve(), folder.resolve())).as_posix(),
            "camera": camera_to_json(view.camera),
            "world_from_camera": view.world_from_camera.matrix().tolist(),
        }
        for view in reconstruction.views
    ]

    def fill(part: Path) -> None:
        values = {"views": views, "left_out": reconstruction.left_out}
        (part / VIEWS_FILE).write_text(json.dumps(values, indent=1), encoding="utf-8")
        archive = io.BytesIO()
        np.savez(
            archive,
            points=reconstruction.points,
            colours=reconstruction.colours,
            errors_px=reconstruction.errors_px,
        )
        (part / POINTS_FILE).write_bytes(archive.getvalue())

    write_folder(folder, fill, replace=True)


def load_reconstruction(folder: Path) -> Reconstruction:
    """Read the reconstruction that `save_reconstruction` wrote, to the same bits.

    Raises:
        ValueError: a file is missing, damaged, or not of this kind.
    """
    try:
        values = json.loads((folder / VIEWS_FILE).read_text(encoding="utf-8"))
        views = tuple(
            View(
                str(view["name"]),
                folder / view["image"],
                camera_from_json(view["camera"]),
                Pose.from_matrix(view["world_from_camera"]),
            )
            for view in values["views"]
        )
        with np.load(folder / POINTS_FILE, allow_pickle=False) as arrays:
            return Reconstruction(
                views,
                arrays["points"],
                arrays["colours"],
                arrays["errors_px"],
                tuple(str(words) for words in values.get("left_out", ())),
            )
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(
            f"{folder}: no saved reconstruction ({error}); run the preparation again"
        ) from error
