"""Poses that another program found: a COLMAP model, or an app's transforms.json."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.formats.storage.error import refusal
from scenes.prepare.footage.capture import (
    PICTURE_SUFFIXES,
    Capture,
    CaptureError,
    CaptureKind,
    Frame,
    Rejected,
    some_of,
)
from scenes.prepare.footage.sharpness import Reason
from scenes.prepare.poses.colmap_folder import find_model, import_colmap
from scenes.prepare.poses.import_transforms import ignored_in, import_transforms
from scenes.prepare.poses.sfm.job import SfmOptions
from scenes.prepare.poses.sfm.run import MIN_VIEWS, SfmReport
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, load_reconstruction, save_reconstruction

TRANSFORMS = "transforms.json"
KEPT = "reconstruction"


def import_poses(
    poses: Path,
    pictures: Path,
    work_dir: Path,
    *,
    options: SfmOptions | None = None,
    progress: Progress = silent,
) -> Reconstruction:
    """Photos with the poses that were found for them elsewhere, kept in `work_dir`.

    Args:
        poses: a COLMAP model's folder (or a project with `sparse/0` in it), a transforms.json, or
            a folder with one.
        pictures: the photos' folder.
        work_dir: folder for what the preparation makes.
        options: how features are found where only poses are given.
        progress: called with the share done.

    Raises:
        FormatError: there is neither, or it is damaged.
        CaptureError: poses and photos do not belong together, or are too few.
        WorkerError, OSError, Cancelled: as the importers.
    """
    if not pictures.is_dir():
        raise CaptureError(
            f"{pictures}: no folder of photos; give the photos that {poses.name} was made from"
        )
    model = find_model(poses) if poses.is_dir() else None
    if model is not None:
        found = import_colmap(
            poses, work_dir, pictures=pictures, options=options, progress=progress
        )
    elif _transforms_in(poses) is not None:
        found = import_transforms(
            poses, work_dir, pictures=pictures, options=options, progress=progress
        )
    else:
        raise refusal(
            poses,
            "",
            "neither a COLMAP model nor a transforms.json",
            "give the folder with cameras, images and points3D, or the JSON file",
        )
    if len(found.views) < MIN_VIEWS:
        raise CaptureError(
            f"{poses}: poses of {len(found.views)} photos, wanted at least {MIN_VIEWS}; "
            "export more of them"
        )
    save_reconstruction(found, work_dir / KEPT)
    return found


def _transforms_in(poses: Path) -> Path | None:
    """The file of an app that is meant, or None where a COLMAP model is."""
    if poses.is_dir():
        file = poses / TRANSFORMS
        return file if file.is_file() and find_model(poses) is None else None
    return poses if poses.suffix.lower() == ".json" else None


def load_imported(work_dir: Path) -> Reconstruction:
    """Read the reconstruction that `import_poses` kept.

    Raises:
        ValueError: it is missing or damaged.
    """
    return load_reconstruction(work_dir / KEPT)


def as_capture(reconstruction: Reconstruction, pictures: Path) -> Capture:
    """The views as if they had been chosen from the photos; the report shows them."""
    first = reconstruction.views[0]
    frames = tuple(
        Frame(view.image.name, view.name, 0.0, f"{view.camera}") for view in reconstruction.views
    )
    rejected = tuple(Rejected(words, Reason.MISSING) for words in reconstruction.left_out)
    return Capture(CaptureKind.PHOTOS, pictures.name, first.image.parent, frames, rejected)


def as_report(reconstruction: Reconstruction, poses: Path, pictures: Path) -> SfmReport:
    """Report on poses that are taken as they are."""
    names = tuple(view.name for view in reconstruction.views)
    left_out = reconstruction.left_out
    count = sum(file.suffix.lower() in PICTURE_SUFFIXES for file in pictures.iterdir())
    advice: list[str] = []
    if left_out:
        advice.append(
            f"{len(left_out)} of {len(names) + len(left_out)} photos with a pose are left out "
            f"({some_of(left_out, '; ')}); copy them beside the others to have them used"
        )
    if count > len(names) + len(left_out):
        advice.append(
            f"{poses.name} has poses for {len(names)} of {count} photos; the others are not used"
        )
    file = _transforms_in(poses)
    ignored = () if file is None else ignored_in(file)
    if file is not None and ignored:
        advice.append(
            f"{file.name} has keys that are not understood and not used: {', '.join(ignored)}"
        )
    errors = reconstruction.errors_px
    return SfmReport(
        placed=names,
        failed=tuple(words.partition(":")[0] for words in left_out),
        models=(len(names),),
        mapper=f"no mapper, poses of {poses.name}",
        points=len(reconstruction.points),
        error_px=float(np.mean(errors)) if len(errors) else float("nan"),
        advice=tuple(advice),
        times={},
    )
