# pyright: standard
"""Points for views whose poses are known already, and the check that the poses are right."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenes.cameras import Pinhole
from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.poses.sfm.job import Job, KnownPose, Picture, SfmOptions
from scenes.prepare.poses.sfm.run import SFM_FOLDER, run_worker
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.saved_reconstruction import load_reconstruction

MIN_POINTS_PER_VIEW = 10
"""Points per picture below which the pictures show too little in common."""
WORST_POSES = 0.005
"""Median distance of matches from where given poses put them, as a fraction of the width."""


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
