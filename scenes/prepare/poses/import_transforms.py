# pyright: standard
"""Poses from capture apps: the `transforms.json` of nerfstudio, ARKit apps and instant-ngp."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.formats.storage.error import FormatError, refusal
from scenes.frames import OPENGL_FROM_OPENCV
from scenes.pose import Pose
from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.footage.photos import write_jpeg
from scenes.prepare.footage.picture_files import read_stored, read_upright
from scenes.prepare.poses.photo_files import check_left_out, find_photo
from scenes.prepare.poses.sfm.job import Job, KnownPose, Picture, SfmOptions
from scenes.prepare.poses.sfm.run import SFM_FOLDER, run_worker
from scenes.prepare.poses.transforms_lens import (
    LensError,
    fits,
    ignored_keys,
    lens_of,
    pinhole_picture,
    stated_size,
)
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View, load_reconstruction

PICTURES_FOLDER = "frames"

READING_SHARE = 0.3
"""Share of the progress that reading the pictures takes."""

ROTATION_TOLERANCE = 1e-3
"""Difference of a matrix from a rotation, by element, that rounding makes."""

FRAME_KEYS = frozenset({"file_path", "transform_matrix"})

SUFFIX = re.compile(r"\.(jpe?g|png|tiff?|webp|heic|heif|bmp)$", re.IGNORECASE)
"""Of a picture's file; names may lack it and have dots of their own."""

FIT_NAME = re.compile(r"[\w-][\w.-]*")
"""Names that structure from motion's lists of pairs can hold: without spaces."""

MIN_POINTS_PER_VIEW = 10
"""Points per picture below which the pictures show too little in common."""

