"""Pictures of a scene's views, drawn on a thread: to mark objects in, and to compare."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.streams import Slot
from scenes.workers.task import Task

Pictures = dict[str, NDArray[np.uint8]]


class ViewPictures:
    """Draws some views of a scene package; `result` has the pictures by view, or why not.

    Args:
        scene: folder of the package.
        names: of the views to draw; empty for `most` of all, spread evenly.
        most: views drawn.
    """

    def __init__(self, scene: Path, names: tuple[str, ...] = (), *, most: int = 8) -> None:
        self.result: Slot[Pictures | str] = Slot()
        self._scene, self._names, self._most = scene, names, most
        Task("drawing views", self._draw).start()

    def _draw(self, _task: Task[None]) -> None:
        from scenes.package import load_package
        from scenes.pose import Pose
        from scenes.render.native import NativeRenderer
        from scenes.render.renderer import PosedSplats

        try:
            package = load_package(self._scene)
            views = [view for view in package.views if view.name in self._names]
            if not self._names and package.views:
                count = min(self._most, len(package.views))
                places = np.linspace(0, len(package.views) - 1, count).round().astype(int)
                views = [package.views[place] for place in dict.fromkeys(places.tolist())]
            renderer, room = NativeRenderer(), [PosedSplats(package.room, Pose.identity())]
            pictures: Pictures = {}
            for view in views:
                drawn = renderer.render(room, view.camera, view.world_from_camera)
                pictures[view.name] = (np.clip(drawn.rgb, 0, 1) * 255 + 0.5).astype(np.uint8)
            self.result.put(pictures or f"{self._scene.name} has no views to mark objects in")
        except (ValueError, OSError) as error:
            self.result.put(str(error))
