"""A whole lens picture compared with what is known of the room, for the search for one object."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from tracking.background.images import expose
from tracking.evidence.evidence import Neighbour, Scene
from tracking.evidence.observation import (
    Observation,
    laid_over,
    observation_of,
    with_layers,
)
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.kernels.native import KERNELS
from tracking.model.object_model import TrackModel
from tracking.window.filters import resized
from tracking.window.window import Layer

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

SEARCH_SIZE_PX = 480
"""Lens pictures are shrunk to about this side for the search: an object across the room is then
still some 25 px wide, as large as its templates show it."""

LEVELS = 3
"""Levels of a look: objects at arm's length are a quarter of the lens wide."""

KNOWN_ALPHA = 0.5
"""Alpha from which a neighbour's drawn distance is that of its surface."""


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


@dataclass(frozen=True, slots=True, eq=False)
class _Changed:
    """A shrunk lens: (H, W, 3) live, (H, W) changed, (H, W) in the object's colours."""

    live: FloatArray
    changed: FloatArray
    own: FloatArray


def look_through(
    scene: Scene,
    lens_index: int,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    *,
    budget: FrameBudget | None = None,
) -> LensLook:
    """A lens picture compared with the room and the neighbours where they are.

    Args:
        scene: the frame.
        lens_index: which lens.
        model: the object that is looked for.
        neighbours: the other tracked objects.
        budget: of this frame; none is no limit.

    Raises:
        BudgetExhausted: the rest is for the next frame.
    """
    do = (budget or FrameBudget()).do
    layers = do(Step.LOOK, _layers, scene, lens_index, neighbours)
    shown = do(Step.LOOK, _changed, scene, lens_index, model, layers)
    whole = do(Step.LOOK, _without_object, scene, lens_index, layers)
    return do(Step.LOOK, _look, scene, lens_index, shown, whole)


def _layers(scene: Scene, lens_index: int, neighbours: Sequence[Neighbour]) -> list[Layer]:
    """The neighbours drawn into a lens."""
    view = scene.frame.rig, scene.world_from_rig, scene.renderer
    return [
        scene.layers.layer(other.source, pose, *view, lens=lens_index) for other, pose in neighbours
    ]


def _shrunk_size(lens: Fisheye) -> tuple[int, tuple[int, int]]:
    """By how much a lens picture is shrunk for the search, and its width and height then."""
    shrink = max(1, round(lens.width_px / SEARCH_SIZE_PX))
    return shrink, (lens.width_px // shrink, lens.height_px // shrink)


def _part_of(lens: Fisheye) -> tuple[slice, slice]:
    """Rows and columns of a lens picture that shrink without a rest."""
    shrink, (width, height) = _shrunk_size(lens)
    return slice(0, height * shrink), slice(0, width * shrink)


def _changed(scene: Scene, lens_index: int, model: TrackModel, layers: Sequence[Layer]) -> _Changed:
    """A shrunk lens picture compared with the empty room."""
    lens = scene.frame.rig.lenses[lens_index]
    shrink, (width, height) = _shrunk_size(lens)
    part = _part_of(lens)
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
    size = height, width
    return _Changed(
        live.reshape(height, width, 3), foreground.reshape(size) * seen, own.reshape(size) * seen
    )


def _look(scene: Scene, lens_index: int, shown: _Changed, whole: _Whole) -> LensLook:
    """Compare a shrunk lens picture with the room, at all levels."""
    lens = scene.frame.rig.lenses[lens_index]
    shrink, size = _shrunk_size(lens)
    level = observation_of(
        shown.live,
        laid_over(whole.room, shown.live, alpha=whole.alpha),
        whole.expected,
        shown.changed,
        hidden=np.zeros_like(shown.changed),
        range_m=whole.range_m,
        camera=lens.resized(*size),
        world_from_camera=scene.world_from_rig @ scene.frame.rig.rig_from_lens[lens_index],
        lens_px=shrink,
        in_any_light=scene.is_first,
        in_shadow=True,
    )
    picture = np.dstack([shown.live, shown.own, shown.changed])
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


def _without_object(scene: Scene, lens_index: int, layers: Sequence[Layer]) -> _Whole:
    lens = scene.frame.rig.lenses[lens_index]
    part, (_, size) = _part_of(lens), _shrunk_size(lens)
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
