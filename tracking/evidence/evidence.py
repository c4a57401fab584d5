"""Evidence: a window of a lens picture around one object, compared with the background."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from tracking.background.images import BackgroundImages, LensExposures
from tracking.background.layers import LayerCache
from tracking.kernels.native import KERNELS, SeenWindow
from tracking.model.object_model import TrackModel
from tracking.model.support_planes import SupportPlanes
from tracking.window.window import Layer, Window, window_around

FloatArray = NDArray[np.float32]

OUTSIDE_M = 0.02
"""Distance in m outside the room's bounds at which an object's origin may be measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Pixels of a window that speak for or against one object.

    Attributes:
        view: the window.
        live: (H, W, 3) float32 0..1.
        foreground: (H, W) float32 0..1, neither the empty room nor another tracked object.
        own: (H, W) float32 0..1, foreground in the object's colours.
        hidden: (H, W) float32 0..1, occluded by a nearer tracked object.
        layers: renderings of the other tracked objects in the window, the farthest first.
        seen: the same for the native solver.
    """

    view: Window
    live: FloatArray
    foreground: FloatArray
    own: FloatArray
    hidden: FloatArray
    layers: Sequence[Layer]
    seen: SeenWindow

    @property
    def camera(self) -> Fisheye:
        """Of the window."""
        return self.view.camera

    @property
    def world_from_camera(self) -> Pose:
        """Pose of the window's camera."""
        return self.view.world_from_camera


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One frame and all that is known of it before the objects are measured.

    Attributes:
        frame: the live pictures.
        world_from_rig: refined camera pose.
        camera_sigma: (6,) its standard deviations: rotation (rad), translation (m).
        background: images of the empty room.
        exposures: by lens.
        renderer: renders splats.
        bounds_m: (2, 3) lowest and highest corner of the room, m.
        support_planes: of the room.
        layers: cache of objects rendered into the lens pictures.
        is_first: whether the room may be in another light than it was scanned in: later its live
            light has been learned.
    """

    frame: Frame
    world_from_rig: Pose
    camera_sigma: NDArray[np.float64]
    background: BackgroundImages
    exposures: LensExposures
    renderer: NativeRenderer
    bounds_m: NDArray[np.float64]
    support_planes: SupportPlanes
    layers: LayerCache
    is_first: bool = False

    def contains(self, world_from_object: Pose) -> bool:
        """Whether an object at a pose is inside the room."""
        place = world_from_object.translation
        low, high = self.bounds_m[0] - OUTSIDE_M, self.bounds_m[1] + OUTSIDE_M
        return bool((place >= low).all() and (place <= high).all())


Neighbour = tuple[TrackModel, Pose]
"""Another tracked object and where it is."""


def view_of(
    scene: Scene, model: TrackModel, world_from_object: Pose, *, at_any_yaw: bool = False
) -> Window:
    """The window of an object at a pose, or at a position with any yaw."""
    return window_around(
        scene.frame.rig,
        scene.world_from_rig,
        model.centre_at(world_from_object),
        radius_m=model.radius_m,
        box_in_world=None if at_any_yaw else model.box_at(world_from_object),
    )


def gather(
    scene: Scene, model: TrackModel, view: Window, neighbours: Sequence[Neighbour]
) -> Evidence:
    """Evidence of one object in one frame.

    Args:
        scene: the frame.
        model: the object.
        view: its window.
        neighbours: all other tracked objects; those in the window are composited over the
            background.
    """
    layers = layers_in(scene, view, neighbours)
    lens, part = scene.frame.rig.lenses[view.lens], view.part
    live, foreground, own, hidden, seen = KERNELS.change(
        scene.frame.images[view.lens][part],
        scene.background.images[view.lens].cut(*part),
        scene.background.noise[view.lens].cut(*part),
        lens_size=(lens.width_px, lens.height_px),
        window=view.corner_and_size,
        shrink=view.shrink,
        exposure=scene.exposures[view.lens].rows(),
        layers=[layer.request(view.target_range_m) for layer in layers],
        table=model.colours.table,
    )
    shape = (view.camera.height_px, view.camera.width_px)
    pictures = (foreground.reshape(shape), own.reshape(shape), hidden.reshape(shape))
    return Evidence(view, live.reshape(*shape, 3), *pictures, layers, seen)


def layers_in(scene: Scene, view: Window, neighbours: Sequence[Neighbour]) -> list[Layer]:
    """The neighbours that reach into a window, drawn; the farthest first."""
    near = _in_view(neighbours, view)
    return [
        scene.layers.layer(
            model.source,
            world_from_object,
            scene.frame.rig,
            scene.world_from_rig,
            scene.renderer,
            lens=view.lens,
        )
        for model, world_from_object in near
    ]


def _in_view(neighbours: Sequence[Neighbour], view: Window) -> list[Neighbour]:
    """The neighbours whose spheres touch the window, the farthest first."""
    if not neighbours:
        return []
    camera = view.camera
    centres = np.array([model.centre_at(pose) for model, pose in neighbours])
    in_camera = view.world_from_camera.inverse() @ centres
    radius = np.array([model.radius_m for model, _ in neighbours])
    distance = np.linalg.norm(in_camera, axis=1)
    spread = camera.f_px * radius / np.maximum(distance, radius)
    angle = np.arctan2(np.hypot(in_camera[:, 0], in_camera[:, 1]), in_camera[:, 2])
    x, y = camera.project(in_camera)[0].T
    seen = angle <= camera.max_angle + spread / camera.f_px
    seen &= (-spread < x) & (x < camera.width_px + spread)
    seen &= (-spread < y) & (y < camera.height_px + spread)
    return [neighbours[k] for k in np.argsort(-distance, kind="stable") if seen[k]]
