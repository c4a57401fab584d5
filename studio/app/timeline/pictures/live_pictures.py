"""Pictures of live surfaces at an instant of a recording: made anew of its camera's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.package import ScenePackage
from studio.app.timeline.recorded.index import RecordingIndex
from tracking.output import TrackOutput

if TYPE_CHECKING:  # what it imports takes half a second, and most recordings have no surface
    from studio.session.live_surfaces import LiveSurfaces
    from studio.view.surface_drawing import LivePicture


class LiveReplay:
    """Live surfaces of a recording; one thread's.

    They remember what they showed from frame to frame, in order of time: going back, they begin
    anew, as if the session had begun there.

    Args:
        index: of the recording.
        scene: that is open: its objects may be in the way.
    """

    def __init__(self, index: RecordingIndex, scene: ScenePackage) -> None:
        self._index = index
        self._scene = scene
        self._surfaces: LiveSurfaces | None = None
        self._t_ns = -1
        self._shown: tuple[LivePicture, ...] = ()

    @property
    def has_any(self) -> bool:
        """Whether the recording has a live surface at all."""
        return bool(self._index.surfaces)

    def at(
        self, t_ns: int, taken_ns: int, images: tuple[NDArray[np.uint8], ...]
    ) -> tuple[LivePicture, ...]:
        """Return their pictures at an instant.

        Args:
            t_ns: the instant: where objects and surfaces are.
            taken_ns: when the pictures were taken.
            images: one (H, W, 3) RGB per lens.
        """
        from studio.session.live_surfaces import LiveSurfaces

        state = self._index.state_at(t_ns)
        surfaces = {key: value for key, value in state.surfaces.items()}
        if not surfaces:
            return ()
        if taken_ns == self._t_ns and len(self._shown) == len(surfaces):
            return self._shown
        if self._surfaces is None or taken_ns < self._t_ns:
            self._surfaces = LiveSurfaces(self._scene)
        self._t_ns = taken_ns
        rig, pose = self._index.session.rig, state.world_from_rig
        frame = Frame("camera-360", 0, taken_ns, taken_ns, images, rig, pose)
        answer = TrackOutput(tuple(state.objects.values()), world_from_rig=pose)
        self._shown = self._surfaces.step(frame, surfaces, answer)
        return self._shown
