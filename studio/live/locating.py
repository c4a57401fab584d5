"""Finds a camera in one room, whose map is drawn when it is first needed and kept."""

from __future__ import annotations

import threading

import numpy as np

from devices.messages import Frame
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer
from tracking.camera.locating.locate import Located, locate_camera, prepare_map
from tracking.camera.locating.room_map import RoomMap

SEED = 0
"""Of the places that are compared: the same pictures are found at the same place again."""


class RoomLocator:
    """Call it with a frame and where the camera was last; one search at a time.

    Args:
        scene: the room.
        renderer: draws splats.
    """

    def __init__(self, scene: ScenePackage, renderer: Renderer) -> None:
        self._scene = scene
        self._renderer = renderer
        self._objects = tuple(
            PosedSplats(item.splats, item.world_from_object) for item in scene.objects
        )
        self._lock = threading.Lock()
        self._rng = np.random.default_rng(SEED)
        self._map: RoomMap | None = None

    def __call__(self, frame: Frame, last_world_from_rig: Pose | None) -> Located:
        """Find the camera's pose; the result says why if it was not found.

        Raises:
            ValueError: the room is too small to stand in.
        """
        with self._lock:
            if last_world_from_rig is None and self._map is None:
                self._map = prepare_map(
                    self._scene.room, self._renderer, objects=self._objects, rng=self._rng
                )
            return locate_camera(
                frame,
                self._scene.room,
                self._renderer,
                objects=self._objects,
                near_world_from_rig=last_world_from_rig,
                rng=self._rng,
                room_map=self._map,
            )
