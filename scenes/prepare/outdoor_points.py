"""Points for what the trainer's stereo cannot see: the way ahead, and the sky.

Photos taken in the direction of walking cannot be turned until their rows agree. Here each is
compared with a few neighbours over planes at growing distance (plane sweep, Collins 1996, with
normalised cross-correlation); a distance counts if another photo's agrees with it. What is blue
above the horizon is sky: it is put on a far dome, or splats near the cameras would have to paint
it. A room that is filmed from the side gets neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole, pixel_centres
from scenes.pose import Pose
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.prepare.train.training_photos import Photos, read_photo

LOOKING_AHEAD = 0.75
"""Cosine between a photo's axis and the way to the next, from which stereo sees nothing."""
PICTURE_PX = 288
PLANES = 64
NEIGHBOURS = 4
WINDOW_PX = 7
LEAST_LIKENESS = 0.8
LEAST_CONTRAST = 3.0
"""Grey levels of standard deviation below which a window shows nothing to compare."""
AGREEMENT = 0.04
"""Relative difference of distances up to which two photos agree."""
NEAREST_SHARE, FARTHEST_SHARE = 0.5, 2.0
"""Distances that are tried, by the nearest and farthest sparse points of a photo."""
LEAST_ANGLE_DEG, BEST_ANGLE_DEG = 0.5, 6.0

SKY_REACH = 6.0
"""How far away the dome is, in distances of the farthest sparse points."""
SKY_CELL_DEG = 2.0
SKY_BLUE = 1.12
"""Sky has so much more blue than red."""
OUTDOORS_M = 15.0
"""Who sees no farther is in a room, and its blue walls are no sky."""
LEAST_SKY = 0.03
"""Less of all pictures than this is no sky."""

FloatArray = NDArray[np.float64]
GreyPicture = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """A photo, small, and where it was taken."""

    colours: NDArray[np.uint8]
    grey: GreyPicture
    camera: Pinhole
    world_from_camera: Pose
    nearest: float
    farthest: float


def with_outdoor_points(
    metric: Reconstruction,
    wanted: int,
    *,
    held_out_every: int,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> Reconstruction:
    """The reconstruction with points on the way ahead and in the sky, if it shows either.

    Args:
        metric: photos with poses and sparse points; world, Z up.
        wanted: points in all, at most; sparse ones come first.
        held_out_every: of so many views one judges the training and has no say here; 0 for none.
        rng: chooses among more.
        progress: told after every photo.

    Raises:
        ValueError: a photo cannot be read, or fewer than two views are left.
    """
    photos = Photos(metric, held_out_every=held_out_every, longest_px=PICTURE_PX)
    looks = _looks(metric, photos.training)
    if len(looks) < 3:
        return metric
    points, colours = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8)
    if _look_ahead(looks):
        partners = _partners(looks, metric.points)
        inverse = []
        for number, look in enumerate(looks):
            inverse.append(_swept(look, [looks[k] for k in partners[number]]))
            progress(0.9 * (number + 1) / len(looks), f"photo {number + 1} of {len(looks)}")
        points, colours = _agreed(looks, inverse, partners)
    sky, sky_colours = _sky(looks, metric.points)
    room = max(wanted - len(metric.points) - len(sky), 0)
    if len(points) > room:
        chosen = np.sort(rng.choice(len(points), room, replace=False))
        points, colours = points[chosen], colours[chosen]
    added = len(points) + len(sky)
    progress(1.0, f"{added:,} points")
    if not added:
        return metric
    return Reconstruction(
        metric.views,
        np.concatenate([metric.points, points, sky]),
        np.concatenate([metric.colours, colours, sky_colours]),
        np.concatenate([metric.errors_px, np.zeros(added, dtype=np.float32)]),
    )


def _look_ahead(looks: list[_Look]) -> bool:
    """Whether most photos look along the way to the next place that they were taken from."""
    eyes = np.stack([look.world_from_camera.translation for look in looks])
    axes = np.stack([look.world_from_camera.rotation[:, 2] for look in looks])
    apart = eyes[:, None] - eyes[None]
    distance = np.linalg.norm(apart, axis=2)
    np.fill_diagonal(distance, np.inf)
    nearest = distance.argmin(axis=1)
    place = np.arange(len(looks))
    way = apart[place, nearest] / np.maximum(distance[place, nearest], 1e-12)[:, None]
    return float(np.median(np.abs(np.einsum("kc,kc->k", way, axes)))) > LOOKING_AHEAD


