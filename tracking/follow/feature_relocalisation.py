"""Where a patterned thing has leapt to: what its portrait shows is found again in the picture.

A solve comes to a pose from a few pixels off, and a slide does not turn. Something that is swung in
a hand is farther off and turned from one picture to the next; its pattern tells where it is.
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
"""How far around its last place it is looked for, in radii."""

CHANGED = 0.3
"""What shows the empty room by more than the rest is not looked at."""

MOST_FEATURES, LEVELS, SCALE = 600, 4, 1.3
"""Features of each picture, at so many sizes, each by so much smaller."""
EDGE_PX = 8
LEAST_CONTRAST = 8
"""Of a corner, in grey levels; none is nearer than so many pixels to the picture's edge."""

LEAST_RATIO = 0.8
"""A feature is found again if no other is nearly as much like it (Lowe 2004)."""

OFF_PX = 2.0
TRIALS = 200
LEAST_FOUND = 8
"""So many features have to agree about a pose, to so many pixels."""

NOT_BESIDE = 0.2
"""Cosine between a ray and what is looked at, below which it is beside it."""

STEPS = 6
MORE_OFF, LEAST_UPRIGHT = 2.0, 0.6
"""Of what agrees about a pose, so many features have to agree about an upright one, to so many
times as many pixels."""


def relocalised(task: Task, appearance: AppearanceMemory, last: Points) -> Pose | None:
    """The pose of an object by its pattern alone, roughly; None if too little of that is found.

    Args:
        task: the object and the frame.
        appearance: how it looked before.
        last: (3,) where it was.
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
    if len(known) < LEAST_FOUND:
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
    """(H, W) a portrait in grey."""
    return _grey(np.clip(255.0 * appearance.shown[..., :3], 0.0, 255.0).astype(np.uint8))


def _grey(picture: BytePicture) -> BytePicture:
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _enlarged(mask: BoolArray, times: int) -> BoolArray:
    """A mask with each pixel as so many both ways."""
    return mask.repeat(times, axis=0).repeat(times, axis=1)


Part = tuple[BytePicture, BoolArray]
"""A grey picture (H, W), and where in it to look."""


def _paired(before: Part, now: Part) -> tuple[Points, Points]:
    """(K, 2) pixels of a picture, and those of another one that show the same."""
    orb = cv2.ORB.create(
        MOST_FEATURES,
        scaleFactor=SCALE,
        nlevels=LEVELS,
        edgeThreshold=EDGE_PX,
        patchSize=3 * EDGE_PX,
        fastThreshold=LEAST_CONTRAST,
    )
    (known, known_looks), (found, found_looks) = (
        orb.detectAndCompute(picture, mask.astype(np.uint8)) for picture, mask in (before, now)
    )
    nothing = np.zeros((0, 2)), np.zeros((0, 2))
    if known_looks is None or found_looks is None or len(found) < 2:
        return nothing
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(known_looks, found_looks, k=2)
    kept = [best for best, other in pairs if best.distance < LEAST_RATIO * other.distance]
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
    if len(points) < LEAST_FOUND:
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
    if not is_found or agree is None or len(agree) < LEAST_FOUND:
        return None
    place = np.asarray(translation[:, 0], dtype=np.float64)
    ahead_from_object = Pose(rotation_from_vector(vector[:, 0]), place)
    world_from_ahead = world_from_camera @ camera_from_ahead
    world_from_object = world_from_ahead @ ahead_from_object
    # Of something flat, two poses that lean either way look nearly alike.
    upright = Pose.from_yaw(world_from_object.yaw(), world_from_object.translation)
    inliers = agree[:, 0].astype(np.intp)
    points, seen = points[inliers], seen[inliers]
    upright, off = _nearest(points, seen, world_from_ahead, upright)
    agreed = int((off < MORE_OFF * sigma).sum())
    return upright if agreed >= max(LEAST_FOUND, LEAST_UPRIGHT * len(off)) else None


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
