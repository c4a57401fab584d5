# pyright: standard
"""Poses from capture apps: the `transforms.json` of nerfstudio, ARKit apps and instant-ngp."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.formats.storage.error import refusal
from scenes.frames import OPENGL_FROM_OPENCV
from scenes.pose import Pose
from scenes.prepare.footage.photos import read_upright, write_jpeg
from scenes.prepare.poses.known_poses import triangulate
from scenes.prepare.poses.sfm.job import SfmOptions
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View

PICTURES_FOLDER = "frames"
READING_SHARE = 0.3
ROTATION_TOLERANCE = 1e-3
SIZE_TOLERANCE = 0.01
FISHEYE_MODELS = frozenset({"OPENCV_FISHEYE"})
PERSPECTIVE_MODELS = frozenset(
    {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE", ""}
)
GUESSED_SUFFIXES = (".png", ".jpg", ".jpeg", ".JPG")
"""instant-ngp's own files leave the suffix out."""


@dataclass(frozen=True, slots=True)
class Distorted:
    """A camera as the file gives it.

    Attributes:
        camera: its pinhole part.
        coefficients: k1, k2, p1, p2, k3 of OpenCV, or k1..k4 of its fisheye model.
        fisheye: which of the two.
    """

    camera: Pinhole
    coefficients: tuple[float, ...]
    fisheye: bool


