"""Live surfaces in a session: made from corners, and kept fresh while tracked objects pass by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from devices.messages import Frame
from scenes.cameras import Fisheye, Rig
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.quad import Quad, quad_of
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from scenes.state import LiveSurface, TrackedObject, TrackState
from studio.view.surface_drawing import LivePicture
from tracking.background.images import BackgroundImages, render_background
from tracking.background.layers import LayerCache
from tracking.output import TrackOutput
from tracking.surfaces.corners import corners_from_clicks
from tracking.surfaces.live import Occluders, SurfacesState, step
from tracking.surfaces.view import native_size_px
from tracking.window.window import Layer

Point = NDArray[np.float64]

PLATE_PX = 480
"""Side of the pictures of the empty room that say what a new surface shows."""


def live_surface(surface_id: str, corners_in_world: ArrayLike, frame: Frame) -> LiveSurface:
    """A surface as fine as the camera sees it.

    Args:
        surface_id: unique in the session.
        corners_in_world: (4, 3) metres, clockwise from the top left.
        frame: of the camera, with its pose.

    Raises:
        ValueError: the corners span no flat convex quad, or the camera's pose is not known.
    """
    corners = np.asarray(corners_in_world, dtype=np.float64)
    size_px = native_size_px(quad_of(corners), frame.rig, _known_pose(frame, surface_id))
    return LiveSurface(surface_id, corners, size_px, frame.stream_id)


def clicked_surface(
    surface_id: str,
    clicks_px: ArrayLike,
    frame: Frame,
    world_from_rig: Pose | None,
    room: SplatCloud,
) -> LiveSurface:
    """A surface whose corners were clicked in the front lens's picture.

    Args:
        surface_id: unique in the session.
        clicks_px: (4, 2) pixels, the top left one first.
        frame: whose picture it was.
        world_from_rig: the camera's refined pose; None takes the frame's.
        room: splats of what stands still.

    Raises:
        ValueError: the clicks lie on no flat surface, or the camera's pose is not known.
    """
    known = world_from_rig or _known_pose(frame, surface_id)
    corners = corners_from_clicks(clicks_px, 0, frame.rig, known, room, NativeRenderer())
    return live_surface(surface_id, corners, replace(frame, world_from_rig=known))


def _shrunk(lens: Fisheye) -> Fisheye:
    scale = min(1.0, PLATE_PX / lens.width_px)
    return lens.resized(round(scale * lens.width_px), round(scale * lens.height_px))


def _known_pose(frame: Frame, surface_id: str) -> Pose:
    if frame.world_from_rig is None:
        raise ValueError(
            f"surface {surface_id!r}: the pose of camera {frame.stream_id!r} is not known yet; "
            "wait until the camera was found"
        )
    return frame.world_from_rig


class LiveSurfaces:
    """Gives live surfaces their pictures, frame by frame.

    Args:
        scene: whose objects may be in the way.
    """

    def __init__(self, scene: ScenePackage) -> None:
        self._models = {item.object_id: item for item in scene.objects}
        self._room = scene.room
        self._renderer = NativeRenderer()
        self._layers = LayerCache()
        self._state = SurfacesState()

    def step(
        self,
        frame: Frame,
        surfaces: Mapping[str, LiveSurface],
        answer: TrackOutput,
    ) -> tuple[LivePicture, ...]:
        """Pictures of all surfaces at one frame.

        Args:
            frame: the camera's; frames come in order of time.
            surfaces: of the session, by id.
            answer: where a tracker has the objects and the camera at this frame.
        """
        world_from_rig = answer.world_from_rig or frame.world_from_rig
        if not surfaces or world_from_rig is None:
            return ()
        quads = [quad_of(surface.corners_in_world) for surface in surfaces.values()]
        layers = tuple(
            self._before(quads, frame.rig, world_from_rig, lens, answer.objects)
            for lens in range(len(frame.rig.lenses))
        )
        is_new = any(key not in self._state.memories for key in surfaces)
        background = self._empty_room(frame.rig, world_from_rig) if is_new else None
        self._state, shown = step(
            self._state,
            frame,
            tuple(surfaces.values()),
            world_from_rig,
            Occluders(layers, background),
        )
        return tuple(LivePicture(surfaces[s.surface_id], s.picture) for s in shown)

    def _empty_room(self, rig: Rig, world_from_rig: Pose) -> BackgroundImages:
        """Return the scan as the lenses would see it, drawn as small as it is asked."""
        small = Rig(tuple(_shrunk(lens) for lens in rig.lenses), rig.rig_from_lens)
        drawn = render_background(self._renderer, self._room, small, world_from_rig)
        sizes = [(lens.width_px, lens.height_px) for lens in rig.lenses]

        def enlarged(picture: NDArray[np.float32], size_px: tuple[int, int]) -> NDArray[np.float32]:
            return np.asarray(cv2.resize(picture, size_px), dtype=np.float32)

        return BackgroundImages.of_pictures(
            world_from_rig,
            [
                enlarged(image.whole(), size)
                for image, size in zip(drawn.images, sizes, strict=True)
            ],
            [enlarged(alpha, size) for alpha, size in zip(drawn.coverage, sizes, strict=True)],
        )

    def _before(
        self,
        quads: Sequence[Quad],
        rig: Rig,
        world_from_rig: Pose,
        lens: int,
        tracks: Sequence[TrackedObject],
    ) -> list[Layer]:
        """Drawings of the objects that may hide a part of a surface from a lens."""
        eye = (world_from_rig @ rig.rig_from_lens[lens]).translation
        layers: list[Layer] = []
        for track in tracks:
            model = self._models.get(track.object_id)
            if model is None or track.state is TrackState.LOST:
                continue
            centre_m, radius_m = model.sphere()
            centre = track.world_from_object @ centre_m
            if any(_may_hide(eye, centre, radius_m, quad) for quad in quads):
                pose = track.world_from_object
                layers.append(
                    self._layers.layer(model, pose, rig, world_from_rig, self._renderer, lens=lens)
                )
        return layers


def _may_hide(eye: Point, centre: Point, radius_m: float, quad: Quad) -> bool:
    """Whether a sphere can be seen before a part of a quad: by the cones around both."""
    corners, _ = quad.points([[0, 0], [1, 0], [1, 1], [0, 1]])
    middle = corners.mean(axis=0)
    reach_m = float(np.linalg.norm(corners - middle, axis=1).max())
    apart_m, surface_m = (float(np.linalg.norm(p - eye)) for p in (centre, middle))
    if apart_m - radius_m > surface_m + reach_m:
        return False
    half_angles = sum(
        np.arcsin(min(1.0, size / max(distance, 1e-6)))
        for size, distance in ((radius_m, apart_m), (reach_m, surface_m))
    )
    between = (centre - eye) @ (middle - eye) / max(apart_m * surface_m, 1e-12)
    return bool(np.arccos(np.clip(between, -1.0, 1.0)) < half_angles)
