"""Window of a small object with and without it, for photometric comparison."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from tracking.background.images import expose
from tracking.evidence.evidence import Evidence, Scene
from tracking.kernels.native import Alone, Setting
from tracking.kernels.native import Shell as DrawnRelightable
from tracking.kernels.photometry import BY_DETAIL, CLOSELY, ROUGHLY
from tracking.model.object_model import RENDER_OPTIONS, TrackModel
from tracking.model.relighting import RELIGHTER, LitView, RelightableModel
from tracking.model.similarity import illumination_ratio
from tracking.window.extent import part_of
from tracking.window.filters import resized
from tracking.window.window import Layer

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

AROUND_PX = 6
"""Margin in px around an object's box that is compared."""


FINER = 2
"""Supersampling, each way, of close comparisons: at few pixels splats widen the silhouette by a
pixel."""


SCAN_COVERAGE_GAP = 0.12
"""Difference of the well-scanned share between poses above which only well-scanned parts are
compared. Chosen on the rooms lab and desk."""


SHADE_RANGE = (0.35, 1.0)
"""Illumination ratio of the empty room in the object's shadow, lower and upper limit."""


Upright = tuple[float, float, float, float]
"""x, y, z in metres and yaw in radians of `world_from_object`."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A part of the live picture in which an object is drawn.

    Attributes:
        roughly: what it shows, and would show without the object; for poses near the right one.
        closely: the same for poses that are right to a pixel.
        view: the same, for the light there.
        relightable: the object.
        drawn: the same, as it is drawn there.
    """

    roughly: Setting
    closely: Setting
    view: LitView
    relightable: RelightableModel
    drawn: DrawnRelightable

    def similarity(self, upright: Upright) -> float:
        """Similarity of the object at a nearby pose to the picture, light fitted there."""
        return RELIGHTER.resemblance(self.roughly, self.drawn, upright)

    def residual_px(self, lit: Alone, upright: Upright) -> float:
        """Robust photometric residual, in pixels, of the object at a nearby pose."""
        return self.roughly.strange_at(lit, [upright])[0]

    def close_similarity(self, lit: Alone, upright: Upright) -> float:
        """Similarity of the object at exactly this pose to the picture."""
        return self.closely.resemblance_at(lit, [upright])[0]

    def detail_similarities(self, uprights: Sequence[Upright]) -> list[float] | None:
        """Similarity of the object at some poses by detail that was scanned well at all of them.

        None where all poses were scanned about as well, so that whole pictures can be compared.
        """
        view, camera = self.view, self.view.camera
        known = [view.known(self.relightable, pose_of(upright)) for upright in uprights]
        shares = [share for _, share in known]
        if max(shares) - min(shares) < SCAN_COVERAGE_GAP:
            return None
        free = (view.free * np.min([there for there, _ in known], axis=0)).astype(np.float32)
        size = (camera.width_px, camera.height_px)
        setting = Setting(view.live, view.empty, free, size=size, constants=BY_DETAIL.for_native())
        lit = ((self.lit(upright, finer=FINER), upright) for upright in uprights)
        return [setting.resemblance_at(alone, [upright])[0] for alone, upright in lit]

    def lit(self, upright: Upright, *, finer: int = 1) -> Alone:
        """The object, to be rendered in the light that fits the picture best at a pose.

        Args:
            upright: the pose for the light.
            finer: supersampling, each way.
        """
        view, camera = self.view, self.view.camera
        if finer > 1:
            camera = camera.resized(finer * camera.width_px, finer * camera.height_px)
        fine = view.renderer.alone(
            self.relightable.splats, camera, view.world_from_camera, RENDER_OPTIONS
        )
        return RELIGHTER.relit(self.roughly, self.drawn, fine, upright)


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """An object's window with and without it.

    Attributes:
        model: the object.
        evidence: its window.
        empty: (H, W, 3) the window without the object, as the live camera records the empty room.
        renderer: draws the object.
    """

    model: TrackModel
    evidence: Evidence
    empty: FloatArray
    renderer: NativeRenderer

    def at(self, world_from_object: Pose) -> Place | None:
        """The part around the object at a pose; None if nothing of it is in the window."""
        evidence = self.evidence
        part = _around(self.model, evidence, world_from_object)
        if part is None:
            return None
        live, empty = (
            np.ascontiguousarray(picture[part]) for picture in (evidence.live, self.empty)
        )
        free = 1.0 - evidence.hidden[part]
        camera = part_of(evidence.camera, part)
        size = (camera.width_px, camera.height_px)
        roughly, closely = (
            Setting(live, empty, free, size=size, constants=options.for_native())
            for options in (ROUGHLY, CLOSELY)
        )
        view = LitView(live, empty, free, camera, evidence.world_from_camera, self.renderer)
        relightable = self.model.relightable
        scanned, compass = (
            self.renderer.alone(splats, camera, evidence.world_from_camera, RENDER_OPTIONS)
            for splats in (relightable.splats, relightable.compass)
        )
        drawn = DrawnRelightable(scanned, compass, relightable.facing)
        return Place(roughly, closely, view, relightable, drawn)


