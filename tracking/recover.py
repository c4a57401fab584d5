"""Finds an object that is not where it was: after it was lost, or moved between sessions.

Places are proposed where the live picture differs from the empty room in the object's colours, then
tried with several yaws, and the best few are refined (paper 4.4.2 "recovery between sessions", done
here without asking the user to select the objects again).
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
from tracking.align import shifted, texture_shift
from tracking.background import difference, expose
from tracking.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.metrics import ROUND
from tracking.model import TrackModel
from tracking.smooth import pose_vector
from tracking.solve import COLD_REACHES, SLID_REACHES, Fit, Prior, draw, solve

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

SEARCH_SIZE_PX = 480
"""Lens pictures are shrunk to this side for the proposals."""

GRID_M = 0.12
REACH_M = 4.5
PLACES = 7
PLACES_TEXTURED = 2
BESIDE_M = 0.3
TRUSTED_PX = 600
YAWS = 12
YAWS_TEXTURED = 24
REFINED = 3
REFINED_TEXTURED = 6
"""How many of the tried poses are refined; patterns match in many places at first."""


LEAST_DENSITY = 0.1
"""A place is proposed if at least this share of its box looks like the object."""

ACCEPTED_AGREEMENT = 0.5
ACCEPTED_QUALITY = 0.35
ACCEPTED_LIKENESS = 0.45
"""What a refined pose must reach to be believed."""


@dataclass(frozen=True, slots=True, eq=False)
class Overview:
    """Small lens pictures compared with the empty room, shared by all searches of a frame.

    Attributes:
        cameras: shrunk lenses.
        images: (H, W, 3) uint8 shrunk live pictures.
        foreground: (H, W) float32 per lens.
    """

    cameras: tuple[Fisheye, ...]
    images: tuple[NDArray[np.uint8], ...]
    foreground: tuple[FloatArray, ...]


def overview(scene: Scene) -> Overview:
    """Shrink a frame and compare it with the empty room."""
    cameras, images, foregrounds = [], [], []
    for index, lens in enumerate(scene.frame.rig.lenses):
        scale = SEARCH_SIZE_PX / lens.width_px
        camera = lens.resized(SEARCH_SIZE_PX, round(lens.height_px * scale))
        size = (camera.width_px, camera.height_px)
        image = cv2.resize(scene.frame.images[index], size, interpolation=cv2.INTER_AREA)
        plate = cv2.resize(scene.plates.images[index], size, interpolation=cv2.INTER_AREA)
        noise = cv2.resize(scene.plates.noise[index], size, interpolation=cv2.INTER_AREA)
        x = (np.arange(size[0]) + 0.5) / size[0] * 2 - 1
        y = (np.arange(size[1]) + 0.5) / size[1] * 2 - 1
        radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
        expected = expose(
            np.asarray(plate, dtype=np.float32), scene.exposures[index], radius2=radius2
        )
        live = image.astype(np.float32) / np.float32(255.0)
        change = difference(live, expected, np.asarray(noise, dtype=np.float32))
        seen = radius2 <= (lens.circle_px * 2 / lens.width_px) ** 2
        cameras.append(camera)
        images.append(np.asarray(image, dtype=np.uint8))
        foregrounds.append((change.probability * seen).astype(np.float32))
    return Overview(tuple(cameras), tuple(images), tuple(foregrounds))


def find(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    *,
    supports_m: Sequence[float],
    last: Points,
    reach_m: float = REACH_M,
) -> Fit | None:
    """The best pose of an object anywhere on the given heights, or None if none is convincing.

    Args:
        scene: the frame.
        look: its overview.
        model: the object.
        neighbours: other objects, whose places are taken.
        supports_m: heights of the planes it may stand on.
        last: (3,) where it was seen last; tried as well.
        reach_m: how far from the camera to search.
    """
    centre = scene.world_from_rig.translation[:2]
    places = propose_places(
        scene, look, model, neighbours, supports_m=supports_m, around=centre, reach_m=reach_m
    )
    beside = _beside(last, supports_m)
    places = beside + places[:PLACES_TEXTURED] if model.textured else beside[:1] + places
    tried: list[tuple[float, Pose, Evidence]] = []
    for place in places:
        rough = Pose.from_yaw(0.0, place)
        evidence = gather(scene, model, view_of(scene, model, rough), neighbours)
        tried += [
            (score, world_from_object, evidence)
            for score, world_from_object in _try_yaws(scene, model, evidence, place)
        ]
    tried.sort(key=lambda item: -item[0])
    best: Fit | None = None
    for _, world_from_object, evidence in tried[: REFINED_TEXTURED if model.textured else REFINED]:
        sigma = np.array([0.25, 0.25, 0.003, 0.6])
        prior = Prior(pose_vector(world_from_object), sigma)
        fit = solve(
            evidence,
            model,
            world_from_object,
            prior,
            scene.renderer,
            reaches_px=SLID_REACHES if model.textured else COLD_REACHES,
            slide_first=True,
        )
        if best is None or fit.quality > best.quality:
            best = fit
    if best is None or best.agreement < ACCEPTED_AGREEMENT or best.quality < ACCEPTED_QUALITY:
        return None
    alike = not model.textured or best.likeness >= ACCEPTED_LIKENESS
    return best if alike and scene.holds(best.world_from_object) else None


def _beside(last: Points, supports_m: Sequence[float]) -> list[Points]:
    """The last place and four around it, on the nearest support: a crop there shows them all."""
    height = min(supports_m, key=lambda z: abs(z - last[2]))
    steps = [(0.0, 0.0)] + [(a, b) for a in (-BESIDE_M, BESIDE_M) for b in (-BESIDE_M, BESIDE_M)]
    return [np.array([last[0] + a, last[1] + b, height]) for a, b in steps]


def propose_places(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    *,
    supports_m: Sequence[float],
    around: Points,
    reach_m: float,
) -> list[Points]:
    """At most `PLACES` (3,) positions whose box is full of the object's colours, best first."""
    steps = np.arange(-reach_m, reach_m + 1e-9, GRID_M)
    x, y = np.meshgrid(around[0] + steps, around[1] + steps)
    flat = np.stack([x.ravel(), y.ravel()], axis=1)
    low, high = scene.bounds_m[:, :2]
    inside = (flat > low).all(axis=1) & (flat < high).all(axis=1)
    flat = flat[inside & (np.hypot(*(flat - around).T) <= reach_m)]
    places = np.concatenate(
        [np.column_stack([flat, np.full(len(flat), z)]) for z in sorted(set(supports_m))]
    )
    scores = np.full(len(places), -np.inf)
    for index, camera in enumerate(look.cameras):
        own = _own(look, index, model)
        for other, world_from_object in neighbours:
            _erase(own, camera, scene, index, other, world_from_object)
        world_from_lens = scene.world_from_rig @ scene.frame.rig.rig_from_lens[index]
        density = _box_density(own, camera, world_from_lens, model, places)
        scores = np.maximum(scores, density)
    chosen: list[Points] = []
    apart = 0.6 * max(model.source.box_m[:2])
    for index in np.argsort(-scores, kind="stable"):
        if scores[index] < LEAST_DENSITY or len(chosen) == PLACES:
            break
        if all(np.linalg.norm(places[index] - other) > apart for other in chosen):
            chosen.append(places[index])
    return chosen


