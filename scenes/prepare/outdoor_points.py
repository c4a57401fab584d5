# pyright: standard
"""Points for what the trainer's stereo sees badly outdoors: the way ahead, and the sky.

Photos taken in the direction of walking get their distances by `plane_sweep`; a distance counts if
another photo's agrees with it. What is blue above the horizon, and clouds in it, is sky: it is put
on a far dome, or splats near the cameras would have to paint it. A room that is filmed from the
side gets neither.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import pixel_centres
from scenes.prepare.plane_sweep import GreyPicture, Look, looks_of, partners_of, swept, ways_of
from scenes.prepare.progress import Progress, silent
from scenes.prepare.reconstruction import Reconstruction
from scenes.prepare.train.training_photos import Photos

LOOKING_AHEAD = 0.75
"""Cosine between a photo's axis and the way to the next, from which what is ahead hardly moves."""
PICTURE_PX = 320
"""Longest side of the pictures, px."""
DEPTH_TOLERANCE = 0.02
"""Relative difference of distances up to which two photos agree."""

SKY_REACH = 6.0
"""How far away the dome is, in distances of the farthest sparse points."""
SKY_CELL_DEG = 2.0
"""Angle between points of the sky, degrees."""
SKY_BLUE = 1.12
"""Sky has so much more blue than red."""
OUTDOORS_M = 15.0
"""Distance seen, metres, below which pictures are of a room: its blue walls are no sky."""
CLOUD_GREY = 140
"""Each channel of a cloud is brighter (0..255)."""
MIN_SKY_SHARE = 0.03
"""Less of all pictures than this is no sky."""

FloatArray = NDArray[np.float64]


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
        progress: called after every photo.

    Raises:
        ValueError: a photo cannot be read, or fewer than two views are left.
    """
    photos = Photos(metric, held_out_every=held_out_every, longest_px=PICTURE_PX)
    looks = looks_of(metric, photos.training, PICTURE_PX)
    if len(looks) < 3:
        return metric
    skies = _skies(looks, metric.points)
    points, colours = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8)
    ways = ways_of(looks)
    if _look_along(looks, ways):
        partners = partners_of(looks, metric.points)
        inverse = []
        for number, (look, is_sky) in enumerate(zip(looks, skies, strict=True)):
            found = swept(look, [looks[k] for k in partners[number]], ways[number])
            inverse.append(np.where(is_sky, np.float32(0), found))
            progress(0.9 * (number + 1) / len(looks), f"photo {number + 1} of {len(looks)}")
        points, colours = _consistent(looks, inverse, partners)
    sky, sky_colours = _dome(looks, skies, metric.points)
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


def _look_along(looks: Sequence[Look], ways: FloatArray) -> bool:
    """Whether most photos look along the way to the next place that they were taken from."""
    axes = np.stack([look.world_from_camera.rotation[:, 2] for look in looks])
    return float(np.median(np.abs(np.einsum("kc,kc->k", ways, axes)))) > LOOKING_AHEAD


def _consistent(
    looks: Sequence[Look], inverse: Sequence[GreyPicture], partners: Sequence[Sequence[int]]
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
        consistent = np.zeros(len(world), dtype=np.bool_)
        for k in partners[number]:
            consistent |= _is_consistent(looks[k], inverse[k], world)
        points.append(world[consistent])
        colours.append(look.colours.reshape(-1, 3)[places[consistent]])
    return np.concatenate(points), np.concatenate(colours)


def _is_consistent(look: Look, inverse: GreyPicture, world: FloatArray) -> NDArray[np.bool_]:
    in_camera = look.world_from_camera.inverse() @ world
    pixels, valid = look.camera.project(in_camera)
    consistent = np.zeros(len(world), dtype=np.bool_)
    column, row = np.floor(pixels[valid]).astype(np.intp).T
    height, width = inverse.shape
    there = inverse[row.clip(0, height - 1), column.clip(0, width - 1)]
    consistent[valid] = np.abs(there * in_camera[valid, 2] - 1.0) < DEPTH_TOLERANCE
    return consistent


def _skies(looks: Sequence[Look], points: FloatArray) -> list[NDArray[np.bool_]]:
    """(H, W) of each photo: where it shows sky; nowhere in a room."""
    skies = [_sky_of(look) for look in looks]
    shown = sum(int(sky.sum()) for sky in skies)
    is_outdoors = _farthest(looks, points)[1] >= OUTDOORS_M
    if is_outdoors and shown >= MIN_SKY_SHARE * sum(sky.size for sky in skies):
        return skies
    return [np.zeros_like(sky) for sky in skies]


def _sky_of(look: Look) -> NDArray[np.bool_]:
    """(H, W) what is blue above the horizon, and what is bright between."""
    r, b = look.colours[..., 0].astype(np.float32), look.colours[..., 2].astype(np.float32)
    blue = ((b > SKY_BLUE * r) & (b > 90)).astype(np.uint8)
    # Clouds are not blue, but have blue around them; so have chimneys, which are dark.
    closed = cv2.morphologyEx(blue, cv2.MORPH_CLOSE, np.ones((15, 15), np.uint8))
    sky = (blue > 0) | ((closed > 0) & (look.colours.min(axis=2) > CLOUD_GREY))
    return np.asarray(sky & (_directions(look)[..., 2] > 0.02))


def _directions(look: Look) -> FloatArray:
    """(H, W, 3) unit vectors, world, that the pixels look along."""
    rays = look.camera.unproject(pixel_centres(look.camera)) @ look.world_from_camera.rotation.T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return rays.reshape(*look.grey.shape, 3)


def _farthest(looks: Sequence[Look], points: FloatArray) -> tuple[FloatArray, float]:
    """The middle (3,) of where photos were taken, and how far from it points lie, but for a few."""
    centre = np.stack([look.eye for look in looks]).mean(axis=0)
    return centre, float(np.quantile(np.linalg.norm(points - centre, axis=1), 0.98))


def _dome(
    looks: Sequence[Look], skies: Sequence[NDArray[np.bool_]], points: FloatArray
) -> tuple[FloatArray, NDArray[np.uint8]]:
    """Points on a far dome in the directions in which photos show sky."""
    centre, far_m = _farthest(looks, points)
    towards = np.concatenate(
        [_directions(look)[sky] for look, sky in zip(looks, skies, strict=True)]
    )
    seen = np.concatenate([look.colours[sky] for look, sky in zip(looks, skies, strict=True)])
    if not len(towards):
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8)
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
