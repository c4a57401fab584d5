"""Window of a small object with and without it, for photometric comparison."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from tracking.evidence.observation import Observation
from tracking.kernels.native import Alone, Setting
from tracking.kernels.native import Shell as DrawnRelightable
from tracking.kernels.photometry import CLOSELY, ROUGHLY
from tracking.model.object_model import RENDER_OPTIONS, TrackModel
from tracking.model.relighting import RELIGHTER, LitView, RelightableModel
from tracking.window.extent import part_of

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

AROUND_PX = 6
"""Margin in px around an object's box that is compared."""


FINER = 2
"""Supersampling, each way, of close comparisons: at few pixels splats widen the silhouette by a
pixel."""


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

    def residual_px(self, lit: Alone, upright: Upright) -> float:
        """Robust photometric residual, in pixels, of the object at a nearby pose."""
        return self.roughly.strange_at(lit, [upright])[0]

    def close_similarity(self, lit: Alone, upright: Upright) -> float:
        """Similarity of the object at exactly this pose to the picture."""
        return self.closely.resemblance_at(lit, [upright])[0]

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
    """A part of the live picture with and without an object.

    Attributes:
        model: the object.
        live: (H, W, 3) float32 0..1.
        empty: (H, W, 3) the same without the object.
        hidden: (H, W) 0..1, behind a nearer tracked object.
        camera: of the picture.
        world_from_camera: its pose.
        renderer: draws the object.
    """

    model: TrackModel
    live: FloatArray
    empty: FloatArray
    hidden: FloatArray
    camera: Fisheye
    world_from_camera: Pose
    renderer: NativeRenderer

    def at(self, world_from_object: Pose) -> Place | None:
        """The part around the object at a pose; None if nothing of it is in the picture."""
        part = _around(self, world_from_object)
        if part is None:
            return None
        live, empty = (np.ascontiguousarray(picture[part]) for picture in (self.live, self.empty))
        free = 1.0 - self.hidden[part]
        camera = part_of(self.camera, part)
        size = (camera.width_px, camera.height_px)
        roughly, closely = (
            Setting(live, empty, free, size=size, constants=options.for_native())
            for options in (ROUGHLY, CLOSELY)
        )
        view = LitView(live, empty, free, camera, self.world_from_camera, self.renderer)
        range_m = float(
            np.linalg.norm(
                self.model.centre_at(world_from_object) - self.world_from_camera.translation
            )
        )
        radius_px = camera.f_px * self.model.radius_m / max(range_m, self.model.radius_m)
        relightable = self.model.level_for(radius_px).relightable
        scanned, compass = (
            self.renderer.alone(splats, camera, self.world_from_camera, RENDER_OPTIONS)
            for splats in (relightable.splats, relightable.compass)
        )
        drawn = DrawnRelightable(scanned, compass, relightable.facing)
        return Place(roughly, closely, view, relightable, drawn)


def surroundings_in(
    observation: Observation, model: TrackModel, renderer: NativeRenderer
) -> Surroundings:
    """An observation with and without an object."""
    return Surroundings(
        model,
        observation.live,
        observation.empty,
        observation.hidden,
        observation.camera,
        observation.world_from_camera,
        renderer,
    )


def upright_of(world_from_object: Pose) -> Upright:
    """Position and yaw of an upright object."""
    x, y, z = world_from_object.translation.tolist()
    return x, y, z, world_from_object.yaw()


def pose_of(upright: Upright) -> Pose:
    """`world_from_object` of an upright object."""
    *place, yaw = upright
    return Pose.from_yaw(yaw, place)


def _around(around: Surroundings, world_from_object: Pose) -> tuple[slice, slice] | None:
    """Rows and columns around an object's box, None if it is outside the picture."""
    camera = around.camera
    corners = around.world_from_camera.inverse() @ around.model.box_at(world_from_object)
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
