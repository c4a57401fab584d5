"""Places in the whole picture where a lost object may stand, without drawing it.

Where the live picture differs from the empty room in the object's colours and something is there to
stand on, it is compared with small pictures of all the object's yaws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from tracking.evidence.evidence import Neighbour, Scene
from tracking.kernels.native import KERNELS
from tracking.kernels.options import OPTIONS
from tracking.model.object_model import TrackModel
from tracking.model.templates import YAWS, Cuts, compare, cut_out

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

SEARCH_SIZE_PX = 720
"""Lens pictures are shrunk to about this side for the proposals."""

FAINT, PLAIN = 0.07, 0.22
"""Distances of colours, of 0..1 channels: below the first a place may be relit, above it is not."""

LEAST_STEP_M = 0.06
STEP = 0.25
"""Places are tried this far apart, in radii of the object."""

PLACES = 160
"""How many places are proposed at most."""

LEAST_DENSITY = 0.08
"""A place is proposed if at least this share of its box looks like the object."""

TEXTURED_SHARE = 0.6
PLAIN_SHARE = 0.5
"""Weight of the colour correlation in a yaw's score; the rest is the overlap."""


@dataclass(frozen=True, slots=True, eq=False)
class Overview:
    """Small lens pictures compared with the empty room, shared by all searches of a frame.

    Attributes:
        cameras: shrunk lenses.
        images: (H, W, 3) float32 0..1 shrunk live pictures.
        foreground: (H, W) float32 per lens.
    """

    cameras: tuple[Fisheye, ...]
    images: tuple[FloatArray, ...]
    foreground: tuple[FloatArray, ...]


def overview(scene: Scene) -> Overview:
    """Shrink a frame and compare it with the empty room."""
    cameras: list[Fisheye] = []
    images: list[FloatArray] = []
    foregrounds: list[FloatArray] = []
    for index, lens in enumerate(scene.frame.rig.lenses):
        shrink = max(1, round(lens.width_px / SEARCH_SIZE_PX))
        width, height = lens.width_px // shrink, lens.height_px // shrink
        part = (slice(0, height * shrink), slice(0, width * shrink))
        live, foreground = KERNELS.differing(
            scene.frame.images[index][part],
            scene.background.images[index].cut(*part),
            scene.background.noise[index].cut(*part),
            lens_size=(lens.width_px, lens.height_px),
            window=(0, 0, width, height),
            shrink=shrink,
            exposure=scene.exposures[index].rows(),
            apart=(FAINT, PLAIN),
        )
        camera = lens.resized(width, height)
        x = ((np.arange(width) + 0.5 - camera.cx) / width).astype(np.float32)
        y = ((np.arange(height) + 0.5 - camera.cy) / height).astype(np.float32)
        seen = x[None, :] ** 2 + y[:, None] ** 2 <= (lens.circle_px / lens.width_px) ** 2
        cameras.append(camera)
        images.append(live.reshape(height, width, 3))
        foregrounds.append(foreground.reshape(height, width) * seen)
    return Overview(tuple(cameras), tuple(images), tuple(foregrounds))


