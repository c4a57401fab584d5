"""What a frame shows of one object: a window of a lens picture, compared with all that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import Renderer
from tracking.background import Exposure, Plates
from tracking.kernels import KERNELS, SeenWindow
from tracking.layers import LayerMemo
from tracking.model import TrackModel
from tracking.window import Layer, Window, window_around

FloatArray = NDArray[np.float32]

OUTSIDE_M = 0.02
"""How far outside the room's walls an object's origin may be measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What a window shows of one object.

    Attributes:
        view: the window.
        live: (H, W, 3) float32 0..1.
        foreground: (H, W) float32 0..1, neither the empty room nor another tracked object.
        own: (H, W) float32 0..1, foreground with the object's colours.
        hidden: (H, W) float32 0..1, covered by a nearer tracked object.
        seen: the same for the native solver.
    """

    view: Window
    live: FloatArray
    foreground: FloatArray
    own: FloatArray
    hidden: FloatArray
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
    """One frame with everything that is known about it before the objects are looked at.

    Attributes:
        frame: the live pictures.
        world_from_rig: refined pose of the camera.
        camera_sigma: (6,) its standard deviations: rotation in radians, translation in metres.
        plates: the empty room.
        exposures: one per lens.
        renderer: draws splats.
        bounds_m: (2, 3) lowest and highest corner of the room.
        layers: objects drawn into the lens pictures.
    """

    frame: Frame
    world_from_rig: Pose
    camera_sigma: NDArray[np.float64]
    plates: Plates
    exposures: tuple[Exposure, ...]
    renderer: Renderer
    bounds_m: NDArray[np.float64]
    layers: LayerMemo

    def holds(self, world_from_object: Pose) -> bool:
        """Whether something at a pose is inside the room."""
        place = world_from_object.translation
        low, high = self.bounds_m[0] - OUTSIDE_M, self.bounds_m[1] + OUTSIDE_M
        return bool((place >= low).all() and (place <= high).all())


Neighbour = tuple[TrackModel, Pose]
"""Another tracked object and where it is."""


def view_of(scene: Scene, model: TrackModel, world_from_object: Pose) -> Window:
    """The window of an object believed to be at a pose."""
    return window_around(
        scene.frame.rig,
        scene.world_from_rig,
        model.centre_at(world_from_object),
        radius_m=model.radius_m,
    )


def gather(
    scene: Scene, model: TrackModel, view: Window, neighbours: Sequence[Neighbour]
) -> Evidence:
    """Cut an object's window out of a frame and tell what in it may be the object.

    Args:
        scene: the frame.
        model: the object.
        view: its window.
        neighbours: all other tracked objects; those in the window are drawn into the background.
    """
    layers = layers_in(scene, view, neighbours)
    lens, part = scene.frame.rig.lenses[view.lens], view.part
    live, foreground, own, hidden = KERNELS.change(
        np.ascontiguousarray(scene.frame.images[view.lens][part]),
        np.ascontiguousarray(scene.plates.images[view.lens][part]),
        np.ascontiguousarray(scene.plates.noise[view.lens][part]),
        lens_size=(lens.width_px, lens.height_px),
        window=view.corner_and_size,
        shrink=view.shrink,
        exposure=scene.exposures[view.lens].rows(),
        layers=[layer.request(view.target_range_m) for layer in layers],
        table=model.colours.table,
    )
    shape = (view.camera.height_px, view.camera.width_px)
    seen = SeenWindow(live, foreground, own, hidden, (shape[1], shape[0]))
    pictures = (foreground.reshape(shape), own.reshape(shape), hidden.reshape(shape))
    return Evidence(view, live.reshape(*shape, 3), *pictures, seen)


def layers_in(scene: Scene, view: Window, neighbours: Sequence[Neighbour]) -> list[Layer]:
    """The neighbours that reach into a window, drawn; the farthest first."""
    near = [n for n in neighbours if _in_view(n, view)]
    eye = view.world_from_camera.translation
    near.sort(key=lambda n: -float(np.linalg.norm(n[0].centre_at(n[1]) - eye)))
    rig = scene.frame.rig
    return [
        scene.layers.layer(
            model.object_id,
            model.splats_at(world_from_object),
            window_around(
                rig,
                scene.world_from_rig,
                model.centre_at(world_from_object),
                radius_m=model.radius_m,
                lens=view.lens,
            ),
            rig.lenses[view.lens],
            scene.renderer,
        )
        for model, world_from_object in near
    ]


def _in_view(neighbour: Neighbour, view: Window) -> bool:
    """Whether a neighbour's sphere touches the window."""
    model, world_from_object = neighbour
    centre = view.world_from_camera.inverse() @ model.centre_at(world_from_object)
    camera = view.camera
    distance = float(np.linalg.norm(centre))
    spread = camera.f_px * model.radius_m / max(distance, model.radius_m)
    angle = float(np.arctan2(np.hypot(centre[0], centre[1]), centre[2]))
    if angle > camera.max_angle + spread / camera.f_px:
        return False
    x, y = camera.project(centre[None])[0][0]
    across = -spread < x < camera.width_px + spread
    return bool(across and -spread < y < camera.height_px + spread)
