"""The recording that is open: read on a thread, played, and its instant shown on the bench."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from devices.clock import WallClock
from devices.recorded.index import is_whole
from scenes.state import SceneState
from scenes.workers.task import Task
from studio.app.model.log import Level
from studio.app.model.script import READING
from studio.app.model.workbench import Workbench
from studio.app.timeline.pictures.proxies import Proxies, proxies_of
from studio.app.timeline.pictures.thread import PictureThread
from studio.app.timeline.playback import Playback

if TYPE_CHECKING:
    from studio.app.timeline.opening import OpenRecording

CUT_OFF = "cut off"
"""Of `OpenRecording.cut`: the file has no end."""


class Viewing:
    """One recording at a time; `poll` is called by the dock's timer.

    Args:
        bench: what shows the instant.
    """

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench
        self.path: Path | None = None
        """The recording that is open, or is opened at the end of a session."""
        self._wanted: Path | None = None
        """The recording that is being read."""
        self.shown: OpenRecording | None = None
        self.playback: Playback | None = None
        self.share: float | None = None
        """How much has been read, 0..1; None while nothing is."""
        self._opening: Task[OpenRecording | None] | None = None
        self._pictures: PictureThread | None = None
        self._proxies: Proxies | None = None
        self._is_held = False
        """Whether `_proxies` waits for a session."""
        self._taken_ns: int | None = None
        """When the picture that is shown was taken."""
        self._state: SceneState | None = None
        self._t_ns = -1

    def begin(self, path: Path) -> None:
        """Begin to read; what is shown stays until it is read, and for good if it cannot be."""
        from studio.app.timeline.opening import opening

        if self._opening is not None:
            self._opening.cancel()
        self._wanted, self.share = path, 0.0
        self.bench.busy.add(READING)
        self._opening = opening(path, self.bench.scene)

    def forget(self) -> None:
        """Close it, and cancel what is being read."""
        if self._opening is not None:
            self._opening.cancel()
            self._opening = None
            self.bench.busy.discard(READING)
        self._stop_pictures()
        self.shown = self.playback = self._state = self.share = self.path = self._wanted = None
        self._t_ns = -1

    def _stop_pictures(self) -> None:
        if self._proxies is not None:
            self._proxies.stop()
        if self._pictures is not None:
            self._pictures.stop()
        self._pictures = self._proxies = self._taken_ns = None
        self._is_held = False

    @property
    def other_picture_ns(self) -> int | None:
        """When the picture that is shown was taken, if a newer one or an older one is due."""
        packets = None if self.shown is None else self.shown.index.packets
        if packets is None or self._taken_ns is None:
            return None
        number = packets.shown_at(self._t_ns)
        is_due = number is not None and int(packets.t_ns[number]) == self._taken_ns
        return None if is_due else self._taken_ns

    def poll(self) -> OpenRecording | None:
        """Take what the threads have left; a recording that has just been read."""
        self._yield_to_sessions()
        if self._pictures is not None:
            self._take_pictures(self._pictures)
        task = self._opening
        if task is None:
            return None
        self.share = task.share or self.share
        if task.is_running:
            return None
        self._opening = self.share = None
        self.bench.busy.discard(READING)
        path, self._wanted = self._wanted, None
        if task.problem:
            self._refuse("error", task.problem)
        if task.result is None or path is None:
            return None
        if self.bench.standing.is_session:
            self._refuse("warning", f"{path}: not shown, because a session has begun meanwhile")
            return None
        return self._opened(task.result, path)

    def _refuse(self, level: Level, words: str) -> None:
        """Say why it is not shown; a recording that is shown stays."""
        self.bench.say(level, words)
        self.bench.notify(words, level)
        if self.shown is None and self.path is not None:
            self.bench.open_recording(None)

    def _opened(self, shown: OpenRecording, path: Path) -> OpenRecording | None:
        index = shown.index
        if index.is_empty:
            why = "an empty recording" if is_whole(path) else "cut off before its first picture"
            self._refuse("warning", f"{index.path}: {why}: nothing to show")
            return None
        if path != self.path:
            self.playback = None
            self.path = path
        for text in (shown.stranger, index.shortened):
            if text:
                self.bench.say("warning", text)
        if shown.cut == CUT_OFF:
            words = (
                f"{index.path.name} was cut off, by a full disk or the program's end: it is shown "
                f"as far as it goes, to {(index.end_ns - index.origin_ns) / 1e9:.1f} s"
            )
            self.bench.say("warning", words)
            self.bench.notify(words, "warning")
        self.shown = shown
        if self.playback is None:
            self.playback = Playback(
                index.frames_ns.tolist(),
                start_ns=index.start_ns,
                end_ns=index.end_ns,
                origin_ns=index.origin_ns,
                clock=WallClock(),
            )
        self._stop_pictures()
        self._proxies = proxies_of(index)
        self._pictures = PictureThread(index, self.bench.scene, self._proxies)
        self._t_ns = -1
        return shown

    def show_instant(self) -> int | None:
        """Show the room where the playhead is; the time, or None if it is shown already."""
        if self.shown is None or self.playback is None:
            return None
        t_ns = self.playback.t_ns
        if t_ns == self._t_ns:
            return None
        self._t_ns = t_ns
        self._state = self.shown.index.state_at(t_ns)
        # What live surfaces showed last stays until the thread has what they show now.
        live = tuple(
            item for item in self.bench.live if item.surface.surface_id in self._state.surfaces
        )
        self.bench.show_state(self._state, live=live)
        if self._pictures is not None:
            self._pictures.ask(t_ns)
        return t_ns

    def _yield_to_sessions(self) -> None:
        """No reduced pictures are made while a session plays or a scene is opened."""
        if self._proxies is None:
            return
        is_busy = self.bench.session is not None and self.bench.session.is_busy
        if is_busy != self._is_held:
            (self._proxies.hold if is_busy else self._proxies.release)("session")
            self._is_held = is_busy

    def _take_pictures(self, pictures: PictureThread) -> None:
        found, live = pictures.pictures.take(), pictures.live.take()
        if found is not None:
            self._taken_ns = found.t_ns
        if self._state is not None and (found is not None or live is not None):
            self.bench.show_state(
                self._state,
                live=self.bench.live if live is None else live,
                camera_picture=None if found is None else found.picture,
            )
        problem = pictures.problems.take()
        if problem is not None:
            self.bench.say("warning", f"the picture cannot be shown: {problem}")

    def close(self) -> None:
        """End the threads and wait for them."""
        task = self._opening
        self.forget()
        if task is not None:
            task.join()
