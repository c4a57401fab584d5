"""Instants of a film, one by one: of a recording, or of the window as it goes on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import SceneState
from studio.app.model.documents.document import Document, composed
from studio.app.timeline.pictures.live_pictures import LiveReplay
from studio.app.timeline.pictures.reader import PictureReader
from studio.app.timeline.recorded.index import RecordingIndex
from studio.view.surface_drawing import LivePicture


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One picture's content.

    Attributes:
        state: of the room.
        live: what live surfaces show.
        camera_picture: (H, W, 3) RGB of the 360° camera's front lens, or None.
        world_from_camera: of the view by hand at that instant; None for the plan's.
        place: of the picture in the film, from 0.
    """

    state: SceneState
    live: tuple[LivePicture, ...] = ()
    camera_picture: NDArray[np.uint8] | None = None
    world_from_camera: Pose | None = None
    place: int = 0


def recorded_moments(
    index: RecordingIndex,
    scene: ScenePackage,
    document: Document,
    *,
    times_ns: Sequence[int],
    shows_camera: bool,
) -> Iterator[Moment]:
    """The room of a recording at some instants, in order.

    Pictures of the camera are decoded where they are shown: by themselves, or on live surfaces.

    Args:
        index: of the recording.
        scene: that is open.
        document: with what was added by hand.
        times_ns: the instants.
        shows_camera: whether the camera's own picture is filmed.

    Raises:
        ValueError, OSError: the recording is damaged, or gone.
    """
    replay = LiveReplay(index, scene)
    packets = index.packets
    reads = packets is not None and (shows_camera or replay.has_any)
    reader = PictureReader(index.path, packets) if reads and packets is not None else None
    try:
        for place, t_ns in enumerate(times_ns):
            found = None if reader is None else reader.picture_at(t_ns)
            live: tuple[LivePicture, ...] = ()
            if found is not None and replay.has_any:
                live = replay.at(t_ns, found.t_ns, found.lenses)
            state = composed(index.state_at(t_ns), document.twin)
            yield Moment(state, live, None if found is None else found.picture, None, place)
    finally:
        if reader is not None:
            reader.close()
