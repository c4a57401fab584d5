"""Where an object may stand: support planes × yaws, compared with small pictures of the object.

Proposals only propose. A whole lens picture is compared with what is known of the room; every place
on a support plane is cut out of that, upright and at the object's size, and correlated with its
templates in four ways. The best places of each way are kept, as none of them is right for all
objects: one believes the colours, one the shape alone, one forgives what is half hidden, and one
prefers what accounts for more of the picture.
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
from tracking.background.images import expose
from tracking.evidence.evidence import Neighbour, Scene
from tracking.evidence.observation import Observation, observation_of, with_layers
from tracking.kernels.native import KERNELS
from tracking.model.object_model import TrackModel
from tracking.model.templates import ELEVATIONS_RAD, YAWS, Cuts, compare, cut_out
from tracking.window.filters import resized
from tracking.window.window import Layer

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

SEARCH_SIZE_PX = 480
"""Lens pictures are shrunk to about this side for the search: an object across the room is then
still some 25 px wide, as large as its templates show it."""

STEP = 0.25
"""Places are this far apart, in radii of the object: half of what an alignment bridges."""

LEAST_STEP_M = 0.06
"""Least distance of two places, m: smaller objects are aligned over more of their radius."""

LEAST_RADIUS_PX = 3.0
"""Radius in the shrunk picture from which an object is looked for: below, its silhouette is worth
less than one independent sample."""

COMPARED = 120
"""Places whose colours are compared with the templates' too, the best by shape of each way."""

LEAST_CHANGED = 0.15
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


@dataclass(frozen=True, slots=True, eq=False)
class LensLook:
    """A whole lens picture for the search for one object.

    Attributes:
        levels: the picture, the same at half the size, ...
        world_from_lens: pose of the lens.
        picture: (H, W, 5) colours, own and all foreground, for `tracking.model.templates.cut_out`.
    """

    levels: tuple[Observation, ...]
    world_from_lens: Pose
    picture: FloatArray

    @property
    def camera(self) -> Fisheye:
        """Of the picture."""
        return self.levels[0].camera

    def level_for(self, radius_px: float, wanted_px: float) -> Observation:
        """The level at which an object of a radius in the picture is about as large as wanted."""
        level = round(math.log2(max(radius_px / wanted_px, 1.0)))
        return self.levels[min(level, len(self.levels) - 1)]


LEVELS = 3
"""Levels of a look: objects at arm's length are a quarter of the lens wide."""