def _looks(metric: Reconstruction, views: Sequence[View]) -> list[_Look]:
    looks = []
    for view in views:
        if not isinstance(view.camera, Pinhole):
            continue
        in_camera = view.world_from_camera.inverse() @ metric.points
        _, is_seen = view.camera.project(in_camera)
        depths = in_camera[is_seen, 2]
        if len(depths) < 10:
            continue
        photo = read_photo(view, PICTURE_PX)
        assert isinstance(photo.camera, Pinhole)
        grey = cv2.cvtColor(photo.picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
        low, high = np.quantile(depths, (0.02, 0.98))
        looks.append(
            _Look(
                photo.picture,
                grey,
                photo.camera,
                view.world_from_camera,
                NEAREST_SHARE * float(low),
                FARTHEST_SHARE * float(high),
            )
        )
    return looks


def _partners(looks: list[_Look], points: FloatArray) -> list[list[int]]:
    """For each photo the others that show most of the same, from neither too near nor too far."""
    eyes = np.stack([look.world_from_camera.translation for look in looks])
    seen = np.stack([_sees(look, points) for look in looks])
    chosen = []
    for number in range(len(looks)):
        both = seen & seen[number]
        towards = points[None] - eyes[:, None]
        towards /= np.maximum(np.linalg.norm(towards, axis=2, keepdims=True), 1e-12)
        cosine = np.einsum("kpc,pc->kp", towards, towards[number]).clip(-1, 1)
        angle = np.degrees(np.arccos(cosine))
        # What is seen under a small angle has no distance, under a large one another look.
        worth = np.minimum(angle / BEST_ANGLE_DEG, BEST_ANGLE_DEG / np.maximum(angle, 1e-6))
        worth = np.where(both & (angle > LEAST_ANGLE_DEG), worth, 0.0)
        worth[number] = 0.0
        chosen.append(_covering(worth))
    return chosen


def _covering(worth: FloatArray) -> list[int]:
    """Rows of (K, P) that together are worth most, each point counted by its best row."""
    chosen: list[int] = []
    had = np.zeros(worth.shape[1])
    for _ in range(NEIGHBOURS):
        gain = np.maximum(worth - had, 0.0).sum(axis=1)
        best = int(gain.argmax())
        if gain[best] <= 0:
            break
        chosen.append(best)
        had = np.maximum(had, worth[best])
    return chosen


def _sees(look: _Look, points: FloatArray) -> NDArray[np.bool_]:
    _, is_seen = look.camera.project(look.world_from_camera.inverse() @ points)
    return is_seen


def _swept(look: _Look, others: list[_Look]) -> GreyPicture:
    """(H, W) inverse depth where the photo looks like its neighbours; 0 where it does not."""
    height, width = look.grey.shape
    if not others:
        return np.zeros((height, width), dtype=np.float32)
    tried = np.linspace(1.0 / look.farthest, 1.0 / look.nearest, PLANES)
    mean, deviation = _moments(look.grey)
    best = np.full((height, width), -1.0, dtype=np.float32)
    place = np.zeros((height, width), dtype=np.intp)
    for number, inverse in enumerate(tried):
        scores = np.stack(
            [_likeness(look, other, float(inverse), mean, deviation) for other in others]
        )
        # Hidden in some of the neighbours, a place is seen in the one that it looks like.
        score = scores.max(axis=0)
        better = score > best
        best[better], place[better] = score[better], number
    sure = (best >= LEAST_LIKENESS) & (deviation >= LEAST_CONTRAST)
    sure &= (place > 0) & (place < PLANES - 1)
    return np.where(sure, tried[place], 0.0).astype(np.float32)


def _likeness(
    look: _Look, other: _Look, inverse: float, mean: GreyPicture, deviation: GreyPicture
) -> GreyPicture:
    """(H, W) correlation of windows if everything were on the plane z = 1 / inverse; -1 outside."""
    other_from_look = other.world_from_camera.inverse() @ look.world_from_camera
    onto = other_from_look.rotation + np.outer(
        other_from_look.translation, np.array([0.0, 0.0, inverse])
    )
    homography = _matrix(other.camera) @ onto @ np.linalg.inv(_matrix(look.camera))
    size = (look.grey.shape[1], look.grey.shape[0])
    warped = cv2.warpPerspective(
        other.grey,
        homography,
        size,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=-1.0,
    )
    warped = np.asarray(warped, dtype=np.float32)
    other_mean, other_deviation = _moments(warped)
    product = cv2.blur(look.grey * warped, (WINDOW_PX, WINDOW_PX)) - mean * other_mean
    likeness = product / np.maximum(deviation * other_deviation, 1.0)
    return np.where(warped < 0, -1.0, likeness).astype(np.float32)


def _moments(grey: GreyPicture) -> tuple[GreyPicture, GreyPicture]:
    window = (WINDOW_PX, WINDOW_PX)
    mean = np.asarray(cv2.blur(grey, window), dtype=np.float32)
    square = np.asarray(cv2.blur(grey * grey, window), dtype=np.float32)
    return mean, np.sqrt(np.maximum(square - mean * mean, 0.0))


def _matrix(camera: Pinhole) -> FloatArray:
    """OpenCV's, whose whole numbers are pixel centres."""
    return np.array([[camera.fx, 0, camera.cx - 0.5], [0, camera.fy, camera.cy - 0.5], [0, 0, 1.0]])


def _agreed(
    looks: list[_Look], inverse: list[GreyPicture], partners: list[list[int]]
) -> tuple[FloatArray, NDArray[np.uint8]]:
    """Points, world, whose distance from one photo is that from another."""
    points, colours = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.uint8)]
    for number, look in enumerate(looks):
        given = inverse[number].ravel()
        places = np.flatnonzero(given > 0)
        pixels = pixel_centres(look.camera)[places]
        rays = look.camera.unproject(pixels)
        in_camera = rays * (1.0 / (given[places] * rays[:, 2]))[:, None]
        world = look.world_from_camera @ in_camera
        agrees = np.zeros(len(world), dtype=np.bool_)
        for k in partners[number]:
            agrees |= _agrees(looks[k], inverse[k], world)
        points.append(world[agrees])
        colours.append(look.colours.reshape(-1, 3)[places[agrees]])
    return np.concatenate(points), np.concatenate(colours)