def yaw_starts(model: TrackModel) -> Points:
    """Yaws worth trying: a turn, or the part of one after which the object repeats."""
    if model.symmetry == ROUND:
        return np.zeros(1)
    turn = 2 * math.pi / model.symmetry
    count = max(3, round((YAWS_TEXTURED if model.textured else YAWS) / model.symmetry))
    return np.arange(count) * turn / count


def silhouette_score(
    evidence: Evidence, model: TrackModel, world_from_object: Pose, scene: Scene
) -> float:
    """Overlap of the drawn silhouette with the object's own foreground, times colour agreement."""
    drawn = draw(model, world_from_object, evidence, scene.renderer)
    alpha = drawn.alpha
    free = 1.0 - np.maximum(evidence.hidden, np.maximum(evidence.foreground - evidence.own, 0.0))
    shared = float((np.minimum(alpha, evidence.own) * free).sum())
    union = float((np.maximum(alpha, evidence.own) * free).sum())
    if union < 12.0:
        return 0.0
    shown = (alpha > 0.5) & (evidence.own > 0.5)
    if shown.sum() < 12:
        return 0.0
    apart = drawn.rgb[shown] - evidence.live[shown]
    apart = apart - np.median(apart, axis=0)
    colour = float(np.exp(-np.abs(apart).mean() / 0.12))
    return shared / union * (0.7 + 0.3 * colour)


def _try_yaws(
    scene: Scene, model: TrackModel, evidence: Evidence, place: Points
) -> list[tuple[float, Pose]]:
    poses = [Pose.from_yaw(float(yaw), place) for yaw in yaw_starts(model)]
    if not model.textured:
        return [
            (silhouette_score(evidence, model, world_from_object, scene), world_from_object)
            for world_from_object in poses
        ]
    tried = []
    for world_from_object in poses:
        drawn = draw(model, world_from_object, evidence, scene.renderer)
        found = texture_shift(evidence, drawn)
        if found is None:
            continue
        # A few pixels match anything: a correlation counts by what it is made of.
        trust = min(1.0, math.sqrt(float((drawn.alpha > 0.5).sum()) / TRUSTED_PX))
        moved = shifted(world_from_object, found[0], evidence, model, grounded=True)
        if scene.holds(moved):
            tried.append((found[1] * trust * _standing_out(evidence, drawn.alpha, found[0]), moved))
    return tried


def _standing_out(evidence: Evidence, alpha: FloatArray, shift_px: Points) -> float:
    """0..1: how much of a slid silhouette, and not of its surroundings, is own foreground."""
    matrix = np.array([[1.0, 0.0, shift_px[0]], [0.0, 1.0, shift_px[1]]])
    size = (alpha.shape[1], alpha.shape[0])
    slid = (cv2.warpAffine(alpha, matrix, size) > 0.5).astype(np.uint8)
    ring = cv2.dilate(slid, np.ones((9, 9), np.uint8)) - cv2.dilate(slid, np.ones((3, 3), np.uint8))
    if not slid.any() or not ring.any():
        return 0.0
    inside = float(evidence.own[slid > 0].mean())
    around = float(evidence.own[ring > 0].mean())
    return max(0.0, inside - 0.6 * around)


def _own(look: Overview, index: int, model: TrackModel) -> FloatArray:
    likeness = np.clip(model.colours.likeness(look.images[index]) * 3.0, 0.0, 1.0)
    return (look.foreground[index] * likeness).astype(np.float32)


def _erase(
    own: FloatArray,
    camera: Fisheye,
    scene: Scene,
    index: int,
    other: TrackModel,
    world_from_object: Pose,
) -> None:
    """Blank the box of an object whose place is known, in an array that is ours."""
    world_from_lens = scene.world_from_rig @ scene.frame.rig.rig_from_lens[index]
    low, high, seen = _boxes(camera, world_from_lens, other, world_from_object.translation[None])
    if seen[0]:
        left, top = np.maximum(np.floor(low[0]), 0).astype(int)
        right, bottom = np.maximum(np.ceil(high[0]), 0).astype(int)
        own[top:bottom, left:right] = 0.0


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