def surroundings_of(scene: Scene, model: TrackModel, evidence: Evidence) -> Surroundings:
    """An object's window with and without it.

    The empty room is shaded as the live picture; what shows another object is as in that.
    """
    view, live = evidence.view, evidence.live
    height, width = live.shape[:2]
    cut = (
        slice(view.top, view.top + height * view.shrink),
        slice(view.left, view.left + width * view.shrink),
    )
    lens = scene.frame.rig.lenses[view.lens]
    background_image = resized(
        np.ascontiguousarray(scene.background.images[view.lens][cut]), (width, height)
    )
    columns: Points = np.arange(int(width), dtype=np.float64) + 0.5
    rows: Points = np.arange(int(height), dtype=np.float64) + 0.5
    x = (view.left + columns * view.shrink) * 2 / lens.width_px - 1
    y = (view.top + rows * view.shrink) * 2 / lens.height_px - 1
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
    room = expose(background_image, scene.exposures[view.lens], radius2=radius2)
    shade = illumination_ratio(room, live, limits=SHADE_RANGE)
    others = resized(_others(evidence.layers, cut), (width, height))[..., None]
    empty = others * live + (1.0 - others) * (room * shade[..., None])
    return Surroundings(model, evidence, np.asarray(empty, dtype=np.float32), scene.renderer)


def upright_of(world_from_object: Pose) -> Upright:
    """Position and yaw of an upright object."""
    x, y, z = world_from_object.translation.tolist()
    return x, y, z, world_from_object.yaw()


def pose_of(upright: Upright) -> Pose:
    """`world_from_object` of an upright object."""
    *place, yaw = upright
    return Pose.from_yaw(yaw, place)


def _around(
    model: TrackModel, evidence: Evidence, world_from_object: Pose
) -> tuple[slice, slice] | None:
    """Rows and columns around an object's box, None if it is outside the window."""
    camera = evidence.camera
    corners = evidence.world_from_camera.inverse() @ model.box_at(world_from_object)
    pixels, seen = camera.project(corners)
    low = np.floor(pixels.min(axis=0)) - AROUND_PX
    high = np.ceil(pixels.max(axis=0)) + AROUND_PX
    size = np.array([camera.width_px, camera.height_px])
    if not seen.any() or (low >= size).any() or (high <= 0).any():
        return None
    (left, top), (right, bottom) = (
        np.maximum(low, 0).astype(int),
        np.minimum(high, size).astype(int),
    )
    return slice(int(top), int(bottom)), slice(int(left), int(right))


def _others(layers: Sequence[Layer], cut: tuple[slice, slice]) -> FloatArray:
    """(H, W) 0..1: how much of a part of a lens other objects cover, before or behind."""
    rows, columns = cut
    others = np.zeros((rows.stop - rows.start, columns.stop - columns.start), np.float32)
    for layer in layers:
        height, width = layer.alpha.shape
        top, bottom = max(layer.top, rows.start), min(layer.top + height, rows.stop)
        left, right = max(layer.left, columns.start), min(layer.left + width, columns.stop)
        if top < bottom and left < right:
            drawn = layer.alpha[top - layer.top : bottom - layer.top]
            drawn = drawn[:, left - layer.left : right - layer.left]
            part = others[top - rows.start : bottom - rows.start]
            part = part[:, left - columns.start : right - columns.start]
            np.maximum(part, drawn, out=part)
    return others
