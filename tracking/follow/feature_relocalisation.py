# pyright: standard
"""Feature-based relocalisation of a textured object by its remembered appearance.

A solve converges from a few pixels and a slide does not turn. An object swung in a hand moves and
turns farther from one frame to the next; matched ORB features and PnP with RANSAC give its pose.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, rotation_from_vector
from tracking.evidence.appearance_memory import SOLID, AppearanceMemory
from tracking.evidence.evidence import gather
from tracking.follow.track import Task
from tracking.window.window import window_around

Points = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
BytePicture = NDArray[np.uint8]

REACH = 2.5
"""Radius of the search window around the last position, in radii of the object. Chosen on the rooms
lab and desk."""


CHANGED = 0.3
"""Foreground probability above which pixels are searched for features."""


MAX_FEATURES = 600
"""ORB features per picture."""

LEVELS = 4
"""Pyramid levels of the ORB detector."""

SCALE = 1.3
"""Scale between two pyramid levels."""

EDGE_PX = 8
"""Margin in px without features at the picture's border."""

MIN_CONTRAST = 8
"""Threshold of the FAST detector, in grey levels."""


MIN_RATIO = 0.8
"""Largest ratio of the best to the second-best descriptor distance (Lowe 2004)."""


OFF_PX = 2.0
"""Reprojection error in lens pixels of a RANSAC inlier."""

TRIALS = 200
"""RANSAC iterations."""

MIN_FOUND = 8
"""Least number of inliers of a pose."""


NOT_BESIDE = 0.2
"""Least cosine between a ray and the viewing direction; other rays are left out of PnP."""


STEPS = 6
"""Gauss-Newton steps of the upright pose."""

MORE_OFF = 2.0
"""Factor on `OFF_PX` for inliers of the upright pose."""

MIN_UPRIGHT = 0.6
"""Share of the PnP inliers that must remain inliers of the upright pose."""


def relocalise(task: Task, appearance: AppearanceMemory, last: Points) -> Pose | None:
    """Rough pose of an object from matched features; None if too few match.

    Args:
        task: the object and the frame.
        appearance: its remembered appearance.
        last: (3,) last position in the world, m.
    """
    scene, model = task.scene, task.model
    reach_m = REACH * model.radius_m
    window = window_around(scene.frame.rig, scene.world_from_rig, last, radius_m=reach_m)
    changed = gather(scene, model, window, task.neighbours).foreground > CHANGED
    if not changed.any():
        return None
    known, now = _paired(
        (_shown(appearance), appearance.shown[..., 3] > SOLID),
        (_grey(scene.frame.images[window.lens][window.part]), _enlarged(changed, window.shrink)),
    )
    if len(known) < MIN_FOUND:
        return None
    columns, rows = np.floor(known).astype(int).T
    rays = appearance.camera.unproject(known)
    points = appearance.camera_from_object.inverse() @ (
        rays * appearance.depth[rows, columns, None]
    )
    lens = scene.frame.rig.lenses[window.lens]
    sights = lens.unproject(now + np.array([window.left, window.top]))
    return _resected(points, sights, window.world_from_camera, OFF_PX / lens.f_px)


def _shown(appearance: AppearanceMemory) -> BytePicture:
    """(H, W) uint8 grey picture of a remembered appearance."""
    return _grey(np.clip(255.0 * appearance.shown[..., :3], 0.0, 255.0).astype(np.uint8))


def _grey(picture: BytePicture) -> BytePicture:
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _enlarged(mask: BoolArray, times: int) -> BoolArray:
    """A mask with each pixel as so many both ways."""
    return mask.repeat(times, axis=0).repeat(times, axis=1)


Part = tuple[BytePicture, BoolArray]
"""A grey picture (H, W), and where in it to look."""


def _paired(before: Part, now: Part) -> tuple[Points, Points]:
    """(K, 2) pixels of matched features in both pictures (ratio test)."""
    orb = cv2.ORB.create(
        MAX_FEATURES,
        scaleFactor=SCALE,
        nlevels=LEVELS,
        edgeThreshold=EDGE_PX,
        patchSize=3 * EDGE_PX,
        fastThreshold=MIN_CONTRAST,
    )
    (known, known_looks), (found, found_looks) = (
        orb.detectAndCompute(picture, mask.astype(np.uint8)) for picture, mask in (before, now)
    )
    nothing = np.zeros((0, 2)), np.zeros((0, 2))
    if known_looks is None or found_looks is None or len(found) < 2:
        return nothing
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(known_looks, found_looks, k=2)
    kept = [best for best, other in pairs if best.distance < MIN_RATIO * other.distance]
    if not kept:
        return nothing
    # The library's pixels are whole numbers at their centres.
    pixels = [[known[m.queryIdx].pt for m in kept], [found[m.trainIdx].pt for m in kept]]
    return np.array(pixels[0]) + 0.5, np.array(pixels[1]) + 0.5