def import_transforms(
    file: Path,
    work_dir: Path,
    *,
    pictures: Path | None = None,
    options: SfmOptions | None = None,
    progress: Progress = silent,
) -> Reconstruction:
    """Take cameras and poses from a file, pictures from beside it, and find the points they share.

    Frames keep the file's own world and its scale; apps with a depth sensor or ARKit write metres.
    Camera axes are turned from OpenGL's to ours. The originals are only read.

    Args:
        file: a `transforms.json`, or its folder.
        work_dir: folder for what the preparation makes; made if missing.
        pictures: where pictures are looked for, by name, that are not where the file says.
        options: how features are found and matched.
        progress: called with the share done.

    Raises:
        FormatError: a field or picture is missing or makes no sense; says which.
        CaptureError: the pictures do not show common points from these poses.
        OSError: the disk is full or a folder is not writable.
        Cancelled: from `progress`.
    """
    path = file / "transforms.json" if file.is_dir() else file
    values = _read(path)
    folder = work_dir / PICTURES_FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    frames = sorted(values["frames"], key=lambda frame: str(frame.get("file_path", "")))
    views = []
    for number, frame in enumerate(frames):
        where = f"frame {number}"
        picture_path = _picture_path(path, where, frame, pictures)
        progress(READING_SHARE * number / len(frames), f"reading {picture_path.name}")
        picture = read_upright(picture_path)
        if picture is None:
            raise refusal(
                path,
                where,
                f"{picture_path} is no picture that can be read",
                "copy the pictures that belong to the file beside it",
            )
        lens = _lens(path, where, values | frame, picture)
        flat, camera = _undistorted(picture, lens)
        name = f"{number:04d}.jpg"
        write_jpeg(folder / name, flat)
        views.append(View(name, folder / name, camera, _pose(path, where, frame)))
    return triangulate(
        views,
        work_dir,
        source=path.name,
        options=options,
        progress=lambda done, note: progress(READING_SHARE + (1 - READING_SHARE) * done, note),
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise refusal(
            path, "", "there is no such file", "give a transforms.json or its folder"
        ) from None
    except ValueError as error:
        raise refusal(path, "", f"not JSON ({error})", "export it from the app again") from None
    frames = values.get("frames") if isinstance(values, dict) else None
    if not isinstance(frames, list) or not frames:
        raise refusal(path, "frames", "missing or empty", "export it from the app again")
    if not all(isinstance(frame, dict) for frame in frames):
        raise refusal(path, "frames", "an entry is no object", "export it from the app again")
    return dict(values)


def _picture_path(path: Path, where: str, frame: Mapping[str, Any], pictures: Path | None) -> Path:
    name = frame.get("file_path")
    if not isinstance(name, str) or not name:
        raise refusal(path, where, "file_path is missing", "export it from the app again")
    direct = path.parent / name
    places = [direct] if pictures is None else [direct, pictures / direct.name]
    candidates = [
        place.with_name(place.name + s) for place in places for s in ("", *GUESSED_SUFFIXES)
    ]
    found = next((candidate for candidate in candidates if candidate.is_file()), None)
    if found is None:
        raise refusal(
            path, where, f"there is no picture {direct}", "copy the pictures beside the file"
        )
    return found


def _pose(path: Path, where: str, frame: Mapping[str, Any]) -> Pose:
    try:
        matrix = np.array(frame["transform_matrix"], dtype=np.float64)
    except (KeyError, TypeError, ValueError):
        matrix = np.zeros(0)
    if matrix.shape not in ((4, 4), (3, 4)) or not np.isfinite(matrix).all():
        raise refusal(
            path,
            where,
            "transform_matrix is missing or not 4×4 finite numbers",
            "export it from the app again",
        )
    rotation = matrix[:3, :3]
    u, _, vt = np.linalg.svd(rotation)
    nearest = u @ vt
    off = float(np.abs(rotation - nearest).max())
    if off > ROTATION_TOLERANCE or np.linalg.det(nearest) < 0:
        raise refusal(
            path,
            where,
            f"transform_matrix is no rigid motion (off by {off:.3g}, limit {ROTATION_TOLERANCE:g}, "
            f"determinant {np.linalg.det(rotation):.3g})",
            "export camera-to-world matrices without scale or mirroring",
        )
    return Pose(nearest, matrix[:3, 3]) @ OPENGL_FROM_OPENCV


def _lens(
    path: Path, where: str, values: Mapping[str, Any], picture: NDArray[np.uint8]
) -> Distorted:
    """The camera of one frame, scaled to the picture that is there."""

    def number(key: str, default: float | None = None) -> float | None:
        value = values.get(key, default)
        if value is None:
            return None
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise refusal(path, where, f"{key} is {value!r}", "wanted a finite number")
        return float(value)

    model = str(values.get("camera_model", ""))
    if model.upper() not in FISHEYE_MODELS | PERSPECTIVE_MODELS:
        raise refusal(
            path, where, f"camera_model {model!r} is not supported", "export pinhole pictures"
        )
    height, width = picture.shape[:2]
    told_width, told_height = number("w", width), number("h", height)
    assert told_width is not None
    assert told_height is not None
    if told_width <= 0 or abs(told_height * width / told_width - height) > SIZE_TOLERANCE * height:
        raise refusal(
            path,
            where,
            f"the picture is {width}×{height} px, the file says {told_width:g}×{told_height:g}",
            "give the pictures that the poses were found with",
        )
    scale = width / told_width
    fx, angle = number("fl_x"), number("camera_angle_x")
    if fx is None and angle is not None and 0 < angle < math.pi:
        fx = 0.5 * told_width / math.tan(0.5 * angle)
    if fx is None or fx <= 0:
        raise refusal(
            path, where, "neither fl_x nor camera_angle_x is given", "export it with intrinsics"
        )
    fy = number("fl_y", fx)
    cx, cy = number("cx", told_width / 2), number("cy", told_height / 2)
    camera = Pinhole(
        width, height, fx * scale, (fy or fx) * scale, (cx or 0.0) * scale, (cy or 0.0) * scale
    )
    fisheye = model.upper() in FISHEYE_MODELS
    keys = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3")
    return Distorted(camera, tuple(number(key, 0.0) or 0.0 for key in keys), fisheye)


def _undistorted(picture: NDArray[np.uint8], lens: Distorted) -> tuple[NDArray[np.uint8], Pinhole]:
    """The picture as a pinhole of the same focal length would have taken it; border pixels repeat.

    OpenCV puts whole numbers at pixel centres, half a pixel less than we do.
    """
    if not lens.fisheye and not any(lens.coefficients):
        return picture, lens.camera
    c = lens.camera
    matrix = np.array([[c.fx, 0, c.cx - 0.5], [0, c.fy, c.cy - 0.5], [0, 0, 1]])
    maps = (cv2.fisheye if lens.fisheye else cv2).initUndistortRectifyMap(
        matrix,
        np.array(lens.coefficients),
        np.eye(3),
        matrix,
        (c.width_px, c.height_px),
        cv2.CV_32FC1,
    )
    flat = cv2.remap(picture, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(flat, dtype=np.uint8), c
