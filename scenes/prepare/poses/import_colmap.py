"""A finished COLMAP model with its photos, text or binary, as a `Reconstruction`."""

from __future__ import annotations

from pathlib import Path

from scenes.formats.storage.error import refusal
from scenes.prepare.poses.sfm.job import Job, SfmOptions
from scenes.prepare.poses.sfm.run import SFM_FOLDER, run_worker
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.saved_reconstruction import load_reconstruction

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