def _resected(points: Points, sights: Points, world_from_camera: Pose, sigma: float) -> Pose | None:
    """`world_from_object` of an upright object by what is seen of it; None if that does not agree.

    Args:
        points: (K, 3) in the object's frame.
        sights: (K, 3) unit rays of the camera that show them, some wrongly.
        world_from_camera: its pose.
        sigma: how exactly rays show points, as a tangent.
    """
    # A camera that looks at what it sees: others have points beside or behind them.
    camera_from_ahead = _looking_along(sights.mean(axis=0))
    ahead = camera_from_ahead.inverse() @ sights
    points, ahead = points[ahead[:, 2] > NOT_BESIDE], ahead[ahead[:, 2] > NOT_BESIDE]
    if len(points) < MIN_FOUND:
        return None
    seen = ahead[:, :2] / ahead[:, 2:]
    is_found, vector, translation, agree = cv2.solvePnPRansac(
        points,
        seen,
        np.eye(3),
        np.zeros(4),
        iterationsCount=TRIALS,
        reprojectionError=sigma,
        flags=cv2.SOLVEPNP_AP3P,
    )
    if not is_found or agree is None or len(agree) < MIN_FOUND:
        return None
    place = np.asarray(translation[:, 0], dtype=np.float64)
    ahead_from_object = Pose(rotation_from_vector(vector[:, 0]), place)
    world_from_ahead = world_from_camera @ camera_from_ahead
    world_from_object = world_from_ahead @ ahead_from_object
    # A flat object has two nearly equivalent poses, leaning either way.
    upright = Pose.from_yaw(world_from_object.yaw(), world_from_object.translation)
    inliers = agree[:, 0].astype(np.intp)
    points, seen = points[inliers], seen[inliers]
    upright, off = _nearest(points, seen, world_from_ahead, upright)
    agreed = int((off < MORE_OFF * sigma).sum())
    return upright if agreed >= max(MIN_FOUND, MIN_UPRIGHT * len(off)) else None


def _nearest(
    points: Points, seen: Points, world_from_camera: Pose, world_from_start: Pose
) -> tuple[Pose, Points]:
    """The upright pose at which points (K, 3) are seen nearest to where they are, (K, 2) tangents.

    Gauss-Newton in place and yaw.

    Returns:
        the pose, and (K,) how far off each is at the last step but one.
    """
    off = np.zeros(0)
    camera_from_world = world_from_camera.inverse()
    place, yaw = np.array(world_from_start.translation), world_from_start.yaw()
    for _ in range(STEPS):
        turned = Pose.from_yaw(yaw, (0.0, 0.0, 0.0)) @ points
        x, y, z = (camera_from_world @ (turned + place)).T
        by_yaw = np.stack([-turned[:, 1], turned[:, 0], np.zeros(len(points))], axis=1)
        moves = np.concatenate(
            [np.broadcast_to(np.eye(3), (len(points), 3, 3)), by_yaw[:, :, None]], axis=2
        )
        moved = camera_from_world.rotation @ moves
        jacobian = np.stack(
            [
                moved[:, 0] / z[:, None] - moved[:, 2] * (x / z**2)[:, None],
                moved[:, 1] / z[:, None] - moved[:, 2] * (y / z**2)[:, None],
            ],
            axis=1,
        ).reshape(-1, 4)
        off = (seen - np.stack([x / z, y / z], axis=1)).ravel()
        step = np.linalg.lstsq(jacobian, off, rcond=None)[0]
        place, yaw = place + step[:3], yaw + float(step[3])
    return Pose.from_yaw(yaw, place), np.linalg.norm(off.reshape(-1, 2), axis=1)


def _looking_along(sight: Points) -> Pose:
    """`camera_from_ahead` of a camera at the same place whose axis is along a direction."""
    sight = sight / np.linalg.norm(sight)
    axis = np.cross((0.0, 0.0, 1.0), sight)
    sine = float(np.linalg.norm(axis))
    turn = axis / max(sine, 1e-12) * math.atan2(sine, float(sight[2]))
    return Pose(rotation_from_vector(turn), np.zeros(3))