def look_through(
    scene: Scene, lens_index: int, model: TrackModel, neighbours: Sequence[Neighbour]
) -> LensLook:
    """A lens picture compared with the room and the neighbours where they are.

    Args:
        scene: the frame.
        lens_index: which lens.
        model: the object that is looked for.
        neighbours: the other tracked objects.
    """
    lens = scene.frame.rig.lenses[lens_index]
    shrink = max(1, round(lens.width_px / SEARCH_SIZE_PX))
    width, height = lens.width_px // shrink, lens.height_px // shrink
    part = (slice(0, height * shrink), slice(0, width * shrink))
    layers = [
        scene.layers.layer(
            other.source,
            pose,
            scene.frame.rig,
            scene.world_from_rig,
            scene.renderer,
            lens=lens_index,
        )
        for other, pose in neighbours
    ]
    live, foreground, own, _, _ = KERNELS.change(
        scene.frame.images[lens_index][part],
        scene.background.images[lens_index].cut(*part),
        scene.background.noise[lens_index].cut(*part),
        lens_size=(lens.width_px, lens.height_px),
        window=(0, 0, width, height),
        shrink=shrink,
        exposure=scene.exposures[lens_index].rows(),
        # No layer hides: where a neighbour is nearer is decided pixel by pixel, by its distance.
        layers=[layer.request(0.0) for layer in layers],
        table=model.colours_in_any_light.table,
    )
    camera = lens.resized(width, height)
    x = ((np.arange(width) + 0.5 - camera.cx) / width).astype(np.float32)
    y = ((np.arange(height) + 0.5 - camera.cy) / height).astype(np.float32)
    seen = x[None, :] ** 2 + y[:, None] ** 2 <= (lens.circle_px / lens.width_px) ** 2
    colours = live.reshape(height, width, 3)
    changed = foreground.reshape(height, width) * seen
    whole = _without_object(scene, lens_index, part, layers, (width, height))
    others = whole.alpha[..., None]
    level = observation_of(
        colours,
        np.asarray(others * colours + (1.0 - others) * whole.room, np.float32),
        whole.expected,
        changed,
        hidden=np.zeros_like(changed),
        range_m=whole.range_m,
        camera=camera,
        world_from_camera=scene.world_from_rig @ scene.frame.rig.rig_from_lens[lens_index],
        lens_px=shrink,
        is_first=scene.is_first,
    )
    picture = np.dstack([colours, own.reshape(height, width) * seen, changed])
    return LensLook(
        tuple(level.shrunk(2**k) for k in range(LEVELS)),
        level.world_from_camera,
        picture.astype(np.float32),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Whole:
    """A lens without the object: the room, with neighbours, their alpha, how far both are."""

    room: FloatArray
    expected: FloatArray
    alpha: FloatArray
    range_m: FloatArray


def _without_object(
    scene: Scene,
    lens_index: int,
    part: tuple[slice, slice],
    layers: Sequence[Layer],
    size: tuple[int, int],
) -> _Whole:
    lens = scene.frame.rig.lenses[lens_index]
    width, height = size
    columns: Points = (np.arange(width, dtype=np.float64) + 0.5) * (part[1].stop / width)
    rows: Points = (np.arange(height, dtype=np.float64) + 0.5) * (part[0].stop / height)
    x, y = columns * 2 / lens.width_px - 1, rows * 2 / lens.height_px - 1
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
    plain, exposure = scene.background.images[lens_index][part], scene.exposures[lens_index]
    laid, alpha = with_layers(plain, _farthest_first(layers), part)
    room = expose(resized(plain, size), exposure, radius2=radius2)
    expected = expose(resized(laid, size), exposure, radius2=radius2)
    range_m = scene.background.ranges_m[lens_index].copy()
    for layer in layers:
        height, width = layer.alpha.shape
        here = slice(layer.top, layer.top + height), slice(layer.left, layer.left + width)
        drawn = layer.alpha > KNOWN_ALPHA
        nearer = drawn & ((range_m[here] == 0) | (layer.range_m < range_m[here]))
        range_m[here] = np.where(nearer, layer.range_m, range_m[here])
    return _Whole(room, expected, resized(alpha, size), resized(range_m[part], size))


def _farthest_first(layers: Sequence[Layer]) -> list[Layer]:
    def nearest_m(layer: Layer) -> float:
        seen = layer.range_m[layer.range_m > 0]
        return float(seen.min()) if len(seen) else math.inf

    return sorted(layers, key=nearest_m, reverse=True)


KNOWN_ALPHA = 0.5
"""Alpha from which a neighbour's drawn distance is that of its surface."""


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
    step = max(LEAST_STEP_M, STEP * model.radius_m)
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
        is_large = look.camera.f_px * model.radius_m >= LEAST_RADIUS_PX * distance
        here = here[is_seen & is_large & (distance > model.radius_m)]
        by_lens.append(here[_changed_share(look, model, here) > LEAST_CHANGED])
    return by_lens


def _changed_share(look: LensLook, model: TrackModel, places: Points) -> Points:
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
    """What a lens shows at some places, upright and as large as the templates."""
    centres = places + model.centre_m
    return cut_out(look.picture, look.camera, look.world_from_lens, centres, model.radius_m)


def proposed(look: LensLook, model: TrackModel, places: Points, cuts: Cuts) -> list[Pose]:
    """Poses at the best places of one lens, each place once a way.

    Args:
        look: the lens.
        model: the object.
        places: (P, 3).
        cuts: of these places.
    """
    if len(places) == 0:
        return []
    levels = np.abs(cuts.elevation_rad[:, None] - np.array(ELEVATIONS_RAD)).argmin(axis=1)
    distance = np.linalg.norm(places + model.centre_m - look.world_from_lens.translation, axis=1)
    yaws = np.arange(YAWS) * (2 * math.pi / YAWS) + cuts.azimuth_rad[:, None]
    shapes = [
        shape / distance[:, None] ** 2 if way.by_area else shape
        for way, shape in zip(WAYS, _shape_scores(cuts, model, levels), strict=True)
    ]
    tops = [np.argsort(-shape.max(axis=1), kind="stable")[:COMPARED] for shape in shapes]
    compared = np.unique(np.concatenate(tops))
    correlation = np.zeros((len(places), YAWS), np.float32)
    correlation[compared] = compare(cuts.some(compared), model.templates)[1]
    chosen: set[tuple[int, int]] = set()
    for way, shape, best in zip(WAYS, shapes, tops, strict=True):
        weight = COLOUR_FLOOR + np.maximum(correlation[best], 0.0)
        coloured = np.where(shape[best] > 0.0, shape[best] * weight, shape[best])
        for scores in (coloured, shape[best]):
            for row in _spread_out(places[best], scores.max(axis=1), model, way.count):
                for turn in _peaks(scores[row]):
                    chosen.add((int(best[row]), turn))
    return [
        Pose.from_yaw(float(yaws[place, turn]), places[place]) for place, turn in sorted(chosen)
    ]


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
