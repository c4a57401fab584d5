"""Proposals: support planes × yaws, compared with small pictures of the object.

Proposals only propose. A whole lens picture is compared with what is known of the room; every place
on a support plane is cut out of that, upright and at the object's size, and compared with its
templates in five ways. The best places of each way are kept, as none of them is right for all
objects: one believes the colours, one the shape alone, one forgives what is half hidden, one
prefers what accounts for more of the picture, and one looks for the overlap of what is in the
object's own colours: among objects that were all moved, a book is the best of thousands of places
by that, and not among the first hundred by shape.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Scene
from tracking.hypotheses.lens_look import LensLook
from tracking.model.object_model import TrackModel
from tracking.model.templates import ELEVATIONS_RAD, YAWS, Cuts, cut_out

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

Similarity = tuple[FloatArray, FloatArray]
"""(P, Y) overlap and correlation of places with templates."""

STEP = 0.25
"""Places are this far apart, in radii of the object: half of what an alignment bridges."""

MIN_STEP_M = 0.06
"""Least distance of two places, m: smaller objects are aligned over more of their radius."""

MIN_RADIUS_PX = 3.0
"""Radius in the shrunk picture from which an object is looked for: below, its silhouette is worth
less than one independent sample."""

OVERLAPPING = 24
"""Places kept by the overlap of what is in the object's colours with its templates, and by its
colours: as many as by the first way."""

MIN_CHANGED = 0.15
"""Share of a place's box that must differ from the empty room: an object fills half of its box, and
half of that may be hidden, with a margin for what looks like the room behind it."""

SPREAD = 0.35
"""Least distance of two proposed places, in radii of the object."""

YAWS_A_PLACE = 2
"""Yaws proposed at a place."""

OTHER_YAW = 3
"""Steps of the templates' yaw between two yaws proposed at a place: 45°."""

COLOUR_FLOOR = 0.3
"""Share of a place's score that it keeps if its colours do not correlate at all: an object may be
plain, or its light another one."""


@dataclass(frozen=True, slots=True)
class Way:
    """One way of scoring a place.

    Attributes:
        own: nats of a changed pixel in the object's colours, inside the silhouette.
        foreign: nats of a changed pixel in other colours.
        unchanged: nats of a pixel that shows the empty room.
        by_area: whether scores are summed over the silhouette's true size, not averaged.
        count: places kept by shape alone, and as many by shape and colours.
    """

    own: float
    foreign: float
    unchanged: float
    by_area: bool
    count: int


WAYS = (
    Way(own=1.0, foreign=-1.2, unchanged=-5.0, by_area=False, count=24),
    Way(own=1.0, foreign=1.0, unchanged=-4.0, by_area=False, count=20),
    Way(own=1.0, foreign=-0.5, unchanged=-2.0, by_area=False, count=12),
    Way(own=1.0, foreign=-0.5, unchanged=-2.0, by_area=True, count=12),
)
"""The first has the likelihood's own extremes: ln 0.3 for an occluded pixel, a capped misfit for
one that shows the room. The second does not ask for colours, the third and fourth forgive more.
Without the second, far chairs in changed light were not proposed in a foreign room."""


def places_on(
    scene: Scene, looks: Sequence[LensLook], model: TrackModel, heights_m: Sequence[float]
) -> list[Points]:
    """By lens, (P, 3) places on support planes that it sees best, a grid over the room.

    Args:
        scene: the frame.
        looks: one per lens.
        model: the object.
        heights_m: heights of the planes.
    """
    step = max(MIN_STEP_M, STEP * model.radius_m)
    low, high = scene.bounds_m[:, :2]
    if not np.isfinite([low, high]).all():
        return [np.zeros((0, 3)) for _ in looks]
    x, y = np.meshgrid(*(np.arange(a, b, step) for a, b in zip(low, high, strict=True)))
    flat = np.stack([x.ravel(), y.ravel()], axis=1)
    places = np.concatenate([np.column_stack([flat, np.full(len(flat), z)]) for z in heights_m])
    places = places[scene.support_planes.can_hold(places)]
    ahead = np.stack([_ahead(look, places + model.centre_m) for look in looks])
    best = ahead.argmax(axis=0)
    by_lens: list[Points] = []
    for index, look in enumerate(looks):
        here = places[best == index]
        centres = look.world_from_lens.inverse() @ (here + model.centre_m)
        distance = np.linalg.norm(centres, axis=1)
        angle = np.arctan2(np.hypot(centres[:, 0], centres[:, 1]), centres[:, 2])
        is_seen = angle < look.camera.max_angle
        is_large = look.camera.f_px * model.radius_m >= MIN_RADIUS_PX * distance
        here = here[is_seen & is_large & (distance > model.radius_m)]
        by_lens.append(here[changed_share(look, model, here) > MIN_CHANGED])
    return by_lens