def _agrees(look: _Look, inverse: GreyPicture, world: FloatArray) -> NDArray[np.bool_]:
    in_camera = look.world_from_camera.inverse() @ world
    pixels, valid = look.camera.project(in_camera)
    agrees = np.zeros(len(world), dtype=np.bool_)
    column, row = np.floor(pixels[valid]).astype(np.intp).T
    height, width = inverse.shape
    there = inverse[row.clip(0, height - 1), column.clip(0, width - 1)]
    agrees[valid] = np.abs(there * in_camera[valid, 2] - 1.0) < AGREEMENT
    return agrees


def _sky(looks: list[_Look], points: FloatArray) -> tuple[FloatArray, NDArray[np.uint8]]:
    """Points on a far dome in the directions in which photos show sky; none in a room."""
    nothing = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8)
    centre = np.stack([look.world_from_camera.translation for look in looks]).mean(axis=0)
    far_m = float(np.quantile(np.linalg.norm(points - centre, axis=1), 0.98))
    if far_m < OUTDOORS_M:
        return nothing
    rays, colours, pixels = [], [], 0
    for look in looks:
        r, b = look.colours[..., 0].astype(np.float32), look.colours[..., 2].astype(np.float32)
        blue = ((b > SKY_BLUE * r) & (b > 90)).astype(np.uint8)
        # Clouds are not blue, but have blue around them.
        blue = cv2.morphologyEx(blue, cv2.MORPH_CLOSE, np.ones((15, 15), np.uint8))
        direction = look.camera.unproject(pixel_centres(look.camera))
        direction = direction @ look.world_from_camera.rotation.T
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        is_sky = (blue.ravel() > 0) & (direction[:, 2] > 0.02)
        rays.append(direction[is_sky])
        colours.append(look.colours.reshape(-1, 3)[is_sky])
        pixels += blue.size
    towards, seen = np.concatenate(rays), np.concatenate(colours)
    if len(towards) < LEAST_SKY * pixels:
        return nothing
    cell = np.deg2rad(SKY_CELL_DEG)
    _, first, inverse, count = np.unique(
        np.floor(towards / cell).astype(np.int64),
        axis=0,
        return_index=True,
        return_inverse=True,
        return_counts=True,
    )
    mean = np.stack(
        [np.bincount(inverse.ravel(), weights=seen[:, c]) / count for c in range(3)], axis=1
    )
    return centre + SKY_REACH * far_m * towards[first], np.round(mean).astype(np.uint8)
