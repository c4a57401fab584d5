"""Reconstruction by structure from motion: photos with cameras and poses, and sparse points."""

from __future__ import annotations

import io
import json
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole, camera_from_json, camera_to_json
from scenes.formats.storage.atomic import write_folder
from scenes.pose import Pose

VIEWS_FILE = "views.json"

POINTS_FILE = "points.npz"


@dataclass(frozen=True, slots=True)
class View:
    """One photo that found its place.

    Attributes:
        name: unique in its reconstruction: the photo's file name.
        image: the picture on disk, free of distortion, of the camera's size.
        camera: its lens.
        world_from_camera: its pose; the world is the reconstruction's own until it is aligned.
    """

    name: str
    image: Path
    camera: Pinhole | Fisheye
    world_from_camera: Pose


@dataclass(frozen=True, slots=True, eq=False)
class Reconstruction:
    """Photos with poses and the points they share.

    Attributes:
        views: in the order the photos were taken.
        points: (N, 3) float64, world.
        colours: (N, 3) uint8 RGB.
        errors_px: (N,) float32, mean reprojection error of each point.
        left_out: photos that were given a pose and are not among the views, each with the reason.

    Raises:
        ValueError: two views share a name, or the arrays do not belong together.
    """

    views: tuple[View, ...]
    points: NDArray[np.float64]
    colours: NDArray[np.uint8]
    errors_px: NDArray[np.float32]
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [view.name for view in self.views]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(f"Reconstruction.views: {twice!r} appears twice, wanted unique names")
        n = len(self.points)
        shapes = {
            "points": (self.points, (n, 3)),
            "colours": (self.colours, (n, 3)),
            "errors_px": (self.errors_px, (n,)),
        }
        for name, (array, wanted) in shapes.items():
            if array.shape != wanted:
                raise ValueError(f"Reconstruction.{name}: shape {array.shape}, wanted {wanted}")
        if not np.isfinite(self.points).all():
            raise ValueError("Reconstruction.points: a value is not finite, wanted finite metres")


def read_picture(view: View) -> NDArray[np.uint8]:
    """The view's photo as it is stored, (H, W, 3) RGB: its camera and pose are of those pixels.

    Raises:
        ValueError: the file is missing, no picture, or not of the camera's size.
    """
    # EXIF would turn the picture under its pose.
    picture = cv2.imread(str(view.image), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if picture is None:
        raise ValueError(f"{view.image}: not a picture that can be read; film or copy it again")
    height, width = picture.shape[:2]
    wanted = (view.camera.width_px, view.camera.height_px)
    if (width, height) != wanted:
        raise ValueError(
            f"{view.image}: {width}×{height} px, but its camera has {wanted[0]}×{wanted[1]}; "
            "give the picture that the poses were found with"
        )
    return np.ascontiguousarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), dtype=np.uint8)


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
