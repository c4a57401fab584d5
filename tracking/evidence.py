"""What a frame shows of one object: a native-resolution crop, compared with all that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.renderer import Renderer
from scenes.warp import VirtualView, warp
from tracking.background import Exposure, Plates, difference
from tracking.model import RENDER_OPTIONS, TrackModel
from tracking.rectify import crop_around, expose_view

FloatArray = NDArray[np.float32]

NEIGHBOUR_NOISE = 0.06
"""Standard deviation between a drawn neighbour and its live picture, of a 0..1 channel."""

OUTSIDE_M = 0.02
"""How far outside the room's walls an object's origin may be measured."""

LIKENESS_GAIN = 3.0
"""Colours with a third of the full likeness already count as the object's own."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What a crop shows of one object.

    Attributes:
        view: the crop.
        live: (H, W, 3) float32 0..1.
        foreground: (H, W) float32 0..1, neither the empty room nor another tracked object.
        own: (H, W) float32 0..1, foreground with the object's colours.
        hidden: (H, W) float32 0..1, covered by a nearer tracked object or out of the lens.
    """

    view: VirtualView
    live: FloatArray
    foreground: FloatArray
    own: FloatArray
    hidden: FloatArray

    @property
    def camera(self) -> Pinhole:
        """Of the crop."""
        return self.view.camera

    @property
    def world_from_camera(self) -> Pose:
        """Pose of the crop's camera."""
        return self.view.world_from_camera


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One frame with everything that is known about it before the objects are looked at.

    Attributes:
        frame: the live pictures.
        world_from_rig: refined pose of the camera.
        plates: the empty room.
        exposures: one per lens.
        renderer: draws splats.
        bounds_m: (2, 3) lowest and highest corner of the room.
    """

    frame: Frame
    world_from_rig: Pose
    plates: Plates
    exposures: tuple[Exposure, ...]
    renderer: Renderer
    bounds_m: NDArray[np.float64]

    def holds(self, world_from_object: Pose) -> bool:
        """Whether something at a pose is inside the room."""
        place = world_from_object.translation
        low, high = self.bounds_m[0] - OUTSIDE_M, self.bounds_m[1] + OUTSIDE_M
        return bool((place >= low).all() and (place <= high).all())


Neighbour = tuple[TrackModel, Pose]
"""Another tracked object and where it is."""


def view_of(scene: Scene, model: TrackModel, world_from_object: Pose) -> VirtualView:
    """The crop's camera for an object believed to be at a pose."""
    return crop_around(
        scene.frame.rig,
        scene.world_from_rig,
        model.centre_at(world_from_object),
        radius_m=model.radius_m,
    )


def gather(
    scene: Scene, model: TrackModel, view: VirtualView, neighbours: Sequence[Neighbour]
) -> Evidence:
    """Cut an object's crop out of a frame and tell what in it may be the object.

    Args:
        scene: the frame.
        model: the object.
        view: the crop's camera.
        neighbours: all other tracked objects; those in the crop are drawn into the background.
    """
    image = np.asarray(warp(scene.frame.images[view.lens], view.table), dtype=np.uint8)
    live = image.astype(np.float32) * np.float32(1.0 / 255.0)
    expected = expose_view(view, scene.plates, scene.exposures[view.lens])
    noise = np.asarray(warp(scene.plates.noise[view.lens], view.table), dtype=np.float32)
    hidden = (~view.table.valid).astype(np.float32)
    near = [n for n in neighbours if _in_view(n, view)]
    if near:
        expected, noise, nearer = _with_neighbours(scene, view, near, expected, noise)
        hidden = np.maximum(hidden, nearer)
    change = difference(live, expected, np.maximum(noise, 1e-3))
    foreground = change.probability * view.table.valid
    likeness = cv2.GaussianBlur(model.colours.likeness(image), (3, 3), 0.7)
    own = foreground * np.clip(likeness * LIKENESS_GAIN, 0.0, 1.0)
    return Evidence(
        view,
        live,
        foreground.astype(np.float32),
        own.astype(np.float32),
        hidden,
    )


def _in_view(neighbour: Neighbour, view: VirtualView) -> bool:
    """Whether a neighbour's sphere touches the crop's cone."""
    model, world_from_object = neighbour
    centre = view.world_from_camera.inverse() @ model.centre_at(world_from_object)
    if centre[2] < 0.1:
        return False
    spread = model.radius_m / centre[2]
    x, y = abs(centre[0] / centre[2]), abs(centre[1] / centre[2])
    camera = view.camera
    return bool(
        x < 0.5 * camera.width_px / camera.fx + spread
        and y < 0.5 * camera.height_px / camera.fy + spread
    )


def _with_neighbours(
    scene: Scene,
    view: VirtualView,
    near: Sequence[Neighbour],
    expected: FloatArray,
    noise: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Background and noise with the neighbours drawn in, and what of them is in front."""
    drawn = scene.renderer.render(
        [m.splats_at(p) for m, p in near], view.camera, view.world_from_camera, RENDER_OPTIONS
    )
    exposure = scene.exposures[view.lens]
    gain = exposure.gain.astype(np.float32)
    colours = drawn.rgb * gain + exposure.offset.astype(np.float32) * drawn.alpha[..., None]
    alpha = drawn.alpha[..., None]
    behind = expected * (1 - alpha) + colours
    edge = cv2.dilate(drawn.alpha, np.ones((3, 3), np.uint8))
    rough = np.maximum(noise, NEIGHBOUR_NOISE * edge)
    # The crop is aimed at the object's centre: what is drawn nearer than that is in front of it.
    own_depth = float((view.world_from_camera.inverse() @ view.target)[2])
    nearer = drawn.alpha * ((drawn.depth > 0) & (drawn.depth < own_depth))
    return behind.astype(np.float32), rough.astype(np.float32), nearer.astype(np.float32)
