"""Protocol of the player of sessions, as docks use it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from studio.app.model.jobs.scene_job import SceneJob
from tracking.options import TrackerOptions

if TYPE_CHECKING:
    from studio.session.session import SessionOutput


class Sessions(Protocol):
    """Opens scenes and plays sessions, one at a time; `SessionRun` is the one there is."""

    output: SessionOutput | None
    line: str
    trying: TrackerOptions | None

    @property
    def out(self) -> Path:
        """Folder where every session gets one of its own."""
        ...

    def new_folder(self, *words: str, out: Path | None = None) -> Path:
        """Make the folder of the session that comes next; it goes if that leaves nothing."""
        ...

    @property
    def job(self) -> SceneJob | None:
        """The job that runs or ran last."""
        ...

    @property
    def is_busy(self) -> bool:
        """Whether a scene is being opened or a session is playing."""
        ...

    @property
    def is_playing(self) -> bool:
        """Whether a session is playing, or is being wound up."""
        ...

    @property
    def is_opening(self) -> bool:
        """Whether a scene is being opened."""
        ...

    @property
    def report(self) -> Path | None:
        """Folder of the last rehearsal that ended here, or None."""
        ...

    def play(self, job: SceneJob) -> None:
        """Play a session that somebody has planned."""
        ...

    def stop(self) -> None:
        """Ask what runs to stop; of a session, what was recorded until then is kept."""
        ...
