"""The camera's picture at the instant that was asked for last, decoded on a thread."""

from __future__ import annotations

import threading
from contextlib import nullcontext
from typing import TYPE_CHECKING

from devices.streams import Slot
from scenes.package import ScenePackage
from scenes.workers.latest import Latest
from studio.app.timeline.pictures.live_pictures import LiveReplay
from studio.app.timeline.pictures.proxies import Proxies
from studio.app.timeline.pictures.reader import (
    PictureAt,
    PictureReader,
    ignore,
)
from studio.app.timeline.recorded.index import Packets, RecordingIndex

if TYPE_CHECKING:
    from studio.view.surface_drawing import LivePicture


class PictureThread:
    """Decodes what was asked for last; older requests that it did not get to are dropped.

    Args:
        index: of the recording.
        scene: that is open: what live surfaces show is made, too; None leaves them empty.
        proxies: reduced pictures, shown at once where the full one takes long; None for none.
    """

    def __init__(
        self,
        index: RecordingIndex,
        scene: ScenePackage | None = None,
        proxies: Proxies | None = None,
    ) -> None:
        self.pictures: Slot[PictureAt] = Slot()
        self.live: Slot[tuple[LivePicture, ...]] = Slot()
        """Pictures of live surfaces at the time that was asked for last."""
        self.problems: Slot[str] = Slot()
        self._index = index
        self._proxies = proxies
        self._reader: PictureReader | None = None
        self._replay = None if scene is None else LiveReplay(index, scene)
        self._worker = Latest("pictures", self._serve, began=self._open, ended=self._close)

    def ask(self, t_ns: int) -> None:
        """Want the picture at a time, and none that was asked for before."""
        self._worker.ask(t_ns)

    def stop(self) -> None:
        """End; waits for the packet that is being decoded."""
        self._worker.close()

    def _open(self) -> None:
        packets = self._index.packets
        if packets is None:
            return
        try:
            self._reader = PictureReader(self._index.path, packets)
        except (ValueError, OSError) as error:
            self.problems.put(str(error))

    def _close(self) -> None:
        if self._reader is not None:
            self._reader.close()

    def _serve(self, t_ns: int, stale: threading.Event) -> None:
        reader, packets = self._reader, self._index.packets
        if reader is not None and packets is not None:
            with nullcontext() if self._proxies is None else self._proxies.held("picture"):
                self._show(reader, packets, t_ns, stale)

    def _show(
        self, reader: PictureReader, packets: Packets, t_ns: int, stale: threading.Event
    ) -> None:
        """Give the picture of an instant: reduced, or the keyframe's, before a full one far off."""
        early = self.pictures.put
        number = reader.packet_at(t_ns)
        if self._proxies is not None and number is not None and not reader.is_soon(t_ns):
            taken_ns = int(packets.t_ns[number])
            reduced = self._proxies.find(number, taken_ns)
            if reduced is not None:
                self.pictures.put(PictureAt(t_ns, taken_ns, reduced))
                early = ignore
        try:
            picture = reader.picture_at(t_ns, is_stale=stale.is_set, early=early)
        except (ValueError, OSError) as error:
            self.problems.put(str(error))
            return
        if picture is not None:
            self.pictures.put(picture)
            self._show_surfaces(picture, stale)

    def _show_surfaces(self, picture: PictureAt, stale: threading.Event) -> None:
        """Unless another time is wanted by now: they take longer than the picture."""
        if self._replay is None or not self._replay.has_any or stale.is_set():
            return
        try:
            self.live.put(self._replay.at(picture.asked_ns, picture.t_ns, picture.lenses))
        except ValueError as error:
            self.problems.put(f"a live surface: {error}")