def changed_share(look: LensLook, model: TrackModel, places: Points) -> Points:
    """(P,) share of the box of an object at each place that differs from the empty room."""
    total: Points = np.asarray(cv2.integral(look.picture[..., 4].copy()), dtype=np.float64)
    x, y, z = model.source.box_m
    half = 0.5 * min(x, y)
    corners = np.array(
        [(a * half, b * half, c * z) for a in (-1, 1) for b in (-1, 1) for c in (0.0, 1.0)]
    )
    points = (places[:, None, :] + corners).reshape(-1, 3)
    pixels, _ = look.camera.project(look.world_from_lens.inverse() @ points)
    pixels = pixels.reshape(len(places), len(corners), 2)
    limit = np.array([total.shape[1] - 1, total.shape[0] - 1])
    low = np.clip(np.floor(pixels.min(axis=1)), 0, limit - 1).astype(int)
    high = np.clip(np.ceil(pixels.max(axis=1)), low + 1, limit).astype(int)
    inside = total[high[:, 1], high[:, 0]] - total[low[:, 1], high[:, 0]]
    inside += total[low[:, 1], low[:, 0]] - total[high[:, 1], low[:, 0]]
    return np.asarray(inside / (high - low).prod(axis=1), dtype=np.float64)


def _ahead(look: LensLook, centres: Points) -> Points:
    """(N,) cosine between a lens's axis and the direction to each point."""
    away = centres - look.world_from_lens.translation
    distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
    return np.asarray(away @ look.world_from_lens.rotation[:, 2] / distance, dtype=np.float64)


def cuts_at(look: LensLook, model: TrackModel, places: Points) -> Cuts:
    """Cut a lens picture at some places, upright and as large as the templates."""
    centres = places + model.centre_m
    return cut_out(look.picture, look.camera, look.world_from_lens, centres, model.radius_m)


def proposed(
    look: LensLook, model: TrackModel, places: Points, cuts: Cuts, similarity: Similarity
) -> list[Pose]:
    """Poses at the best places of one lens, each place once a way.

    Args:
        look: the lens.
        model: the object.
        places: (P, 3).
        cuts: of these places.
        similarity: `tracking.model.templates.compare` of these.
    """
    if len(places) == 0:
        return []
    levels = np.abs(cuts.elevation_rad[:, None] - np.array(ELEVATIONS_RAD)).argmin(axis=1)
    distance = np.linalg.norm(places + model.centre_m - look.world_from_lens.translation, axis=1)
    overlap, correlation = similarity
    weight = COLOUR_FLOOR + np.maximum(correlation, 0.0)
    rankings = [(overlap * weight, OVERLAPPING)]
    for way, shape in zip(WAYS, _shape_scores(cuts, model, levels), strict=True):
        scores = shape / distance[:, None] ** 2 if way.by_area else shape
        coloured = np.where(scores > 0.0, scores * weight, scores)
        rankings += [(coloured, way.count), (scores, way.count)]
    chosen: set[tuple[int, int]] = set()
    for scores, count in rankings:
        for row in _spread_out(places, scores.max(axis=1), model, count):
            chosen |= {(row, turn) for turn in _peaks(scores[row])}
    yaws = yaws_of(cuts)
    return [Pose.from_yaw(float(yaws[row, turn]), places[row]) for row, turn in sorted(chosen)]


def likeliest_at_each(
    model: TrackModel, places: Points, cuts: Cuts, similarity: Similarity
) -> list[Pose]:
    """Poses at all places, at each the best yaws by overlap and colours."""
    overlap, correlation = similarity
    scores = overlap * (COLOUR_FLOOR + np.maximum(correlation, 0.0))
    yaws = yaws_of(cuts)
    return [
        Pose.from_yaw(float(yaws[row, turn]), places[row])
        for row in range(len(places))
        for turn in _peaks(scores[row])
    ]


def yaws_of(cuts: Cuts) -> Points:
    """(P, Y) yaws in the world, rad, of the templates at every place."""
    return np.arange(YAWS) * (2 * math.pi / YAWS) + cuts.azimuth_rad[:, None]


def _shape_scores(cuts: Cuts, model: TrackModel, levels: NDArray[np.intp]) -> list[FloatArray]:
    """(P, Y) nats of each yaw's silhouette, by way.

    Averages are raised so that only hopeless ones are negative.
    """
    shape = (len(cuts.own), YAWS)
    own, changed = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    area = np.zeros(shape, np.float32)
    whole = cuts.own + 1.0 - cuts.free
    for level in np.unique(levels):
        alpha, here = model.templates.alpha[level], levels == level
        own[here], changed[here] = cuts.own[here] @ alpha.T, whole[here] @ alpha.T
        area[here] = np.maximum(alpha.sum(axis=1), 1.0)
    scores: list[FloatArray] = []
    for way in WAYS:
        nats = way.own * own + way.foreign * (changed - own) + way.unchanged * (area - changed)
        nats = nats if way.by_area else nats / area - way.unchanged
        scores.append(nats.astype(np.float32))
    return scores


def _spread_out(places: Points, scores: FloatArray, model: TrackModel, limit: int) -> list[int]:
    """Indices of at most so many of the best places, each the best of its neighbourhood."""
    order = list(np.argsort(-scores, kind="stable"))
    chosen: list[int] = []
    left = np.ones(len(places), np.bool_)
    for index in order:
        if not left[index]:
            continue
        chosen.append(int(index))
        if len(chosen) == limit:
            break
        apart2 = ((places - places[index]) ** 2).sum(axis=1)
        left &= apart2 > (SPREAD * model.radius_m) ** 2
    return chosen


def _peaks(scores: FloatArray) -> list[int]:
    """The best yaws of a place that are not neighbours of each other."""
    turns: list[int] = []
    for turn in np.argsort(-scores, kind="stable"):
        if all(min((turn - k) % YAWS, (k - turn) % YAWS) >= OTHER_YAW for k in turns):
            turns.append(int(turn))
            if len(turns) == YAWS_A_PLACE:
                break
    return turns