def pixel_evidence(
    scene: Scene,
    look: Overview,
    index: int,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
) -> FloatArray:
    """(H, W, 5) a lens picture: colours, own and all foreground; neighbours are nobody's."""
    image, foreground = look.images[index], look.foreground[index].copy()
    bytes_ = np.clip(image * 255.0 + 0.5, 0, 255).astype(np.uint8)
    own = foreground * np.clip(model.colours.colour_similarity(bytes_) * 3.0, 0.0, 1.0)
    height, width = foreground.shape
    shrink = scene.frame.rig.lenses[index].width_px // width
    for other, world_from_object in neighbours:
        layer = scene.layers.layer(
            other.source,
            world_from_object,
            scene.frame.rig,
            scene.world_from_rig,
            scene.renderer,
            lens=index,
        )
        rows, columns = np.nonzero(layer.alpha > OPTIONS.foreign)
        rows = np.minimum((rows + layer.top) // shrink, height - 1)
        columns = np.minimum((columns + layer.left) // shrink, width - 1)
        own[rows, columns] = 0.0
        foreground[rows, columns] = 1.0
    return np.dstack([image, own, foreground]).astype(np.float32)


def proposed(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    pictures: Sequence[FloatArray],
    *,
    support_heights_m: Sequence[float],
    reach_m: float,
) -> Points:
    """(P, 3) at most `PLACES` positions whose box is full of the object's colours, best first."""
    around: Points = scene.world_from_rig.translation[:2]
    step = max(LEAST_STEP_M, STEP * model.radius_m)
    steps = np.arange(-reach_m, reach_m + 1e-9, step)
    shifted: Points = around[:, None] + steps
    x, y = np.meshgrid(*shifted)
    flat: Points = np.stack([x.ravel(), y.ravel()], axis=1)
    low, high = scene.bounds_m[:, :2]
    inside = (flat > low).all(axis=1) & (flat < high).all(axis=1)
    flat = flat[inside & (np.hypot(*(flat - around).T) <= reach_m)]
    places = np.concatenate(
        [np.column_stack([flat, np.full(len(flat), z)]) for z in support_heights_m]
    )
    places = places[scene.support_planes.can_hold(places)]
    scores = np.full(len(places), -np.inf)
    for index, camera in enumerate(look.cameras):
        world_from_lens = scene.world_from_rig @ scene.frame.rig.rig_from_lens[index]
        own = np.ascontiguousarray(pictures[index][..., 3])
        scores = np.maximum(scores, _box_density(own, camera, world_from_lens, model, places))
    scores = np.where(scores > LEAST_DENSITY, scores, -np.inf)
    return spread_out(places, scores, apart=0.5 * max(model.source.box_m[:2]), limit=PLACES)


def spread_out(places: Points, scores: Points, *, apart: float, limit: int) -> Points:
    """(P, 3) at most so many of the places, the best of each neighbourhood, best first."""
    order = np.argsort(-scores, kind="stable")
    order = order[scores[order] > 0.0]
    left = places[order]
    chosen: list[Points] = []
    while len(chosen) < limit and len(left):
        chosen.append(left[0])
        left = left[((left - left[0]) ** 2).sum(axis=1) >= apart**2]
    return np.array(chosen).reshape(-1, 3)


def scored(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    pictures: Sequence[FloatArray],
    places: Points,
) -> tuple[Points, Points]:
    """(P, Y) world yaws that the templates stand for at each place, and how well each fits."""
    centres = places + model.centre_m
    poses = [scene.world_from_rig @ local for local in scene.frame.rig.rig_from_lens]
    ahead = np.stack(
        [
            (centres - pose.translation)
            / np.linalg.norm(centres - pose.translation, axis=1, keepdims=True)
            @ pose.rotation[:, 2]
            for pose in poses
        ]
    )
    lens_of_place = ahead.argmax(axis=0)
    scores, yaws = np.zeros((2, len(places), YAWS))
    for index, pose in enumerate(poses):
        chosen = lens_of_place == index
        if chosen.any():
            cuts = cut_out(
                pictures[index], look.cameras[index], pose, centres[chosen], model.radius_m
            )
            scores[chosen] = template_scores(cuts, model)
            turns = np.arange(YAWS) * (2 * math.pi / YAWS)
            yaws[chosen] = turns + cuts.azimuth_rad[:, None]
    return yaws, scores


def template_scores(cuts: Cuts, model: TrackModel) -> FloatArray:
    """(P, Y) 0..1: how well every yaw fits at the places of some cuts."""
    overlap, correlation = compare(cuts, model.templates)
    share = TEXTURED_SHARE if model.textured else PLAIN_SHARE
    scores = overlap * (1.0 - share + share * np.maximum(correlation, 0.0))
    return scores.astype(np.float32)


def _box_density(
    own: FloatArray,
    camera: Fisheye,
    world_from_lens: Pose,
    model: TrackModel,
    places: Points,
) -> Points:
    """(N,) own share inside each place's box, less that in the frame around it."""
    low, high, seen = _boxes(camera, world_from_lens, model, places)
    total = np.asarray(cv2.integral(own), dtype=np.float64)
    margin = 0.4 * (high - low)
    inside, area = _sum(total, low, high)
    outside, whole = _sum(total, low - margin, high + margin)
    ring = (outside - inside) / np.maximum(whole - area, 1.0)
    density = inside / np.maximum(area, 1.0)
    # A small box inside a large blob is full too, but so are its surroundings.
    return np.where(seen & (area >= 6), density - ring, -np.inf)


def _boxes(
    camera: Fisheye, world_from_lens: Pose, model: TrackModel, places: Points
) -> tuple[Points, Points, NDArray[np.bool_]]:
    """Picture boxes (N, 2) low and high of the object standing at each place, and whether seen."""
    x, y, z = model.source.box_m
    half = 0.42 * max(x, y)
    corners = np.array(
        [(a * half, b * half, c * z) for a in (-1, 1) for b in (-1, 1) for c in (0.0, 1.0)]
    )
    points = (places[:, None, :] + corners[None]).reshape(-1, 3)
    pixels, valid = camera.project(world_from_lens.inverse() @ points)
    pixels = pixels.reshape(len(places), 8, 2)
    seen = np.asarray(valid.reshape(len(places), 8).all(axis=1), dtype=np.bool_)
    return pixels.min(axis=1), pixels.max(axis=1), seen


def _sum(total: NDArray[np.float64], low: Points, high: Points) -> tuple[Points, Points]:
    """Sums and areas of picture boxes from an integral picture."""
    limit = np.array([total.shape[1] - 1, total.shape[0] - 1])
    a = np.clip(np.round(low), 0, limit).astype(int)
    b = np.clip(np.round(high), 0, limit).astype(int)
    value = total[b[:, 1], b[:, 0]] - total[a[:, 1], b[:, 0]]
    value = value - total[b[:, 1], a[:, 0]] + total[a[:, 1], a[:, 0]]
    return value, ((b - a).prod(axis=1)).astype(np.float64)