WORST_POSES = 0.005
"""Median distance of matches from where given poses put them, as a fraction of the width."""


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
    Camera axes are turned from OpenGL's to ours. The originals are only read. Frames that cannot be
    used are left out, and the reconstruction says which and why.

    Args:
        file: a `transforms.json`, or its folder.
        work_dir: folder for what the preparation makes; made if missing.
        pictures: where pictures are looked for, by name, that are not where the file says.
        options: how features are found and matched.
        progress: called with the share done.

    Raises:
        FormatError: it is no such file, or no frame can be used; says what is wrong with the first.
        CaptureError: most frames cannot be used, or the pictures do not show common points from
            these poses.
        OSError: the disk is full or a folder is not writable.
        Cancelled: from `progress`.
    """
    path = file / "transforms.json" if file.is_dir() else file
    values = _read(path)
    folder = work_dir / PICTURES_FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    views: list[View] = []
    left_out: list[str] = []
    first_fault: FormatError | None = None
    frames = sorted(enumerate(values["frames"]), key=lambda frame: _name(frame[1]))
    names = _picture_names([_name(frame) for _, frame in frames])
    for done, (number, frame) in enumerate(frames):
        progress(READING_SHARE * done / len(frames), f"reading {_name(frame) or 'frames'}")
        try:
            views.append(_view(path, number, values, frame, pictures, folder / names[done]))
        except FormatError as error:
            first_fault = first_fault or error
            fault = str(error).removeprefix(f"{path}, ").partition(";")[0]
            left_out.append(f"{_name(frame) or f'frame {number}'}: {fault.partition(': ')[2]}")
    if first_fault is not None and not views:
        raise first_fault
    check_left_out(path, left_out, len(frames))
    found = triangulate(
        views,
        work_dir,
        source=path.name,
        options=options,
        progress=lambda done, note: progress(READING_SHARE + (1 - READING_SHARE) * done, note),
    )
    return replace(found, left_out=tuple(left_out))


def ignored_in(file: Path) -> tuple[str, ...]:
    """The keys of a file that nothing here understands; they do not seem to describe the lens.

    Raises:
        FormatError: it is no such file.
    """
    values = _read(file)
    frames = [frame for frame in values.pop("frames") if isinstance(frame, dict)]
    keys = set(values).union(*(frame.keys() - FRAME_KEYS for frame in frames))
    return ignored_keys(keys)


def _view(
    path: Path,
    number: int,
    values: dict[str, Any],
    frame: Any,
    pictures: Path | None,
    target: Path,
) -> View:
    """One frame, its picture written to `target` as a pinhole would have taken it.

    Raises:
        FormatError: it cannot be used.
    """
    where = f"frame {number}"
    if not isinstance(frame, dict):
        raise refusal(path, where, "an entry is no object", "export it from the app again")
    pose = _pose(path, where, frame)
    try:
        size = stated_size(values | frame)
        picture = _picture(path, where, _picture_path(path, where, frame, pictures), size)
        flat, camera = pinhole_picture(picture, lens_of(values | frame, picture))
    except LensError as error:
        raise refusal(path, where, error.what, error.remedy) from None
    write_jpeg(target, flat)
    return View(target.name, target, camera, pose)


def _picture(
    path: Path, where: str, file: Path, size: tuple[float, float] | None
) -> NDArray[np.uint8]:
    """A picture as it is stored, whatever EXIF says: the pose is of those pixels.

    Only where the file of poses gives a size that the turned picture alone has were the poses found
    with turned pictures.
    """
    stored = read_stored(file)
    if stored is None:
        raise refusal(
            path,
            where,
            f"{file} is no picture that can be read",
            "copy the pictures that belong to the file beside it",
        )
    if size is None or fits(stored, size):
        return stored
    turned = read_upright(file)
    return turned if turned is not None and fits(turned, size) else stored


def _picture_names(files: Sequence[str]) -> list[str]:
    """Names of the pictures that are written: the photos' own, or numbers if two would be one.

    By them people say what they mark, and whoever knows more of the photos finds them again.
    """
    stems = [SUFFIX.sub("", PurePosixPath(file.replace("\\", "/")).name) for file in files]
    numbers = [f"frame-{number:04d}" for number in range(len(files))]
    fit = [
        stem if FIT_NAME.fullmatch(stem) else number
        for stem, number in zip(stems, numbers, strict=True)
    ]
    are_unique = len({stem.casefold() for stem in fit}) == len(fit)
    return [f"{stem}.jpg" for stem in (fit if are_unique else numbers)]


def _name(frame: Any) -> str:
    return str(frame.get("file_path", "")) if isinstance(frame, dict) else ""


def _read(path: Path) -> dict[str, Any]:
    try:
        # Bytes: the reader then knows UTF-8 with and without a mark, and UTF-16.
        values = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise refusal(
            path, "", "there is no such file", "give a transforms.json or its folder"
        ) from None
    except ValueError as error:
        raise refusal(path, "", f"not JSON ({error})", "export it from the app again") from None
    frames = values.get("frames") if isinstance(values, dict) else None
    if not isinstance(frames, list) or not frames:
        raise refusal(path, "frames", "missing or empty", "export it from the app again")
    return dict(values)


def _picture_path(path: Path, where: str, frame: Mapping[str, Any], pictures: Path | None) -> Path:
    name = frame.get("file_path")
    if not isinstance(name, str) or not name:
        raise refusal(path, where, "file_path is missing", "export it from the app again")
    folders = [path.parent] if pictures is None else [path.parent, pictures]
    found = find_photo(name, folders)
    if found is None:
        raise refusal(
            path,
            where,
            f"there is no picture {path.parent / name}",
            "copy the pictures beside the file",
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


def triangulate(
    views: Sequence[View],
    work_dir: Path,
    *,
    source: str,
    options: SfmOptions | None = None,
    progress: Progress = silent,
) -> Reconstruction:
    """Find the points that pinhole views with known poses share; poses and scale are kept.

    Args:
        views: their pictures lie in one folder.
        work_dir: folder for what the preparation makes.
        source: what to call them in messages.
        options: how features are found and matched.
        progress: called with the share done.

    Raises:
        CaptureError: the poses are not those of the pictures, or hardly any points agree.
        ValueError: a view is no pinhole.
        WorkerError: the process that finds them crashed.
        OSError: the disk is full or a folder is not writable.
        Cancelled: from `progress`.
    """
    job = Job(
        work=work_dir / SFM_FOLDER,
        pictures_folder=views[0].image.parent,
        pictures=tuple(_picture_with_pose(view) for view in views),
        ordered=True,
        options=options or SfmOptions(),
    )
    result = run_worker(job, progress)
    _refuse_wrong_poses(result.pose_error_px, views[0].camera.width_px, source)
    found = load_reconstruction(job.work / "reconstruction")
    wanted = MIN_POINTS_PER_VIEW * len(views)
    if len(found.points) < wanted:
        raise CaptureError(
            f"{source}: only {len(found.points)} points agree with the poses of {len(views)} "
            f"pictures, wanted at least {wanted}; the pictures show too little in common: give "
            "more of them"
        )
    return Reconstruction(tuple(views), found.points, found.colours, found.errors_px)


def _picture_with_pose(view: View) -> Picture:
    camera = view.camera
    if not isinstance(camera, Pinhole):
        raise ValueError(  # noqa: TRY004 - the view is of the right type, not of the right kind
            f"triangulate: {view.name} is no pinhole view, wanted pinhole views"
        )
    camera_from_world = view.world_from_camera.inverse()
    return Picture(
        view.name,
        lens=f"{camera}",
        known=KnownPose(
            (camera.fx, camera.fy, camera.cx, camera.cy),
            tuple(camera_from_world.quaternion().tolist()),
            tuple(camera_from_world.translation.tolist()),
        ),
    )


def _refuse_wrong_poses(error_px: float | None, width_px: int, source: str) -> None:
    """Raise where matches lie too far (median) from where the poses put them."""
    limit_px = WORST_POSES * width_px
    if error_px is not None and error_px > limit_px:
        raise CaptureError(
            f"{source}: matches lie {error_px:.1f} px (median) from where the poses "
            f"put them, limit {limit_px:.1f} px; the poses do not belong to these pictures: "
            "export both again, or give the pictures alone"
        )
