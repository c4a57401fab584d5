# pyright: standard
"""Metric alignment without codes: an object of known size, marked with a box in a few photos.

Where the object stands, how it is turned and how large the reconstruction drew it are found
together: its known points, projected, shall just fill the boxes. Only outlines count, so a plain
object without any texture does as well as another.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull

from scenes.pose import Pose, rotation_from_quaternion
from scenes.prepare.align.alignment import Alignment
from scenes.prepare.align.by_length import picked_point, standing_alignment
from scenes.prepare.align.gravity import find_gravity, standing_world
from scenes.prepare.align.similarity import Similarity
from scenes.prepare.options import KnownObject
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.state import ObjectModel

FloatArray = NDArray[np.float64]

YAWS = 8
"""Starts of the search around a whole turn."""
DRAWN_PX = 2.0
"""How exactly people draw boxes: no better than this, however well the fit looks."""
MAX_MISFIT = 0.06
"""Of the boxes' mean side: what does not fit better is another object, or boxes around another."""
UNKNOWNS = 5
TOLD_SIGMA = 0.03
"""Relative deviation of the scale from which on the user is warned."""
SOLID = 0.5
"""Opacity from which on a splat shows the object's surface."""
REACH = 1.5
"""Standard deviations at which a splat has faded to a third: there its outline is."""
MIN_SPLATS = 30
"""Solid splats below which an object's shape is not known."""


def box_corners(box_m: tuple[float, float, float]) -> FloatArray:
    """(8, 3) corners of an upright box with its origin under its centre, metres."""
    x, y, z = box_m
    unit = [(i, j, k) for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (0.0, 1.0)]
    return np.array(unit) * (x, y, z)


def spanning_points(item: ObjectModel) -> FloatArray:
    """(N, 3) points in an object's own frame whose outlines are the object's, metres.

    Raises:
        ValueError: it has too few solid splats.
    """
    solid = item.splats.select(item.splats.opacities >= SOLID)
    if len(solid) < MIN_SPLATS:
        raise ValueError(
            f"known object {item.object_id!r}: {len(solid)} solid splats, wanted {MIN_SPLATS}; "
            "choose another"
        )
    axes = REACH * rotation_from_quaternion(solid.rotations) * solid.scales[:, None, :]
    ends = [solid.means + sign * axes[:, :, k] for k in range(3) for sign in (-1.0, 1.0)]
    points = np.concatenate(ends).astype(np.float64)
    return points[ConvexHull(points).vertices]


def align_by_object(
    reconstruction: Reconstruction, known: KnownObject, *, rng: np.random.Generator
) -> Alignment:
    """The metric world from an object of known size.

    The origin is on the floor under the object, and X is the object's.

    Args:
        reconstruction: photos with poses and sparse points.
        known: the object, upright, and its boxes in the photos.
        rng: for the search of the floor.

    Raises:
        ValueError: fewer than two photos, an unknown one, or the boxes do not fit the object.
    """
    middles = {
        name: ((left + right) / 2, (top + bottom) / 2)
        for name, (left, top, right, bottom) in known.boxes_px.items()
    }
    middle = picked_point(reconstruction, middles)
    gravity = find_gravity(reconstruction, rng=rng)
    ahead = reconstruction.views[0].world_from_camera.rotation[:, 2]
    level = standing_world(gravity, middle, _not_along(ahead, gravity.up), 1.0)
    views = [view for view in reconstruction.views if view.name in known.boxes_px]
    points_m = known.points_m - 0.5 * (known.points_m.min(axis=0) + known.points_m.max(axis=0))
    boxes = np.array([known.boxes_px[view.name] for view in views])
    units_per_metre, yaw, sigma = _fit(points_m, views, boxes, level, level @ middle)
    along = level.rotation.T @ (math.cos(yaw), math.sin(yaw), 0.0)
    alignment = standing_alignment(
        reconstruction, gravity, 1.0 / units_per_metre, middle[None], along, sigma
    )
    if sigma < TOLD_SIGMA:
        return alignment
    warning = (
        f"The scale is only known to {sigma:.0%}: box the object in more photos, from different "
        "sides and where it is large, or take one that is shaped as its size says."
    )
    return replace(alignment, warnings=(warning, *alignment.warnings))


def _fit(
    points_m: FloatArray,
    views: Sequence[View],
    boxes: FloatArray,
    level: Similarity,
    middle: FloatArray,
) -> tuple[float, float, float]:
    """Units per metre, yaw in the level frame, and the relative deviation of the former."""
    camera_from_level = [
        (Pose(level.rotation, level.translation) @ view.world_from_camera).inverse()
        for view in views
    ]

    def off_px(unknowns: FloatArray) -> FloatArray:
        size, yaw, *place = unknowns
        turned = points_m @ Pose.from_yaw(yaw).rotation.T
        there = np.asarray(place) + math.exp(size) * turned
        edges = []
        for view, from_level in zip(views, camera_from_level, strict=True):
            pixels, _ = view.camera.project(from_level @ there)
            edges.append(np.concatenate([pixels.min(axis=0), pixels.max(axis=0)]))
        return np.nan_to_num(np.concatenate(edges) - boxes.ravel(), nan=1e4).clip(-1e4, 1e4)

    start = math.log(_first_size(points_m, views, boxes, camera_from_level, middle))
    fits = [
        least_squares(
            off_px, [start, 2 * math.pi * k / YAWS, *middle], x_scale="jac", loss="soft_l1",
            f_scale=DRAWN_PX,
        )
        for k in range(YAWS)
    ]  # fmt: skip
    best = min(fits, key=lambda fit: fit.cost)
    off = off_px(best.x)
    spare = max(len(off) - UNKNOWNS, 1)
    rms_px = math.sqrt(float(off @ off) / spare)
    side_px = float((boxes[:, 2:] - boxes[:, :2]).mean())
    if rms_px > MAX_MISFIT * side_px:
        raise ValueError(
            f"known object: its outline misses the boxes by {rms_px:.0f} px, limit "
            f"{MAX_MISFIT * side_px:.0f} ({MAX_MISFIT:.0%} of their size); draw each box close "
            "around the whole object, and see whether its size is width, depth, height in metres"
        )
    spread = np.linalg.pinv(best.jac.T @ best.jac) * max(rms_px, DRAWN_PX) ** 2
    return math.exp(best.x[0]), float(best.x[1]), math.sqrt(float(spread[0, 0]))


def _first_size(
    points_m: FloatArray,
    views: Sequence[View],
    boxes: FloatArray,
    camera_from_level: Sequence[Pose],
    middle: FloatArray,
) -> float:
    """Units per metre from the boxes' sizes, whatever way the object is turned."""
    extent_m = float(np.linalg.norm(np.ptp(points_m, axis=0)))
    found = []
    for view, from_level, box in zip(views, camera_from_level, boxes, strict=True):
        # Pixels at the middle for a step of a thousandth of the distance.
        in_camera = from_level @ middle
        step = 1e-3 * float(np.linalg.norm(in_camera))
        at = np.stack([in_camera, in_camera + np.array([step, 0.0, 0.0])])
        pixels, _ = view.camera.project(at)
        px_per_unit = float(np.linalg.norm(pixels[1] - pixels[0])) / step
        found.append(float(np.linalg.norm(box[2:] - box[:2])) / px_per_unit / extent_m)
    return float(np.median(found))


def _not_along(direction: FloatArray, up: FloatArray) -> FloatArray:
    """A direction that is not the vertical."""
    if abs(float(direction @ up)) < 0.9:
        return direction
    return np.eye(3)[int(np.argmin(np.abs(up)))]
