# pyright: standard
"""Results of structure from motion: pictures without distortion, and how it went."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.footage.picture_files import forget_turn
from scenes.prepare.poses.sfm.job import Attempt, JobResult, KnownPose, StageTime
from scenes.prepare.poses.sfm.session import MAPPING_FILE, Worker, open_database
from scenes.prepare.reconstruction import Reconstruction, View, save_reconstruction

JPEG_QUALITY = 97
"""Quality of the pictures without distortion, which training sees."""

FloatArray = NDArray[np.float64]


def undistort(worker: Worker) -> None:
    """Pinhole pictures of the kept model, and everything as a `Reconstruction`."""
    job = worker.job
    mapping = json.loads((job.work / MAPPING_FILE).read_text(encoding="utf-8"))
    if mapping["kept"] is None:
        return
    worker.report("undistortion", 0.0, "taking the lens's distortion out of the pictures")
    out = job.work / "undistorted"
    placed = list(mapping["attempts"][-1]["models"][0])
    pycolmap.undistort_images(
        out,
        job.work / mapping["kept"],
        job.pictures_folder,
        placed,
        jpeg_quality=JPEG_QUALITY,
        num_threads=job.options.threads,
    )
    for name in placed:
        forget_turn(out / "images" / name)
    order = {picture.name: i for i, picture in enumerate(job.pictures)}
    placed.sort(key=lambda name: (order.get(name, 0), name))
    flat = _reconstruction(pycolmap.Reconstruction(out / "sparse"), out / "images", placed)
    flat = replace(flat, left_out=tuple(mapping.get("left_out", ())))
    save_reconstruction(flat, job.work / "reconstruction")
    worker.report("undistortion", 1.0, f"{len(placed)} pictures placed")


def _reconstruction(model: Any, pictures: Path, placed: Sequence[str]) -> Reconstruction:
    by_name = {image.name: image for image in model.images.values()}
    views = []
    for name in placed:
        image = by_name[name]
        camera_from_world = Pose.from_matrix(
            np.vstack([image.cam_from_world().matrix(), [0, 0, 0, 1]])
        )
        camera = _pinhole(model.cameras[image.camera_id])
        views.append(View(name, pictures / name, camera, camera_from_world.inverse()))
    points = list(model.points3D.values())
    return Reconstruction(
        tuple(views),
        np.array([p.xyz for p in points], dtype=np.float64).reshape(-1, 3),
        np.array([p.color for p in points], dtype=np.uint8).reshape(-1, 3),
        np.array([p.error for p in points], dtype=np.float32),
    )


def _pinhole(camera: Any) -> Pinhole:
    return Pinhole(
        int(camera.width),
        int(camera.height),
        float(camera.focal_length_x),
        float(camera.focal_length_y),
        float(camera.principal_point_x),
        float(camera.principal_point_y),
    )


def outcome(worker: Worker, times: dict[str, StageTime]) -> JobResult:
    """How it went, from what the stages left on the disk."""
    job = worker.job
    mapping = json.loads((job.work / MAPPING_FILE).read_text(encoding="utf-8"))
    attempts = tuple(
        Attempt(a["mapper"], tuple(tuple(m) for m in a["models"])) for a in mapping["attempts"]
    )
    error_px = float("nan")
    if mapping["kept"] is not None:
        model = pycolmap.Reconstruction(job.work / mapping["kept"])
        error_px = float(model.compute_mean_reprojection_error())
    features: dict[str, int] = {}
    matches: list[tuple[int, int, int]] = []
    turning = 0
    pose_errors: list[float] = []
    if worker.database.exists():
        with open_database(worker.database) as database:
            numbers: dict[int, int] = {}
            for number, picture in enumerate(job.pictures):
                image = database.read_image_with_name(picture.name)
                if image is not None:
                    numbers[int(image.image_id)] = number
                    features[picture.name] = int(database.num_keypoints_for_image(image.image_id))
            for pair_id, geometry in zip(*database.read_two_view_geometries(), strict=True):
                pairs = np.asarray(geometry.inlier_matches)
                if not len(pairs):
                    continue
                ids = pycolmap.pair_id_to_image_pair(pair_id)
                i, j = (numbers[k] for k in ids)
                matches.append((i, j, len(pairs)))
                turning += "PANORAMIC" in str(geometry.config)
                known = job.pictures[i].known, job.pictures[j].known
                if known[0] is not None and known[1] is not None:
                    at = [
                        np.asarray(database.read_keypoints(k).data)[pairs[:, n], :2]
                        for n, k in enumerate(ids)
                    ]
                    pose_errors.extend(_pose_errors_px((known[0], known[1]), (at[0], at[1])))
    return JobResult(
        attempts,
        features,
        tuple(sorted(matches)),
        turning / len(matches) if matches else 0.0,
        error_px,
        float(np.median(pose_errors)) if pose_errors else None,
        times,
    )


def _pose_errors_px(
    known: tuple[KnownPose, KnownPose], at: tuple[FloatArray, FloatArray]
) -> FloatArray:
    first_from_world, second_from_world = (
        Pose.from_quaternion(k.wxyz, k.translation) for k in known
    )
    first, second = (Pinhole(1, 1, *k.pinhole) for k in known)
    second_from_first = second_from_world @ first_from_world.inverse()
    return epipolar_distances_px(*at, (first, second), second_from_first)


def epipolar_distances_px(
    first: FloatArray,
    second: FloatArray,
    cameras: tuple[Pinhole, Pinhole],
    second_from_first: Pose,
) -> FloatArray:
    """How far each match lies from the line on which it must lie (Sampson's distance).

    Args:
        first: (N, 2) pixels in the first picture.
        second: (N, 2) the same points in the second.
        cameras: of both.
        second_from_first: between the cameras; pixel distances mean nothing without a baseline.

    Returns:
        (N,) pixels; infinite where the cameras stand at one place.
    """
    t = second_from_first.translation
    if float(np.linalg.norm(t)) < 1e-9:
        return np.full(len(first), np.inf)
    cross = np.cross(np.eye(3), t / np.linalg.norm(t))
    essential = cross.T @ second_from_first.rotation
    inverse_a, inverse_b = (np.linalg.inv(_matrix(camera)) for camera in cameras)
    fundamental = inverse_b.T @ essential @ inverse_a
    a = np.column_stack([first, np.ones(len(first))])
    b = np.column_stack([second, np.ones(len(second))])
    line_in_b, line_in_a = a @ fundamental.T, b @ fundamental
    residual = np.einsum("nd,nd->n", b, line_in_b)
    slope = (line_in_b[:, :2] ** 2).sum(axis=1) + (line_in_a[:, :2] ** 2).sum(axis=1)
    return np.abs(residual) / np.sqrt(np.maximum(slope, 1e-18))


def _matrix(camera: Pinhole) -> FloatArray:
    return np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
