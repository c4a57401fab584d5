"""A camera that stands nowhere near its old place is looked for beside the running session."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from devices.camera.lenses.lens_pictures import stream_images
from devices.camera.received import Received
from devices.messages import Frame
from scenes.pose import Pose
from scenes.workers.task import Task
from studio.live.camera_frames import STREAM_ID
from studio.live.placing import Locate, Placed, PlacedCamera
from tracking.output import CameraMoment, CameraNotice

SEARCH_EVERY_S = 15.0
"""Seconds between searches for a camera that is lost: one takes up to ten on two cores, beside the
session; whoever stands before it or carries it may be gone by the next."""


@dataclass(frozen=True, slots=True, eq=False)
class Lookout:
    """Inputs of a search.

    Attributes:
        received: the camera's newest picture.
        placed: lenses and pose as they were found last.
        last_world_from_rig: where the tracker had the camera last; None before its first picture.
    """

    received: Received
    placed: PlacedCamera
    last_world_from_rig: Pose | None


class Relocation:
    """Searches on a thread of its own, one at a time.

    Args:
        locate: finds the camera's pose.
        look: gives what a search begins with; None while there is nothing to search with.
        done: is given what was found, on the search's thread.
        failed: is given why a search could not be made, on the search's thread.
    """

    def __init__(
        self,
        locate: Locate,
        look: Callable[[], Lookout | None],
        *,
        done: Callable[[Placed], None],
        failed: Callable[[str], None],
    ) -> None:
        self._locate = locate
        self._look = look
        self._done = done
        self._failed = failed
        self._searching: Task[None] | None = None
        self._is_lost = False
        self._next_ns = 0

    @property
    def is_lost(self) -> bool:
        """Whether the tracker has the camera nowhere near its old place."""
        return self._is_lost

    @property
    def is_running(self) -> bool:
        """Whether a search is made now."""
        return self._searching is not None and self._searching.is_running

    def start(self) -> None:
        """Search now, unless a search is being made."""
        if not self.is_running:
            self._searching = Task("locate", self._search).start()

    def notice(self, notices: Sequence[CameraNotice], now_ns: int) -> None:
        """Take what the tracker says of the camera in a picture; search while it is lost."""
        for notice in notices:
            if notice.moment is CameraMoment.NOT_FOUND:
                self._is_lost = True
            elif notice.moment is CameraMoment.FOUND:
                self._is_lost = False
        if self._is_lost and now_ns >= self._next_ns:
            self._next_ns = now_ns + round(SEARCH_EVERY_S * 1e9)
            self.start()

    def _search(self, _task: Task[None]) -> None:
        at = self._look()
        if at is None:
            return
        received, placed = at.received, at.placed
        images = stream_images(received.pictures, placed.stream)
        frame = Frame(
            STREAM_ID, received.seq, received.t_ns, received.decoded_ns, images, placed.rig, None
        )
        try:
            self._done(self._locate(frame, at.last_world_from_rig))
        except ValueError as error:
            self._failed(str(error))
